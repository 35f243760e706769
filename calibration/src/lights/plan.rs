use super::emission::{Emitter, PER_LIGHT, Place};
use super::joint::{PER_SHEET, Prior, Problem, State};
use super::observation::{Cell, PoseSigma, Sample, Sheet};
use super::uncertainty::covariance;
use crate::description::{Camera, Light, Plane};
use crate::projection::Projector;

/// What is known and what has been photographed, to foresee what another picture would bring.
#[derive(Clone, Debug)]
pub struct Plan<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// The lights as known so far.
    pub lights: &'a [Light],
    /// Per light: the ruler's sigma, millimetres.
    pub ruler_sigma_mm: &'a [f64],
    /// Relative noise of one of [`PLAN_CELLS`] cells.
    pub cell_noise: f64,
    /// RMS of slow, light-dependent errors.
    pub slow_error_rms: f64,
}

/// Grid of cells that a planned sheet is thought to have.
const GRID: [usize; 2] = [15, 10];
/// Cells of a planned sheet.
pub const PLAN_CELLS: usize = GRID[0] * GRID[1];

impl Plan<'_> {
    /// Expected sigma of every light's position (RMS over axes, millimetres) once the sheet has been photographed on
    /// `planes`; NaN for far lights. `None` where the equations have no solution.
    ///
    /// The information of a sheet does not depend on what it shows: the fit's own normal equations tell in advance.
    pub fn expected_sigma_mm(&self, planes: &[Plane]) -> Option<Vec<f64>> {
        let exact: Vec<(Plane, PoseSigma)> =
            planes.iter().map(|plane| (plane.clone(), PoseSigma::default())).collect();
        self.expected_sigma_with_poses_mm(&exact)
    }

    /// The same for planes that are known to a sigma each.
    pub(super) fn expected_sigma_with_poses_mm(
        &self,
        planes: &[(Plane, PoseSigma)],
    ) -> Option<Vec<f64>> {
        let sheets: Vec<Sheet> =
            planes.iter().map(|(plane, sigma)| self.sheet(plane, *sigma)).collect();
        let priors: Vec<Prior> =
            self.lights.iter().zip(self.ruler_sigma_mm).map(|(l, s)| prior(l, *s)).collect();
        let mut problem = Problem::new(&sheets, priors);
        problem.slow.set_total(self.slow_error_rms.max(1e-5));
        let state = State::start(&problem.priors, sheets.len());
        let weight = self.cell_noise.max(1e-6).powi(-2);
        let weights: Vec<Vec<f64>> =
            sheets.iter().map(|sheet| vec![weight; sheet.samples.len()]).collect();
        let at = problem.assemble(&problem.systems(&state, &weights), &state)?;
        debug_assert_eq!(
            at.descent.len(),
            self.lights.len() * PER_LIGHT + sheets.len() * PER_SHEET
        );
        let covariance = covariance(&problem, &at)?;
        let sigma = |(i, light): (usize, &Light)| match light {
            Light::Point(_) => {
                let sum: f64 =
                    (0..3).map(|k| covariance[(i * PER_LIGHT + k, i * PER_LIGHT + k)]).sum();
                (sum / 3.0).sqrt()
            }
            Light::Directional(_) => f64::NAN,
        };
        Some(self.lights.iter().enumerate().map(sigma).collect())
    }

    fn sheet(&self, plane: &Plane, pose_sigma: PoseSigma) -> Sheet {
        let projector = Projector::new(self.camera);
        let size = [self.camera.width_px, self.camera.height_px];
        let cell = |k: usize| {
            let place = [k % GRID[0], k / GRID[0]];
            let pixel = std::array::from_fn(|a| {
                (place[a] as f64 + 0.5) / GRID[a] as f64 * size[a] as f64 - 0.5
            });
            let ray = projector.ray(pixel)?;
            Some(Cell { place, pixel, point_mm: ray.on_plane(plane)?, view: ray.direction })
        };
        let cells: Vec<Cell> = (0..PLAN_CELLS).filter_map(cell).collect();
        let sample = Sample { signal: [1.0; 3], relative_sigma: [self.cell_noise; 3] };
        Sheet {
            name: String::new(),
            plane: plane.clone(),
            pose_sigma,
            reflectance: 1.0,
            grid: GRID,
            samples: vec![sample; cells.len() * self.lights.len()],
            cells,
        }
    }
}

/// Over the near lights, those that have a number.
pub(super) fn rms(sigmas_mm: &[f64]) -> Option<f64> {
    let near: Vec<f64> = sigmas_mm.iter().copied().filter(|sigma| sigma.is_finite()).collect();
    let square = near.iter().map(|sigma| sigma * sigma).sum::<f64>();
    (!near.is_empty()).then(|| (square / near.len() as f64).sqrt())
}

fn prior(light: &Light, ruler_sigma_mm: f64) -> Prior {
    let place = match light {
        Light::Point(light) => Place::Near {
            position_mm: light.position_mm,
            axis: light.axis,
            exponent: light.exponent,
        },
        Light::Directional(light) => Place::Far { direction: light.direction },
    };
    Prior {
        emitter: Emitter { place, log_intensity: 0.0 },
        position_sigma_mm: ruler_sigma_mm,
        angle_sigma_rad: 0.26,
        exponent_sigma: 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::bench_scene::{Bench, camera, poses};

    #[test]
    fn tilts_bring_more_than_heights_and_all_together_most() {
        let bench = Bench::default();
        let lights: Vec<Light> =
            bench.priors(&bench.leds()).iter().map(|prior| prior.emitter.light([1.0; 3])).collect();
        let ruler_sigma_mm = [10.0; 10];
        let plan = Plan {
            camera: &camera(),
            lights: &lights,
            ruler_sigma_mm: &ruler_sigma_mm,
            cell_noise: 5e-4,
            slow_error_rms: 1e-3,
        };
        let all = poses();
        let rms = |planes: &[Plane]| rms(&plan.expected_sigma_mm(planes).unwrap()).unwrap();
        let flat = rms(&all[..1]);
        let raised = rms(&all[..2]);
        let tilted = rms(&[all[0].clone(), all[2].clone()]);
        let six = rms(&all);
        assert!(
            six < tilted && tilted < raised && raised < flat && flat < 10.0,
            "{six} {tilted} {raised} {flat}"
        );
    }
}
