use super::emission::{Emitter, PER_LIGHT, Place};
use super::gain::has_several_poses;
use super::joint::{Linearised, PER_SHEET, Prior, Problem, State};
use super::observation::Sheet;
use super::uncertainty::{covariance, damped_step, data_scale, estimate_scales};
use nalgebra::{DMatrix, DVector, Point3};

/// How the joint fit runs.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Linearisations at most.
    pub max_iterations: usize,
    /// Positions with a larger sigma are not claimed: the rig's stay.
    pub claim_sigma_mm: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { max_iterations: 15, claim_sigma_mm: 5.0 }
    }
}

/// What went wrong in the fit.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum Error {
    /// Nothing to fit.
    #[error(
        "no cell of the white sheets is usable under light {light}; expose it so that the sheet reads 50-90 % of full scale"
    )]
    NoCells {
        /// The light.
        light: usize,
    },
    /// Normal equations that cannot be solved.
    #[error(
        "the light fit has no solution with these sheets; check the rig file's light positions, then photograph the sheet flat, raised and tilted"
    )]
    Singular,
    /// Did not settle.
    #[error(
        "the light fit did not settle within {iterations} iterations; check that the rig file's positions belong to these lights and that no sheet moved"
    )]
    NotConverged {
        /// Linearisations done.
        iterations: usize,
    },
}

/// One light after the fit.
#[derive(Clone, Debug)]
pub struct FittedLight {
    /// What to use: where the position is not claimed, it is the ruler's and the rest is fitted to it.
    pub emitter: Emitter,
    /// Position that the pictures and the ruler together make most probable.
    pub estimated_position_mm: Option<Point3<f64>>,
    /// RMS over axes of the error to expect of the position in `emitter`; `None` for far lights.
    pub position_sigma_mm: Option<f64>,
    /// Whether the pictures carry the position.
    pub position_claimed: bool,
    /// RMS over the inlier cells of the relative residual.
    pub residual_rms: f64,
    /// Share of this light's samples that the robust weights removed.
    pub rejected: f64,
}

/// The joint fit of all lights.
#[derive(Clone, Debug)]
pub struct Fit {
    /// In the order of the priors.
    pub lights: Vec<FittedLight>,
    /// Per sheet: correction of the stated pose, two tilts (radians, about the plane's own axes) and offset (mm).
    pub pose_corrections: Vec<[f64; PER_SHEET]>,
    /// Linearisations used until the positions were settled.
    pub iterations: usize,
    /// RMS of the relative residual over inliers.
    pub residual_rms: f64,
    /// RMS of the slow, light-dependent errors that the pictures show (the sheet's reflectance lobe, stray light).
    pub slow_error_rms: f64,
    /// Factor that the pictures put on the ruler's sigma.
    pub ruler_scale: f64,
    /// Robust weight of every sample relative to a clean one (0..1), sheet by sheet, cell by cell.
    pub trust: Vec<Vec<f64>>,
    /// Posterior covariance of all parameters; 7 per light (position, two of the axis, exponent, log intensity), then 3 per
    /// sheet.
    pub covariance: DMatrix<f64>,
}

