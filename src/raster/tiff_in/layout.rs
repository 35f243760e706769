//! What a TIFF picture stores: colours, bits and format of a sample, and what is refused by name.

use super::super::PictureError;
use super::directory::{Directory, tag};

/// What to do with a TIFF of a kind that is not read.
pub(super) const SAVE_AS: &str = "save it as a 16-bit TIFF of grey or RGB";

/// Format of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Unsigned,
    Float,
}

/// What the numbers stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Colors {
    /// 0 is black.
    Grey,
    /// 0 is white.
    InvertedGrey,
    Rgb,
    /// Numbers of colours in a table.
    Palette,
}

/// How a picture stores its samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Samples of a pixel, colours first.
    pub(super) samples: usize,
    pub(super) bits: u32,
    pub(super) format: Format,
    pub(super) colors: Colors,
    /// Place of the alpha among the samples, and whether the colours are multiplied by it.
    pub(super) alpha: Option<(usize, bool)>,
    /// Whether a tag says that it is alpha.
    pub(super) alpha_named: bool,
    /// Whether each sample has a plane of its own.
    pub(super) planar: bool,
    pub(super) compression: u64,
    pub(super) predictor: u64,
    /// Bytes hold their first pixel in the lowest bit.
    pub(super) lowest_bit_first: bool,
}

impl Layout {
    /// # Errors
    /// A kind that is not read, by name; or tags that contradict each other.
    pub(super) fn parse(page: &Directory) -> Result<Self, PictureError> {
        page.check_whole()?;
        let [width, height] = page.size().ok_or_else(|| PictureError::damaged("it has no size"))?;
        let samples = page.integer(tag::SAMPLES_PER_PIXEL).unwrap_or(1);
        let bits = equal(page, tag::BITS_PER_SAMPLE, 1, "channels of different depth")?;
        let format =
            format(equal(page, tag::SAMPLE_FORMAT, 1, "channels of different format")?, bits)?;
        let colors = colors(page, samples, format)?;
        let count = colors.count() as u64;
        if samples < count || samples > 64 {
            return Err(PictureError::damaged(format!("it claims {samples} samples per pixel")));
        }
        let extra = page.integers(tag::EXTRA_SAMPLES).unwrap_or_default();
        if colors == Colors::Grey && samples > 2 && extra.iter().all(|kind| *kind == 0) {
            let what = format!("a TIFF of {samples} channels that are no colours");
            return Err(PictureError::unsupported(what, SAVE_AS));
        }
        let named = extra.iter().position(|kind| matches!(kind, 1 | 2));
        let alpha = match named {
            Some(at) => Some((at + count as usize, extra[at] == 1)),
            // Programs that write one more channel without naming it mean alpha.
            None if extra.is_empty() && samples == count + 1 => Some((count as usize, false)),
            None => None,
        };
        let number = |tag, absent| page.integer(tag).unwrap_or(absent);
        Ok(Self {
            width: usize::try_from(width).unwrap_or(usize::MAX),
            height: usize::try_from(height).unwrap_or(usize::MAX),
            samples: samples as usize,
            bits: bits as u32,
            format,
            colors,
            alpha: alpha.filter(|(at, _)| (*at as u64) < samples),
            alpha_named: named.is_some(),
            planar: number(tag::PLANAR_CONFIGURATION, 1) == 2 && samples > 1,
            compression: number(tag::COMPRESSION, 1),
            predictor: number(tag::PREDICTOR, 1),
            lowest_bit_first: number(tag::FILL_ORDER, 1) == 2,
        })
    }

    /// Samples of a pixel that are stored together.
    pub(super) fn together(&self) -> usize {
        if self.planar { 1 } else { self.samples }
    }
}

impl Colors {
    /// Samples of a pixel, alpha aside.
    pub(super) fn count(self) -> usize {
        if self == Self::Rgb { 3 } else { 1 }
    }
}

/// The one value of a tag that has one for each sample.
fn equal(page: &Directory, tag: u16, absent: u64, what: &str) -> Result<u64, PictureError> {
    let values = page.integers(tag).unwrap_or_else(|| vec![absent]);
    match values.first() {
        Some(&first) if values.iter().all(|&value| value == first) => Ok(first),
        Some(_) => Err(PictureError::unsupported(format!("a TIFF with {what}"), SAVE_AS)),
        None => Ok(absent),
    }
}

fn format(code: u64, bits: u64) -> Result<Format, PictureError> {
    let unsupported = |what: String| Err(PictureError::unsupported(what, SAVE_AS));
    match (code, bits) {
        (1 | 4, 1..=16 | 24 | 32) => Ok(Format::Unsigned),
        (3, 16 | 32 | 64) => Ok(Format::Float),
        (2, _) => unsupported(format!("a TIFF of signed {bits}-bit numbers")),
        (5 | 6, _) => unsupported("a TIFF of complex numbers".to_owned()),
        (3, _) => unsupported(format!("a TIFF of {bits}-bit floating point")),
        (1 | 4, 1..) => unsupported(format!("a TIFF of {bits} bits")),
        _ => Err(PictureError::damaged(format!("it claims sample format {code} of {bits} bits"))),
    }
}

fn colors(page: &Directory, samples: u64, format: Format) -> Result<Colors, PictureError> {
    let guessed = if samples >= 3 { 2 } else { 1 };
    let photometric = page.integer(tag::PHOTOMETRIC).unwrap_or(guessed);
    let kind = match photometric {
        0 if format == Format::Float => "a floating-point TIFF in which white is zero",
        0 => return Ok(Colors::InvertedGrey),
        1 => return Ok(Colors::Grey),
        2 => return Ok(Colors::Rgb),
        3 => return Ok(Colors::Palette),
        4 => "a TIFF of nothing but a transparency mask",
        5 => "a CMYK TIFF",
        6 => "a YCbCr TIFF",
        8..=10 => "a Lab TIFF",
        32_803 | 34_892 => "a TIFF of sensor data",
        32_844 => "a LogL TIFF",
        32_845 => "a LogLuv TIFF",
        other => {
            let what = format!("a TIFF of photometric interpretation {other}");
            return Err(PictureError::unsupported(what, SAVE_AS));
        }
    };
    Err(PictureError::unsupported(kind, SAVE_AS))
}
