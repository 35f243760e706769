//! Any picture, values as the file has them.

use super::PictureError;
use super::encoding::Said;
use super::foreign::kind_not_read;

/// A decoded picture: rows from the top left, channels interleaved.
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
    /// The number that stands for full scale; infinite for floating point, which has no ceiling.
    pub full_scale: f32,
    /// Opacity of each pixel, 0 to 1, where the file has an alpha channel.
    pub alpha: Option<Alpha>,
    /// What the file says of its numbers.
    pub said: Said,
    /// Bits that carry information, where the file says that there are fewer than it stores.
    pub significant_bits: Option<u8>,
    /// Why the picture is no frame, though it can be looked at, as in "an OpenEXR picture whose data window ...".
    pub no_frame: Option<String>,
}

/// Opacity.
#[derive(Clone, Debug, PartialEq)]
pub struct Alpha {
    /// One a pixel, 0 to 1.
    pub values: Vec<f32>,
    /// Whether the colours are multiplied by it.
    pub premultiplied: bool,
}

impl Alpha {
    /// Whether any pixel is more or less transparent.
    pub fn is_transparent(&self) -> bool {
        self.values.iter().any(|&alpha| alpha < 1.0)
    }
}

/// Values of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Up to 8 bits.
    U8(Vec<u8>),
    /// Up to 16 bits.
    U16(Vec<u16>),
    /// Floating point, may hold NaN and infinities; or integers of more than 16 bits as fractions of full scale.
    F32(Vec<f32>),
}

impl Values {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::F32(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Picture {
    /// A picture of which the file says nothing but the numbers.
    pub(crate) fn plain(
        size: [usize; 2],
        channels: usize,
        values: Values,
        full_scale: f32,
    ) -> Self {
        let [width, height] = size;
        Self {
            width,
            height,
            channels,
            values,
            full_scale,
            alpha: None,
            said: Said::default(),
            significant_bits: None,
            no_frame: None,
        }
    }

    /// Value `index` as a fraction of full scale; as it is where there is no ceiling.
    pub(crate) fn fraction(&self, index: usize) -> f32 {
        let value = match &self.values {
            Values::U8(values) => f32::from(values[index]),
            Values::U16(values) => f32::from(values[index]),
            Values::F32(values) => values[index],
        };
        if self.full_scale.is_finite() { value / self.full_scale } else { value }
    }
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

/// The error for bytes of no picture format that is read.
pub(crate) fn not_a_picture(bytes: &[u8], expected: &'static str) -> PictureError {
    if let Some((kind, remedy)) = kind_not_read(bytes) {
        return PictureError::unsupported(kind, remedy);
    }
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

/// Colour channels among the stored ones: grey and grey-alpha have one, RGB and RGBA three.
pub(super) fn color_channels(stored: usize) -> usize {
    if stored < 3 { 1 } else { 3 }
}

/// Colours and, where there are two or four channels, opacity: the last of them, straight.
pub(super) fn split_alpha<T: Copy>(
    values: Vec<T>,
    stored: usize,
    opacity: impl Fn(T) -> f32,
) -> (Vec<T>, Option<Alpha>) {
    if !matches!(stored, 2 | 4) {
        return (values, None);
    }
    let pixels = || values.chunks_exact(stored);
    let alpha = pixels().map(|pixel| opacity(pixel[stored - 1])).collect();
    let colors = pixels().flat_map(|pixel| &pixel[..stored - 1]).copied().collect();
    (colors, Some(Alpha { values: alpha, premultiplied: false }))
}
