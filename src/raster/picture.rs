//! Any picture file that other programs write, values as the file has them.

use super::guard::guarded;
use super::{FileError, PictureError, exr_in, limits};
use std::io::Cursor;
use std::path::Path;
use weavelight_calibration::description::Image;

/// A decoded picture: rows from the top left, channels interleaved, alpha left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1 (grey) or 3 (R, G, B).
    pub channels: usize,
    /// `width * height * channels` values as the file has them.
    pub values: Values,
}

/// Values of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// 8 bits (or fewer, stretched to 8).
    U8(Vec<u8>),
    /// 16 bits.
    U16(Vec<u16>),
    /// Floating point; may hold NaN and infinities.
    F32(Vec<f32>),
}

/// File formats, told apart by their first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// OpenEXR.
    Exr,
    /// TIFF, and RAW files built like one.
    Tiff,
}

impl Format {
    /// `None` for anything else.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x89, b'P', b'N', b'G', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::Exr),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Some(Self::Tiff),
            _ => None,
        }
    }
}

/// What a reader of pictures asks for when it gets something else.
const PICTURES: &str = "a PNG, JPEG, TIFF or OpenEXR file";

/// Decodes PNG, JPEG, TIFF or EXR (R, G, B or Y of the first layer). Palettes are expanded, alpha is left out.
///
/// # Errors
/// Anything that is no sound picture of grey or RGB; never panics.
pub fn decode_picture(bytes: &[u8]) -> Result<Picture, PictureError> {
    match Format::sniff(bytes) {
        Some(Format::Png) => guarded(|| decode_png(bytes)),
        Some(Format::Jpeg) => guarded(|| decode_jpeg(bytes)),
        Some(Format::Tiff) => guarded(|| decode_tiff(bytes)),
        Some(Format::Exr) => exr_in::decode_exr(bytes)?.into_picture(),
        None => Err(not_a_picture(bytes, PICTURES)),
    }
}

/// Reads a picture file; see [`decode_picture`].
///
/// # Errors
/// [`FileError`] with the path.
pub fn read_picture(path: &Path) -> Result<Picture, FileError> {
    let bytes =
        std::fs::read(path).map_err(|source| FileError::Read { path: path.to_owned(), source })?;
    decode_picture(&bytes).map_err(|source| FileError::Content { path: path.to_owned(), source })
}

/// Reads a mask: whatever is not zero (nor NaN) in any channel is inside.
///
/// # Errors
/// [`FileError`] with the path. Whether the size fits is the caller's to judge.
pub fn read_mask(path: &Path) -> Result<Image<bool>, FileError> {
    let picture = read_picture(path)?;
    fn inside<T: Copy>(values: &[T], channels: usize, counts: impl Fn(T) -> bool) -> Vec<bool> {
        values
            .chunks_exact(channels)
            .map(|pixel| pixel.iter().any(|&value| counts(value)))
            .collect()
    }
    let data = match &picture.values {
        Values::U8(values) => inside(values, picture.channels, |value| value != 0),
        Values::U16(values) => inside(values, picture.channels, |value| value != 0),
        Values::F32(values) => {
            inside(values, picture.channels, |value| value != 0.0 && !value.is_nan())
        }
    };
    Ok(Image { width: picture.width, height: picture.height, data })
}

/// The error for bytes of no known picture format.
pub(crate) fn not_a_picture(bytes: &[u8], expected: &'static str) -> PictureError {
    let head = &bytes[..bytes.len().min(4096)];
    let printable = |&&byte: &&u8| matches!(byte, b'\t' | b'\n' | b'\r' | 0x20..=0x7e | 0x80..);
    match (head.len(), head.iter().filter(printable).count()) {
        (0, _) => PictureError::Empty,
        (all, text)
            if all == text
                && std::str::from_utf8(&head[..all.min(64).saturating_sub(4)]).is_ok() =>
        {
            PictureError::NotAPicture { found: "a text file", expected }
        }
        _ => PictureError::NotAPicture { found: "a file of unknown kind", expected },
    }
}

fn decode_png(bytes: &[u8]) -> Result<Picture, PictureError> {
    let damaged = |error: png::DecodingError| PictureError::damaged(error.to_string());
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    let header = decoder.read_header_info().map_err(damaged)?;
    limits::check(header.width.into(), header.height.into(), 4, bytes.len())?;
    decoder.set_limits(png::Limits { bytes: 64 << 20 });
    let mut reader = decoder.read_info().map_err(damaged)?;
    let size =
        reader.output_buffer_size().ok_or_else(|| PictureError::damaged("its size overflows"))?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(damaged)?;
    data.truncate(frame.buffer_size());
    let (width, height, stored) =
        (frame.width as usize, frame.height as usize, frame.color_type.samples());
    let values = match frame.bit_depth {
        png::BitDepth::Sixteen => {
            let words: Vec<u16> =
                data.as_chunks().0.iter().map(|&two| u16::from_be_bytes(two)).collect();
            Values::U16(without_alpha(words, stored))
        }
        _ => Values::U8(without_alpha(data, stored)),
    };
    Ok(Picture { width, height, channels: color_channels(stored), values })
}

