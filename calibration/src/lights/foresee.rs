//! How well the lights' places are known in the middle of the work, and what one more sheet would bring.

use super::fit::{Error, Fit, Settings, fit};
use super::gain::has_several_poses;
use super::joint::Prior;
use super::observation::{PoseSigma, Sheet};
use super::plan::{PLAN_CELLS, Plan};
use super::{Place, plan};
use crate::description::{Camera, Light, Plane};

/// RMS over lights and axes of the error to expect of the lights' places, millimetres; `None` where all lights are far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foreseen {
    /// If the lights were calibrated with the sheets there are.
    pub now_mm: Option<f64>,
    /// And if they were with one more.
    pub then_mm: Option<f64>,
}

/// Relative noise of a planned cell, and of slow errors, before the first picture has shown any: that of good paper under a
/// good exposure.
const USUAL_CELL_NOISE: f64 = 1e-3;
const USUAL_SLOW_ERROR: f64 = 1e-3;

/// What is known so far, to plan with.
struct Known {
    lights: Vec<Light>,
    ruler_sigma_mm: Vec<f64>,
    now_mm: Vec<f64>,
    cell_noise: f64,
    slow_error_rms: f64,
}

/// Foresees the errors of the lights' places from the sheets so far, with the fit itself, and with one more that will lie on
/// `next`, with the fit's own normal equations. A place that the pictures will not carry stays the ruler's, and is as wrong
/// as that.
///
/// # Errors
/// Where the sheets so far cannot be fitted.
pub fn foresee(
    camera: &Camera,
    sheets: &[Sheet],
    priors: &[Prior],
    next: &Plane,
) -> Result<Foreseen, Error> {
    let known = match sheets {
        [] => by_ruler(priors),
        sheets => match fit(sheets, priors, &Settings::default()) {
            Ok(fit) => fitted(sheets, priors, &fit),
            // One pose may carry nothing at all.
            Err(_) if !has_several_poses(sheets) => by_ruler(priors),
            Err(error) => return Err(error),
        },
    };
    let plan = Plan {
        camera,
        lights: &known.lights,
        ruler_sigma_mm: &known.ruler_sigma_mm,
        cell_noise: known.cell_noise,
        slow_error_rms: known.slow_error_rms,
    };
    let planned: Vec<(Plane, PoseSigma)> = sheets
        .iter()
        .map(|sheet| (sheet.plane.clone(), sheet.pose_sigma))
        .chain([(next.clone(), worst_pose(sheets))])
        .collect();
    let claim = |(sigma, ruler): (f64, &f64)| {
        if sigma > Settings::default().claim_sigma_mm { sigma.max(*ruler) } else { sigma }
    };
    let then = plan.expected_sigma_with_poses_mm(&planned).ok_or(Error::Singular)?;
    let then: Vec<f64> = then.into_iter().zip(&known.ruler_sigma_mm).map(claim).collect();
    Ok(Foreseen { now_mm: plan::rms(&known.now_mm), then_mm: plan::rms(&then) })
}

fn by_ruler(priors: &[Prior]) -> Known {
    let near = |prior: &Prior| match prior.emitter.place {
        Place::Near { .. } => prior.position_sigma_mm,
        Place::Far { .. } => f64::NAN,
    };
    Known {
        lights: priors.iter().map(|prior| prior.emitter.light([1.0; 3])).collect(),
        ruler_sigma_mm: priors.iter().map(|prior| prior.position_sigma_mm).collect(),
        now_mm: priors.iter().map(near).collect(),
        cell_noise: USUAL_CELL_NOISE,
        slow_error_rms: USUAL_SLOW_ERROR,
    }
}

fn fitted(sheets: &[Sheet], priors: &[Prior], fit: &Fit) -> Known {
    let cells = sheets.iter().map(|sheet| sheet.cells.len()).sum::<usize>() as f64;
    let per_sheet = cells / sheets.len() as f64;
    Known {
        lights: fit.lights.iter().map(|light| light.emitter.light([1.0; 3])).collect(),
        ruler_sigma_mm: priors
            .iter()
            .map(|prior| prior.position_sigma_mm * fit.ruler_scale)
            .collect(),
        now_mm: fit
            .lights
            .iter()
            .map(|light| light.position_sigma_mm.unwrap_or(f64::NAN))
            .collect(),
        // Fewer, larger cells with the same information.
        cell_noise: fit.residual_rms * (PLAN_CELLS as f64 / per_sheet).sqrt(),
        slow_error_rms: fit.slow_error_rms,
    }
}

