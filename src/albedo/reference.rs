//! The way of one window from a mosaic of one dye to its colours, by its definitions, in float64 and without tables.

use super::Input;
use nalgebra::{DMatrix, DVector};
use weavelight_calibration::description::Image;

const FEATURES: usize = 10;
const SHARES: [f64; 9] = [0.02, 0.06, 0.15, 0.3, 0.5, 0.7, 0.85, 0.94, 0.98];

pub(super) struct Reference {
    pub(super) reflectance: Image<[f64; 3]>,
    pub(super) shade: Image<f64>,
}

/// Of a picture that is one window, solved everywhere, without outliers, prints and flat parts.
pub(super) fn colours(input: &Input) -> Reference {
    let (width, height) = (input.mosaic.width, input.mosaic.height);
    let image = |data| Image { width, height, data };
    let channel = |k: usize| input.cfa.channel(k % width, k / width) as usize;
    let features: Vec<([f64; FEATURES], f64)> =
        (0..width * height).map(|k| features(input.normal, k % width, k / width)).collect();
    let logs: Vec<f64> = input.mosaic.data.iter().map(|value| f64::from(*value).ln()).collect();
    let fits = [0, 1, 2].map(|c| {
        let sites: Vec<usize> = (0..width * height).filter(|k| channel(*k) == c).collect();
        let terms = sites.iter().map(|k| terms(&features[*k].0)).collect::<Vec<_>>();
        robust_fit(&terms, &sites.iter().map(|k| logs[*k]).collect::<Vec<_>>())
    });
    let mean = (&fits[0] + &fits[1] + &fits[2]) / 3.0;
    let predicted: Vec<f64> =
        features.iter().map(|(values, _)| mean.dot(&DVector::from_vec(terms(values)))).collect();
    let crowns = quantile(&predicted, 0.9);
    let pairs = predicted.iter().zip(&features);
    let shade: Vec<f64> =
        pairs.map(|(p, (_, rough))| (p - crowns).min(0.0).max(-4.0 * rough.max(0.0))).collect();
    let unshaded: Vec<f64> = logs.iter().zip(&shade).map(|(log, shade)| log - shade).collect();
    let knots = knots(&unshaded, &channel);
    let colour = |k: usize| {
        let from = channel(k);
        [0, 1, 2].map(|to| match to == from {
            true => unshaded[k].exp(),
            false => along(&knots[from], &knots[to], unshaded[k]).exp(),
        })
    };
    Reference {
        reflectance: Image { width, height, data: (0..width * height).map(colour).collect() },
        shade: image(shade.iter().map(|shade| shade.exp()).collect()),
    }
}

/// The features of a place, by their definitions, and the roughness; beyond the border the border's normals go on.
fn features(normal: &Image<[f32; 3]>, x: usize, y: usize) -> ([f64; FEATURES], f64) {
    let n = |u: isize, v: isize| {
        let at = |k: usize, d: isize, length: usize| {
            (k as isize + d).clamp(0, length as isize - 1) as usize
        };
        let place = (at(x, u, normal.width), at(y, v, normal.height));
        let [a, b, c] = normal.at(place.0, place.1).map(f64::from);
        [a, -b, c]
    };
    let slope = |u, v, axis: usize| -(n(u, v)[axis] / n(u, v)[2].max(0.15)).clamp(-4.0, 4.0);
    let own = n(0, 0);
    let mut f = [0.0; FEATURES];
    f[0] = 1.0 - own[2];
    let mut convexity = 0.0;
    for (u, v) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
        let there = n(u, v);
        f[1] += (0..3).map(|c| (there[c] - own[c]).powi(2)).sum::<f64>();
        let axis = usize::from(u == 0);
        let bend = (there[axis] - own[axis]) * (u + v) as f64;
        convexity += 0.5 * bend;
        f[4] += bend.min(0.0).powi(2);
        f[5] += bend.max(0.0).powi(2);
        let rise = |k: isize| {
            let ends = slope(k * u, k * v, axis) + slope((k + 1) * u, (k + 1) * v, axis);
            0.5 * ends * (u + v) as f64
        };
        f[7] += rise(0) / 4.0;
        f[8] += 0.5 * (rise(0) + rise(1)) / 4.0;
        f[9] += (0.5 * (rise(0) + rise(1))).max(0.0) / 4.0;
    }
    f[2] = convexity.max(0.0);
    f[3] = (-convexity).max(0.0);
    let spread = |reach: isize| {
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for (v, u) in (-reach..=reach).flat_map(|v| (-reach..=reach).map(move |u| (v, u))) {
            let weight = ((reach + 1 - u.abs()) * (reach + 1 - v.abs())) as f64;
            (0..3).for_each(|c| sum[c] += weight * n(u, v)[c]);
            total += weight;
        }
        1.0 - sum.iter().map(|c| (c / total).powi(2)).sum::<f64>().sqrt()
    };
    f[6] = spread(1);
    (f, spread(3))
}

