//! What the fit leaves over of every light, on request: how much more light came back than from a Lambertian surface of the
//! normal and albedo found. Highlights are positive, cast shadows negative; gloss and sheen are measured from it.

use crate::files::FileError;
use crate::photometry::is_solved;
use crate::photometry::{FieldRow, RowOutput};
use crate::raster::{ExrRows, read_exr, write_exr_y};
use crate::solution::{ResidualFile, residual_exr};
use crate::solve::error::SolveError;
use crate::solve::output::finish::undistort_values;
use nalgebra::Vector3;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use weavelight_calibration::description::{Camera, Image};

/// Takes rows of residuals, from several threads and in any order: position of the light among the scene's, row, one value
/// a photosite of the frame. A residual is in units of the albedo, as a fraction of what a perfect white diffuser that
/// faces the light would send back; NaN where there is none: unsolved, or the sample is clipped.
pub(crate) type ResidualRows<'a> = &'a (dyn Fn(usize, usize, &[f32]) + Sync);

/// Residuals of one light along a row: (y - albedo max(0, n . l)) / |l| with l the light vector, y the sample and the
/// surface as in the maps (of a colour picture, the grey mix that its normal is found from).
pub(crate) fn residual_row(
    light: usize,
    signal: &[f32],
    field: &FieldRow,
    surface: &RowOutput,
    residual: &mut [f32],
) {
    let step = field.step.max(1);
    for (node, between) in residual.chunks_mut(step).enumerate() {
        let start = field.at(node * step, light);
        let per_column = (field.at((node + 1) * step, light) - start) / step as f64;
        for (k, residual) in between.iter_mut().enumerate() {
            let (column, vector) = (node * step + k, start + per_column * k as f64);
            let normal = Vector3::from(surface.normal[column]).cast::<f64>();
            let predicted = f64::from(surface.albedo[column]) * normal.dot(&vector).max(0.0);
            let value = ((f64::from(signal[column]) - predicted) / vector.norm()) as f32;
            let known = is_solved(surface.outcome[column]) && value.is_finite();
            *residual = if known { value } else { f32::NAN };
        }
    }
}

/// The residuals' files, one a light, written while the bands are solved.
pub(crate) struct ResidualFiles {
    folder: PathBuf,
    lights: Vec<usize>,
    rows: Vec<ExrRows>,
    /// Whether the files are resampled at the end, and until then keep NaN where there is no residual.
    resampled: bool,
    failure: OnceLock<FileError>,
}

impl ResidualFiles {
    /// Starts the files of these lights (their numbers in the rig); `resampled` where [`ResidualFiles::finish`] will be given
    /// a camera.
    pub(crate) fn create(
        folder: &Path,
        lights: Vec<usize>,
        size_px: [usize; 2],
        resampled: bool,
    ) -> Result<Self, FileError> {
        let start = |light: &usize| ExrRows::create(&folder.join(residual_exr(*light)), size_px);
        let rows = lights.iter().map(start).collect::<Result<_, _>>()?;
        Ok(Self { folder: folder.to_owned(), lights, rows, resampled, failure: OnceLock::new() })
    }

    /// Writes a row; a failure is kept for [`ResidualFiles::finish`].
    pub(crate) fn write_row(&self, light: usize, y: usize, values: &[f32]) {
        if self.failure.get().is_some() {
            return;
        }
        let written = match self.resampled {
            true => self.rows[light].write_row(y, values),
            false => self.rows[light].write_row(y, &zero_where_missing(values)),
        };
        if let Err(error) = written {
            // Another thread may have been first; one failure says enough.
            let _ = self.failure.set(error);
        }
    }

    /// Resamples the files to the picture of a camera without distortion, where one is given, one light at a time, and
    /// names them.
    pub(crate) fn finish(
        self,
        undistorted: Option<&Camera>,
    ) -> Result<Vec<ResidualFile>, SolveError> {
        if let Some(failure) = self.failure.into_inner() {
            return Err(failure.into());
        }
        // Closed before they are read.
        drop(self.rows);
        let files = self.lights.iter().map(|&light| {
            let file = residual_exr(light);
            if let Some(camera) = undistorted {
                undistort_file(&self.folder.join(&file), camera)?;
            }
            Ok(ResidualFile { light, file })
        });
        files.collect()
    }
}

/// As the format has it.
fn zero_where_missing(values: &[f32]) -> Vec<f32> {
    values.iter().map(|value| if value.is_nan() { 0.0 } else { *value }).collect()
}

fn undistort_file(path: &Path, camera: &Camera) -> Result<(), SolveError> {
    let unreadable = |error| FileError::read(path, std::io::Error::other(error));
    let exr = read_exr(path).map_err(unreadable)?;
    let (width, height) = (exr.width, exr.height);
    let data = exr.channel("Y").unwrap_or_default().to_vec();
    let mut resampled = undistort_values(&Image { width, height, data }, camera);
    resampled.data = zero_where_missing(&resampled.data);
    write_exr_y(path, &resampled)?;
    Ok(())
}
