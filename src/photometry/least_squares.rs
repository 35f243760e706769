//! Plain least squares of photosites with samples missing: normal equations over the others.

use multiversion::multiversion;

use super::block::{Block, LANES, Lanes, ZERO};
use super::normal_equations::{Weighting, accumulate, add_square, dot, predict, times};
use super::surface::Surface;

/// Normal equations in float32 lose the square of the condition number; refined once, this much is carried.
const NORMAL_EQUATIONS_CONDITION_SQUARED: f32 = 1000.0;

/// Photosites with samples missing: normal equations over the others, refined once on the residual.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(crate) fn solve_masked(block: &mut Block) -> Surface {
    let first = accumulate(block, &[ZERO; 3], Weighting::Equal);
    let (inverse, condition_squared) = first.inverse();
    let mut g = times(&inverse, &first.right);
    let second = accumulate(block, &g, Weighting::Kept);
    add(&mut g, &times(&inverse, &second.right));
    let mut surface = Surface::new(g, 0.0);
    let mut spread = [ZERO; 6];
    for sample in &block.sample {
        let mut light = sample.light;
        for axis in &mut light {
            for k in 0..LANES {
                axis[k] *= sample.usable[k];
            }
        }
        let predicted = predict(&light, &surface.g);
        let mut variance = ZERO;
        for k in 0..LANES {
            variance[k] = sample.variance(k, predicted[k]);
        }
        add_square(&mut spread, &light, &variance);
        for k in 0..LANES {
            let residual = (sample.y[k] - predicted[k]) * sample.usable[k];
            surface.squares[k] = residual.mul_add(residual, surface.squares[k]);
            surface.count[k] += sample.usable[k];
        }
    }
    surface.tangent_variance = sandwich_across(&surface, &inverse, &spread);
    for k in 0..LANES {
        surface.carried[k] = condition_squared[k] < NORMAL_EQUATIONS_CONDITION_SQUARED;
    }
    surface
}

/// Trace of the plain solution's covariance N (sum var l l^T) N across the normal.
#[inline(always)]
pub(crate) fn sandwich_across(
    surface: &Surface,
    inverse: &[Lanes; 6],
    spread: &[Lanes; 6],
) -> Lanes {
    let [xx, xy, xz, yy, yz, zz] = inverse;
    // Columns of N, then N's rows against spread times them: the diagonal suffices.
    let mut trace = ZERO;
    for column in [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] {
        let column = column.map(|c| *c);
        let through = times(spread, &column);
        for k in 0..LANES {
            let c = [column[0][k], column[1][k], column[2][k]];
            trace[k] += dot(c, [through[0][k], through[1][k], through[2][k]]);
        }
    }
    let (normal, _) = surface.normal_and_length();
    let column = times(inverse, &normal);
    let through = times(spread, &column);
    for k in 0..LANES {
        let c = [column[0][k], column[1][k], column[2][k]];
        trace[k] -= dot(c, [through[0][k], through[1][k], through[2][k]]);
    }
    trace
}

/// g += change.
#[inline(always)]
pub(crate) fn add(g: &mut [Lanes; 3], change: &[Lanes; 3]) {
    for (g, change) in g.iter_mut().zip(change) {
        for k in 0..LANES {
            g[k] += change[k];
        }
    }
}
