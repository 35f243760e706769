//! OpenEXR in, through the `exr` crate.

use super::guard::guarded;
use super::picture::{Format, Picture, Values, not_a_picture};
use super::{FileError, PictureError, limits};
use exr::prelude::{FlatSamples, MetaData, ReadChannels, ReadLayers, read};
use std::io::Cursor;
use std::path::Path;

/// The channels of an EXR file's first flat layer, over its data window.
#[derive(Clone, Debug, PartialEq)]
pub struct Exr {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Name and `width * height` values of each, in the file's order; may hold NaN and infinities.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl Exr {
    /// The values of a channel.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(other, _)| other == name).map(|(_, values)| values.as_slice())
    }

    /// R, G, B interleaved, or Y.
    pub(crate) fn into_picture(self) -> Result<Picture, PictureError> {
        let (width, height) = (self.width, self.height);
        let picture =
            |channels, values| Ok(Picture { width, height, channels, values: Values::F32(values) });
        match (self.channel("R"), self.channel("G"), self.channel("B"), self.channel("Y")) {
            (Some(red), Some(green), Some(blue), _) => {
                let pixels =
                    red.iter().zip(green).zip(blue).flat_map(|((&r, &g), &b)| [r, g, b]).collect();
                picture(3, pixels)
            }
            (_, _, _, Some(grey)) => picture(1, grey.to_vec()),
            _ => {
                let names: Vec<&str> =
                    self.channels.iter().map(|(name, _)| name.as_str()).collect();
                let what = format!("an EXR file with the channels {}", names.join(", "));
                Err(PictureError::unsupported(what, "name its channels R, G, B or Y"))
            }
        }
    }
}

/// Reads an EXR file's first flat layer.
///
/// # Errors
/// [`FileError`] with the path.
pub fn read_exr(path: &Path) -> Result<Exr, FileError> {
    let bytes =
        std::fs::read(path).map_err(|source| FileError::Read { path: path.to_owned(), source })?;
    decode_exr(&bytes).map_err(|source| FileError::Content { path: path.to_owned(), source })
}

/// Decodes an EXR file's first flat layer: half, float and unsigned channels, scan lines or tiles, any lossless compression.
///
/// # Errors
/// Anything that is no sound EXR file; never panics.
pub fn decode_exr(bytes: &[u8]) -> Result<Exr, PictureError> {
    if Format::sniff(bytes) != Some(Format::Exr) {
        return Err(not_a_picture(bytes, "an OpenEXR file"));
    }
    guarded(|| decode(bytes))
}

fn decode(bytes: &[u8]) -> Result<Exr, PictureError> {
    let damaged = |error: exr::error::Error| PictureError::damaged(error.to_string());
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?.headers;
    // The reader allocates every layer.
    for header in &headers {
        let size = header.layer_size;
        limits::check(
            size.width() as u64,
            size.height() as u64,
            header.channels.list.len(),
            bytes.len(),
        )?;
        let subsampled = header
            .channels
            .list
            .iter()
            .any(|channel| (channel.sampling.x(), channel.sampling.y()) != (1, 1));
        if subsampled {
            return Err(PictureError::unsupported(
                "an EXR file with subsampled channels",
                "save all at full size",
            ));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(damaged)?;
    let layer = image.layer_data;
    let channels = layer.channel_data.list.into_iter().map(|channel| {
        let values = match channel.sample_data {
            FlatSamples::F32(values) => values,
            FlatSamples::F16(values) => values.into_iter().map(exr::prelude::f16::to_f32).collect(),
            FlatSamples::U32(values) => values.into_iter().map(|value| value as f32).collect(),
        };
        (channel.name.to_string(), values)
    });
    Ok(Exr { width: layer.size.width(), height: layer.size.height(), channels: channels.collect() })
}
