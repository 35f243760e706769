//! The pictures themselves: what must be known of them to import them.

use super::{Encoding, ImportError};
use crate::files::FileError;
use crate::raster;
use crate::raw::{self, DecodeError, Hint, Histogram, Numbers};
use image::{ColorType, ImageEncoder, codecs::png::PngEncoder};
use std::path::Path;

/// A picture's file and its size.
pub(super) struct Frame {
    /// The file as it is.
    pub(super) bytes: Vec<u8>,
    /// Width and height.
    pub(super) size_px: [usize; 2],
    /// What its file says of its numbers.
    pub(super) numbers: Numbers,
    /// How often each number occurs, where its file leaves it open where samples clip.
    pub(super) histogram: Option<Histogram>,
}

/// Reads a picture, and decodes it as a solve will: what cannot be solved is not imported.
pub(super) fn read_frame(path: &Path, encoding: Option<Encoding>) -> Result<Frame, ImportError> {
    let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
        .map_err(|source| FileError::read(path, source))?;
    let encoding = encoding.map(|encoding| match encoding {
        Encoding::Linear => raw::Encoding::Linear,
        Encoding::Srgb => raw::Encoding::Srgb,
    });
    let frame =
        raw::decode(&bytes, &Hint { cfa: None, encoding }).map_err(|error| match error {
            DecodeError::EncodingUndeclared => ImportError::EncodingUnknown(path.to_owned()),
            DecodeError::EncodingUnreadable { by, why } => {
                ImportError::EncodingUnreadable { path: path.to_owned(), by, why }
            }
            error => FileError::Content { path: path.to_owned(), what: error.to_string() }.into(),
        })?;
    Ok(Frame {
        size_px: [frame.width, frame.height],
        histogram: Histogram::of_frame(&frame),
        numbers: frame.metadata.numbers,
        bytes,
    })
}

/// A mask: 255 inside, 0 outside.
pub(super) struct Mask {
    /// Row by row.
    inside: Vec<u8>,
    /// Width and height.
    pub(super) size_px: [usize; 2],
}

/// Reads any picture as a mask; see [`raster::decode_mask`].
pub(super) fn read_mask(path: &Path) -> Result<Mask, FileError> {
    let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
        .map_err(|source| FileError::read(path, source))?;
    let mask = raster::decode_mask(&bytes)
        .map_err(|error| FileError::Content { path: path.to_owned(), what: error.to_string() })?;
    let inside = mask.data.iter().map(|&inside| if inside { 255 } else { 0 }).collect();
    Ok(Mask { inside, size_px: [mask.width, mask.height] })
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
