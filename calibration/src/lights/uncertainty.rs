//! What correlated residuals leave of the information, and how good the ruler really was.

use super::emission::PER_LIGHT;
use super::fit::Error;
use super::joint::{Linearised, Problem, State, median, weighted_mean};
use super::slow::Evidence;
use super::system::SheetSystem;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Sides of the blocks of cells that are averaged to see correlation.
const BLOCK_SIDES: [usize; 3] = [1, 2, 4];
/// Blocks must leave at least this share of their count as degrees of freedom, or their variance says little.
const LEAST_FREEDOM: f64 = 0.25;
/// Samples whose robust weight fell below this share are outliers and say nothing about the noise.
const INLIER_WEIGHT: f64 = 0.25;
/// Turns of the fixed point of the slow errors' sizes at one linearisation.
const SLOW_ROUNDS: usize = 2;
/// Variance of the noise, in units of the readings' own, below which rounding would decide.
const LEAST_NOISE: f64 = 1e-3;
/// The ruler's sigma is trusted within this factor either way.
const RULER_SCALES: (f64, f64) = (0.5, 1.6);
/// Spread of ln(ruler scale) before the data.
const RULER_SPREAD: f64 = 0.3;

/// Variance of the noise per independent cell, in units of the readings' variance.
///
/// What varies quickly is measured where nothing else can hide it: by second differences between neighbouring cells, which
/// a wrong model or a slow error hardly touches. What is correlated over a few cells (the paper's texture) averages out
/// less: the means of blocks of cells scatter more than they should, and N cells count as N / inflation.
pub(super) fn data_scale(problem: &Problem, residuals: &[Vec<f64>], weights: &[Vec<f64>]) -> f64 {
    let white = second_difference_variance(problem, residuals, weights);
    let sides =
        BLOCK_SIDES.iter().filter_map(|side| block_variance(problem, residuals, weights, *side));
    let mut sides = sides.peekable();
    let single = sides.peek().copied().unwrap_or(1.0);
    let inflation = sides.fold(1.0, |most: f64, variance| most.max(variance / single));
    (white * inflation).max(LEAST_NOISE)
}

/// Robust variance of (r1 - 2 r2 + r3) / sqrt 6 along the rows of the grids, in the readings' own units.
fn second_difference_variance(
    problem: &Problem,
    residuals: &[Vec<f64>],
    weights: &[Vec<f64>],
) -> f64 {
    let lights = problem.lights;
    let mut sizes = Vec::new();
    for (s, sheet) in problem.sheets.iter().enumerate() {
        let standard = gainless(problem, s, &residuals[s], &weights[s]);
        for (c, three) in sheet.cells.windows(3).enumerate() {
            let in_row = three[0].place[1] == three[2].place[1]
                && three[0].place[0] + 2 == three[2].place[0];
            if in_row {
                let at = |cell: usize, i: usize| standard[(c + cell) * lights + i];
                sizes.extend(
                    (0..lights).map(|i| (at(0, i) - 2.0 * at(1, i) + at(2, i)).abs() / 6f64.sqrt()),
                );
            }
        }
    }
    sizes.retain(|size| size.is_finite());
    if sizes.is_empty() {
        return 1.0;
    }
    // Taking each cell's gain out removes one part in `lights` of the variance.
    let freedom = lights as f64 / (lights as f64 - 1.0).max(1.0);
    (1.4826 * median(&mut sizes)).powi(2) * freedom
}

/// Residuals of one sheet about each cell's gain, over sigma; NaN for outliers.
fn gainless(problem: &Problem, s: usize, residuals: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(residuals.len());
    for (c, (r, w)) in
        residuals.chunks(problem.lights).zip(weights.chunks(problem.lights)).enumerate()
    {
        let gain = weighted_mean(r, w);
        out.extend(r.iter().zip(w).enumerate().map(|(i, (r, w))| {
            let sigma = problem.sigma(s, c * problem.lights + i);
            if w * sigma.powi(2) > INLIER_WEIGHT { (r - gain) / sigma } else { f64::NAN }
        }));
    }
    out
}

