//! The plain float64 solution of one photosite, by the book. Every fast path is tested against this one, and photosites
//! that float32 cannot carry are solved here.

use nalgebra::{Matrix3, Vector3};

use super::light_set::LightSet;
use super::method::{
    BEHIND_DEVIATIONS, BEHIND_LEVEL, CLEAR_DEVIATIONS, COPLANAR_CONDITION, FEWEST_KEPT,
    LIT_ABOVE_FLOOR, MAX_LIGHTS, MOST_LENGTHENING, Method, RELATIVE_FLOOR, REWEIGHTINGS,
    START_LEVEL, START_SAMPLES, WEIGHTED_CONDITION_SQUARED,
};
use super::row::{Outcome, RowInput, RowOutput, Support, VarianceModel};

/// One photosite solved, or why not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pixel {
    /// A surface was found.
    Fitted(Fit),
    /// Fewer than three usable samples.
    TooFewLights {
        /// Samples that could be used.
        usable: usize,
    },
    /// The usable lights lie in a plane through the photosite.
    CoplanarLights,
    /// No light comes back, or the fitted normal points away from the camera.
    NoSurface,
}

/// The surface at one photosite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Unit normal, rig frame.
    pub normal: Vector3<f64>,
    /// Albedo under the photosite's filter.
    pub albedo: f64,
    /// Expected RMS of the total angular error, radians.
    pub expected_error: f64,
    /// Root of the residual's mean square over the lights used, in units of y.
    pub residual: f64,
    /// What the subset test did.
    pub outcome: Outcome,
    /// Which samples it rests on.
    pub support: Support,
}

/// The samples of one photosite. All slices have one entry a light.
#[derive(Clone, Copy)]
pub struct Samples<'a> {
    /// Light vectors, rig frame, length = falloff.
    pub lights: &'a [Vector3<f64>],
    /// y, see [`RowInput::signal`]; NaN or infinite where unusable.
    pub y: &'a [f64],
    /// Variance of y.
    pub variance: &'a [VarianceModel],
    /// What the gain maps do to the noise, see [`RowInput::noise_scale`].
    pub noise_scale: f64,
}

/// Albedo times normal with the weights that it was solved with.
#[derive(Clone)]
pub(crate) struct Solution {
    pub(crate) g: Vector3<f64>,
    /// (sum w l l^T)^-1.
    pub(crate) inverse: Matrix3<f64>,
    pub(crate) weights: [f64; MAX_LIGHTS],
    /// The fit that albedo is taken from, where it is another one: g and its covariance.
    pub(crate) clear: Option<(Vector3<f64>, Matrix3<f64>)>,
    /// Lights whose samples the subset test dropped.
    pub(crate) dropped: LightSet,
}

impl Solution {
    fn support(&self) -> Support {
        let lights = self.weights.iter().enumerate();
        let kept = lights.filter(|(_, w)| **w > 0.0).map(|(i, _)| i).collect();
        Support { kept, dropped: self.dropped }
    }
}

/// Normal and albedo of one Lambertian photosite.
///
/// y_i = g . l_i + noise with g = albedo times normal. Weighted least squares by normal equations; the weights
/// 1 / var(y) are taken at the fitted value, never at the sample, which would bias dark albedo. Lights whose predicted
/// signal is not positive stand behind the surface and drop out.
///
/// Woodham, "Photometric method for determining surface orientation from multiple images", Optical Engineering 19(1),
/// 1980; Carroll and Ruppert, "Transformation and Weighting in Regression", 1988, for the reweighting.
pub fn solve_pixel(samples: &Samples, method: Method) -> Pixel {
    let usable = samples.usable();
    let count = usable.iter().filter(|&&u| u).count();
    if count < 3 {
        return Pixel::TooFewLights { usable: count };
    }
    let Some(start) = samples.solve(equal_weights(&usable)) else {
        return Pixel::CoplanarLights;
    };
    match method {
        Method::LeastSquares => {
            let lengthening = 0.0;
            samples.describe(&start, samples.sandwich(&start), lengthening, Outcome::Fitted)
        }
        Method::Weighted => {
            samples.describe_weighted(&samples.weighted(&usable, start), Outcome::Fitted)
        }
        Method::Robust => samples.solve_robustly(&usable, &samples.weighted(&usable, start)),
        Method::Auto => {
            let weighted = samples.weighted(&usable, start);
            if samples.fits(&weighted) && !samples.overlooks(&weighted, &usable) {
                samples.describe_weighted(&weighted, Outcome::Fitted)
            } else {
                samples.solve_robustly(&usable, &weighted)
            }
        }
    }
}

