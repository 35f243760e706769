//! The pictures themselves: what must be known of them to import them.

use super::{Encoding, ImportError};
use crate::files::FileError;
use crate::raster::{Values, decode_picture};
use crate::raw::{self, DecodeError, Hint};
use image::{ColorType, ImageEncoder, codecs::png::PngEncoder};
use std::path::Path;

/// A picture's file and its size.
pub(super) struct Frame {
    /// The file as it is.
    pub(super) bytes: Vec<u8>,
    /// Width and height.
    pub(super) size_px: [usize; 2],
}

/// Reads a picture, and decodes it as a solve will: what cannot be solved is not imported.
pub(super) fn read_frame(path: &Path, encoding: Option<Encoding>) -> Result<Frame, ImportError> {
    let bytes = std::fs::read(path).map_err(|source| FileError::read(path, source))?;
    let encoding = encoding.map(|encoding| match encoding {
        Encoding::Linear => raw::Encoding::Linear,
        Encoding::Srgb => raw::Encoding::Srgb,
    });
    let frame =
        raw::decode(&bytes, &Hint { cfa: None, encoding }).map_err(|error| match error {
            DecodeError::EncodingUndeclared => ImportError::EncodingUnknown(path.to_owned()),
            error => FileError::Content { path: path.to_owned(), what: error.to_string() }.into(),
        })?;
    Ok(Frame { size_px: [frame.width, frame.height], bytes })
}

/// A mask: 255 inside, 0 outside.
pub(super) struct Mask {
    /// Row by row.
    inside: Vec<u8>,
    /// Width and height.
    pub(super) size_px: [usize; 2],
}

/// Reads any picture as a mask: what is not black is inside.
pub(super) fn read_mask(path: &Path) -> Result<Mask, FileError> {
    let bytes = std::fs::read(path).map_err(|source| FileError::read(path, source))?;
    let picture = decode_picture(&bytes)
        .map_err(|error| FileError::Content { path: path.to_owned(), what: error.to_string() })?;
    let inside = match &picture.values {
        Values::U8(values) => not_black(values, picture.channels),
        Values::U16(values) => not_black(values, picture.channels),
        Values::F32(values) => not_black(values, picture.channels),
    };
    Ok(Mask { inside, size_px: [picture.width, picture.height] })
}

fn not_black<T: PartialOrd + Default>(values: &[T], channels: usize) -> Vec<u8> {
    let inside = |pixel: &[T]| pixel.iter().any(|value| *value > T::default());
    values.chunks_exact(channels).map(|pixel| if inside(pixel) { 255 } else { 0 }).collect()
}

impl Mask {
    /// Writes it as a grey PNG.
    pub(super) fn write(&self, path: &Path) -> Result<(), FileError> {
        let unwritable = |what: String| FileError::Unwritable { path: path.to_owned(), what };
        let mut bytes = Vec::new();
        let [width, height] = self.size_px.map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        PngEncoder::new(&mut bytes)
            .write_image(&self.inside, width, height, ColorType::L8.into())
            .map_err(|error| unwritable(error.to_string()))?;
        std::fs::write(path, bytes).map_err(|source| FileError::write(path, source))
    }
}