/// Fits position, axis, exponent and relative intensity of all lights to sheets at known poses, in ratio mode: each
/// cell has one free gain that all lights share, so that vignetting and the sheet's own unevenness cancel.
///
/// `priors`: one a light, in the order of the sheets' samples. Gauss-Newton with Levenberg damping on the normal equations
/// in float64, analytic derivatives, robust weights, sigma inflated for correlated residuals.
///
/// # Errors
/// Where a light has no usable cell, the equations are singular, or the fit does not settle.
pub fn fit(sheets: &[Sheet], priors: &[Prior], settings: &Settings) -> Result<Fit, Error> {
    check_cells(sheets, priors.len())?;
    let mut problem = Problem::new(sheets, priors.to_vec());
    let mut start = State::start(priors, sheets.len());
    problem.level(&mut start);
    let settled = match settle(&mut problem, start.clone(), settings, Stage::Everything) {
        Ok(settled) => settled,
        // One pose may leave the positions open: then the ruler's stay.
        Err(_) if !has_several_poses(sheets) => {
            let none = vec![false; priors.len()];
            problem = Problem::new(sheets, priors.to_vec());
            let start = hold_unclaimed(&mut problem, &start, &none);
            let held = settle(&mut problem, start, settings, Stage::PositionsHeld)?;
            return Ok(describe_all(&problem, &held, &held, priors, &none));
        }
        Err(error) => return Err(error),
    };
    let sigma: Vec<Option<f64>> = (0..priors.len()).map(|i| position_sigma(&settled, i)).collect();
    let several = has_several_poses(sheets);
    let limit = settings.claim_sigma_mm * if several { 1.0 } else { ONE_POSE };
    let claimed: Vec<bool> = sigma.iter().map(|sigma| sigma.is_none_or(|s| s <= limit)).collect();
    let mut last = settled.clone();
    if claimed.contains(&false) {
        let start = hold_unclaimed(&mut problem, &settled.state, &claimed);
        last = settle(&mut problem, start, settings, Stage::PositionsHeld)?;
    }
    Ok(describe_all(&problem, &settled, &last, priors, &claimed))
}

/// `settled`: with all positions free; `last`: with those held that are not claimed.
fn describe_all(
    problem: &Problem,
    settled: &Settled,
    last: &Settled,
    priors: &[Prior],
    claimed: &[bool],
) -> Fit {
    let lights = (0..priors.len())
        .map(|i| describe(problem, settled, last, &priors[i], i, claimed[i]))
        .collect();
    let inliers = inlier_square(problem, last, None);
    Fit {
        lights,
        iterations: settled.iterations,
        residual_rms: inliers.0.sqrt(),
        slow_error_rms: settled.slow_error_rms,
        ruler_scale: settled.ruler_scale,
        trust: trust(problem, last),
        covariance: settled.covariance.clone(),
        pose_corrections: last.state.poses.clone(),
    }
}

fn check_cells(sheets: &[Sheet], lights: usize) -> Result<(), Error> {
    let usable = |light: usize| {
        sheets.iter().any(|sheet| {
            sheet.samples.iter().skip(light).step_by(lights).any(|sample| sample.is_usable())
        })
    };
    (0..lights).find(|light| !usable(*light)).map_or(Ok(()), |light| Err(Error::NoCells { light }))
}

/// Share of the claim's limit that holds for sheets at one pose: there positions take up most of the slow errors, and what is
/// left of these makes them look smaller than they are.
const ONE_POSE: f64 = 0.4;

/// What a run of the fit moves.
#[derive(Clone, Copy, PartialEq)]
enum Stage {
    /// All of it, the ruler's quality estimated too.
    Everything,
    /// Positions that are not claimed stay at the ruler's.
    PositionsHeld,
}

#[derive(Clone)]
struct Settled {
    state: State,
    covariance: DMatrix<f64>,
    /// Less the most probable slow errors.
    residuals: Vec<Vec<f64>>,
    weights: Vec<Vec<f64>>,
    iterations: usize,
    slow_error_rms: f64,
    ruler_scale: f64,
}

/// Expected gain of the cost (in units where one sigma costs 1/2) below which a step is not worth taking.
const SETTLED: f64 = 1e-2;
/// Robust weights may leave a step of a fraction of a sigma for ever: at the last iteration that is enough.
const SETTLED_ENOUGH: f64 = 0.5;
/// Linearisations after which the scales of noise, slow errors and ruler are left alone.
const SCALE_ROUNDS: usize = 9;
/// Expected gain of the cost below which the model is near enough to judge the ruler by and to call the scales calm.
const NEAR: f64 = 1e3;
/// Relative change of the scale of the slow errors below which it is settled.
const SCALE_SETTLED: f64 = 0.1;

