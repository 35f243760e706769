//! The middle of the run: from decoded frames to maps, without a file.

use super::SolveError;
use super::bands::Run;
use super::check::{check_frames, check_light_field};
use super::device::{Chosen, Device, choose};
use super::field::{LightField, Unseen};
use super::idle::leave_out_idle_frames;
use super::maps::Maps;
use super::on_gpu::{OnGpu, report_of};
use super::progress::{Progress, Stage};
use super::residual::ResidualRows;
use super::scene::Scene;
use super::witness::question;
use crate::instrument::{CAMERA_FILE, Noise};
use crate::linear::{LinearNoise, Surroundings, full_scale, noise_of_residuals};
use crate::photometry::Method;
use crate::solution::DeviceReport;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Noise that is assumed where neither the calibration nor the residuals tell: a full well of 40 000 electrons in
/// 14 bits, 4 electrons of read noise, a light model good to half a percent.
const TYPICAL_FULL_WELL_E: f64 = 40_000.0;
const TYPICAL_READ_NOISE_E: f64 = 4.0;
const TYPICAL_KAPPA: f64 = 0.005;

/// What came of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedScene {
    /// The maps.
    pub maps: Maps,
    /// Sentences.
    pub warnings: Vec<String>,
    /// Who solved.
    pub device: DeviceReport,
}

/// Solves a scene on the current thread pool: maps and warnings.
///
/// # Errors
/// Where the frames, the lights and the camera do not belong together or say too little.
pub fn solve_scene(
    scene: &Scene,
    method: Method,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(Maps, Vec<String>), SolveError> {
    let solved = solve_scene_on(scene, method, &Device::Cpu, progress)?;
    Ok((solved.maps, solved.warnings))
}

/// Solves a scene on the current thread pool, with the help of a graphics processor where `device` says so.
///
/// # Errors
/// As [`solve_scene`]; and where a graphics processor is asked for and there is none.
pub fn solve_scene_on(
    scene: &Scene,
    method: Method,
    device: &Device,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<SolvedScene, SolveError> {
    solve(scene, method, device, None, progress)
}

/// [`solve_scene_on`] that also hands out what the fit leaves over of every light, row by row as it is found.
///
/// # Errors
/// As [`solve_scene_on`].
pub fn solve_scene_with_residuals(
    scene: &Scene,
    method: Method,
    device: &Device,
    residuals: ResidualRows,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<SolvedScene, SolveError> {
    solve(scene, method, device, Some(residuals), progress)
}

fn solve(
    scene: &Scene,
    method: Method,
    device: &Device,
    residuals: Option<ResidualRows>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<SolvedScene, SolveError> {
    check_frames(scene)?;
    let field = light_field(scene)?;
    let mut warnings = check_light_field(scene, &field)?;
    let mut run = Run::new(scene, &field, noise(scene, &field), method);
    let Chosen { gpu, why } = choose(&run, device)?;
    // Only now: choosing may solve some rows to see who is faster.
    run.residuals = residuals;
    if gpu.is_none() && matches!(device, Device::Gpu | Device::Opened(_)) {
        warnings.push(format!("No graphics processor took part: {why}."));
    }
    let on = gpu.as_deref().map(OnGpu::new);
    let rows = AtomicUsize::new(0);
    let total = scene.height;
    let maps = run.solve_rows(0..total, on.as_ref(), &|finished| {
        let done = rows.fetch_add(finished, Ordering::Relaxed) + finished;
        progress(Progress { stage: Stage::Solve, done, total });
    });
    let (device, failure) = report_of(why, on.as_ref());
    warnings.extend(failure);
    Ok(SolvedScene { maps, warnings, device })
}

/// Leaves out frames that are copies of another or clip everywhere, and lights that stayed dark; warnings about these and
/// about lights that contradict the others.
///
/// # Errors
/// As [`solve_scene`]; and where fewer than three lights remain, or an ambient frame is brighter than the lit ones.
pub fn leave_out_what_adds_nothing(scene: &mut Scene) -> Result<Vec<String>, SolveError> {
    check_frames(scene)?;
    let mut warnings = leave_out_idle_frames(scene)?;
    let verdict = question(scene, &light_field(scene)?);
    let mut position = 0;
    scene.lights.retain(|_| {
        position += 1;
        !verdict.dark.contains(&(position - 1))
    });
    warnings.extend(verdict.warnings);
    Ok(warnings)
}

/// The light field of a scene's lights.
pub(crate) fn light_field(scene: &Scene) -> Result<LightField<'_>, SolveError> {
    let lights = scene.lights.iter().map(|light| &light.calibrated.light).collect();
    LightField::new(lights, scene.camera.as_ref(), &scene.plane, scene.size_px())
        .map_err(|unseen| unseen_pixel(scene, unseen))
}

/// A pixel that shows no point of the plane, as an error.
pub(crate) fn unseen_pixel(scene: &Scene, unseen: Unseen) -> SolveError {
    SolveError::Unseen {
        calibration: scene.origin.calibration.join(CAMERA_FILE),
        u: unseen.pixel[0],
        v: unseen.pixel[1],
    }
}

/// The sensor's noise: as calibrated, else from the residuals of the pictures, else typical.
pub(crate) fn noise(scene: &Scene, field: &LightField) -> LinearNoise {
    let range = full_scale(&scene.photographs());
    if let Some(noise) = &scene.color.noise {
        return LinearNoise::from_electrons(noise, range);
    }
    let around =
        Surroundings { mask: scene.mask.as_ref(), vectors: &|pixel: [f64; 2]| field.exact(pixel) };
    noise_of_residuals(&scene.photographs(), around).unwrap_or_else(|| {
        let electrons_per_dn = TYPICAL_FULL_WELL_E / range;
        let typical =
            Noise { electrons_per_dn, read_noise_e: TYPICAL_READ_NOISE_E, kappa: TYPICAL_KAPPA };
        LinearNoise::from_electrons(&typical, range)
    })
}
