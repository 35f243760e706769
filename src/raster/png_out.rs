//! PNG out, row by row.
//!
//! Measured on normals and albedo of 4928 x 3264 with 16 bits (`cargo bench --bench encode`): the encoder made for PNG
//! (fdeflate) takes a third to half the time of deflate's level 1 and an eighth of level 3, for files a tenth to a fifth larger;
//! among its filters the adaptive choice is smallest or nearly so, for a tenth more time.

use crate::files::FileError;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use weavelight_calibration::description::Image;

/// What the numbers of a PNG mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PngContent {
    /// Colours, encoded with sRGB's curve; the file says so (sRGB and gAMA chunks).
    Srgb,
    /// Normals, masks and other data; the file says nothing, so that nobody converts them.
    Data,
}

/// Writes 16-bit RGB row by row as `fill(y, row)` gives it. The file grows in place: whoever must not show half a file
/// writes it elsewhere first.
///
/// # Errors
/// No space, or not allowed.
pub fn write_png_rgb16(
    path: &Path,
    size: [usize; 2],
    content: PngContent,
    fill: impl Fn(usize, &mut [[u16; 3]]),
) -> Result<(), FileError> {
    let mut pixels = vec![[0; 3]; size[0]];
    let kind = Kind { color: png::ColorType::Rgb, depth: png::BitDepth::Sixteen, content };
    write(path, size, kind, |y, bytes| {
        fill(y, &mut pixels);
        bytes.extend(pixels.as_flattened().iter().flat_map(|value| value.to_be_bytes()));
    })
}

/// Writes 16-bit grey; see [`write_png_rgb16`].
///
/// # Errors
/// No space, or not allowed.
pub fn write_png_grey16(
    path: &Path,
    size: [usize; 2],
    content: PngContent,
    fill: impl Fn(usize, &mut [u16]),
) -> Result<(), FileError> {
    let mut pixels = vec![0; size[0]];
    let kind = Kind { color: png::ColorType::Grayscale, depth: png::BitDepth::Sixteen, content };
    write(path, size, kind, |y, bytes| {
        fill(y, &mut pixels);
        bytes.extend(pixels.iter().flat_map(|value| value.to_be_bytes()));
    })
}

/// Writes 8-bit grey, such as a mask.
///
/// # Errors
/// No space, or not allowed.
pub fn write_png_grey8(path: &Path, image: &Image<u8>) -> Result<(), FileError> {
    write(path, [image.width, image.height], GREY8, |y, bytes| bytes.extend(image.row(y)))
}

/// The bytes of an 8-bit grey PNG.
///
/// # Errors
/// An empty picture.
pub fn encode_png_grey8(image: &Image<u8>) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    encode(&mut bytes, [image.width, image.height], GREY8, |y, bytes| bytes.extend(image.row(y)))?;
    Ok(bytes)
}

/// The bytes of an 8-bit RGB PNG, such as a picture inside a report.
///
/// # Errors
/// An empty picture.
pub fn encode_png_rgb8(image: &Image<[u8; 3]>, content: PngContent) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let kind = Kind { color: png::ColorType::Rgb, depth: png::BitDepth::Eight, content };
    encode(&mut bytes, [image.width, image.height], kind, |y, bytes| {
        bytes.extend(image.row(y).as_flattened());
    })?;
    Ok(bytes)
}

#[derive(Clone, Copy)]
struct Kind {
    color: png::ColorType,
    depth: png::BitDepth,
    content: PngContent,
}

const GREY8: Kind = Kind {
    color: png::ColorType::Grayscale,
    depth: png::BitDepth::Eight,
    content: PngContent::Data,
};

fn write(
    path: &Path,
    size: [usize; 2],
    kind: Kind,
    fill: impl FnMut(usize, &mut Vec<u8>),
) -> Result<(), FileError> {
    let failed = |source| FileError::write(path, source);
    let file = BufWriter::with_capacity(1 << 20, File::create(path).map_err(failed)?);
    encode(file, size, kind, fill).map_err(failed)
}

