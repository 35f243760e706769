//! The sensor's noise from the pictures themselves, where the calibration does not state it.

use super::bands::variance_of_row;
use super::field::{FieldRows, LightField};
use super::noise::{AmbientNoise, LinearNoise, exposure_variances};
use super::scene::Scene;
use super::signal::{Normalizer, SignalRows};
use crate::photometry::{FieldRow, RowInput, VarianceModel, estimate_noise};
use std::ops::Range;

/// Rows asked, spread over the frame.
const ROWS: usize = 32;
/// Columns of each: pieces whose place wanders from row to row.
const COLUMNS: usize = 512;

/// One row's worth of what the estimate reads.
struct Sample {
    signals: Vec<Vec<f32>>,
    vectors: Vec<[f64; 3]>,
    row_parity: usize,
}

/// Shot noise, floor and kappa in fractions of full scale; `None` where the pictures do not tell (three lights, too few
/// photosites).
pub(crate) fn noise_of_residuals(scene: &Scene, field: &LightField) -> Option<LinearNoise> {
    let iso = scene.exposures().next()?.iso;
    // One unit of each term: the estimate says how many there are.
    let unit = LinearNoise { shot: 1.0, floor: 1.0, kappa: 1.0, iso };
    let units = exposure_variances(scene, unit, AmbientNoise::default());
    let equal: Vec<Vec<f64>> =
        scene.lights.iter().map(|light| vec![1.0; light.exposures.len()]).collect();
    let variance: [Vec<[VarianceModel; 2]>; 2] = [0, 1].map(|parity| {
        units
            .iter()
            .zip(&equal)
            .map(|(of, weights)| variance_of_row(of, weights, parity, u64::MAX))
            .collect()
    });
    let samples = samples(scene, field, &Normalizer::new(scene, &equal));
    let signals: Vec<Vec<&[f32]>> =
        samples.iter().map(|sample| sample.signals.iter().map(Vec::as_slice).collect()).collect();
    let rows: Vec<RowInput> = samples
        .iter()
        .zip(&signals)
        .map(|(sample, signal)| RowInput {
            signal,
            field: FieldRow {
                step: field.step(),
                vectors: &sample.vectors,
                lights: scene.lights.len(),
            },
            variance: &variance[sample.row_parity],
            noise_scale: None,
        })
        .collect();
    let found = estimate_noise(&rows)?;
    let (shot, floor) = (f64::from(found.shot), f64::from(found.floor));
    Some(LinearNoise { shot, floor, kappa: f64::from(found.kappa), iso })
}

fn samples(scene: &Scene, field: &LightField, normalizer: &Normalizer) -> Vec<Sample> {
    let mut rows = SignalRows::default();
    let mut field_rows = FieldRows::new(field);
    let count = ROWS.min(scene.height);
    (0..count)
        .map(|k| {
            let y = (2 * k + 1) * scene.height / (2 * count);
            let columns = columns(scene.width, k, field.step());
            normalizer.row(y, columns.clone(), &mut rows);
            if let Some(mask) = &scene.mask {
                rows.blank(&mask.row(y)[columns.clone()]);
            }
            let nodes = (columns.len() - 1).div_ceil(field.step()) + 1;
            let vectors =
                field_rows.row(y, columns.start).vectors[..nodes * scene.lights.len()].to_vec();
            Sample { signals: rows.signals().to_vec(), vectors, row_parity: y & 1 }
        })
        .collect()
}

/// The piece of row `k`: from a node of the light field at an even column on.
fn columns(width: usize, k: usize, step: usize) -> Range<usize> {
    let room = width.saturating_sub(COLUMNS);
    let align = step.max(2);
    // The golden section spreads the pieces evenly, however many there are.
    let start = (room as f64 * (k as f64 * 0.618_034).fract()) as usize / align * align;
    start..(start + COLUMNS).min(width)
}
