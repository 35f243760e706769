//! Reweighted least squares with Cauchy's weights.

use super::photosite::{Photosite, median};
use nalgebra::Vector3;

/// Residuals of this many standard deviations count half: 95 % as good as least squares where noise is normal. Holland and
/// Welsch, "Robust regression using iteratively reweighted least-squares", 1977.
const TUNING: f64 = 2.385;
const REWEIGHTINGS: usize = 10;
/// A normal distribution's standard deviation over its median absolute value.
const DEVIATION_OF_MEDIAN: f64 = 1.4826;

/// Below this share of the photosite's median a sample counts as shadow; so many are kept at least.
const SHADOW_SHARE: f64 = 0.3;
const KEPT_AT_LEAST: usize = 5;

/// Cauchy's weights on all samples.
pub(super) fn cauchy(photosite: &Photosite) -> Option<Vector3<f64>> {
    let mut weights = vec![1.0; photosite.y.len()];
    let (mut g, _) = photosite.weighted(&weights)?;
    for _ in 0..REWEIGHTINGS {
        let residuals = photosite.residuals(&g);
        let scale = TUNING * deviation(photosite, &residuals);
        if scale <= 0.0 {
            break;
        }
        for (weight, residual) in weights.iter_mut().zip(&residuals) {
            *weight = 1.0 / (1.0 + (residual / scale).powi(2));
        }
        g = match photosite.weighted(&weights) {
            Some((next, _)) => next,
            None => break,
        };
    }
    Some(g)
}

/// The same after samples far below the photosite's median are taken for shadows: what open programs for picture sets do.
pub(super) fn shadow_test_then_cauchy(photosite: &Photosite) -> Option<Vector3<f64>> {
    let least = SHADOW_SHARE * median(&photosite.y);
    let mut order: Vec<usize> = (0..photosite.y.len()).collect();
    order.sort_by(|&a, &b| photosite.y[b].total_cmp(&photosite.y[a]));
    let lit = order.iter().filter(|&&i| photosite.y[i] >= least).count();
    order.truncate(lit.max(KEPT_AT_LEAST));
    let kept = Photosite {
        lights: order.iter().map(|&i| photosite.lights[i]).collect(),
        y: order.iter().map(|&i| photosite.y[i]).collect(),
        variance: order.iter().map(|&i| photosite.variance[i]).collect(),
    };
    cauchy(&kept).or_else(|| cauchy(photosite))
}

/// Standard deviation from the median residual, the two least left out because three parameters were fitted; never less
/// than the noise.
fn deviation(photosite: &Photosite, residuals: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let spread = DEVIATION_OF_MEDIAN * median(&sizes[sizes.len().min(2)..]);
    spread.max(median(&photosite.variance).sqrt())
}