/// `fill(y, bytes)` appends row `y` to `bytes`, 16-bit values high byte first.
fn encode(
    mut out: impl Write,
    [width, height]: [usize; 2],
    kind: Kind,
    mut fill: impl FnMut(usize, &mut Vec<u8>),
) -> io::Result<()> {
    let too_large =
        |_| io::Error::new(io::ErrorKind::InvalidInput, "the picture is too large for PNG");
    let mut encoder = png::Encoder::new(
        &mut out,
        width.try_into().map_err(too_large)?,
        height.try_into().map_err(too_large)?,
    );
    encoder.set_color(kind.color);
    encoder.set_depth(kind.depth);
    encoder.set_deflate_compression(png::DeflateCompression::FdeflateUltraFast);
    encoder.set_filter(png::Filter::Adaptive);
    if kind.content == PngContent::Srgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        // 1/2.2, for readers that do not know sRGB (PNG specification, 11.3.2.5).
        encoder.set_source_gamma(png::ScaledFloat::from_scaled(45_455));
    }
    let mut writer = encoder.write_header().map_err(as_io)?;
    let mut stream = writer.stream_writer_with_size(1 << 18).map_err(as_io)?;
    let mut row = Vec::new();
    for y in 0..height {
        row.clear();
        fill(y, &mut row);
        stream.write_all(&row)?;
    }
    stream.finish().map_err(as_io)?;
    writer.finish().map_err(as_io)?;
    out.flush()
}

/// The system's own error where there is one, so that "no space left" stays what it is.
fn as_io(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Picture, Values, decode_picture};
    use super::*;

    fn read(path: &Path) -> Picture {
        decode_picture(&std::fs::read(path).unwrap()).unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        for [width, height] in [[1, 1], [7, 3], [513, 300]] {
            let value = |x: usize, y: usize, c: usize| (x * 131 + y * 7919 + c * 40_961) as u16;
            write_png_rgb16(&path, [width, height], PngContent::Data, |y, row| {
                row.iter_mut()
                    .enumerate()
                    .for_each(|(x, pixel)| *pixel = [0, 1, 2].map(|c| value(x, y, c)));
            })
            .unwrap();
            let expected = (0..width * height * 3)
                .map(|i| value(i / 3 % width, i / 3 / width, i % 3))
                .collect();
            assert_eq!(
                read(&path),
                Picture::plain([width, height], 3, Values::U16(expected), 65_535.0)
            );
            write_png_grey16(&path, [width, height], PngContent::Data, |y, row| {
                row.iter_mut().enumerate().for_each(|(x, pixel)| *pixel = value(x, y, 0));
            })
            .unwrap();
            let expected = (0..width * height).map(|i| value(i % width, i / width, 0)).collect();
            assert_eq!(
                read(&path),
                Picture::plain([width, height], 1, Values::U16(expected), 65_535.0)
            );
            let data: Vec<u8> = (0..width * height).map(|i| (i * 37 % 256) as u8).collect();
            write_png_grey8(&path, &Image { width, height, data: data.clone() }).unwrap();
            assert_eq!(read(&path), Picture::plain([width, height], 1, Values::U8(data), 255.0));
        }
    }

    #[test]
    fn colours_say_so_and_data_do_not() {
        let image = Image::filled(4, 4, [1, 2, 3]);
        let has = |content, chunk: &[u8]| {
            encode_png_rgb8(&image, content).unwrap().windows(4).any(|window| window == chunk)
        };
        assert!(has(PngContent::Srgb, b"sRGB") && has(PngContent::Srgb, b"gAMA"));
        assert!(!has(PngContent::Data, b"sRGB") && !has(PngContent::Data, b"gAMA"));
    }

    #[test]
    fn a_missing_folder_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such.png");
        let error = write_png_grey8(&path, &Image::filled(2, 2, 0)).unwrap_err().to_string();
        assert!(error.contains("such.png"), "{error}");
    }

    #[test]
    fn no_pixels_are_an_error() {
        assert!(encode_png_rgb8(&Image::filled(0, 3, [0; 3]), PngContent::Data).is_err());
    }
}
