//! Weighted least squares of a block, with lights behind the surface left out.

use super::block::{Block, LANES, ZERO};
use super::method::{MOST_LENGTHENING, REWEIGHTINGS, START_LEVEL, chi_square_limit};
use super::normal_equations::{Sums, Weighting, accumulate, times};
use super::surface::Surface;

/// Normal equations only correct an earlier fit here, so a larger condition is carried than where they make it.
const WEIGHTED_CONDITION_SQUARED: f32 = 1e4;

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
    #[inline(always)]
    pub(crate) fn is_suspect(&self, k: usize) -> bool {
        self.overlooked[k] > 0.0 || !self.fits(k)
    }
}

/// Plain start, then reweighted solves.
#[inline(always)]
pub(crate) fn solve_weighted(block: &mut Block) -> Weighted {
    let start = accumulate(block, &[ZERO; 3], Weighting::Bright);
    let (inverse, _) = start.inverse();
    let mut g = times(&inverse, &start.right);
    let mut sums = accumulate(block, &g, Weighting::Noise);
    for _ in 1..REWEIGHTINGS {
        let (inverse, _) = sums.inverse();
        step(&mut g, &inverse, &sums);
        sums = accumulate(block, &g, Weighting::Noise);
    }
    let (inverse, condition_squared) = sums.inverse();
    step(&mut g, &inverse, &sums);
    finish(block, g, inverse, &condition_squared)
}

#[inline(always)]
pub(crate) fn step(g: &mut [[f32; LANES]; 3], inverse: &[[f32; LANES]; 6], sums: &Sums) {
    let change = times(inverse, &sums.right);
    for (g, change) in g.iter_mut().zip(&change) {
        for k in 0..LANES {
            g[k] += change[k];
        }
    }
}

/// Residuals at the last solution with the weights that it was solved with.
#[inline(always)]
pub(crate) fn finish(
    block: &Block,
    g: [[f32; LANES]; 3],
    inverse: [[f32; LANES]; 6],
    condition_squared: &[f32; LANES],
) -> Weighted {
    let mut surface = Surface::new(g, MOST_LENGTHENING);
    let (mut chi_square, mut overlooked) = (ZERO, ZERO);
    let [gx, gy, gz] = &surface.g;
    for sample in &block.sample {
        let [lx, ly, lz] = &sample.light;
        for k in 0..LANES {
            let residual = sample.y[k] - (lx[k] * gx[k] + ly[k] * gy[k] + lz[k] * gz[k]);
            let w = sample.weight[k];
            let used = if w > 0.0 { 1.0 } else { 0.0 };
            chi_square[k] += w * residual * residual;
            surface.squares[k] += used * residual * residual;
            surface.count[k] += used;
            let seen = sample.y[k] > START_LEVEL as f32 * block.level[k];
            overlooked[k] += if seen & (w == 0.0) { sample.usable[k] } else { 0.0 };
        }
    }
    let (normal, _) = surface.normal_and_length();
    let [px, py, pz] = &times(&inverse, &normal);
    for k in 0..LANES {
        let along = px[k] * normal[0][k] + py[k] * normal[1][k] + pz[k] * normal[2][k];
        surface.tangent_variance[k] = inverse[0][k] + inverse[3][k] + inverse[5][k] - along;
        surface.carried[k] = condition_squared[k] < WEIGHTED_CONDITION_SQUARED;
    }
    Weighted { surface, chi_square, overlooked }
}