fn equal_weights(used: &[bool; MAX_LIGHTS]) -> [f64; MAX_LIGHTS] {
    used.map(|u| if u { 1.0 } else { 0.0 })
}

impl Samples<'_> {
    /// Lights whose sample and vector are finite.
    fn usable(&self) -> [bool; MAX_LIGHTS] {
        let mut usable = [false; MAX_LIGHTS];
        for ((usable, y), light) in usable.iter_mut().zip(self.y).zip(self.lights) {
            *usable = y.is_finite() && light.iter().all(|c| c.is_finite());
        }
        usable
    }

    /// argmin over g of sum w (y - g . l)^2; `None` where the lights that count lie in a plane.
    pub(crate) fn solve(&self, weights: [f64; MAX_LIGHTS]) -> Option<Solution> {
        let (mut normal_matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for ((l, &y), &w) in self.lights.iter().zip(self.y).zip(&weights) {
            if w > 0.0 {
                normal_matrix += w * l * l.transpose();
                right += w * y * l;
            }
        }
        let inverse = inverse_if_conditioned(&normal_matrix)?;
        Some(Solution {
            g: inverse * right,
            inverse,
            weights,
            clear: None,
            dropped: LightSet::NONE,
        })
    }

    /// Weighted solution; `plain` is the solution with every usable sample. Where all samples are there, noise explains the
    /// solution with all of them, and every light stands in front of the surface, that is it.
    fn weighted(&self, usable: &[bool; MAX_LIGHTS], plain: Solution) -> Solution {
        if let Some(solution) = self.weighted_with_all(usable, &plain) {
            return solution;
        }
        let mut solution = self.solve(equal_weights(&self.bright(usable))).unwrap_or(plain);
        for _ in 0..REWEIGHTINGS {
            let lit = self.weights_at(&solution.g, usable, true);
            solution = match self
                .solve(lit)
                .or_else(|| self.solve(self.weights_at(&solution.g, usable, false)))
            {
                Some(next) => next,
                None => break,
            };
        }
        self.settle_albedo(solution)
    }

    /// Takes albedo from the lights clear of the horizon, see [`CLEAR_DEVIATIONS`].
    pub(crate) fn settle_albedo(&self, solution: Solution) -> Solution {
        let is_clear = |i: usize| {
            let predicted = solution.g.dot(&self.lights[i]);
            let floor = variance(&self.variance[i], 0.0, self.noise_scale);
            predicted > 0.0 && predicted * predicted > CLEAR_DEVIATIONS.powi(2) * floor
        };
        let mut weights = solution.weights;
        let (mut left, mut squares) = (0, 0.0);
        for (i, light) in self.lights.iter().enumerate().filter(|&(i, _)| weights[i] > 0.0) {
            if is_clear(i) {
                left += 1;
                squares += weights[i] * light.norm_squared();
            }
        }
        (0..self.lights.len()).filter(|&i| !is_clear(i)).for_each(|i| weights[i] = 0.0);
        if weights == solution.weights || left < FEWEST_KEPT {
            return solution;
        }
        let carried = |clear: &Solution| {
            squares * clear.inverse.trace() < f64::from(WEIGHTED_CONDITION_SQUARED)
                && clear.g.norm() > 0.0
        };
        let clear = self.solve(weights).filter(carried).map(|clear| (clear.g, clear.inverse));
        Solution { clear, ..solution }
    }

    /// The subset test; where none of its solves succeeds, the weighted solution stands.
    fn solve_robustly(&self, usable: &[bool; MAX_LIGHTS], weighted: &Solution) -> Pixel {
        match self.robust(usable) {
            Some((solution, outcome)) => self.describe_weighted(&solution, outcome),
            None => self.describe_weighted(weighted, Outcome::Other),
        }
    }

    /// Whether a light that counts as behind the surface is clearly seen.
    fn overlooks(&self, solution: &Solution, usable: &[bool; MAX_LIGHTS]) -> bool {
        let least = START_LEVEL * self.level();
        self.y
            .iter()
            .enumerate()
            .any(|(i, &y)| usable[i] && solution.weights[i] == 0.0 && y > least)
    }

    fn describe_weighted(&self, solution: &Solution, outcome: Outcome) -> Pixel {
        self.describe(solution, solution.inverse, MOST_LENGTHENING, outcome)
    }

    /// Least variance that counts.
    pub(crate) fn least_variance(&self) -> f64 {
        (RELATIVE_FLOOR * self.level()).powi(2).max(f64::MIN_POSITIVE)
    }

    /// The weighted solution with every sample, reweighted once after the plain one.
    fn weighted_with_all(&self, usable: &[bool; MAX_LIGHTS], plain: &Solution) -> Option<Solution> {
        let n = self.y.len();
        let in_front = self.lights.iter().all(|l| plain.g.dot(l) > 0.0);
        if !in_front || !usable[..n].iter().all(|&usable| usable) {
            return None;
        }
        let solution = self.solve(self.weights_at(&plain.g, usable, false))?;
        self.fits(&solution).then_some(solution)
    }

    /// Samples for the plain start: those near the photosite's own level, or all where these are too few.
    fn bright(&self, usable: &[bool; MAX_LIGHTS]) -> [bool; MAX_LIGHTS] {
        let least = START_LEVEL * self.level();
        let mut bright = *usable;
        for (bright, &y) in bright.iter_mut().zip(self.y) {
            *bright &= y > least;
        }
        if bright.iter().filter(|&&b| b).count() < START_SAMPLES { *usable } else { bright }
    }

    /// 1 / var at the value that `g` predicts; zero for unusable samples and, if `lit_only`, for lights behind the surface.
    pub(crate) fn weights_at(
        &self,
        g: &Vector3<f64>,
        usable: &[bool; MAX_LIGHTS],
        lit_only: bool,
    ) -> [f64; MAX_LIGHTS] {
        let level = self.level();
        let least = self.least_variance();
        let mut weights = [0.0; MAX_LIGHTS];
        for (i, l) in self.lights.iter().enumerate().filter(|&(i, _)| usable[i]) {
            let predicted = g.dot(l);
            if !lit_only || self.is_lit(i, predicted, level) {
                weights[i] =
                    1.0 / variance(&self.variance[i], predicted, self.noise_scale).max(least);
            }
        }
        weights
    }

    /// Whether light `i` stands in front of the surface, see [`LIT_ABOVE_FLOOR`].
    fn is_lit(&self, i: usize, predicted: f64, level: f64) -> bool {
        let deviation = |at: f64| variance(&self.variance[i], at, self.noise_scale).sqrt();
        let arrives = self.y[i] > LIT_ABOVE_FLOOR * deviation(0.0);
        let behind = predicted + BEHIND_LEVEL * level < -BEHIND_DEVIATIONS * deviation(level);
        predicted > 0.0 || (arrives && !behind)
    }

    /// The brightest sample.
    fn level(&self) -> f64 {
        self.y.iter().filter(|y| y.is_finite()).fold(0.0, |level, y| level.max(y.abs()))
    }

    fn describe(
        &self,
        solution: &Solution,
        covariance: Matrix3<f64>,
        most_lengthening: f64,
        outcome: Outcome,
    ) -> Pixel {
        let length = solution.g.norm();
        if !(length > 0.0 && length.is_finite() && solution.g.z > 0.0) {
            return Pixel::NoSurface;
        }
        let normal = solution.g / length;
        let expected_error = relative_deviation(&solution.g, &covariance);
        let (g, covariance) = solution.clear.unwrap_or((solution.g, covariance));
        let lengthening = 0.5 * relative_deviation(&g, &covariance).powi(2);
        let albedo = g.norm() * (1.0 - lengthening.min(most_lengthening));
        let residual = self.residual(solution);
        Pixel::Fitted(Fit {
            normal,
            albedo,
            expected_error,
            residual,
            outcome,
            support: solution.support(),
        })
    }

    /// Covariance of a plain solution: P V P^T with P = (sum l l^T)^-1 [l]. Where w = 1 / var it is the inverse itself.
    fn sandwich(&self, solution: &Solution) -> Matrix3<f64> {
        let mut covariance = Matrix3::zeros();
        for (i, l) in self.lights.iter().enumerate().filter(|&(i, _)| solution.weights[i] > 0.0) {
            let column = solution.inverse * l;
            let noise = variance(&self.variance[i], solution.g.dot(l), self.noise_scale);
            covariance += noise * column * column.transpose();
        }
        covariance
    }

    fn residual(&self, solution: &Solution) -> f64 {
        let (mut squares, mut count) = (0.0, 0.0);
        for ((l, y), w) in self.lights.iter().zip(self.y).zip(&solution.weights) {
            if *w > 0.0 {
                squares += (y - solution.g.dot(l)).powi(2);
                count += 1.0;
            }
        }
        (squares / f64::max(count, 1.0)).sqrt()
    }
}

