//! The noise model where the calibration has none: from the residuals of plain least squares.
//!
//! A residual is sensor noise, or light that the model does not describe (gloss, shadow, bounce, errors of the light
//! field). Noise is independent from photosite to photosite; what the model leaves over is shared by neighbours. So shot
//! noise and floor come from the difference between the residual of a photosite and those of its four neighbours of the
//! same colour, and kappa from what the residual itself has beyond them. Medians and lower quartiles make both blind to the
//! places where the model fails badly, which are for the subset test.
//!
//! Nothing here depends on the order of photosites, lights or neighbours, but for the rounding of sums over lights.

use nalgebra::{Matrix3, Vector3};

use super::reference::inverse_if_conditioned;
use super::row::VarianceModel;

/// A light field and a surface that differ from the model by more than this differ in a way that is no noise: the subset
/// test is to see it. (On the DiLiGenT objects, where residuals of 5 to 10 % are usual, weights and subset test do best
/// with about this value.)
const MOST_KAPPA: f64 = 0.02;

/// Photosites are grouped by brightness, so that shot noise and floor can be told apart.
const GROUPS: usize = 12;

/// Fewest photosites from which noise is estimated.
const FEWEST_PHOTOSITES: usize = 20 * GROUPS;

/// Variance of four times a sample less its four neighbours, relative to that of one sample.
const DIFFERENCE_VARIANCE: f64 = 20.0;

/// One photosite and its four nearest neighbours of the same colour, under every light.
pub struct NoiseSample<'a> {
    /// Light vectors, as the kernels read them; at the neighbours they differ by too little to matter, and by opposite
    /// amounts.
    pub vectors: &'a [Vector3<f64>],
    /// Normalised signal of the photosite. Not a number where unusable.
    pub signal: &'a [f64],
    /// Four times that, less the signals of the neighbours.
    pub difference: &'a [f64],
    /// Per light: what *one unit* of each term is in the normalised signal (for frames alike in exposure and light: 1, 1, 1).
    pub variance: &'a [VarianceModel],
    /// What the lights' gain maps together do to the noise, 1 without them: [`RowInput::noise_scale`](super::RowInput).
    pub noise_scale: f64,
}

/// What one photosite says: squared residuals, and what each unit of noise would contribute to their sum.
#[derive(Clone, Copy, Debug)]
pub struct NoiseEvidence {
    brightness: f64,
    /// Sum over lights of the squared difference of the residual, in units of the variance of one residual.
    difference: f64,
    /// Sum over lights of the squared residual.
    total: f64,
    /// Expected sum of squares per unit of shot, floor and kappa^2.
    unit: [f64; 3],
}

impl NoiseEvidence {
    /// `None` where the photosite says nothing: a sample is unusable, its lights do not span space, or there are fewer than
    /// four.
    pub fn of(sample: &NoiseSample) -> Option<Self> {
        let vectors = sample.vectors;
        if vectors.len() < 4 {
            return None;
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let known = vectors.iter().all(|vector| finite(vector.as_slice()));
        if !(known && finite(sample.signal) && finite(sample.difference)) {
            return None;
        }
        let matrix: Matrix3<f64> = vectors.iter().map(|l| l * l.transpose()).sum();
        let inverse = inverse_if_conditioned(&matrix)?;
        let fit = |values: &[f64]| -> Vector3<f64> {
            inverse * vectors.iter().zip(values).map(|(l, y)| l * *y).sum::<Vector3<f64>>()
        };
        // The residual of a difference is the difference of the residuals.
        let (surface, change) = (fit(sample.signal), fit(sample.difference));
        let scale = sample.noise_scale;
        let mut found = Self { brightness: 0.0, difference: 0.0, total: 0.0, unit: [0.0; 3] };
        for (i, l) in vectors.iter().enumerate() {
            let (predicted, model) = (surface.dot(l), sample.variance[i]);
            let lit = predicted.max(0.0);
            // The share of a sample's variance that its residual shows.
            let shown = 1.0 - l.dot(&(inverse * l));
            found.brightness += lit;
            found.difference +=
                (sample.difference[i] - change.dot(l)).powi(2) / DIFFERENCE_VARIANCE;
            found.total += (sample.signal[i] - predicted).powi(2);
            found.unit[0] += shown * f64::from(model.shot) * scale * lit;
            found.unit[1] += shown * f64::from(model.floor) * scale * scale;
            found.unit[2] += shown * (f64::from(model.kappa) * lit).powi(2);
        }
        let finite = finite(&found.unit) && found.total.is_finite() && found.difference.is_finite();
        (finite && found.brightness > 0.0).then_some(found)
    }

    /// An order of its own, so that the order in which the photosites were visited does not matter.
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let key = |e: &Self| [e.brightness, e.difference, e.total, e.unit[0], e.unit[1], e.unit[2]];
        let pairs = key(self).into_iter().zip(key(other));
        pairs
            .map(|(a, b)| a.total_cmp(&b))
            .find(|order| order.is_ne())
            .unwrap_or(std::cmp::Ordering::Equal)
    }
}

