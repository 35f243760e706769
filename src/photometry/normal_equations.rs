//! Weighted normal equations of a block of photosites: sums over lights, their 3 x 3 solution, and what it says.

use multiversion::multiversion;

use super::block::{Block, LANES, Lanes, ZERO};
use super::method::{BEHIND_DEVIATIONS, BEHIND_LEVEL, LIT_ABOVE_FLOOR, START_LEVEL, START_SAMPLES};
use super::row::VarianceModel;

/// sum w l l^T, sum w l r and company, with r = y - l . g the residual at the g that the sums were taken at.
pub(crate) struct Sums {
    /// sum w l l^T: xx, xy, xz, yy, yz, zz.
    pub(crate) matrix: [Lanes; 6],
    /// sum w l r.
    pub(crate) right: [Lanes; 3],
    /// sum w r^2.
    pub(crate) chi_square: Lanes,
    /// Samples with a weight.
    pub(crate) count: Lanes,
}

/// Where the weights come from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weighting {
    /// 1 for every usable sample.
    Equal,
    /// 1 for the samples near the photosite's own level, or every usable one where these are too few.
    Bright,
    /// 1 / var at the predicted value; lights behind the surface get none.
    Noise,
    /// Those of the latest solve.
    Kept,
}

/// Takes the sums at `g` and leaves the weights in the block.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn accumulate(block: &mut Block, g: &[Lanes; 3], weighting: Weighting) -> Sums {
    let mut sums = Sums { matrix: [ZERO; 6], right: [ZERO; 3], chi_square: ZERO, count: ZERO };
    let least = block.least_variance();
    for sample in &mut block.sample {
        let [lx, ly, lz] = &sample.light;
        let (mut predicted, mut residual) = (ZERO, ZERO);
        for k in 0..LANES {
            predicted[k] = lx[k] * g[0][k] + ly[k] * g[1][k] + lz[k] * g[2][k];
            residual[k] = sample.y[k] - predicted[k];
        }
        match weighting {
            Weighting::Equal => sample.weight = sample.usable,
            Weighting::Kept => {}
            Weighting::Bright => {
                for k in 0..LANES {
                    let bright = sample.y[k] > START_LEVEL as f32 * block.level[k];
                    let few = block.bright[k] < START_SAMPLES as f32;
                    sample.weight[k] = if bright || few { sample.usable[k] } else { 0.0 };
                }
            }
            Weighting::Noise => {
                let [even, odd] = sample.variance;
                for k in 0..LANES {
                    let predicted = predicted[k];
                    let model = if block.odd[k] == 0 { even } else { odd };
                    let scale = block.noise_scale[k];
                    let variance = variance(model, predicted, scale).max(least[k]);
                    let lit = is_lit(model, predicted, sample.y[k], block.level[k], scale);
                    sample.weight[k] = if lit { sample.usable[k] / variance } else { 0.0 };
                }
            }
        }
        sums.add(&sample.light, &sample.weight, &residual);
    }
    sums
}

/// var(y) at a predicted value.
#[inline(always)]
pub(crate) fn variance(model: VarianceModel, predicted: f32, noise_scale: f32) -> f32 {
    let predicted = predicted.max(0.0);
    let model_error = model.kappa * predicted;
    noise_scale * (model.shot * predicted + model.floor * noise_scale) + model_error * model_error
}