fn settle(
    problem: &mut Problem,
    mut state: State,
    settings: &Settings,
    stage: Stage,
) -> Result<Settled, Error> {
    let (mut open, mut near) = (true, false);
    let mut lambda = 0.0;
    let mut ripples: Vec<DVector<f64>> = Vec::new();
    for iterations in 1..=settings.max_iterations {
        // Outliers are judged with slow errors and all: a hand's shadow must not pass for one.
        let all = problem.residuals(&state);
        let weights = problem.weights(&all);
        let residuals = problem.without_ripples(&all, &ripples);
        if open {
            problem.data_scale = data_scale(problem, &residuals, &weights);
        }
        let systems = problem.systems(&state, &weights);
        if open {
            let before = problem.slow.total();
            let ruler = stage == Stage::Everything && near;
            estimate_scales(problem, &systems, &state, ruler)?;
            let calm = near && (problem.slow.total() / before).ln().abs() < SCALE_SETTLED;
            open = !calm && (iterations < SCALE_ROUNDS || !near);
        }
        let joint = problem.joint(&systems, &state).ok_or(Error::Singular)?;
        let at = problem.marginal(&joint).ok_or(Error::Singular)?;
        ripples = problem.ripples_from(&systems, &joint).ok_or(Error::Singular)?;
        let (next, decrement) = advance(problem, &state, &at, &weights, &mut lambda)?;
        let last = iterations == settings.max_iterations;
        if decrement < if last { SETTLED_ENOUGH } else { SETTLED } && (last || !open) {
            let covariance = covariance(problem, &at).ok_or(Error::Singular)?;
            let (slow_error_rms, ruler_scale) = (problem.slow.total(), problem.ruler_scale);
            return Ok(Settled {
                state,
                covariance,
                residuals,
                weights,
                iterations,
                slow_error_rms,
                ruler_scale,
            });
        }
        near |= decrement < NEAR;
        state = next;
    }
    Err(Error::NotConverged { iterations: settings.max_iterations })
}

/// A sheet at one pose leaves a long curved valley: a full step along it first climbs, and the next one falls back to the
/// floor much farther on. Only steps that climb beyond this factor are shortened.
const TOLERATED: f64 = 10.0;

/// Longest step of a coordinate, in its prior's sigmas.
const LONGEST_STEP: f64 = 3.0;

/// The largest share of a coordinate's prior sigma that a step takes.
fn longest(problem: &Problem, step: &DVector<f64>) -> f64 {
    problem
        .prior_weights()
        .iter()
        .zip(step.iter())
        .map(|(weight, step)| weight.sqrt() * step.abs())
        .fold(0.0, f64::max)
}

/// A step that lowers the cost at fixed weights, and how much it was expected to.
fn advance(
    problem: &Problem,
    state: &State,
    at: &Linearised,
    weights: &[Vec<f64>],
    lambda: &mut f64,
) -> Result<(State, f64), Error> {
    for _ in 0..12 {
        let mut step = damped_step(problem, at, *lambda).ok_or(Error::Singular)?;
        let decrement = 0.5 * step.dot(&at.descent);
        step *= (LONGEST_STEP / longest(problem, &step)).min(1.0);
        let next = state.moved(&step);
        let cost = || problem.assemble(&problem.systems(&next, weights), &next).map(|at| at.cost);
        if decrement < SETTLED || cost().is_some_and(|cost| cost < TOLERATED * at.cost.max(1.0)) {
            *lambda = if *lambda < 0.1 { 0.0 } else { *lambda * 0.1 };
            return Ok((next, decrement));
        }
        *lambda = (*lambda * 10.0).max(0.1);
    }
    Ok((state.clone(), 0.0))
}

