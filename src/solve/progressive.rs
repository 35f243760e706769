//! A solution that grows: first an eighth of the resolution each way, then a quarter, a half, and all of it.

use super::finish::{Finished, finish};
use super::in_memory::solve_scene;
use super::maps::Counts;
use super::options::{AlbedoKind, Outputs};
use super::preview::Scale;
use super::scene::Scene;
use super::{Progress, SolveError};
use crate::photometry::Method;
use std::ops::ControlFlow;
use weavelight_calibration::description::Camera;

/// The solution at one resolution.
pub struct Level {
    /// Photosites that a pixel spans, each way.
    pub scale: Scale,
    /// The maps, on the sensor's grid.
    pub maps: Finished,
    /// How many pixels took which way.
    pub counts: Counts,
    /// The camera to which the maps' pixels belong.
    pub camera: Option<Camera>,
    /// What the solve had to say.
    pub warnings: Vec<String>,
}

/// Solves a scene at [`Scale::GROWING`] resolution on the current thread pool and hands over each level as soon as it is
/// there, until `show` breaks off. The last level is the full solution; those before it are the plain least-squares solutions
/// of [`Scene::reduced`], as means over a curved surface are calmer than the light model is true for them, and every test of
/// the residual fails. `progress` is of the level at work.
///
/// # Errors
/// As [`solve_scene`].
pub fn progressively(
    scene: &Scene,
    method: Method,
    progress: &(dyn Fn(Progress) + Sync),
    show: &mut dyn FnMut(Level) -> ControlFlow<()>,
) -> Result<(), SolveError> {
    for scale in Scale::GROWING {
        let level = match scale {
            Scale::Full => level(scene, scale, method, progress)?,
            _ => level(&scene.reduced(scale), scale, Method::LeastSquares, progress)?,
        };
        if show(level).is_break() {
            break;
        }
    }
    Ok(())
}

fn level(
    scene: &Scene,
    scale: Scale,
    method: Method,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Level, SolveError> {
    let (maps, mut warnings) = solve_scene(scene, method, progress)?;
    let counts = maps.counts;
    let mut maps = finish(maps, &scene.color, Outputs::ALL, AlbedoKind::Reflectance);
    if scale == Scale::Full {
        warnings.append(&mut maps.said);
    }
    Ok(Level { scale, maps, counts, camera: scene.camera.clone(), warnings })
}
