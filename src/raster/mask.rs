//! Masks: one meaning, wherever a picture says what is inside.

use super::PictureError;
use super::decode::decode_picture;
use super::error::content_error;
use super::picture::{Format, Picture, Values};
use crate::files::FileError;
use std::path::Path;
use weavelight_calibration::description::Image;

/// From here on a pixel of a JPEG counts, of 255: its compression leaves traces in what was black.
const JPEG_INSIDE: u8 = 128;

/// Reads a mask; see [`decode_mask`].
///
/// # Errors
/// [`FileError`] with the path. Whether the size fits is the caller's to judge.
pub fn read_mask(path: &Path) -> Result<Image<bool>, FileError> {
    let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
        .map_err(|source| FileError::read(path, source))?;
    decode_mask(&bytes).map_err(|source| content_error(path, &source))
}

/// Decodes a mask: any picture; true is inside.
///
/// - Without transparency a pixel is inside where any channel is above 0 (floating point: above 0, so that NaN and negative
///   values are outside; JPEG: at least half).
/// - Where the picture is transparent in places, only what is not transparent can be inside: of that, what is not black; or
///   all of it, where all of it is black (a shape cut out and painted black).
///
/// # Errors
/// Anything that is no sound picture, or has nothing inside.
pub fn decode_mask(bytes: &[u8]) -> Result<Image<bool>, PictureError> {
    let picture = decode_picture(bytes)?;
    let mut inside = not_black(&picture, Format::sniff(bytes) == Some(Format::Jpeg));
    let transparent = picture.alpha.as_ref().filter(|alpha| alpha.is_transparent());
    if let Some(alpha) = transparent {
        let opaque = || alpha.values.iter().map(|&alpha| alpha > 0.0);
        let black = !inside.iter().zip(opaque()).any(|(&inside, opaque)| inside && opaque);
        inside.iter_mut().zip(opaque()).for_each(|(inside, opaque)| {
            *inside = opaque && (*inside || black);
        });
    }
    if inside.contains(&true) {
        return Ok(Image { width: picture.width, height: picture.height, data: inside });
    }
    Err(PictureError::EmptyMask {
        all: if transparent.is_some() { "transparent" } else { "black" },
    })
}

fn not_black(picture: &Picture, jpeg: bool) -> Vec<bool> {
    fn any<T: Copy>(values: &[T], channels: usize, counts: impl Fn(T) -> bool) -> Vec<bool> {
        let inside = |pixel: &[T]| pixel.iter().any(|&value| counts(value));
        values.chunks_exact(channels).map(inside).collect()
    }
    let lowest = if jpeg { JPEG_INSIDE } else { 1 };
    match &picture.values {
        Values::U8(values) => any(values, picture.channels, |value| value >= lowest),
        Values::U16(values) => any(values, picture.channels, |value| value > 0),
        Values::F32(values) => any(values, picture.channels, |value| value > 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, LumaA, Rgb, Rgba};
    use std::io::Cursor;

    fn bytes(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.into().write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn check(image: impl Into<DynamicImage>, format: ImageFormat, expected: &[bool]) {
        let mask = decode_mask(&bytes(image, format)).unwrap();
        assert_eq!((mask.width * mask.height, mask.data.as_slice()), (expected.len(), expected));
    }

    fn row<P: image::Pixel>(pixels: &[P]) -> ImageBuffer<P, Vec<P::Subpixel>> {
        ImageBuffer::from_fn(pixels.len() as u32, 1, |x, _| pixels[x as usize])
    }

    #[test]
    fn alpha_counts() {
        let [white, black] = [[255; 3], [0; 3]];
        let rgba = |[r, g, b]: [u8; 3], alpha| Rgba([r, g, b, alpha]);
        // White painted on nothing; black painted on nothing; a transparent white is outside.
        let painted = [rgba(white, 255), rgba(white, 0), rgba(black, 0)];
        check(row(&painted), ImageFormat::Png, &[true, false, false]);
        check(row(&painted), ImageFormat::Tiff, &[true, false, false]);
        check(row(&[rgba(black, 255), rgba(black, 0)]), ImageFormat::Png, &[true, false]);
        // Opaque everywhere: colours alone.
        check(row(&[rgba(black, 255), rgba(white, 255)]), ImageFormat::Png, &[false, true]);
        // Both: black is outside.
        let both = [rgba(black, 255), rgba(white, 255), rgba(white, 0)];
        check(row(&both), ImageFormat::Png, &[false, true, false]);
        check(
            row(&[LumaA([65_535_u16, 65_535]), LumaA([65_535, 0])]),
            ImageFormat::Png,
            &[true, false],
        );
        // A soft edge is inside, as a dark grey is.
        check(row(&[rgba(white, 1), rgba(white, 0)]), ImageFormat::Png, &[true, false]);
    }

    #[test]
    fn any_value_above_nothing_is_inside() {
        check(row(&[Luma([0_u8]), Luma([1])]), ImageFormat::Png, &[false, true]);
        check(row(&[Luma([0_u16]), Luma([1])]), ImageFormat::Tiff, &[false, true]);
        check(row(&[Rgb([0_u8, 0, 1]), Rgb([0, 0, 0])]), ImageFormat::Png, &[true, false]);
        let floats = [0.0, -1.0, f32::NAN, 1e-9, f32::INFINITY, f32::NEG_INFINITY];
        let floats: Vec<_> = floats.iter().map(|&value| Rgb([value, 0.0, -3.0])).collect();
        for format in [ImageFormat::OpenExr, ImageFormat::Tiff] {
            check(row(&floats), format, &[false, false, false, true, true, false]);
        }
    }

    /// Ringing around an edge leaves values of 1 to 20 in black.
    #[test]
    fn a_jpeg_counts_from_half() {
        let image = ImageBuffer::from_fn(64, 64, |x, _| Luma([if x < 30 { 0_u8 } else { 255 }]));
        let expected: Vec<bool> = (0..64 * 64).map(|k| k % 64 >= 30).collect();
        check(image, ImageFormat::Jpeg, &expected);
    }

    #[test]
    fn a_mask_with_nothing_inside_is_refused() {
        let refused = |bytes: &[u8], expected: &str| {
            let error = decode_mask(bytes).unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains("; "), "{error}");
        };
        refused(&bytes(row(&[Luma([0_u8]); 3]), ImageFormat::Png), "black everywhere");
        refused(
            &bytes(row(&[Rgba([9_u8, 9, 9, 0]); 3]), ImageFormat::Png),
            "transparent everywhere",
        );
        refused(b"white, please", "a text file");
    }
}
