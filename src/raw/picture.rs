//! Pictures that other programs wrote, as frames.

use super::{DecodeError, Encoding, Frame, Hint, Layout, Metadata, Numbers, Samples, metadata};
use crate::raster::{Curve, Format, Picture, Said, SaidCurve, Values, decode_picture};
use std::path::Path;

/// Full scale of integer pictures that went through a curve, at which a sample counts as saturated.
const FULL: f32 = 65_535.0;

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// # Errors
/// A damaged picture, or one that contradicts what the capture session says of it.
pub(crate) fn decode(
    bytes: &[u8],
    format: Format,
    metadata: Metadata,
    hint: &Hint,
) -> Result<Frame, DecodeError> {
    let picture = decode_picture(bytes)?;
    check(&picture)?;
    let layout = layout(&picture, hint)?;
    let curve = curve(&picture, hint)?;
    let numbers = numbers(&picture, &curve, hint);
    let full_scale = picture.full_scale;
    let (samples, saturation) = match picture.values {
        Values::F32(values) if curve == Curve::Linear => (Samples::F32(values), full_scale),
        Values::F32(values) => {
            let light =
                |(k, value): (usize, f32)| curve.linear(k % picture.channels, value.into()) as f32;
            (Samples::F32(values.into_iter().enumerate().map(light).collect()), full_scale)
        }
        Values::U16(values) if curve == Curve::Linear => (Samples::U16(values), full_scale),
        Values::U16(values) => {
            let tables = tables(&curve, full_scale);
            let light = |(k, value): (usize, u16)| tables[k % picture.channels][usize::from(value)];
            (Samples::U16(values.into_iter().enumerate().map(light).collect()), FULL)
        }
        Values::U8(values) => {
            let tables = tables(&curve, full_scale);
            let light =
                |(k, &value): (usize, &u8)| tables[k % picture.channels][usize::from(value)];
            (Samples::U16(values.iter().enumerate().map(light).collect()), FULL)
        }
    };
    let metadata = match format {
        Format::Png | Format::Jpeg => metadata::from_exif_container(bytes),
        _ => metadata,
    };
    Ok(Frame {
        width: picture.width,
        height: picture.height,
        layout,
        samples,
        black: [0.0; 4],
        saturation: [saturation; 4],
        metadata: Metadata { numbers, ..metadata },
    })
}

/// Refuses what can be looked at but not measured in.
fn check(picture: &Picture) -> Result<(), DecodeError> {
    if let Some(what) = &picture.no_frame {
        return Err(DecodeError::unsupported(what.clone(), "save it whole, with square pixels"));
    }
    let faded = picture.alpha.as_ref().is_some_and(|a| a.premultiplied && a.is_transparent());
    if faded {
        let what = "a picture whose colours are multiplied by its transparency";
        return Err(DecodeError::unsupported(what, "save it without alpha channel"));
    }
    Ok(())
}

fn layout(picture: &Picture, hint: &Hint) -> Result<Layout, DecodeError> {
    match (picture.channels, hint.cfa) {
        (3, Some(declared)) => {
            let found = "an RGB picture".to_owned();
            Err(DecodeError::CfaContradicted { declared: declared.name(), found })
        }
        (3, None) => Ok(Layout::Rgb),
        (_, Some(cfa)) => Ok(Layout::Mosaic(cfa)),
        (_, None) => Ok(Layout::Grey),
    }
}

/// What is declared, else what the file says; without either, more than 8 bits are linear.
fn curve(picture: &Picture, hint: &Hint) -> Result<Curve, DecodeError> {
    let whole = matches!(picture.values, Values::F32(_));
    match (hint.encoding, &picture.said.curve) {
        (Some(Encoding::Srgb), _) if whole => {
            Err(DecodeError::EncodingContradicted { format: "a floating-point picture" })
        }
        (Some(encoding), _) => Ok(curve_of(encoding)),
        (None, SaidCurve::Known(curve)) => Ok(curve.clone()),
        (None, SaidCurve::Unreadable(why)) => {
            let by = picture.said.by.clone();
            Err(DecodeError::EncodingUnreadable { by, why: why.clone() })
        }
        (None, SaidCurve::Silent) if matches!(picture.values, Values::U8(_)) => {
            Err(DecodeError::EncodingUndeclared)
        }
        (None, SaidCurve::Silent) => Ok(Curve::Linear),
    }
}

