//! Neighbours on one piece that have all their samples: the way of most photosites. Light vectors come from the piece's
//! coefficients and samples from the row, so that nothing is loaded, marked and stored that is not needed.

use pulp::{Simd, WithSimd};

use super::block::{Block, LANES, Lanes, ZERO};
use super::method::{RELATIVE_FLOOR, WEIGHTED_CONDITION_SQUARED, chi_square_limit};
use super::pieces::{Linear, Piece, Pieces};
use super::row::RowInput;
use super::surface::Surface;
use super::wide::{Matrix, Vector, Wide};

/// A placed block, its piece and its row.
#[derive(Clone, Copy)]
pub(crate) struct Neighbours<'a> {
    pub(crate) block: &'a Block,
    pub(crate) pieces: &'a Pieces,
    pub(crate) piece: &'a Piece,
    pub(crate) input: &'a RowInput<'a>,
}

/// Plain least squares; not finite where a sample is missing.
pub(crate) struct LeastSquares<'a> {
    pub(crate) at: Neighbours<'a>,
    pub(crate) surface: &'a mut Surface,
}

/// Weighted least squares with every sample, reweighted once after a plain start. Carries those photosites that noise
/// explains so, with every light in front of them.
pub(crate) struct Weighted<'a> {
    pub(crate) at: Neighbours<'a>,
    pub(crate) surface: &'a mut Surface,
    /// One vector a light, for a while.
    pub(crate) weights: &'a mut [Lanes],
}

impl WithSimd for LeastSquares<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for chunk in 0..LANES / S::F32_LANES {
            self.at.chunk(Wide(simd), chunk).least_squares(self.surface);
        }
        self.surface.count = [self.at.block.sample.len() as f32; LANES];
        self.surface.carried = [true; LANES];
    }
}

impl WithSimd for Weighted<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let lights = self.at.block.sample.len();
        let mut test = Test { lowest: ZERO, chi_square: ZERO, condition_squared: ZERO };
        for chunk in 0..LANES / S::F32_LANES {
            self.at.chunk(Wide(simd), chunk).weighted(self.weights, self.surface, &mut test);
        }
        self.surface.count = [lights as f32; LANES];
        let limit = chi_square_limit(lights - 3) as f32;
        for k in 0..LANES {
            self.surface.carried[k] = (test.lowest[k] > 0.0)
                & (test.chi_square[k] <= limit)
                & (test.condition_squared[k] < WEIGHTED_CONDITION_SQUARED);
        }
    }
}

/// What a weighted solution is accepted by.
struct Test {
    /// The least signal that the plain start predicts.
    lowest: Lanes,
    chi_square: Lanes,
    condition_squared: Lanes,
}

impl<'a> Neighbours<'a> {
    #[inline(always)]
    fn chunk<S: Simd>(self, wide: Wide<S>, chunk: usize) -> Chunk<'a, S> {
        let first = (self.block.column[0] - self.piece.start + chunk * S::F32_LANES) as f32;
        let offset = wide.0.add_f32s(wide.splat(first), wide.load(&COUNT, 0));
        let entries = self.piece.inverse.at_start.iter().zip(&self.piece.inverse.per_column);
        let mut inverse = [offset; 6];
        for (inverse, (&start, &slope)) in inverse.iter_mut().zip(entries) {
            *inverse = wide.line(start, slope, offset);
        }
        let lights = &self.pieces.light[self.piece.first..][..self.block.sample.len()];
        Chunk { at: self, wide, chunk, offset, inverse, lights }
    }

    /// Samples of a light.
    #[inline(always)]
    fn y(&self, i: usize) -> &[f32] {
        let start = self.block.column[0];
        if self.block.len == LANES {
            &self.input.signal[i][start..start + LANES]
        } else {
            &self.block.padded[i]
        }
    }
}

/// As many neighbours as a vector holds.
struct Chunk<'a, S: Simd> {
    at: Neighbours<'a>,
    wide: Wide<S>,
    chunk: usize,
    /// Columns from the piece's start.
    offset: S::f32s,
    /// (L^T L)^-1.
    inverse: Matrix<S>,
    lights: &'a [Linear],
}

