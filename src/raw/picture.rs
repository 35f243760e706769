//! Pictures that other programs wrote, as frames.

use super::{DecodeError, Encoding, Frame, Hint, Layout, Metadata, Samples, metadata};
use crate::raster::{Format, Values, decode_picture, srgb};

/// Full scale of integer pictures, at which a sample counts as saturated.
const FULL: f32 = 65_535.0;

/// # Errors
/// A damaged picture, or one that contradicts what the capture session says of it.
pub(crate) fn decode(
    bytes: &[u8],
    format: Format,
    metadata: Metadata,
    hint: &Hint,
) -> Result<Frame, DecodeError> {
    let picture = decode_picture(bytes)?;
    let layout = match (picture.channels, hint.cfa) {
        (3, Some(declared)) => {
            let found = "an RGB picture".to_owned();
            return Err(DecodeError::CfaContradicted { declared: declared.name(), found });
        }
        (3, None) => Layout::Rgb,
        (_, Some(cfa)) => Layout::Mosaic(cfa),
        (_, None) => Layout::Grey,
    };
    let (samples, saturation) = match (picture.values, hint.encoding) {
        (Values::F32(_), Some(Encoding::Srgb)) => {
            return Err(DecodeError::EncodingContradicted { format: "a floating-point picture" });
        }
        (Values::F32(values), _) => (Samples::F32(values), f32::INFINITY),
        (Values::U8(_), None) => return Err(DecodeError::EncodingUndeclared),
        (Values::U8(values), Some(encoding)) => {
            (Samples::U16(from_8_bits(&values, encoding)), FULL)
        }
        (Values::U16(values), encoding) => (Samples::U16(from_16_bits(values, encoding)), FULL),
    };
    let metadata = match format {
        Format::Png | Format::Jpeg => metadata::from_exif_container(bytes),
        _ => metadata,
    };
    let (width, height) = (picture.width, picture.height);
    Ok(Frame {
        width,
        height,
        layout,
        samples,
        black: [0.0; 4],
        saturation: [saturation; 4],
        metadata,
    })
}

/// 255 becomes 65535, which counts as saturated.
fn from_8_bits(values: &[u8], encoding: Encoding) -> Vec<u16> {
    let table: [u16; 256] = std::array::from_fn(|i| match encoding {
        Encoding::Linear => i as u16 * 257,
        Encoding::Srgb => linear_of(i as f32 / 255.0),
    });
    values.iter().map(|&value| table[usize::from(value)]).collect()
}

fn from_16_bits(mut values: Vec<u16>, encoding: Option<Encoding>) -> Vec<u16> {
    if encoding == Some(Encoding::Srgb) {
        let table: Vec<u16> = (0..=u16::MAX).map(|i| linear_of(f32::from(i) / FULL)).collect();
        values.iter_mut().for_each(|value| *value = table[usize::from(*value)]);
    }
    values
}

fn linear_of(encoded: f32) -> u16 {
    (FULL * srgb::decode(encoded)).round() as u16
}