/// Whether a light stands in front of the surface, see [`LIT_ABOVE_FLOOR`]. Squares stand for the roots.
#[inline(always)]
fn is_lit(model: VarianceModel, predicted: f32, y: f32, level: f32, noise_scale: f32) -> bool {
    let square = |a: f32| a * a;
    let floor = variance(model, 0.0, noise_scale) * square(LIT_ABOVE_FLOOR as f32);
    let spread = variance(model, level, noise_scale) * square(BEHIND_DEVIATIONS as f32);
    let beyond = -(predicted + BEHIND_LEVEL as f32 * level);
    let arrives = (y > 0.0) & (square(y) > floor);
    let behind = (beyond > 0.0) & (square(beyond) > spread);
    (predicted > 0.0) | (arrives & !behind)
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, [lx, ly, lz]: &[Lanes; 3], weight: &Lanes, residual: &Lanes) {
        let [xx, xy, xz, yy, yz, zz] = &mut self.matrix;
        let [x, y, z] = &mut self.right;
        for k in 0..LANES {
            let w = weight[k];
            let (wx, wy, wz) = (w * lx[k], w * ly[k], w * lz[k]);
            xx[k] += wx * lx[k];
            xy[k] += wx * ly[k];
            xz[k] += wx * lz[k];
            yy[k] += wy * ly[k];
            yz[k] += wy * lz[k];
            zz[k] += wz * lz[k];
            x[k] += wx * residual[k];
            y[k] += wy * residual[k];
            z[k] += wz * residual[k];
            self.chi_square[k] += w * residual[k] * residual[k];
            self.count[k] += if w > 0.0 { 1.0 } else { 0.0 };
        }
    }

    /// (sum w l l^T)^-1 by LDL^T, and the square of the condition number (an upper bound within a factor of nine). Where
    /// the matrix is not positive the condition is NaN, infinite or negative.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> ([Lanes; 6], Lanes) {
        let [xx, xy, xz, yy, yz, zz] = &self.matrix;
        let (mut inverse, mut condition_squared) = ([ZERO; 6], ZERO);
        for k in 0..LANES {
            let (l21, l31) = (xy[k] / xx[k], xz[k] / xx[k]);
            let d2 = yy[k] - l21 * xy[k];
            let l32 = (yz[k] - l21 * xz[k]) / d2;
            let d3 = zz[k] - l31 * xz[k] - l32 * l32 * d2;
            let m31 = l21 * l32 - l31;
            let (r1, r2, r3) = (1.0 / xx[k], 1.0 / d2, 1.0 / d3);
            inverse[0][k] = r1 + l21 * l21 * r2 + m31 * m31 * r3;
            inverse[1][k] = -l21 * r2 - m31 * l32 * r3;
            inverse[2][k] = m31 * r3;
            inverse[3][k] = r2 + l32 * l32 * r3;
            inverse[4][k] = -l32 * r3;
            inverse[5][k] = r3;
            let positive = d2 > 0.0 && d3 > 0.0;
            let condition =
                (xx[k] + yy[k] + zz[k]) * (inverse[0][k] + inverse[3][k] + inverse[5][k]);
            condition_squared[k] = if positive { condition } else { f32::INFINITY };
        }
        (inverse, condition_squared)
    }
}

/// Symmetric 3 x 3 times vector.
#[inline(always)]
pub(crate) fn times(matrix: &[Lanes; 6], vector: &[Lanes; 3]) -> [Lanes; 3] {
    let [xx, xy, xz, yy, yz, zz] = matrix;
    let [x, y, z] = vector;
    let mut product = [ZERO; 3];
    for k in 0..LANES {
        product[0][k] = xx[k] * x[k] + xy[k] * y[k] + xz[k] * z[k];
        product[1][k] = xy[k] * x[k] + yy[k] * y[k] + yz[k] * z[k];
        product[2][k] = xz[k] * x[k] + yz[k] * y[k] + zz[k] * z[k];
    }
    product
}

/// Adds the solution of the sums to `g`: returns (sum w l l^T)^-1 and the square of its condition number.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn improve(g: &mut [Lanes; 3], sums: &Sums) -> ([Lanes; 6], Lanes) {
    let (inverse, condition_squared) = sums.inverse();
    let change = times(&inverse, &sums.right);
    for (g, change) in g.iter_mut().zip(&change) {
        for k in 0..LANES {
            g[k] += change[k];
        }
    }
    (inverse, condition_squared)
}