impl<S: Simd> Chunk<'_, S> {
    #[inline(always)]
    fn least_squares(&self, surface: &mut Surface) {
        let (wide, s) = (self.wide, self.wide.0);
        let zero = wide.splat(0.0);
        let start = self.start();
        let (mut right, mut spread, mut squares) = ([zero; 3], [zero; 6], zero);
        for i in 0..self.lights.len() {
            let light = self.light(i);
            let predicted = wide.dot(&light, &start);
            let residual = s.sub_f32s(self.y(i), predicted);
            squares = s.mul_add_f32s(residual, residual, squares);
            wide.add_product(&mut right, &light, residual);
            wide.add_square(&mut spread, &light, self.variance(i, predicted));
        }
        let change = wide.times(&self.inverse, &right);
        // What the change takes off the squares: right . change, as right = L^T L change.
        squares = s.sub_f32s(squares, wide.dot(&right, &change));
        let g = wide.add(&start, &change);
        wide.store(&mut surface.squares, self.chunk, squares);
        self.store(&g, self.sandwich_across(&spread, &g), surface);
    }

    /// Trace of the plain solution's covariance N (sum var l l^T) N across the normal.
    #[inline(always)]
    fn sandwich_across(&self, spread: &Matrix<S>, g: &Vector<S>) -> S::f32s {
        let (wide, s) = (self.wide, self.wide.0);
        let [xx, xy, xz, yy, yz, zz] = self.inverse;
        let mut trace = wide.form(spread, &[xx, xy, xz]);
        trace = s.add_f32s(trace, wide.form(spread, &[xy, yy, yz]));
        trace = s.add_f32s(trace, wide.form(spread, &[xz, yz, zz]));
        let along = wide.form(spread, &wide.times(&self.inverse, g));
        s.sub_f32s(trace, s.div_f32s(along, wide.dot(g, g)))
    }

    #[inline(always)]
    fn weighted(&self, weights: &mut [Lanes], surface: &mut Surface, test: &mut Test) {
        let (wide, s) = (self.wide, self.wide.0);
        let zero = wide.splat(0.0);
        let start = self.start();
        let least = self.least_variance();
        let one = wide.splat(1.0);
        let (mut right, mut matrix) = ([zero; 3], [zero; 6]);
        let mut lowest = wide.splat(f32::INFINITY);
        for (i, kept) in weights.iter_mut().enumerate() {
            let light = self.light(i);
            let predicted = wide.dot(&light, &start);
            // In this order what is not a number stays.
            lowest = s.select_f32s(s.greater_than_f32s(predicted, lowest), lowest, predicted);
            let weight = s.div_f32s(one, s.max_f32s(self.variance(i, predicted), least));
            let residual = s.mul_f32s(weight, s.sub_f32s(self.y(i), predicted));
            wide.add_product(&mut right, &light, residual);
            wide.add_square(&mut matrix, &light, weight);
            wide.store(kept, self.chunk, weight);
        }
        let (inverse, condition_squared) = wide.inverse(&matrix);
        let g = wide.add(&start, &wide.times(&inverse, &right));
        let (mut squares, mut chi_square) = (zero, zero);
        for (i, kept) in weights.iter().enumerate() {
            let residual = s.sub_f32s(self.y(i), wide.dot(&self.light(i), &g));
            let square = s.mul_f32s(residual, residual);
            squares = s.add_f32s(squares, square);
            chi_square = s.mul_add_f32s(wide.load(kept, self.chunk), square, chi_square);
        }
        wide.store(&mut surface.squares, self.chunk, squares);
        wide.store(&mut test.lowest, self.chunk, lowest);
        wide.store(&mut test.chi_square, self.chunk, chi_square);
        wide.store(&mut test.condition_squared, self.chunk, condition_squared);
        let along = s.div_f32s(wide.form(&inverse, &g), wide.dot(&g, &g));
        self.store(&g, s.sub_f32s(wide.trace(&inverse), along), surface);
    }

    #[inline(always)]
    fn store(&self, g: &Vector<S>, tangent_variance: S::f32s, surface: &mut Surface) {
        for (axis, g) in surface.g.iter_mut().zip(g) {
            self.wide.store(axis, self.chunk, *g);
        }
        self.wide.store(&mut surface.tangent_variance, self.chunk, tangent_variance);
    }

    /// The unrefined plain solution N L^T y.
    #[inline(always)]
    fn start(&self) -> Vector<S> {
        let mut right = [self.wide.splat(0.0); 3];
        for i in 0..self.lights.len() {
            self.wide.add_product(&mut right, &self.light(i), self.y(i));
        }
        self.wide.times(&self.inverse, &right)
    }

    /// Least variance that counts.
    #[inline(always)]
    fn least_variance(&self) -> S::f32s {
        let s = self.wide.0;
        let mut level = self.wide.splat(0.0);
        for i in 0..self.lights.len() {
            level = s.max_f32s(s.abs_f32s(self.y(i)), level);
        }
        let sigma = s.mul_f32s(self.wide.splat(RELATIVE_FLOOR as f32), level);
        s.max_f32s(s.mul_f32s(sigma, sigma), self.wide.splat(f32::MIN_POSITIVE))
    }

    #[inline(always)]
    fn light(&self, i: usize) -> Vector<S> {
        let Linear { at_start: [x, y, z], per_column: [dx, dy, dz] } = self.lights[i];
        let (wide, t) = (self.wide, self.offset);
        [wide.line(x, dx, t), wide.line(y, dy, t), wide.line(z, dz, t)]
    }

    #[inline(always)]
    fn y(&self, i: usize) -> S::f32s {
        self.wide.load(self.at.y(i), self.chunk)
    }

    /// var(y) of a light's samples at predicted values.
    #[inline(always)]
    fn variance(&self, i: usize, predicted: S::f32s) -> S::f32s {
        let (wide, s) = (self.wide, self.wide.0);
        let sample = &self.at.block.sample[i];
        let shot = wide.load(&sample.shot, self.chunk);
        let floor = wide.load(&sample.floor, self.chunk);
        let kappa = wide.load(&sample.kappa, self.chunk);
        let predicted = s.max_f32s(predicted, wide.splat(0.0));
        let noise = s.mul_add_f32s(shot, predicted, floor);
        let model_error = s.mul_f32s(kappa, predicted);
        s.mul_add_f32s(model_error, model_error, noise)
    }
}

/// 0, 1, 2, ...
const COUNT: Lanes = {
    let mut count = [0.0; LANES];
    let mut k = 1;
    while k < LANES {
        count[k] = k as f32;
        k += 1;
    }
    count
};