/// Estimates the noise from what photosites under `lights` lights say: numbers of units of shot, floor and kappa.
///
/// `None` where they do not tell: three lights (no residual), or too few photosites.
pub fn estimate_noise(mut evidence: Vec<NoiseEvidence>, lights: usize) -> Option<VarianceModel> {
    if evidence.len() < FEWEST_PHOTOSITES || lights < 4 {
        return None;
    }
    evidence.sort_by(NoiseEvidence::order);
    let freedom = (lights - 3) as f64;
    let groups: Vec<Group> =
        evidence.chunks(evidence.len().div_ceil(GROUPS)).map(|g| Group::new(g, freedom)).collect();
    let [shot, floor] = non_negative_fit(&groups);
    let kappa = kappa(&groups, shot, floor);
    Some(VarianceModel { shot: shot as f32, floor: floor as f32, kappa: kappa as f32 })
}

/// A group of about equal brightness.
struct Group {
    unit: [f64; 3],
    difference: f64,
    total: f64,
}

impl Group {
    fn new(evidence: &[NoiseEvidence], freedom: f64) -> Self {
        let mean =
            |i: usize| evidence.iter().map(|e| e.unit[i]).sum::<f64>() / evidence.len() as f64;
        let quantile = |share: f64, value: fn(&NoiseEvidence) -> f64| {
            let mut values: Vec<f64> = evidence.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            let expected = chi_square_quantile_over_mean(share, freedom);
            values[(share * (values.len() - 1) as f64) as usize] / expected
        };
        Self {
            unit: [mean(0), mean(1), mean(2)],
            difference: quantile(0.5, |e| e.difference),
            total: quantile(0.25, |e| e.total),
        }
    }
}

/// Quantile of chi-square over its degrees of freedom, by Wilson and Hilferty's cube root, for the two quantiles in use.
fn chi_square_quantile_over_mean(share: f64, freedom: f64) -> f64 {
    let deviate = if share < 0.4 { -0.674_49 } else { 0.0 };
    let spread = 2.0 / (9.0 * freedom);
    (1.0 - spread + deviate * spread.sqrt()).powi(3)
}

/// Shot and floor, neither negative, that explain the differences with least relative error.
fn non_negative_fit(groups: &[Group]) -> [f64; 2] {
    let (mut aa, mut ab, mut bb, mut a, mut b) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for group in groups.iter().filter(|g| g.difference > 0.0) {
        let (shot, floor) = (group.unit[0] / group.difference, group.unit[1] / group.difference);
        aa += shot * shot;
        ab += shot * floor;
        bb += floor * floor;
        a += shot;
        b += floor;
    }
    let alone = |sum: f64, squares: f64| if squares > 0.0 { sum / squares } else { 0.0 };
    let determinant = aa * bb - ab * ab;
    let (shot, floor) = ((a * bb - b * ab) / determinant, (b * aa - a * ab) / determinant);
    if determinant > 1e-9 * aa * bb && shot >= 0.0 && floor >= 0.0 {
        return [shot, floor];
    }
    // The better of the two single terms: what it leaves is the number of groups minus sum^2 / squares.
    if a * a * bb >= b * b * aa { [alone(a, aa), 0.0] } else { [0.0, alone(b, bb)] }
}

/// The median over the groups of what the residual has beyond shot noise and floor.
fn kappa(groups: &[Group], shot: f64, floor: f64) -> f64 {
    let excess = |g: &Group| (g.total - shot * g.unit[0] - floor * g.unit[1]) / g.unit[2];
    let mut squares: Vec<f64> = groups.iter().map(excess).filter(|e| e.is_finite()).collect();
    squares.sort_by(f64::total_cmp);
    let middle = squares.get(squares.len() / 2).copied().unwrap_or(0.0);
    middle.max(0.0).sqrt().min(MOST_KAPPA)
}
