use super::observation::Sheet;
use super::{Emitter, Prior};

/// A light whose pictures look like another light's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// The light as the capture session names it.
    pub light: usize,
    /// The light that it shines like.
    pub shines_like: usize,
}

/// How much better another light's place must explain the pictures. A ruler that is off by 30 mm changes the fit by less.
const CLEARLY: f64 = 2.5;

/// Lights that shine from where the rig has another one: swapped or mis-wired.
///
/// Per cell, every light's log signal about the mean over lights is compared with what each place of the rig predicts; the
/// mean does not change when wires are swapped. `priors`: in the order of the samples.
pub fn mismatches(sheets: &[Sheet], priors: &[Prior]) -> Vec<Mismatch> {
    let lights = priors.len();
    let mut sums = vec![[0.0f64; 3]; lights * lights];
    for sheet in sheets {
        for (c, cell) in sheet.cells.iter().enumerate() {
            let log = |k: usize| sheet.samples_of(c)[k].signal[1].ln();
            let measured: Vec<f64> = (0..lights).map(log).collect();
            let model = |prior: &Prior| {
                let emitter = Emitter { log_intensity: 0.0, ..prior.emitter.clone() };
                emitter.log_irradiance(&cell.point_mm, &sheet.plane.normal).unwrap_or(f64::NAN)
            };
            let predicted: Vec<f64> = priors.iter().map(model).collect();
            let mean = |values: &[f64]| values.iter().sum::<f64>() / lights as f64;
            let (of_measured, of_predicted) = (mean(&measured), mean(&predicted));
            if !(of_measured + of_predicted).is_finite() {
                continue;
            }
            for i in 0..lights {
                for j in 0..lights {
                    let off = (measured[i] - of_measured) - (predicted[j] - of_predicted);
                    let sum = &mut sums[i * lights + j];
                    *sum = [sum[0] + 1.0, sum[1] + off, sum[2] + off * off];
                }
            }
        }
    }
    // A light's strength is free: only the pattern counts.
    let spread = |[n, sum, square]: &[f64; 3]| (square / n - (sum / n).powi(2)).max(0.0).sqrt();
    let spreads: Vec<f64> = sums.iter().map(spread).collect();
    let best = |i: usize| {
        let row = &spreads[i * lights..(i + 1) * lights];
        (0..lights)
            .min_by(|a, b| row[*a].total_cmp(&row[*b]))
            .filter(|j| *j != i && row[i] > CLEARLY * row[*j])
    };
    (0..lights).filter_map(|light| Some(Mismatch { light, shines_like: best(light)? })).collect()
}