/// Standard deviation across a vector (both axes together) over its length.
fn relative_deviation(g: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    let normal = g.normalize();
    let across_normal = covariance.trace() - normal.dot(&(covariance * normal));
    across_normal.max(0.0).sqrt() / g.norm()
}

/// var(y) at a predicted value; terms that are not finite or negative count as zero.
pub(crate) fn variance(model: &VarianceModel, predicted: f64, noise_scale: f64) -> f64 {
    let term = |t: f32| if t.is_finite() { f64::from(t.max(0.0)) } else { 0.0 };
    let scale = if noise_scale.is_finite() && noise_scale > 0.0 { noise_scale } else { 1.0 };
    let predicted = predicted.max(0.0);
    term(model.shot) * scale * predicted
        + term(model.floor) * scale * scale
        + (term(model.kappa) * predicted).powi(2)
}

/// Inverse of a symmetric positive matrix; `None` where its condition (that of the light vectors squared) is too large.
pub(crate) fn inverse_if_conditioned(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let scale = matrix.trace();
    if !(scale > f64::MIN_POSITIVE && scale.is_finite()) {
        return None;
    }
    let inverse = inverse_by_factors(&(matrix / scale))?;
    let condition_squared = inverse.trace();
    (condition_squared < COPLANAR_CONDITION.powi(2)).then(|| inverse / scale)
}

