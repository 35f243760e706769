//! Any picture file that other programs write.

use super::error::content_error;
use super::guard::guarded;
use super::picture::{Format, Picture, not_a_picture};
use super::{PictureError, exr_in, jpeg_in, png_in, tiff_in};
use crate::files::FileError;
use std::path::Path;

/// What a reader of pictures asks for when it gets something else.
const PICTURES: &str = "a PNG, JPEG, TIFF or OpenEXR file";

/// Decodes PNG, JPEG, TIFF or EXR (R, G, B or Y of its one layer). Palettes are expanded.
///
/// # Errors
/// Anything that is no sound picture of grey or RGB; never panics.
pub fn decode_picture(bytes: &[u8]) -> Result<Picture, PictureError> {
    match Format::sniff(bytes) {
        Some(Format::Png) => guarded(|| png_in::decode(bytes)),
        Some(Format::Jpeg) => guarded(|| jpeg_in::decode(bytes)),
        Some(Format::Tiff) => guarded(|| tiff_in::decode(bytes)),
        Some(Format::Exr) => exr_in::decode_exr(bytes)?.into_picture(),
        None => Err(not_a_picture(bytes, PICTURES)),
    }
}

/// Reads a picture file; see [`decode_picture`].
///
/// # Errors
/// [`FileError`] with the path.
pub fn read_picture(path: &Path) -> Result<Picture, FileError> {
    let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
        .map_err(|source| FileError::read(path, source))?;
    decode_picture(&bytes).map_err(|source| content_error(path, &source))
}
