//! What is in the swatch's picture, as EXR.

use super::SimulateError;
use crate::files::FileError;
use crate::raster::{write_exr_rgb, write_exr_y};
use std::path::Path;
use weavelight_calibration::description::Image;
use weavelight_sim::render::Truth;

/// Writes `normal.exr` (R, G, B = nx, ny, nz), `albedo.exr` (linear sRGB reflectance) and `height.exr` (Y, millimetres over
/// the swatch's plane).
pub(super) fn write(
    folder: &Path,
    [width, height]: [usize; 2],
    truth: Truth,
) -> Result<(), SimulateError> {
    std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
    let Truth { normal, albedo, height_mm } = truth;
    write_exr_rgb(&folder.join("normal.exr"), &Image { width, height, data: normal })?;
    write_exr_rgb(&folder.join("albedo.exr"), &Image { width, height, data: albedo })?;
    write_exr_y(&folder.join("height.exr"), &Image { width, height, data: height_mm })?;
    Ok(())
}
