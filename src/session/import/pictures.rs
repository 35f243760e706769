//! The pictures themselves: what must be known of them to import them.

use super::looks::Look;
use super::{ImportError, Options};
use crate::files::{FileError, sha256_hex};
use crate::raster;
use crate::raw::{self, DecodeError, Hint, Histogram, Metadata};
use crate::session::Encoding;
use image::{ColorType, ImageEncoder, codecs::png::PngEncoder};
use std::path::Path;

/// A picture's file and what must be known of it.
pub(super) struct Frame {
    /// The file as it is.
    pub(super) bytes: Vec<u8>,
    pub(super) sha256: String,
    /// Width and height.
    pub(super) size_px: [usize; 2],
    pub(super) metadata: Metadata,
    /// Levels that its file does not state, and what to do; ends where the place to state them follows.
    pub(super) assumed: Option<String>,
    pub(super) look: Look,
    /// How often each number occurs, where its file leaves it open where samples clip.
    pub(super) histogram: Option<Histogram>,
}

/// Reads a picture, and decodes it as a solve will: what cannot be solved is not imported.
pub(super) fn read_frame(path: &Path, options: &Options) -> Result<Frame, ImportError> {
    let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
        .map_err(|source| FileError::read(path, source))?;
    let encoding = options.encoding.map(|encoding| match encoding {
        Encoding::Linear => raw::Encoding::Linear,
        Encoding::Srgb => raw::Encoding::Srgb,
    });
    let path = || path.to_owned();
    let hint = Hint { cfa: options.cfa, encoding };
    let frame = raw::decode(&bytes, &hint).map_err(|error| match error {
        DecodeError::EncodingUndeclared => ImportError::EncodingUnknown(path()),
        DecodeError::EncodingUnreadable { by, why } => {
            ImportError::EncodingUnreadable { path: path(), by, why }
        }
        DecodeError::EncodingContradicted { format } => {
            ImportError::EncodingContradicted { path: path(), format }
        }
        DecodeError::CfaContradicted { declared, found } => {
            ImportError::CfaContradicted { path: path(), declared, found }
        }
        error => FileError::Content { path: path(), what: error.to_string() }.into(),
    })?;
    let sha256 = sha256_hex(&bytes);
    Ok(Frame {
        look: Look::new(&path(), &sha256, &frame),
        size_px: [frame.width, frame.height],
        assumed: frame.assumed_levels([false; 2]),
        histogram: Histogram::of_frame(&frame),
        metadata: frame.metadata,
        sha256,
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