/// The features and their squares.
fn terms(features: &[f64; FEATURES]) -> Vec<f64> {
    features.iter().copied().chain(features.iter().map(|f| f * f)).collect()
}

/// Ridge regression, three times, residuals beyond twice their spread counting less each time (Huber).
fn robust_fit(terms: &[Vec<f64>], y: &[f64]) -> DVector<f64> {
    let mut weights = vec![1.0; y.len()];
    let mut found = ridge(terms, y, &weights);
    for _ in 1..3 {
        let off: Vec<f64> = terms
            .iter()
            .zip(y)
            .map(|(terms, y)| y - found.dot(&DVector::from_column_slice(terms)))
            .collect();
        let middle = quantile(&off, 0.5);
        let apart: Vec<f64> = off.iter().map(|off| (off - middle).abs()).collect();
        let limit = 2.0 * 1.48 * quantile(&apart, 0.5);
        weights = apart.iter().map(|off| 1.0 / (off / limit).max(1.0)).collect();
        found = ridge(terms, y, &weights);
    }
    found
}

fn ridge(terms: &[Vec<f64>], y: &[f64], weights: &[f64]) -> DVector<f64> {
    let count = terms[0].len();
    let total: f64 = weights.iter().sum();
    let mean = |value: &dyn Fn(usize) -> f64| {
        (0..y.len()).map(|k| weights[k] * value(k)).sum::<f64>() / total
    };
    let means: Vec<f64> = (0..count).map(|j| mean(&|k| terms[k][j])).collect();
    let mean_y = mean(&|k| y[k]);
    let mut covariance = DMatrix::zeros(count, count);
    let mut right = DVector::zeros(count);
    for k in 0..y.len() {
        let off = DVector::from_fn(count, |j, _| terms[k][j] - means[j]);
        covariance.ger(weights[k] / total, &off, &off, 1.0);
        right.axpy(weights[k] / total * (y[k] - mean_y), &off, 1.0);
    }
    let spread = covariance.diagonal().map(|variance: f64| variance.sqrt());
    let scaled = DMatrix::from_fn(count, count, |i, j| {
        covariance[(i, j)] / (spread[i] * spread[j]) + if i == j { 1e-3 } else { 0.0 }
    });
    let right = right.component_div(&spread);
    scaled.cholesky().unwrap().solve(&right).component_div(&spread)
}

/// Of each channel; as parallel as chance alone can have made them differ.
fn knots(logs: &[f64], channel: &dyn Fn(usize) -> usize) -> [[f64; 9]; 3] {
    let of = |c: usize| -> Vec<f64> {
        (0..logs.len()).filter(|k| channel(*k) == c).map(|k| logs[k]).collect()
    };
    let all = [0, 1, 2].map(of);
    let knots = all.each_ref().map(|logs| SHARES.map(|share| quantile(logs, share)));
    let spread = (quantile(logs, 0.93) - quantile(logs, 0.07)) / 3.1;
    let chance = spread * spread / (all[0].len().min(all[2].len()) as f64 / 8.0);
    let mean: [f64; 9] = std::array::from_fn(|k| (0..3).map(|c| knots[c][k]).sum::<f64>() / 3.0);
    let apart = |c: usize, k: usize| knots[c][k] - mean[k];
    let offset = [0, 1, 2].map(|c| quantile(&(0..9).map(|k| apart(c, k)).collect::<Vec<_>>(), 0.5));
    let bend = |c: usize, k: usize| apart(c, k) - offset[c];
    let squares: f64 = (0..27).map(|j| bend(j / 9, j % 9).powi(2)).sum::<f64>() / 18.0;
    let kept = (1.0 - 2.0 * chance / squares).max(0.0);
    std::array::from_fn(|c| std::array::from_fn(|k| mean[k] + offset[c] + kept * bend(c, k)))
}

/// Where one curve is where the other is at `value`.
fn along(from: &[f64; 9], to: &[f64; 9], value: f64) -> f64 {
    let overall = ((to[8] - to[0]) / (from[8] - from[0])).clamp(1.0 / 3.0, 3.0);
    match value {
        v if v <= from[0] => to[0] + overall * (v - from[0]),
        v if v >= from[8] => to[8] + overall * (v - from[8]),
        v => {
            let k = (0..8).rfind(|k| from[*k] <= v).unwrap();
            to[k] + (to[k + 1] - to[k]) * (v - from[k]) / (from[k + 1] - from[k])
        }
    }
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
}
