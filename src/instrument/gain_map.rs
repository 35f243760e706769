//! Gain maps as EXR pictures.

use crate::files::{FileError, InputKind, read_input};
use crate::quantity::GAIN;
use crate::raster::{Exr, Values, decode_exr};
use exr::prelude::WritableImage;
use std::io::Cursor;
use std::path::Path;
use weavelight_calibration::description::Image;

/// Reads a gain map: R, G, B, every value a gain.
pub(super) fn read_gain_map(path: &Path) -> Result<Image<[f32; 3]>, FileError> {
    let bytes =
        read_input(path, InputKind::Picture).map_err(|source| FileError::read(path, source))?;
    let wrong = |what: String| {
        let remedy = "restore the file or run `weavelight calibrate lights` again";
        FileError::Content { path: path.to_owned(), what: format!("{what}; {remedy}") }
    };
    let no_rgb = |error: String| wrong(format!("is no RGB OpenEXR picture ({error})"));
    let picture = decode_exr(&bytes)
        .and_then(Exr::into_picture)
        .map_err(|error| no_rgb(error.to_string()))?;
    if let Some(what) = &picture.no_frame {
        return Err(wrong(format!("is {what}; a gain is missing")));
    }
    let Values::F32(values) = &picture.values else { return Err(no_rgb("no numbers".into())) };
    if picture.channels != 3 {
        return Err(no_rgb("it is grey".into()));
    }
    let data = values.as_chunks::<3>().0.to_vec();
    let map = Image { width: picture.width, height: picture.height, data };
    match map.data.iter().flatten().find_map(|gain| GAIN.check(f64::from(*gain)).err()) {
        Some(what) => Err(wrong(format!("a gain of it {what}"))),
        None => Ok(map),
    }
}

/// The bytes of a gain map's EXR file.
pub(super) fn encode_gain_map(
    folder: &Path,
    light: usize,
    map: &Image<[f32; 3]>,
) -> Result<Vec<u8>, FileError> {
    let unwritable = |what| FileError::Unwritable { path: folder.to_owned(), what };
    let range = GAIN.range();
    if map.data.is_empty()
        || map.data.iter().flatten().any(|gain| !range.contains(&f64::from(*gain)))
    {
        return Err(unwritable(format!(
            "the gain map of light {light} has gains that are not positive"
        )));
    }
    let channels = exr::prelude::SpecificChannels::rgb(|place: exr::prelude::Vec2<usize>| {
        let [r, g, b] = *map.at(place.x(), place.y());
        (r, g, b)
    });
    let mut bytes = Cursor::new(Vec::new());
    exr::prelude::Image::from_channels((map.width, map.height), channels)
        .write()
        // Several threads would write blocks in the order in which they finish: other bytes every time.
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|error| unwritable(format!("the gain map of light {light}: {error}")))?;
    Ok(bytes.into_inner())
}