/// RMS over the axes of the position's posterior sigma.
fn position_sigma(settled: &Settled, light: usize) -> Option<f64> {
    matches!(settled.state.emitters[light].place, Place::Near { .. }).then(|| {
        let at = light * PER_LIGHT;
        ((0..3).map(|k| settled.covariance[(at + k, at + k)]).sum::<f64>() / 3.0).sqrt()
    })
}

/// Puts unclaimed lights back to where the ruler says and pins them there.
fn hold_unclaimed(problem: &mut Problem, state: &State, claimed: &[bool]) -> State {
    let mut held = state.clone();
    for (i, _) in claimed.iter().enumerate().filter(|(_, claimed)| !**claimed) {
        let prior = &mut problem.priors[i];
        prior.position_sigma_mm = 1e-3;
        if let (Place::Near { position_mm, .. }, Place::Near { position_mm: ruler, .. }) =
            (&mut held.emitters[i].place, &prior.emitter.place)
        {
            *position_mm = *ruler;
        }
    }
    held
}

fn describe(
    problem: &Problem,
    settled: &Settled,
    last: &Settled,
    prior: &Prior,
    i: usize,
    claimed: bool,
) -> FittedLight {
    let estimate = position(&settled.state.emitters[i]);
    // Held from the first on: nothing but the ruler speaks of it.
    let least = if std::ptr::eq(settled, last) && !claimed { prior.position_sigma_mm } else { 0.0 };
    let variance = position_sigma(settled, i).map(|sigma| sigma * sigma + least * least);
    // The error to expect of the ruler's value, given the pictures: E|true - ruler|^2 = var + |estimate - ruler|^2.
    let moved = match (estimate, position(&prior.emitter)) {
        (Some(estimate), Some(ruler)) if !claimed => (estimate - ruler).norm_squared() / 3.0,
        _ => 0.0,
    };
    let (square, rejected) = inlier_square(problem, last, Some(i));
    FittedLight {
        emitter: last.state.emitters[i].clone(),
        estimated_position_mm: estimate,
        position_sigma_mm: variance.map(|variance| (variance + moved).sqrt()),
        position_claimed: claimed,
        residual_rms: square.sqrt(),
        rejected,
    }
}

fn position(emitter: &Emitter) -> Option<Point3<f64>> {
    match &emitter.place {
        Place::Near { position_mm, .. } => Some(*position_mm),
        Place::Far { .. } => None,
    }
}

/// Samples with less of their weight left count as outliers.
const INLIER: f64 = 0.25;

fn trust(problem: &Problem, settled: &Settled) -> Vec<Vec<f64>> {
    let of_sheet = |(s, weights): (usize, &Vec<f64>)| {
        weights
            .iter()
            .enumerate()
            .map(|(k, w)| if *w > 0.0 { w * problem.sigma(s, k).powi(2) } else { 0.0 })
            .collect()
    };
    settled.weights.iter().enumerate().map(of_sheet).collect()
}

/// Mean square of the inliers' residuals about their cell's gain, and the share of outliers, of one light or all.
fn inlier_square(problem: &Problem, settled: &Settled, light: Option<usize>) -> (f64, f64) {
    let (mut square, mut inliers, mut outliers) = (0.0, 0.0, 0.0);
    for (s, (residuals, weights)) in settled.residuals.iter().zip(&settled.weights).enumerate() {
        for c in 0..residuals.len() / problem.lights {
            let range = c * problem.lights..(c + 1) * problem.lights;
            let gain =
                super::joint::weighted_mean(&residuals[range.clone()], &weights[range.clone()]);
            for k in range.filter(|k| {
                residuals[*k].is_finite() && light.is_none_or(|i| k % problem.lights == i)
            }) {
                if weights[k] * problem.sigma(s, k).powi(2) > INLIER {
                    square += (residuals[k] - gain).powi(2);
                    inliers += 1.0;
                } else {
                    outliers += 1.0;
                }
            }
        }
    }
    (square / f64::max(inliers, 1.0), outliers / f64::max(inliers + outliers, 1.0))
}
