//! JPEG in, through the `image` crate; the frame header is looked at first, as it says what the library does not read.
//!
//! ITU-T T.81, annex B; Exif 2.32 and DCF 2.0 for the colour space.

use super::encoding::{Curve, Said, Tone};
use super::icc::said_by_icc;
use super::picture::{Picture, Values};
use super::primaries::{BT_709, D65, linear_srgb_from};
use super::{PictureError, limits};
use image::{ColorType, ImageDecoder, ImageError, codecs::jpeg::JpegDecoder};
use std::io::Cursor;

const SAVE_AS: &str = "save it as a baseline JPEG, or as a 16-bit TIFF or PNG";

/// # Errors
/// Anything that is no sound JPEG of 8 bits, grey or RGB.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, PictureError> {
    check_kind(bytes)?;
    let wrong = |error: ImageError| match error {
        ImageError::Unsupported(error) => {
            PictureError::unsupported(format!("a JPEG of a rare kind ({error})"), SAVE_AS)
        }
        error => PictureError::damaged(error.to_string()),
    };
    let mut decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let channels = match decoder.color_type() {
        ColorType::L8 => 1,
        ColorType::Rgb8 => 3,
        other => return Err(PictureError::unsupported(format!("a JPEG of {other:?}"), SAVE_AS)),
    };
    limits::check(width.into(), height.into(), channels, bytes.len())?;
    let said = match decoder.icc_profile().map_err(wrong)? {
        Some(profile) => said_by_icc(&profile),
        None => said_by_exif(bytes),
    };
    let mut data = vec![0; width as usize * height as usize * channels];
    decoder.read_image(&mut data).map_err(wrong)?;
    let size = [width as usize, height as usize];
    Ok(Picture { said, ..Picture::plain(size, channels, Values::U8(data), 255.0) })
}

/// Refuses by name what the library does not read, or would convert without a word.
fn check_kind(bytes: &[u8]) -> Result<(), PictureError> {
    let Some([marker, precision, components]) = frame_header(bytes) else { return Ok(()) };
    let process = match marker {
        0xc3 => Some("a lossless JPEG"),
        0xc5..=0xc7 => Some("a hierarchical JPEG"),
        0xc9..=0xcb | 0xcd..=0xcf => Some("a JPEG with arithmetic coding"),
        0xf7 => Some("a JPEG-LS picture"),
        _ => None,
    };
    let what = match (process, precision, components) {
        (Some(process), _, _) => process.to_owned(),
        (_, 8, 4) => "a CMYK JPEG".to_owned(),
        (_, 8, 1 | 3) => return Ok(()),
        (_, 8, n) => format!("a JPEG of {n} components"),
        (_, bits, _) => format!("a JPEG of {bits} bits"),
    };
    Err(PictureError::unsupported(what, SAVE_AS))
}

/// Marker (its second byte), bits and components of the frame.
fn frame_header(bytes: &[u8]) -> Option<[u8; 3]> {
    let mut at = 2;
    loop {
        let marker = *bytes.get(at + 1)?;
        match (bytes.get(at)?, marker) {
            (0xff, 0xff) => at += 1,
            (0xff, 0x01 | 0xd0..=0xd8) => at += 2,
            (0xff, 0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf | 0xf7) => {
                return Some([marker, *bytes.get(at + 4)?, *bytes.get(at + 9)?]);
            }
            (0xff, 0xd9 | 0xda) => return None,
            (0xff, _) => {
                let length = u16::from_be_bytes([*bytes.get(at + 2)?, *bytes.get(at + 3)?]);
                at += 2 + usize::from(length);
            }
            _ => return None,
        }
    }
}

/// Cameras' word: sRGB, or Adobe RGB where the interoperability index is R03 (DCF's optional file).
fn said_by_exif(bytes: &[u8]) -> Said {
    let mut reader = exif::Reader::new();
    reader.continue_on_error(true);
    let exif = match reader.read_from_container(&mut Cursor::new(bytes)) {
        Ok(exif) => exif,
        Err(exif::Error::PartialResult(partial)) => partial.into_inner().0,
        Err(_) => return Said::default(),
    };
    let field = |tag| exif.get_field(tag, exif::In::PRIMARY).map(|field| &field.value);
    let space = field(exif::Tag::ColorSpace).and_then(|value| value.get_uint(0));
    let r03 = match field(exif::Tag::InteroperabilityIndex) {
        Some(exif::Value::Ascii(text)) => text.iter().any(|text| text.starts_with(b"R03")),
        _ => false,
    };
    match (space, r03) {
        (Some(1), _) => Said::known(Curve::Srgb, "its Exif colour space")
            .with_primaries(linear_srgb_from(BT_709, D65)),
        (Some(2), _) | (Some(65_535), true) => {
            let adobe = [[0.64, 0.33], [0.21, 0.71], [0.15, 0.06]];
            // Adobe RGB (1998), 4.3.1.2.
            let tone = || Tone::Gamma(563.0 / 256.0);
            Said::known(Curve::from_tones([tone(), tone(), tone()]), "its Exif colour space")
                .with_primaries(linear_srgb_from(adobe, D65))
        }
        _ => Said::default(),
    }
}
