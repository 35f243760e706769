//! The middle of the run: from decoded frames to maps, without a file.

use super::Run;
use super::device::{Chosen, choose};
use super::on_gpu::{OnGpu, report_of};
use super::residual::ResidualRows;
use crate::gpu::Device;
use crate::instrument::Noise;
use crate::linear::{LinearNoise, Surroundings, full_scale, noise_of_residuals};
use crate::photometry::{Maps, Method};
use crate::solution::DeviceReport;
use crate::solve::SolveError;
use crate::solve::light_field::LightField;
use crate::solve::progress::{Progress, Stage};
use crate::solve::scene::{CheckedScene, Scene};
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

impl<'a> Run<'a> {
    /// The run of a scene, with the sensor's noise as calibrated or estimated.
    pub(crate) fn of(checked: &'a CheckedScene<'a>, method: Method) -> Self {
        let CheckedScene { scene, field, .. } = checked;
        Self::new(scene, field, noise(scene, field), method)
    }
}

impl CheckedScene<'_> {
    /// Solves the scene on the current thread pool, with the help of a graphics processor where `device` says so. `residuals`
    /// takes what the fit leaves over of every light, row by row as it is found: position of the light among the scene's, row,
    /// one value a photosite of the frame. A residual is in units of the albedo, as a fraction of what a perfect white diffuser
    /// that faces the light would send back; NaN where there is none: unsolved, or the sample is clipped.
    ///
    /// # Errors
    /// Where a graphics processor is asked for and there is none.
    pub fn solve(
        &self,
        method: Method,
        device: &Device,
        residuals: Option<ResidualRows>,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<SolvedScene, SolveError> {
        let mut warnings = self.warnings.clone();
        let mut run = Run::of(self, method);
        let Chosen { gpu, why } = choose(&run, device)?;
        // Only now: choosing may solve some rows to see who is faster.
        run.residuals = residuals;
        if gpu.is_none() && matches!(device, Device::Gpu | Device::Opened(_)) {
            warnings.push(format!("No graphics processor took part: {why}."));
        }
        let on = gpu.as_deref().map(OnGpu::new);
        let rows = AtomicUsize::new(0);
        let total = self.scene.height;
        let maps = run.solve_rows(0..total, on.as_ref(), &|finished| {
            let done = rows.fetch_add(finished, Ordering::Relaxed) + finished;
            progress(Progress { stage: Stage::Solve, done, total });
        });
        let (device, failure) = report_of(why, on.as_ref());
        warnings.extend(failure);
        Ok(SolvedScene { maps, warnings, device })
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
