//! Sparse Bayesian regression: every sample may have an error of its own, of a variance that is learned.
//!
//! y = L g + e + noise with e_i ~ N(0, gamma_i), noise ~ N(0, lambda_i), and nothing known of g beforehand. Expectation:
//! with W = diag 1 / (gamma + lambda), g = (L^T W L)^-1 L^T W y and r = y - L g,
//!
//!   mean e_i = gamma_i w_i r_i,    var e_i = gamma_i - gamma_i^2 (w_i - w_i^2 l_i^T (L^T W L)^-1 l_i);
//!
//! maximisation: gamma_i = (mean e_i)^2 + var e_i. Ikehata, Wipf, Matsushita and Aizawa, "Robust Photometric Stereo using
//! Sparse Regression", CVPR 2012, with the normal's prior made infinitely wide and lambda the sensor's noise.

use super::photosite::Photosite;
use nalgebra::Vector3;

const ITERATIONS: usize = 60;
/// Least noise relative to the brightest sample, so that no weight is infinite.
const LEAST_NOISE: f64 = 1e-5;

/// The g that leaves the fewest samples with an error of their own.
pub(super) fn sparse_bayesian(photosite: &Photosite) -> Option<Vector3<f64>> {
    let level = photosite.y.iter().fold(0.0, |level: f64, y| level.max(y.abs()));
    let floor = (LEAST_NOISE * level).powi(2).max(f64::MIN_POSITIVE);
    let lambda: Vec<f64> = photosite.variance.iter().map(|v| v.max(floor)).collect();
    let mut gamma = vec![level * level; photosite.y.len()];
    let mut g = Vector3::zeros();
    for _ in 0..ITERATIONS {
        let weights: Vec<f64> =
            gamma.iter().zip(&lambda).map(|(gamma, lambda)| 1.0 / (gamma + lambda)).collect();
        let (next, inverse) = photosite.weighted(&weights)?;
        g = next;
        for (i, residual) in photosite.residuals(&g).into_iter().enumerate() {
            let (l, w) = (&photosite.lights[i], weights[i]);
            let mean = gamma[i] * w * residual;
            let information = w - w * w * l.dot(&(inverse * l));
            gamma[i] = mean * mean + gamma[i] * (1.0 - gamma[i] * information);
        }
    }
    Some(g)
}
