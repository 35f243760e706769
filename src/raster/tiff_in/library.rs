//! JPEG-compressed TIFF, through the `tiff` crate.

use super::super::picture::{Picture, Values};
use super::super::{PictureError, limits};
use super::directory::Directory;
use super::layout::{Colors, Layout};
use super::segments::refused;
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult};

/// Grey or RGB of 8 bits in the file's first directory.
///
/// # Errors
/// Anything else, by name; or a damaged file.
pub(super) fn decode(bytes: &[u8], first: bool, page: &Directory) -> Result<Picture, PictureError> {
    let layout = Layout::parse(page)?;
    let plain = matches!(layout.colors, Colors::Grey | Colors::Rgb)
        && layout.samples == layout.colors.count()
        && layout.bits == 8
        && !layout.planar;
    if !first || !plain {
        return Err(refused(7));
    }
    let damaged = |error: tiff::TiffError| match error {
        tiff::TiffError::UnsupportedError(_) => refused(7),
        error => PictureError::damaged(error.to_string()),
    };
    limits::check(layout.width as u64, layout.height as u64, layout.samples, bytes.len())?;
    let mut limits = tiff::decoder::Limits::default();
    let needed = layout.width * layout.height * layout.samples;
    limits.decoding_buffer_size = limits.decoding_buffer_size.max(needed);
    limits.intermediate_buffer_size = limits.intermediate_buffer_size.max(needed);
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(damaged)?.with_limits(limits);
    let DecodingResult::U8(values) = decoder.read_image().map_err(damaged)? else {
        return Err(refused(7));
    };
    if values.len() != needed {
        return Err(PictureError::damaged(format!(
            "it holds {} of {needed} samples",
            values.len()
        )));
    }
    let said = super::said::said(page, &layout);
    let size = [layout.width, layout.height];
    Ok(Picture { said, ..Picture::plain(size, layout.samples, Values::U8(values), 255.0) })
}
