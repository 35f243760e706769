//! A solution taken off the disk, ready to be looked at.

use crate::jobs::look::capture::{Capture, capture_of};
use crate::model::project::Project;
use crate::viewer::geometry::Geometry;
use crate::viewer::maps::{Maps, surface};
use crate::viewer::pyramid::Pyramid;
use crate::viewer::slopes;
use crate::viewer::slopes::Distribution;
use nalgebra::{Point3, UnitVector3, Vector3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use weavelight::files::FileError;
use weavelight::instrument::{CalibratedLight, Calibration};
use weavelight::raster::{Exr, read_exr};
use weavelight::solution::{
    ALBEDO_EXR, CAMERA_TOML, CONFIDENCE_EXR, NORMAL_EXR, SHADE_EXR, Solution,
};
use weavelight_calibration::description::{Camera, Plane};

/// A solution with what belongs to it.
#[derive(Debug)]
pub struct Opened {
    /// Its name: that of its folder.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// Its maps.
    pub maps: Maps,
    /// Size of a pixel, millimetres, where the camera is known.
    pub mm_per_px: Option<f64>,
    /// How steep it is.
    pub slopes: Option<Distribution>,
    /// Sentences of the solve.
    pub warnings: Vec<String>,
    /// How it was solved, as the command line says it.
    pub method: String,
    /// The frames that it was solved from; or a sentence that says why they cannot be looked at.
    pub frames: Result<Capture, String>,
    /// The rig's lights, where they are calibrated.
    pub lights: Vec<CalibratedLight>,
}

impl Opened {
    /// The frames that it was solved from, where they can be looked at.
    pub fn capture(&self) -> Option<&Capture> {
        self.frames.as_ref().ok()
    }
}

/// Why a solution cannot be looked at.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    /// A file is missing or broken.
    #[error(transparent)]
    File(#[from] FileError),
    /// A map is not there.
    #[error("{path} is missing, so that the solution is not whole; solve the scan again")]
    Missing {
        /// The file.
        path: String,
    },
    /// A map lacks a channel.
    #[error("{path} has no channel {channel}; solve the scan again")]
    Channel {
        /// The file.
        path: String,
        /// R, G, B or Y.
        channel: &'static str,
    },
    /// Maps of different sizes.
    #[error("{path} is {found} and normal.exr {expected}; solve the scan again")]
    Size {
        /// The file.
        path: String,
        /// Its size.
        found: String,
        /// That of the normals.
        expected: String,
    },
    /// A solution to compare with, of another size.
    #[error(
        "{name} is {found} and what you look at {expected}; only solutions of one size can be compared: solve both alike"
    )]
    Incomparable {
        /// Its name.
        name: String,
        /// Its size.
        found: String,
        /// That of the solution that is looked at.
        expected: String,
    },
}

/// Reads a solution. `progress` gets the share done and the step.
///
/// # Errors
/// Where it is no solution, or its maps are broken.
pub(crate) fn open(
    folder: &Path,
    project: Option<&Project>,
    progress: &dyn Fn(f64, &str),
) -> Result<Opened, OpenError> {
    progress(0.0, NORMAL_EXR);
    let solution = Solution::load(folder)?;
    let surface = read_surface(folder)?;
    progress(0.5, ALBEDO_EXR);
    let report = solution.report;
    let plane = Plane {
        point_mm: Point3::from(report.plane.point_mm),
        normal: UnitVector3::new_normalize(Vector3::from(report.plane.normal)),
    };
    let geometry = Geometry::new(surface.size(), camera_of(folder)?, plane, 1);
    let albedo = read_map(folder, ALBEDO_EXR, Some(surface.size()))?;
    let [r, g, b] = channels(&albedo, &folder.join(ALBEDO_EXR), ["R", "G", "B"])?;
    // Solutions from before it was written have their albedo as it appears.
    let shade = match folder.join(SHADE_EXR).exists() {
        true => Some(read_map(folder, SHADE_EXR, Some(surface.size()))?),
        false => None,
    };
    let shade = shade.as_ref().map(|map| channels(map, &folder.join(SHADE_EXR), ["Y"]));
    let shade = shade.transpose()?.map(|[shade]| shade);
    let shade = |k: usize| shade.map_or(1.0, |shade| shade[k]);
    let maps = Maps::over(surface, &|k| [r[k], g[k], b[k]], &shade, geometry);
    progress(0.9, "");
    let frames = capture_of(folder, project, &report);
    Ok(Opened {
        name: folder.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        folder: folder.to_owned(),
        slopes: slopes::of_surface(&maps.surface),
        maps,
        mm_per_px: report.mm_per_px,
        warnings: report.warnings,
        lights: lights_of(&frames, project),
        method: report.method,
        frames,
    })
}

/// Normals and expected errors of a solution.
///
/// # Errors
/// As [`open`].
pub(crate) fn read_surface(folder: &Path) -> Result<Arc<Pyramid>, OpenError> {
    let normal = read_map(folder, NORMAL_EXR, None)?;
    let size = [normal.width, normal.height];
    let [x, y, z] = channels(&normal, &folder.join(NORMAL_EXR), ["R", "G", "B"])?;
    let confidence = read_map(folder, CONFIDENCE_EXR, Some(size))?;
    let [error] = channels(&confidence, &folder.join(CONFIDENCE_EXR), ["Y"])?;
    Ok(surface(size, &|k| [x[k], y[k], z[k]], &|k| error[k]))
}

fn read_map(folder: &Path, name: &str, size: Option<[usize; 2]>) -> Result<Exr, OpenError> {
    let path = folder.join(name);
    if !path.exists() {
        return Err(OpenError::Missing { path: path.display().to_string() });
    }
    let map = read_exr(&path)?;
    let found = [map.width, map.height];
    let words = |[width, height]: [usize; 2]| format!("{width} x {height}");
    match size.filter(|size| *size != found) {
        Some(expected) => Err(OpenError::Size {
            path: path.display().to_string(),
            found: words(found),
            expected: words(expected),
        }),
        None => Ok(map),
    }
}

fn channels<'a, const N: usize>(
    map: &'a Exr,
    path: &Path,
    names: [&'static str; N],
) -> Result<[&'a [f32]; N], OpenError> {
    let missing = names.into_iter().find(|name| map.channel(name).is_none());
    match missing {
        Some(channel) => Err(OpenError::Channel { path: path.display().to_string(), channel }),
        None => Ok(names.map(|name| map.channel(name).unwrap_or_default())),
    }
}

/// The camera that the maps' pixels belong to; `None` where the solution has none.
fn camera_of(folder: &Path) -> Result<Option<Camera>, FileError> {
    match folder.join(CAMERA_TOML).exists() {
        true => Ok(Calibration::load(folder)?.camera),
        false => Ok(None),
    }
}

/// The lights that the frames were solved with, else those of the rig that is open.
fn lights_of(frames: &Result<Capture, String>, project: Option<&Project>) -> Vec<CalibratedLight> {
    let of_frames = frames.as_ref().ok().map(|capture| capture.sources.calibration.clone());
    let calibration = of_frames.or_else(|| project.map(|project| project.calibration()));
    let calibration = calibration.and_then(|folder| Calibration::load(&folder).ok());
    calibration.map(|calibration| calibration.lights).unwrap_or_default()
}