/// Colour channels among the stored ones: grey and grey-alpha have one, RGB and RGBA three.
fn color_channels(stored: usize) -> usize {
    if stored < 3 { 1 } else { 3 }
}

fn without_alpha<T: Copy>(values: Vec<T>, stored: usize) -> Vec<T> {
    match stored {
        2 | 4 => {
            values.chunks_exact(stored).flat_map(|pixel| &pixel[..stored - 1]).copied().collect()
        }
        _ => values,
    }
}

fn decode_jpeg(bytes: &[u8]) -> Result<Picture, PictureError> {
    use image::{ColorType, ImageDecoder, codecs::jpeg::JpegDecoder};
    let damaged = |error: image::ImageError| PictureError::damaged(error.to_string());
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let channels = match decoder.color_type() {
        ColorType::L8 => 1,
        ColorType::Rgb8 => 3,
        other => {
            return Err(PictureError::unsupported(
                format!("a JPEG of {other:?}"),
                "save it as grey or RGB",
            ));
        }
    };
    limits::check(width.into(), height.into(), channels, bytes.len())?;
    let mut data = vec![0; width as usize * height as usize * channels];
    decoder.read_image(&mut data).map_err(damaged)?;
    Ok(Picture {
        width: width as usize,
        height: height as usize,
        channels,
        values: Values::U8(data),
    })
}

fn decode_tiff(bytes: &[u8]) -> Result<Picture, PictureError> {
    use tiff::ColorType::{Gray, GrayA, RGB, RGBA};
    use tiff::decoder::{Decoder, DecodingResult};
    let damaged = |error: tiff::TiffError| PictureError::damaged(error.to_string());
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions().map_err(damaged)?;
    let stored = match decoder.colortype().map_err(damaged)? {
        Gray(_) => 1,
        GrayA(_) => 2,
        RGB(_) => 3,
        RGBA(_) => 4,
        other => {
            return Err(PictureError::unsupported(
                format!("a TIFF of {other:?}"),
                "save it as 16-bit grey or RGB",
            ));
        }
    };
    limits::check(width.into(), height.into(), stored, bytes.len())?;
    check_tiff_kind(&mut decoder, stored)?;
    let mut decoder = decoder.with_limits(tiff_limits(width as usize * height as usize * stored));
    let values = match decoder.read_image().map_err(damaged)? {
        DecodingResult::U8(values) => Values::U8(without_alpha(values, stored)),
        DecodingResult::U16(values) => Values::U16(without_alpha(values, stored)),
        DecodingResult::F32(values) => Values::F32(without_alpha(values, stored)),
        _ => {
            let what = "a TIFF of neither 8 nor 16 bits nor 32-bit float";
            return Err(PictureError::unsupported(what, "save it with 16 bits"));
        }
    };
    let (width, height, channels) = (width as usize, height as usize, color_channels(stored));
    let found = match &values {
        Values::U8(values) => values.len(),
        Values::U16(values) => values.len(),
        Values::F32(values) => values.len(),
    };
    if found != width * height * channels {
        return Err(PictureError::damaged(format!(
            "it holds {found} values for {width} x {height} pixels"
        )));
    }
    Ok(Picture { width, height, channels, values })
}

fn tiff_limits(samples: usize) -> tiff::decoder::Limits {
    let mut limits = tiff::decoder::Limits::default();
    limits.decoding_buffer_size = limits.decoding_buffer_size.max(4 * samples);
    limits.intermediate_buffer_size = limits.intermediate_buffer_size.max(4 * samples);
    limits
}

/// Refuses what would come out negative or as one channel of several.
fn check_tiff_kind(
    decoder: &mut tiff::decoder::Decoder<Cursor<&[u8]>>,
    stored: usize,
) -> Result<(), PictureError> {
    use tiff::tags::Tag;
    let mut number =
        |tag, absent| decoder.find_tag_unsigned::<u32>(tag).ok().flatten().unwrap_or(absent);
    if number(Tag::PhotometricInterpretation, 1) == 0 {
        return Err(PictureError::unsupported(
            "a TIFF in which white is zero",
            "save it with black as zero",
        ));
    }
    if stored > 1 && number(Tag::PlanarConfiguration, 1) != 1 {
        return Err(PictureError::unsupported(
            "a TIFF of separate colour planes",
            "save it with interleaved channels",
        ));
    }
    Ok(())
}
