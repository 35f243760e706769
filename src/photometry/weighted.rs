//! Weighted least squares of photosites from anywhere in a row, with lights behind the surface left out.

use multiversion::multiversion;

use super::block::{Block, LANES, Lanes, ZERO};
use super::least_squares::add;
use super::method::{
    CLEAR_DEVIATIONS, FEWEST_KEPT, MOST_LENGTHENING, START_LEVEL, WEIGHTED_CONDITION_SQUARED,
    chi_square_limit,
};
use super::normal_equations::{Sums, Weighting, accumulate, dot, improve, predict, times};
use super::surface::Surface;

/// A block's weighted solution and its chi-square.
pub(crate) struct Weighted {
    pub(crate) surface: Surface,
    /// sum w r^2 over the lights used.
    pub(crate) chi_square: [f32; LANES],
    /// Lights that count as behind the surface although they are clearly seen.
    pub(crate) overlooked: [f32; LANES],
}

impl Weighted {
    /// Whether noise explains the residual of lane `k`.
    #[inline(always)]
    pub(crate) fn fits(&self, k: usize) -> bool {
        let freedom = (self.surface.count[k] as usize).saturating_sub(3);
        self.chi_square[k] <= chi_square_limit(freedom) as f32
    }

    /// Whether lane `k` asks for the subset test.
    pub(crate) fn is_suspect(&self, k: usize) -> bool {
        self.overlooked[k] > 0.0 || !self.fits(k)
    }
}

/// A plain start from the bright samples, then two reweighted solves.
pub(crate) fn solve_weighted(block: &mut Block) -> Weighted {
    let mut g = [ZERO; 3];
    let start = accumulate(block, &g, Weighting::Bright);
    improve(&mut g, &start);
    let sums = accumulate(block, &g, Weighting::Noise);
    improve(&mut g, &sums);
    let sums = accumulate(block, &g, Weighting::Noise);
    let (inverse, condition_squared) = improve(&mut g, &sums);
    finish(block, &g, &inverse, &condition_squared)
}

/// Residuals at the last solution with the weights that it was solved with.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(crate) fn finish(
    block: &Block,
    g: &[[f32; LANES]; 3],
    inverse: &[[f32; LANES]; 6],
    condition_squared: &[f32; LANES],
) -> Weighted {
    let mut surface = Surface::new(*g, MOST_LENGTHENING);
    let (mut chi_square, mut overlooked) = (ZERO, ZERO);
    let [gx, gy, gz] = &surface.g;
    for sample in &block.sample {
        let [lx, ly, lz] = &sample.light;
        for k in 0..LANES {
            let residual = sample.y[k] - dot([lx[k], ly[k], lz[k]], [gx[k], gy[k], gz[k]]);
            let w = sample.weight[k];
            let used: f32 = if w > 0.0 { 1.0 } else { 0.0 };
            let square = residual * residual;
            chi_square[k] = w.mul_add(square, chi_square[k]);
            surface.squares[k] = used.mul_add(square, surface.squares[k]);
            surface.count[k] += used;
            let seen = sample.y[k] > START_LEVEL as f32 * block.level[k];
            overlooked[k] += if seen & (w == 0.0) { sample.usable[k] } else { 0.0 };
        }
    }
    covariance_across(&mut surface, inverse, condition_squared);
    settle_albedo(block, &mut surface);
    Weighted { surface, chi_square, overlooked }
}

/// Takes albedo from the lights clear of the horizon, see [`CLEAR_DEVIATIONS`].
#[inline(always)]
fn settle_albedo(block: &Block, surface: &mut Surface) {
    let (mut sums, mut left, mut dropped) = (Sums::none(), ZERO, ZERO);
    for sample in &block.sample {
        let predicted = predict(&sample.light, &surface.g);
        let (mut weight, mut residual) = (ZERO, ZERO);
        for k in 0..LANES {
            let floor = sample.variance(k, 0.0) * (CLEAR_DEVIATIONS * CLEAR_DEVIATIONS) as f32;
            let clear = (predicted[k] > 0.0) & (predicted[k] * predicted[k] > floor);
            let used = sample.weight[k] > 0.0;
            weight[k] = if clear { sample.weight[k] } else { 0.0 };
            residual[k] = sample.y[k] - predicted[k];
            left[k] += if used & clear { 1.0 } else { 0.0 };
            dropped[k] += if used & !clear { 1.0 } else { 0.0 };
        }
        sums.add(&sample.light, &weight, &residual);
    }
    if dropped == ZERO {
        return;
    }
    let (inverse, condition_squared) = sums.inverse();
    let mut clear = Surface::new(surface.g, surface.most_lengthening.into());
    add(&mut clear.g, &times(&inverse, &sums.right));
    covariance_across(&mut clear, &inverse, &condition_squared);
    let (_, of_clear) = clear.deviation_and_true_length(&clear.normal_and_length().1);
    let (_, of_all) = surface.deviation_and_true_length(&surface.normal_and_length().1);
    for k in 0..LANES {
        let enough = (dropped[k] > 0.0) & (left[k] >= FEWEST_KEPT as f32) & clear.carried[k];
        let share = of_clear[k] / of_all[k];
        surface.albedo_share[k] = if enough & (share > 0.0) { share } else { 1.0 };
    }
}

/// Notes the covariance across the normal, and whether float32 carries the lights' condition.
#[inline(always)]
pub(crate) fn covariance_across(
    surface: &mut Surface,
    inverse: &[Lanes; 6],
    condition_squared: &Lanes,
) {
    let (normal, _) = surface.normal_and_length();
    let [px, py, pz] = &times(inverse, &normal);
    for k in 0..LANES {
        let along = dot([px[k], py[k], pz[k]], [normal[0][k], normal[1][k], normal[2][k]]);
        surface.tangent_variance[k] = inverse[0][k] + inverse[3][k] + inverse[5][k] - along;
        surface.carried[k] = condition_squared[k] < WEIGHTED_CONDITION_SQUARED;
    }
}