/// Inverse of a symmetric positive matrix from its factors L D L^T; `None` where it is not positive.
fn inverse_by_factors(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let (l21, l31) = (m[(1, 0)] / m[(0, 0)], m[(2, 0)] / m[(0, 0)]);
    let d2 = m[(1, 1)] - l21 * m[(1, 0)];
    let l32 = (m[(2, 1)] - l21 * m[(2, 0)]) / d2;
    let d3 = m[(2, 2)] - l31 * m[(2, 0)] - l32 * l32 * d2;
    if !(m[(0, 0)] > 0.0 && d2 > 0.0 && d3 > 0.0) {
        return None;
    }
    let (r1, r2, r3) = (1.0 / m[(0, 0)], 1.0 / d2, 1.0 / d3);
    let m31 = l21 * l32 - l31;
    let (xy, xz, yz) = (-l21 * r2 - m31 * l32 * r3, m31 * r3, -l32 * r3);
    let (xx, yy) = (r1 + l21 * l21 * r2 + m31 * m31 * r3, r2 + l32 * l32 * r3);
    Some(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, r3))
}

/// Solves a row photosite by photosite, with the light vectors interpolated to each column. What the row's kernels are
/// measured against.
pub fn reference_row(input: &RowInput, output: &mut RowOutput, method: Method) {
    for column in 0..output.outcome.len() {
        let pixel = solve_column(input, column, method);
        output.write(column, &pixel);
    }
}

/// One photosite of a row.
pub(crate) fn solve_column(input: &RowInput, column: usize, method: Method) -> Pixel {
    let n = input.field.lights.min(MAX_LIGHTS);
    let mut lights = [Vector3::zeros(); MAX_LIGHTS];
    let mut y = [f64::NAN; MAX_LIGHTS];
    let mut variance = [VarianceModel::default(); MAX_LIGHTS];
    for i in 0..n {
        lights[i] = input.field.at(column, i);
        y[i] = f64::from(input.signal[i][column]);
        variance[i] = input.variance[i][column & 1];
    }
    let noise_scale = input.noise_scale.map_or(1.0, |scale| f64::from(scale[column]));
    let samples =
        Samples { lights: &lights[..n], y: &y[..n], variance: &variance[..n], noise_scale };
    solve_pixel(&samples, method)
}

impl RowOutput<'_> {
    /// Writes one photosite.
    pub(crate) fn write(&mut self, column: usize, pixel: &Pixel) {
        let fit = match pixel {
            Pixel::Fitted(fit) if fit.albedo as f32 > 0.0 => fit,
            Pixel::Fitted(_) => return self.clear(column, Outcome::NoSurface),
            Pixel::TooFewLights { .. } => return self.clear(column, Outcome::TooFewLights),
            Pixel::CoplanarLights => return self.clear(column, Outcome::CoplanarLights),
            Pixel::NoSurface => return self.clear(column, Outcome::NoSurface),
        };
        self.normal[column] = [fit.normal.x as f32, fit.normal.y as f32, fit.normal.z as f32];
        self.albedo[column] = fit.albedo.min(f64::from(f32::MAX)) as f32;
        self.expected_error_deg[column] =
            fit.expected_error.to_degrees().min(MOST_ERROR_DEG) as f32;
        self.residual[column] = fit.residual.min(f64::from(f32::MAX)) as f32;
        self.outcome[column] = fit.outcome;
        self.note(column, fit.support);
    }
}

/// An expected error beyond this says only that nothing is known.
pub(crate) const MOST_ERROR_DEG: f64 = 90.0;
