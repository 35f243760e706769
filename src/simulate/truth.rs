//! What is in the swatch's picture, as EXR.

use super::SimulateError;
use crate::files::FileError;
use exr::prelude::{Encoding, Image, SpecificChannels, Vec2, WritableImage};
use std::path::Path;
use weavelight_sim::render::Truth;

/// Writes `normal.exr` (R, G, B = nx, ny, nz), `albedo.exr` (linear sRGB reflectance) and `height.exr` (Y, millimetres over
/// the swatch's plane). In one thread: several write their blocks in the order in which they finish.
pub(super) fn write(
    folder: &Path,
    size_px: [usize; 2],
    truth: &Truth,
) -> Result<(), SimulateError> {
    std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
    write_rgb(&folder.join("normal.exr"), size_px, &truth.normal)?;
    write_rgb(&folder.join("albedo.exr"), size_px, &truth.albedo)?;
    let path = folder.join("height.exr");
    let at = |place: Vec2<usize>| (truth.height_mm[place.y() * size_px[0] + place.x()],);
    let channels = SpecificChannels::build().with_channel("Y").with_pixel_fn(at);
    Image::from_encoded_channels((size_px[0], size_px[1]), Encoding::UNCOMPRESSED, channels)
        .write()
        .non_parallel()
        .to_file(&path)
        .map_err(|error| failed(&path, error))?;
    Ok(())
}

fn write_rgb(
    path: &Path,
    [width, height]: [usize; 2],
    pixels: &[[f32; 3]],
) -> Result<(), FileError> {
    let at = |place: Vec2<usize>| {
        let [r, g, b] = pixels[place.y() * width + place.x()];
        (r, g, b)
    };
    Image::from_encoded_channels((width, height), Encoding::UNCOMPRESSED, SpecificChannels::rgb(at))
        .write()
        .non_parallel()
        .to_file(path)
        .map_err(|error| failed(path, error))
}

fn failed(path: &Path, error: exr::error::Error) -> FileError {
    let source = match error {
        exr::error::Error::Io(source) => source,
        other => std::io::Error::other(other.to_string()),
    };
    FileError::write(path, source)
}