fn block_variance(
    problem: &Problem,
    residuals: &[Vec<f64>],
    weights: &[Vec<f64>],
    side: usize,
) -> Option<f64> {
    let (mut square, mut count, mut gains) = (0.0, 0.0, 0.0);
    for s in 0..problem.sheets.len() {
        let (sum_of_squares, full, places) =
            sheet_blocks(problem, s, &residuals[s], &weights[s], side);
        square += sum_of_squares;
        count += full;
        gains += places;
    }
    let freedom = count - gains - problem.parameters_with_slow_errors() as f64;
    (freedom > LEAST_FREEDOM * count && freedom > 10.0).then(|| square / freedom)
}

/// Sum of n mean^2 over blocks and lights, how many there are, and how many places of blocks (each with a free gain).
fn sheet_blocks(
    problem: &Problem,
    s: usize,
    residuals: &[f64],
    weights: &[f64],
    side: usize,
) -> (f64, f64, f64) {
    let (sheet, lights) = (&problem.sheets[s], problem.lights);
    let columns = sheet.grid[0].div_ceil(side);
    let rows = sheet.grid[1].div_ceil(side);
    let standard = gainless(problem, s, residuals, weights);
    let mut sums = vec![(0.0, 0.0); columns * rows * lights];
    for (cell, values) in sheet.cells.iter().zip(standard.chunks(lights)) {
        let block = (cell.place[1] / side) * columns + cell.place[0] / side;
        for (i, value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let sum: &mut (f64, f64) = &mut sums[block * lights + i];
            sum.0 += value;
            sum.1 += 1.0;
        }
    }
    let full = |block: &[(f64, f64)]| block.iter().all(|(_, n)| *n >= 0.5 * (side * side) as f64);
    let blocks: Vec<_> = sums.chunks(lights).filter(|block| full(block)).collect();
    let square = blocks.iter().flat_map(|block| block.iter()).map(|(sum, n)| sum * sum / n).sum();
    (square, (blocks.len() * lights) as f64, blocks.len() as f64)
}

/// Sets the sizes of the slow errors, and with `ruler` the factor on the ruler's sigma, to what makes the pictures most
/// probable.
pub(super) fn estimate_scales(
    problem: &mut Problem,
    systems: &[SheetSystem],
    state: &State,
    ruler: bool,
) -> Result<(), Error> {
    for _ in 0..SLOW_ROUNDS {
        let evidence = slow_evidence(problem, systems, state).ok_or(Error::Singular)?;
        problem.slow.adopt(&evidence);
    }
    if ruler {
        let at = problem.assemble(systems, state).ok_or(Error::Singular)?;
        problem.ruler_scale = ruler_scale(problem, state, &at);
    }
    Ok(())
}

/// What the linearised pictures say of the slow errors' sizes once the parameters have taken what they can.
fn slow_evidence(
    problem: &Problem,
    systems: &[SheetSystem],
    state: &State,
) -> Option<[Evidence; 4]> {
    let joint = problem.joint(systems, state)?;
    let factor = definite(&joint.hessian, &problem.prior_weights())?;
    let (step, covariance) = (factor.solve(&joint.descent), factor.inverse());
    let mut evidence = [Evidence::default(); 4];
    for (s, system) in systems.iter().enumerate() {
        let places = problem.places(s);
        let step = DVector::from_iterator(places.len(), places.iter().map(|k| step[*k]));
        let own =
            DMatrix::from_fn(places.len(), places.len(), |i, j| covariance[(places[i], places[j])]);
        system.learn(&problem.slow, &step, &own, &mut evidence)?;
    }
    let (n, shares) = (problem.parameters(), problem.slow.fixed_shares());
    // With one sheet nothing tells what others would share.
    if systems.len() > 1 {
        for k in n..step.len() {
            let share = shares[(k - n) % shares.len()];
            problem.slow.learn(&mut evidence, share, step[k], covariance[(k, k)]);
        }
    }
    Some(evidence)
}

fn half_log_det(factor: &Cholesky<f64, Dyn>) -> f64 {
    factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum()
}