fn curve_of(encoding: Encoding) -> Curve {
    match encoding {
        Encoding::Linear => Curve::Linear,
        Encoding::Srgb => Curve::Srgb,
    }
}

fn numbers(picture: &Picture, applied: &Curve, hint: &Hint) -> Numbers {
    let Said { curve, by, linear_srgb_from_rgb } = &picture.said;
    let said = match curve {
        SaidCurve::Known(curve) => Some(curve),
        _ => None,
    };
    let contradiction = match (said, hint.encoding) {
        (Some(said), Some(declared)) if *said != curve_of(declared) => {
            Some(format!("{by} says {}, declared is {}", said.name(), curve_of(declared).name()))
        }
        _ => None,
    };
    // Pictures in sRGB's curve come in sRGB's primaries, unless they say otherwise.
    let stated = linear_srgb_from_rgb.filter(|_| picture.channels == 3);
    let primaries = stated.or((*applied == Curve::Srgb).then_some(IDENTITY));
    let integers = !matches!(picture.values, Values::F32(_));
    Numbers {
        may_clip_below: integers,
        significant_bits: picture.significant_bits.filter(|_| *applied == Curve::Linear),
        curve: applied.name(),
        encoding: match (hint.encoding, said.filter(|_| integers)) {
            (None, Some(Curve::Linear)) => Some(Encoding::Linear),
            (None, Some(Curve::Srgb)) => Some(Encoding::Srgb),
            _ => None,
        },
        contradiction,
        linear_srgb_from_rgb: primaries,
    }
}

/// Light of every stored number, for each channel; 65535 is full scale.
fn tables(curve: &Curve, full_scale: f32) -> [Vec<u16>; 3] {
    let light = |channel: usize, number: u32| {
        let light = curve.linear(channel, f64::from(number) / f64::from(full_scale));
        (f64::from(FULL) * light).round().clamp(0.0, f64::from(FULL)) as u16
    };
    [0, 1, 2].map(|channel| (0..=full_scale as u32).map(|number| light(channel, number)).collect())
}

impl DecodeError {
    /// Whether declaring the encoding is what it takes.
    pub fn asks_for_encoding(&self) -> bool {
        matches!(self, Self::EncodingUndeclared | Self::EncodingUnreadable { .. })
    }
}

/// One sentence for pictures that were read as declared although their files say otherwise.
pub fn contradictions<'a>(
    pictures: impl Iterator<Item = (&'a Path, &'a Numbers)>,
) -> Option<String> {
    let mut contradicted =
        pictures.filter_map(|(path, numbers)| Some((path, numbers.contradiction.as_ref()?)));
    let (path, what) = contradicted.next()?;
    let others = match contradicted.count() {
        0 => String::new(),
        1 => " (and one other)".to_owned(),
        n => format!(" (and {n} others)"),
    };
    Some(format!(
        "{}{others}: {what}. It is read as declared; if the file is right, remove the declaration.",
        path.display()
    ))
}

/// One sentence for pictures of one set that were not read by one curve.
pub fn mixed_encodings<'a>(
    pictures: impl Iterator<Item = (&'a Path, &'a Numbers)>,
) -> Option<String> {
    let mut read = pictures.filter(|(_, numbers)| !numbers.curve.is_empty());
    let (first, of_first) = read.next()?;
    let (other, of_other) = read.find(|(_, numbers)| numbers.curve != of_first.curve)?;
    Some(format!(
        "{} is read as {}, but {} as {}, as each file says or by default: if one of them is wrong, declare one encoding for all.",
        first.display(),
        of_first.curve,
        other.display(),
        of_other.curve
    ))
}
