//! Sums of products for the regression of log albedo on features, in float32 over short runs and float64 over all.

use super::features::FEATURES;
use multiversion::multiversion;
use nalgebra::{SMatrix, SVector};

/// The features and their squares.
pub(super) const TERMS: usize = 2 * FEATURES;
/// One, the terms, and what they are to explain.
const COLUMNS: usize = TERMS + 2;
const RUN: usize = 256;
const LANES: usize = 16;

/// Coefficients of the terms.
pub(super) type Coefficients = SVector<f64, TERMS>;

/// Some photosites of one channel.
#[derive(Clone, Default)]
pub(super) struct Samples {
    pub(super) features: [Vec<f32>; FEATURES],
    /// Log albedo.
    pub(super) y: Vec<f32>,
    pub(super) weight: Vec<f32>,
}

impl Samples {
    pub(super) fn len(&self) -> usize {
        self.y.len()
    }

    /// What the terms say, without the constant, into `out`.
    pub(super) fn predict(&self, coefficients: &Coefficients, out: &mut Vec<f32>) {
        out.clear();
        out.resize(self.len(), 0.0);
        for (k, values) in self.features.iter().enumerate() {
            let once = coefficients[k] as f32;
            let squared = coefficients[FEATURES + k] as f32;
            for (out, value) in out.iter_mut().zip(values) {
                *out += value * (once + value * squared);
            }
        }
    }
}

/// Weighted sums of products of all pairs of columns.
#[derive(Clone)]
pub(super) struct Gram {
    sums: SMatrix<f64, COLUMNS, COLUMNS>,
}

impl Gram {
    pub(super) fn none() -> Self {
        Self { sums: SMatrix::zeros() }
    }

    pub(super) fn of(samples: &Samples) -> Self {
        let mut all = Self::none();
        for start in (0..samples.len()).step_by(RUN) {
            let end = (start + RUN).min(samples.len());
            let mut columns = [[0.0f32; RUN]; COLUMNS];
            let count = end - start;
            columns[0][..count].fill(1.0);
            for (k, values) in samples.features.iter().enumerate() {
                columns[1 + k][..count].copy_from_slice(&values[start..end]);
                let squares = columns[1 + FEATURES + k][..count].iter_mut();
                squares.zip(&values[start..end]).for_each(|(out, v)| *out = v * v);
            }
            columns[COLUMNS - 1][..count].copy_from_slice(&samples.y[start..end]);
            let mut weight = [0.0f32; RUN];
            weight[..count].copy_from_slice(&samples.weight[start..end]);
            add_run(&columns, &weight, &mut all.sums);
        }
        all
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.sums += other.sums;
    }

    /// Sum of the weights.
    pub(super) fn count(&self) -> f64 {
        self.sums[(0, 0)]
    }

    /// Mean of column `k`.
    fn mean(&self, k: usize) -> f64 {
        self.sums[(0, k)] / self.count()
    }

    /// What a fit with these coefficients adds to the terms.
    pub(super) fn constant(&self, coefficients: &Coefficients) -> f64 {
        let terms: f64 = (0..TERMS).map(|k| coefficients[k] * self.mean(k + 1)).sum();
        self.mean(COLUMNS - 1) - terms
    }

    fn covariance_of(&self, j: usize, k: usize) -> f64 {
        self.sums[(j, k)] / self.count() - self.mean(j) * self.mean(k)
    }

    /// Standard deviation of y.
    pub(super) fn deviation(&self) -> f64 {
        self.covariance_of(COLUMNS - 1, COLUMNS - 1).max(0.0).sqrt()
    }

    /// Between the terms.
    pub(super) fn covariance(&self) -> SMatrix<f64, TERMS, TERMS> {
        SMatrix::from_fn(|j, k| self.covariance_of(j.min(k) + 1, j.max(k) + 1))
    }

