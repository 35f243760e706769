//! Weighted normal equations of a block of photosites: sums over lights, their 3 x 3 solution, and what it says.

use multiversion::multiversion;

use super::block::{Block, LANES, Lanes, Sample, ZERO, larger};
use super::method::{BEHIND_DEVIATIONS, BEHIND_LEVEL, LIT_ABOVE_FLOOR, START_LEVEL, START_SAMPLES};

/// sum w l l^T and sum w l r, with r = y - l . g the residual at the g that the sums were taken at.
pub(crate) struct Sums {
    /// sum w l l^T: xx, xy, xz, yy, yz, zz.
    pub(crate) matrix: [Lanes; 6],
    /// sum w l r.
    pub(crate) right: [Lanes; 3],
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
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(crate) fn accumulate(block: &mut Block, g: &[Lanes; 3], weighting: Weighting) -> Sums {
    let mut sums = Sums::none();
    let least = block.least_variance();
    for sample in &mut block.sample {
        let predicted = predict(&sample.light, g);
        let mut residual = ZERO;
        for k in 0..LANES {
            residual[k] = sample.y[k] - predicted[k];
        }
        let mut weight = ZERO;
        match weighting {
            Weighting::Equal => weight = sample.usable,
            Weighting::Kept => weight = sample.weight,
            Weighting::Bright => {
                for k in 0..LANES {
                    let bright = sample.y[k] > START_LEVEL as f32 * block.level[k];
                    let few = block.bright[k] < START_SAMPLES as f32;
                    weight[k] = if bright || few { sample.usable[k] } else { 0.0 };
                }
            }
            Weighting::Noise => {
                for k in 0..LANES {
                    let variance = larger(sample.variance(k, predicted[k]), least[k]);
                    let lit = is_lit(sample, k, predicted[k], block.level[k]);
                    weight[k] = if lit { sample.usable[k] / variance } else { 0.0 };
                }
            }
        }
        sums.add(&sample.light, &weight, &residual);
        sample.weight = weight;
    }
    sums
}

/// Whether a light stands in front of the surface, see [`LIT_ABOVE_FLOOR`]. Squares stand for the roots.
#[inline(always)]
fn is_lit(sample: &Sample, k: usize, predicted: f32, level: f32) -> bool {
    let square = |a: f32| a * a;
    let y = sample.y[k];
    let floor = sample.variance(k, 0.0) * square(LIT_ABOVE_FLOOR as f32);
    let spread = sample.variance(k, level) * square(BEHIND_DEVIATIONS as f32);
    let beyond = -(predicted + BEHIND_LEVEL as f32 * level);
    let arrives = (y > 0.0) & (square(y) > floor);
    let behind = (beyond > 0.0) & (square(beyond) > spread);
    (predicted > 0.0) | (arrives & !behind)
}

impl Sums {
    /// Sums over no light.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self { matrix: [ZERO; 6], right: [ZERO; 3] }
    }

    /// Adds a sample of weight w and residual r.
    #[inline(always)]
    pub(crate) fn add(&mut self, light: &[Lanes; 3], weight: &Lanes, residual: &Lanes) {
        let mut weighted = ZERO;
        for k in 0..LANES {
            weighted[k] = weight[k] * residual[k];
        }
        add_square(&mut self.matrix, light, weight);
        add_product(&mut self.right, light, &weighted);
    }

    /// (sum w l l^T)^-1 by LDL^T, and the square of the condition number (an upper bound within a factor of nine). Where
    /// the matrix is not positive the condition is NaN, infinite or negative.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> ([Lanes; 6], Lanes) {
        let [xx, xy, xz, yy, yz, zz] = &self.matrix;
        let (mut inverse, mut condition_squared) = ([ZERO; 6], ZERO);
        for k in 0..LANES {
            let r1 = 1.0 / xx[k];
            let (l21, l31) = (xy[k] * r1, xz[k] * r1);
            let d2 = yy[k] - l21 * xy[k];
            let r2 = 1.0 / d2;
            let l32 = (yz[k] - l21 * xz[k]) * r2;
            let d3 = zz[k] - l31 * xz[k] - l32 * l32 * d2;
            let r3 = 1.0 / d3;
            let m31 = l21 * l32 - l31;
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

/// Scalar product of two vectors.
#[inline(always)]
pub(crate) fn dot([ax, ay, az]: [f32; 3], [bx, by, bz]: [f32; 3]) -> f32 {
    az.mul_add(bz, ay.mul_add(by, ax * bx))
}

/// The signal that `g` predicts under a light.
#[inline(always)]
pub(crate) fn predict([lx, ly, lz]: &[Lanes; 3], [gx, gy, gz]: &[Lanes; 3]) -> Lanes {
    let mut predicted = ZERO;
    for k in 0..LANES {
        predicted[k] = dot([lx[k], ly[k], lz[k]], [gx[k], gy[k], gz[k]]);
    }
    predicted
}

/// matrix += w l l^T.
#[inline(always)]
pub(crate) fn add_square(matrix: &mut [Lanes; 6], [lx, ly, lz]: &[Lanes; 3], w: &Lanes) {
    let [xx, xy, xz, yy, yz, zz] = matrix;
    for k in 0..LANES {
        let (wx, wy, wz) = (w[k] * lx[k], w[k] * ly[k], w[k] * lz[k]);
        xx[k] = wx.mul_add(lx[k], xx[k]);
        xy[k] = wx.mul_add(ly[k], xy[k]);
        xz[k] = wx.mul_add(lz[k], xz[k]);
        yy[k] = wy.mul_add(ly[k], yy[k]);
        yz[k] = wy.mul_add(lz[k], yz[k]);
        zz[k] = wz.mul_add(lz[k], zz[k]);
    }
}

/// right += l v.
#[inline(always)]
pub(crate) fn add_product(right: &mut [Lanes; 3], light: &[Lanes; 3], v: &Lanes) {
    for (right, light) in right.iter_mut().zip(light) {
        for k in 0..LANES {
            right[k] = light[k].mul_add(v[k], right[k]);
        }
    }
}

/// Symmetric 3 x 3 times vector.
#[inline(always)]
pub(crate) fn times(matrix: &[Lanes; 6], vector: &[Lanes; 3]) -> [Lanes; 3] {
    let [xx, xy, xz, yy, yz, zz] = matrix;
    let [x, y, z] = vector;
    let mut product = [ZERO; 3];
    for k in 0..LANES {
        let v = [x[k], y[k], z[k]];
        product[0][k] = dot([xx[k], xy[k], xz[k]], v);
        product[1][k] = dot([xy[k], yy[k], yz[k]], v);
        product[2][k] = dot([xz[k], yz[k], zz[k]], v);
    }
    product
}

/// Adds the solution of the sums to `g`: returns (sum w l l^T)^-1 and the square of its condition number.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
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