/// The next sheet's pose will be known as well as that of the worst so far.
fn worst_pose(sheets: &[Sheet]) -> PoseSigma {
    let sigmas = sheets.iter().map(|sheet| sheet.pose_sigma);
    sigmas.fold(PoseSigma::default(), |worst, sigma| PoseSigma {
        tilt_rad: worst.tilt_rad.max(sigma.tilt_rad),
        offset_mm: worst.offset_mm.max(sigma.offset_mm),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::FittedLight;
    use crate::lights::bench_scene::{Bench, Led, camera, poses};
    use nalgebra::Vector3;

    const RIGS: u64 = 3;

    fn square_error_mm2(fit: &Fit, leds: &[Led]) -> f64 {
        let square = |(light, led): (&FittedLight, &Led)| match &light.emitter.place {
            Place::Near { position_mm, .. } => (position_mm - led.position).norm_squared() / 3.0,
            Place::Far { .. } => f64::NAN,
        };
        fit.lights.iter().zip(leds).map(square).sum::<f64>() / leds.len() as f64
    }

    /// After so many sheets: what is foreseen of one more, what the fit then states, and what is true; RMS over rigs, mm.
    fn spread(sheets: usize) -> [f64; 3] {
        let mut squares = [0.0; 3];
        for seed in 0..RIGS {
            let bench = Bench { seed, kappa: 1e-3, grid: [15, 10], ..Bench::default() };
            let (leds, planes) = (bench.leds(), poses());
            let (seen, priors) = (bench.sheets(&leds, &planes[..=sheets]), bench.priors(&leds));
            let foreseen = foresee(&camera(), &seen[..sheets], &priors, &planes[sheets]).unwrap();
            squares[0] += foreseen.then_mm.unwrap().powi(2);
            let fit = fit(&seen, &priors, &Settings::default()).unwrap();
            let stated = plan::rms(&fitted(&seen, &priors, &fit).now_mm).unwrap();
            squares[1] += stated.powi(2);
            squares[2] += square_error_mm2(&fit, &leds);
        }
        squares.map(|sum| (sum / RIGS as f64).sqrt())
    }

    #[test]
    fn what_is_foreseen_is_what_comes_of_it() {
        for sheets in [1, 4] {
            let [foreseen, stated, found] = spread(sheets);
            for told in [foreseen, stated] {
                assert!(
                    (0.6..1.7).contains(&(told / found)),
                    "{sheets} + 1 sheets: {foreseen} mm foreseen, {stated} stated, {found} true"
                );
            }
        }
    }

    #[test]
    fn before_the_first_sheet_there_is_the_ruler() {
        let bench = Bench::default();
        let priors = bench.priors(&bench.leds());
        let Foreseen { now_mm, then_mm } = foresee(&camera(), &[], &priors, &poses()[0]).unwrap();
        assert_eq!(now_mm, Some(bench.ruler_sigma_mm));
        assert!(then_mm.unwrap() <= bench.ruler_sigma_mm, "{then_mm:?}");
    }

    #[test]
    fn far_lights_have_no_place() {
        let far = |k: u32| {
            let (sin, cos) = (f64::from(k) * 1.3).sin_cos();
            let direction = nalgebra::UnitVector3::new_normalize(Vector3::new(cos, sin, 1.0));
            let place = Place::Far { direction };
            let emitter = crate::lights::Emitter { place, log_intensity: 0.0 };
            Prior { emitter, position_sigma_mm: 1.0, angle_sigma_rad: 0.05, exponent_sigma: 1.0 }
        };
        let priors: Vec<Prior> = (0..4).map(far).collect();
        let foreseen = foresee(&camera(), &[], &priors, &poses()[0]).unwrap();
        assert_eq!(foreseen, Foreseen { now_mm: None, then_mm: None });
    }
}