/// The factor on the ruler's sigma that makes the pictures most probable (maximum of the marginal likelihood of the
/// linearised problem, with a mild prior about 1). Ruler readings are often worse than people think; where the pictures
/// show it, every light's prior widens.
fn ruler_scale(problem: &Problem, state: &State, at: &Linearised) -> f64 {
    let positions: Vec<(usize, f64, f64)> = position_terms(problem, state);
    if positions.is_empty() {
        return 1.0;
    }
    let steps = 24;
    let (low, high) = (RULER_SCALES.0.ln(), RULER_SCALES.1.ln());
    let candidates =
        (0..=steps).map(|k| (low + (high - low) * f64::from(k) / f64::from(steps)).exp());
    let scored =
        candidates.filter_map(|scale| Some((scale, evidence(problem, at, &positions, scale)?)));
    scored.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(problem.ruler_scale, |(scale, _)| scale)
}

/// Index, distance from the ruler's value and weight at scale 1 of every coordinate that the ruler measured.
fn position_terms(problem: &Problem, state: &State) -> Vec<(usize, f64, f64)> {
    let mut terms = Vec::new();
    for (i, (emitter, prior)) in state.emitters.iter().zip(&problem.priors).enumerate() {
        let (super::Place::Near { position_mm, .. }, super::Place::Near { position_mm: ruler, .. }) =
            (&emitter.place, &prior.emitter.place)
        else {
            continue;
        };
        let off = position_mm - ruler;
        terms.extend((0..3).map(|k| (i * PER_LIGHT + k, off[k], prior.position_sigma_mm.powi(-2))));
    }
    terms
}

/// ln p(pictures | scale) up to a constant: the best cost and the volume of the posterior against the prior's.
fn evidence(
    problem: &Problem,
    at: &Linearised,
    positions: &[(usize, f64, f64)],
    scale: f64,
) -> Option<f64> {
    let mut hessian = at.hessian.clone();
    let mut descent = at.descent.clone();
    let change = scale.powi(-2) - problem.ruler_scale.powi(-2);
    let mut prior_cost = 0.0;
    for (k, off, weight) in positions {
        hessian[(*k, *k)] += weight * change;
        descent[*k] -= weight * change * off;
        prior_cost += 0.5 * weight * scale.powi(-2) * off * off;
    }
    let factor = Cholesky::new(hessian)?;
    let best = prior_cost - 0.5 * descent.dot(&factor.solve(&descent));
    let log_det = half_log_det(&factor);
    let mild = scale.ln().powi(2) / (2.0 * RULER_SPREAD.powi(2));
    Some(-best - log_det - positions.len() as f64 * scale.ln() - mild)
}

/// Inverse of the cost's second derivative.
pub(super) fn covariance(problem: &Problem, at: &Linearised) -> Option<DMatrix<f64>> {
    definite(&at.hessian, &problem.prior_weights()).map(|factor| factor.inverse())
}

/// One Levenberg step: (H + lambda P) step = descent, with P the priors' own weights, so that damping shortens the step in
/// the directions that the pictures leave open, in units of what the ruler allows.
pub(super) fn damped_step(problem: &Problem, at: &Linearised, lambda: f64) -> Option<DVector<f64>> {
    let weights = problem.prior_weights();
    let mut hessian = at.hessian.clone();
    for (k, weight) in weights.iter().enumerate() {
        hessian[(k, k)] += lambda * weight;
    }
    definite(&hessian, &weights).map(|factor| factor.solve(&at.descent))
}

/// Shares of the priors that are added until rounding leaves the equations positive definite, as they are without it: every
/// parameter has a prior.
const MORE_PRIOR: [f64; 6] = [0.0, 1e-4, 1e-2, 0.1, 1.0, 10.0];

/// Cholesky factor of the data's and the priors' weight; `None` only where they are no numbers.
fn definite(hessian: &DMatrix<f64>, prior_weights: &[f64]) -> Option<Cholesky<f64, Dyn>> {
    MORE_PRIOR.into_iter().find_map(|share| {
        let mut hessian = hessian.clone();
        for (k, weight) in prior_weights.iter().enumerate() {
            hessian[(k, k)] += share * (weight + 1e-12 * hessian[(k, k)].abs());
        }
        Cholesky::new(hessian).filter(|factor| factor.l_dirty().iter().all(|v| v.is_finite()))
    })
}
