//! One photosite as the estimators from the literature see it: the usable samples in float64, all of equal weight.

use crate::photometry::{Outcome, RowInput, RowOutput, inverse_if_conditioned, variance};
use nalgebra::{Matrix3, Vector3};

/// The usable samples of one photosite; all lists have one entry a light, brightness as in [`RowInput::signal`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Photosite {
    /// Light vectors, rig frame.
    pub(crate) lights: Vec<Vector3<f64>>,
    /// y.
    pub(crate) y: Vec<f64>,
    /// Variance of a sample as bright as the photosite's median, in units of y squared.
    pub(crate) variance: Vec<f64>,
}

/// Albedo times normal; `None` where the samples do not tell.
pub(crate) type Estimator = fn(&Photosite) -> Option<Vector3<f64>>;

impl Photosite {
    /// Fills this from a column of a row.
    fn take(&mut self, input: &RowInput, column: usize) {
        let usable: Vec<usize> =
            (0..input.field.lights).filter(|&i| input.signal[i][column].is_finite()).collect();
        let refill = |list: &mut Vec<f64>, value: &dyn Fn(usize) -> f64| {
            list.clear();
            list.extend(usable.iter().map(|&i| value(i)));
        };
        self.lights.clear();
        self.lights.extend(usable.iter().map(|&i| input.field.at(column, i)));
        refill(&mut self.y, &|i| f64::from(input.signal[i][column]));
        let middle = median(&self.y);
        let noise_scale = input.noise_scale.map_or(1.0, |scale| f64::from(scale[column]));
        refill(&mut self.variance, &|i| {
            variance(&input.variance[i][column & 1], middle, noise_scale)
        });
    }

    /// y - l . g of every light.
    pub(crate) fn residuals(&self, g: &Vector3<f64>) -> Vec<f64> {
        self.lights.iter().zip(&self.y).map(|(l, y)| y - l.dot(g)).collect()
    }

    /// argmin over g of sum w (y - l . g)^2, and (sum w l l^T)^-1; `None` where the lights lie in a plane.
    pub(crate) fn weighted(&self, weights: &[f64]) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for ((l, y), w) in self.lights.iter().zip(&self.y).zip(weights) {
            matrix += *w * l * l.transpose();
            right += *w * *y * l;
        }
        let inverse = inverse_if_conditioned(&matrix)?;
        Some((inverse * right, inverse))
    }
}

/// The middle value, the upper one of two; 0 of nothing.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    match values.len() {
        0 => 0.0,
        n => *values.select_nth_unstable_by(n / 2, f64::total_cmp).1,
    }
}

/// Solves a row photosite by photosite. A normal that points away from the camera counts as none, as everywhere.
pub(crate) fn solve_row(estimator: Estimator, input: &RowInput, output: &mut RowOutput) {
    let mut photosite = Photosite::default();
    for column in 0..output.outcome.len() {
        photosite.take(input, column);
        let g = if photosite.y.len() < 3 { None } else { estimator(&photosite) };
        let seen = g.filter(|g| g.z > 0.0 && g.norm().is_finite());
        output.normal[column] = seen.map_or([0.0; 3], |g| g.normalize().cast::<f32>().into());
        output.albedo[column] = seen.map_or(0.0, |g| g.norm() as f32);
        output.outcome[column] = seen.map_or(Outcome::NoSurface, |_| Outcome::Fitted);
    }
}