    /// Ridge regression of y: `ridge` is a share of each term's own variance. `None` where that has no answer.
    pub(super) fn fit(&self, ridge: f64) -> Option<Coefficients> {
        if self.count() < 4.0 * TERMS as f64 {
            return None;
        }
        let covariance = self.covariance();
        let spread: Coefficients =
            covariance.diagonal().map(|variance| variance.max(0.0).sqrt() + 1e-9);
        let scaled = SMatrix::<f64, TERMS, TERMS>::from_fn(|j, k| {
            let own = if j == k { ridge } else { 0.0 };
            covariance[(j, k)] / (spread[j] * spread[k]) + own
        });
        let right =
            Coefficients::from_fn(|k, _| self.covariance_of(k + 1, COLUMNS - 1) / spread[k]);
        let found = scaled.cholesky()?.solve(&right).component_div(&spread);
        found.iter().all(|c| c.is_finite()).then_some(found)
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add_run(
    columns: &[[f32; RUN]; COLUMNS],
    weight: &[f32; RUN],
    sums: &mut SMatrix<f64, COLUMNS, COLUMNS>,
) {
    for j in 0..COLUMNS {
        let mut weighted = [0.0f32; RUN];
        for k in 0..RUN {
            weighted[k] = columns[j][k] * weight[k];
        }
        for (k, column) in columns.iter().enumerate().skip(j) {
            let mut lanes = [0.0f32; LANES];
            for run in 0..RUN / LANES {
                for lane in 0..LANES {
                    lanes[lane] += weighted[run * LANES + lane] * column[run * LANES + lane];
                }
            }
            for half in [8, 4, 2, 1] {
                for lane in 0..half {
                    lanes[lane] += lanes[lane + half];
                }
            }
            sums[(j, k)] += f64::from(lanes[0]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples with features that differ in scale, and y a known mixture of them.
    fn known(count: usize, coefficients: &Coefficients, outliers: usize) -> Samples {
        let mut state = 7u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f32 / 16_777_216.0
        };
        let mut samples = Samples::default();
        for k in 0..count {
            let f: [f32; FEATURES] = std::array::from_fn(|k| random() * (1.0 + k as f32));
            let y: f64 = (0..FEATURES)
                .map(|k| {
                    let f = f64::from(f[k]);
                    coefficients[k] * f + coefficients[FEATURES + k] * f * f
                })
                .sum();
            samples.features.iter_mut().zip(f).for_each(|(all, f)| all.push(f));
            samples.y.push(y as f32 - 1.0 + if k < outliers { 3.0 } else { 0.0 });
            samples.weight.push(if k < outliers { 0.0 } else { 1.0 });
        }
        samples
    }

    #[test]
    fn a_known_mixture_is_found_and_weights_count() {
        let wanted = Coefficients::from_fn(|k, _| 0.1 * (k as f64 - 9.0) / (1.0 + k as f64));
        let samples = known(5000, &wanted, 800);
        let found = Gram::of(&samples).fit(1e-9).unwrap();
        assert!((found - wanted).amax() < 2e-3, "{found}");
        let mut predicted = Vec::new();
        samples.predict(&found, &mut predicted);
        let off = predicted.iter().zip(&samples.y).skip(800).map(|(p, y)| (p - y - 1.0).abs());
        assert!(off.fold(0.0, f32::max) < 1e-3);
    }

    #[test]
    fn sums_agree_with_float64() {
        let samples = known(1000, &Coefficients::repeat(0.05), 0);
        let gram = Gram::of(&samples);
        for k in 0..FEATURES {
            let column = samples.features[k].iter().map(|v| f64::from(*v));
            let mean = column.clone().sum::<f64>() / 1000.0;
            let variance = column.map(|v| (v - mean).powi(2)).sum::<f64>() / 1000.0;
            assert!((gram.covariance()[(k, k)] / variance - 1.0).abs() < 1e-4, "{k}");
        }
        assert_eq!(gram.count(), 1000.0);
    }

    #[test]
    fn too_few_samples_have_no_fit() {
        assert!(Gram::of(&known(50, &Coefficients::zeros(), 0)).fit(1e-3).is_none());
        assert!(Gram::none().fit(1e-3).is_none());
    }
}
