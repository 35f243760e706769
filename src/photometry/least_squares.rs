//! Plain least squares: pseudo-inverse times samples where a photosite has them all, normal equations where some are
//! missing.

use multiversion::multiversion;

use super::block::{Block, LANES, Lanes, ZERO};
use super::normal_equations::{Weighting, accumulate, times, variance};
use super::pieces::{Linear, Piece, Pieces};
use super::surface::Surface;

/// Normal equations in float32 lose the square of the condition number; refined once, this much is carried.
const NORMAL_EQUATIONS_CONDITION_SQUARED: f32 = 1000.0;

/// Photosites of one piece, g = P y; carries those that have all their samples.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn solve_complete(block: &Block, pieces: &Pieces, piece: &Piece) -> Surface {
    let offset = block.offset(piece);
    let inverse = &pieces.inverse[piece.first..piece.first + block.sample.len()];
    let mut g = [ZERO; 3];
    for (sample, linear) in block.sample.iter().zip(inverse) {
        let [px, py, pz] = columns(linear, &offset);
        let [gx, gy, gz] = &mut g;
        for k in 0..LANES {
            gx[k] += px[k] * sample.y[k];
            gy[k] += py[k] * sample.y[k];
            gz[k] += pz[k] * sample.y[k];
        }
    }
    unbend(&mut g, piece, &offset);
    let mut surface = describe(block, g, |i| columns(&inverse[i], &offset));
    for k in 0..LANES {
        surface.carried[k] = surface.count[k] == block.sample.len() as f32;
    }
    surface
}

/// Takes off what mixing the pseudo-inverses of the piece's ends adds: t (1 - t) (P0 - P1) (L1 - L0) g.
#[inline(always)]
fn unbend(g: &mut [Lanes; 3], piece: &Piece, offset: &Lanes) {
    let [bx, by, bz] = &piece.bend;
    let [gx, gy, gz] = g;
    for k in 0..LANES {
        let t = offset[k] * piece.per_column;
        let share = t * (1.0 - t);
        let (x, y, z) = (gx[k], gy[k], gz[k]);
        gx[k] -= share * (bx[0] * x + bx[1] * y + bx[2] * z);
        gy[k] -= share * (by[0] * x + by[1] * y + by[2] * z);
        gz[k] -= share * (bz[0] * x + bz[1] * y + bz[2] * z);
    }
}

/// Photosites with samples missing: normal equations over the others, refined once on the residual.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn solve_masked(block: &mut Block) -> Surface {
    let first = accumulate(block, &[ZERO; 3], Weighting::Equal);
    let (inverse, condition_squared) = first.inverse();
    let mut g = times(&inverse, &first.right);
    let second = accumulate(block, &g, Weighting::Kept);
    let change = times(&inverse, &second.right);
    for (g, change) in g.iter_mut().zip(&change) {
        for k in 0..LANES {
            g[k] += change[k];
        }
    }
    let mut surface = describe(block, g, |i| times(&inverse, &block.sample[i].light));
    for k in 0..LANES {
        surface.carried[k] = condition_squared[k] < NORMAL_EQUATIONS_CONDITION_SQUARED;
    }
    surface
}

#[inline(always)]
fn columns(linear: &Linear, offset: &Lanes) -> [Lanes; 3] {
    let mut value = [ZERO; 3];
    for axis in 0..3 {
        let (a, b) = (linear.at_start[axis], linear.per_column[axis]);
        for k in 0..LANES {
            value[axis][k] = a + b * offset[k];
        }
    }
    value
}

/// Residual and covariance (the sandwich P V P^T) of a plain solution; `column(i)` is light i's column of P.
#[inline(always)]
fn describe(block: &Block, g: [Lanes; 3], column: impl Fn(usize) -> [Lanes; 3]) -> Surface {
    let mut surface = Surface::new(g, 0.0);
    let (normal, _) = surface.normal_and_length();
    let [gx, gy, gz] = &surface.g;
    for (i, sample) in block.sample.iter().enumerate() {
        let [lx, ly, lz] = &sample.light;
        let [px, py, pz] = &column(i);
        let [even, odd] = sample.variance;
        for k in 0..LANES {
            let predicted = lx[k] * gx[k] + ly[k] * gy[k] + lz[k] * gz[k];
            let residual = (sample.y[k] - predicted) * sample.usable[k];
            let along = px[k] * normal[0][k] + py[k] * normal[1][k] + pz[k] * normal[2][k];
            let across = px[k] * px[k] + py[k] * py[k] + pz[k] * pz[k] - along * along;
            let model = if block.odd[k] == 0 { even } else { odd };
            let noise = variance(model, predicted, block.noise_scale[k]) * sample.usable[k];
            surface.squares[k] += residual * residual;
            surface.tangent_variance[k] += across.max(0.0) * noise;
            surface.count[k] += sample.usable[k];
        }
    }
    surface
}
