//! What the sensor's noise becomes in the units that the kernels fit: variance of the normalised signal.

use super::exposure::{Exposure, PhotographedLight, Photographs};
use super::reading::{GREY, Reading, intensity_of_places};
use crate::instrument::Noise;
use crate::photometry::VarianceModel;
use crate::raw::Layout;

/// Sensor noise in fractions of full scale: var(x) = shot x + floor + (kappa x)^2 at the sensitivity `iso`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LinearNoise {
    pub(crate) shot: f64,
    pub(crate) floor: f64,
    pub(crate) kappa: f64,
    /// The sensitivity at which this holds. Gain, and with it `shot`, grows in proportion.
    pub(crate) iso: f64,
}

/// The sensitivity at which `[noise]` states electrons per raw number.
const NOISE_ISO: f64 = 100.0;

impl LinearNoise {
    /// From the calibration's figures, for a sensor with `range` raw numbers from black to saturation.
    pub(crate) fn from_electrons(noise: &Noise, range: f64) -> Self {
        let full_scale_e = noise.electrons_per_dn * range;
        let read_e2 = noise.read_noise_e.powi(2) + noise.electrons_per_dn.powi(2) / 12.0;
        Self {
            shot: 1.0 / full_scale_e,
            floor: read_e2 / full_scale_e.powi(2),
            kappa: noise.kappa,
            iso: NOISE_ISO,
        }
    }

    /// The same sensor at another sensitivity.
    fn at_iso(self, iso: f64) -> Self {
        let gain = iso / self.iso;
        Self { shot: self.shot * gain, floor: self.floor * gain * gain, iso, ..self }
    }
}

/// What the ambient frames leave behind when they are subtracted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AmbientNoise {
    /// Mean ambient light, fraction of full scale per second at ISO 100.
    pub(crate) rate: f64,
    /// Variance of the measured rate.
    pub(crate) variance: f64,
}

impl AmbientNoise {
    /// Of all ambient frames together, whose mean light is known.
    pub(crate) fn new(ambient: &[Exposure], rate: f64, noise: LinearNoise) -> Self {
        let seconds: f64 = ambient.iter().map(Exposure::seconds_at_iso_100).sum();
        let variance = |exposure: &Exposure| {
            let noise = noise.at_iso(exposure.iso);
            noise.floor + noise.shot * (rate * exposure.seconds_at_iso_100()).max(0.0)
        };
        match seconds > 0.0 {
            true => {
                Self { rate, variance: ambient.iter().map(variance).sum::<f64>() / seconds.powi(2) }
            }
            false => Self::default(),
        }
    }
}

/// Variance of the normalised signal of one exposure of a light with intensity `intensity`, ambient light subtracted.
fn exposure_variance(
    noise: LinearNoise,
    ambient: AmbientNoise,
    exposure: &Exposure,
    intensity: f64,
) -> VarianceModel {
    let noise = noise.at_iso(exposure.iso);
    let seconds = exposure.seconds_at_iso_100();
    let full_signal = seconds * intensity;
    let floor = noise.floor
        + noise.shot * (ambient.rate * seconds).max(0.0)
        + ambient.variance * seconds.powi(2);
    VarianceModel {
        shot: (noise.shot / full_signal) as f32,
        floor: (floor / full_signal.powi(2)) as f32,
        kappa: noise.kappa as f32,
    }
}

/// Variance of a weighted mean of independent exposures. The error of the light model (kappa) is the same in all.
fn merged_variance(parts: &[(f64, VarianceModel)]) -> VarianceModel {
    let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
    let mean = |part: fn(&VarianceModel) -> f32| {
        let sum: f64 =
            parts.iter().map(|(weight, variance)| weight.powi(2) * f64::from(part(variance))).sum();
        (sum / total.powi(2)) as f32
    };
    VarianceModel {
        shot: mean(|v| v.shot),
        floor: mean(|v| v.floor),
        kappa: parts.first().map_or(0.0, |(_, v)| v.kappa),
    }
}

/// Variance at even and odd columns of a row, of the mean of those exposures whose bit is set.
pub(crate) fn variance_of_row(
    exposures: &[[VarianceModel; 4]],
    weights: &[f64],
    row_parity: usize,
    used: u64,
) -> [VarianceModel; 2] {
    [0, 1].map(|column| {
        let parts: Vec<(f64, VarianceModel)> = exposures
            .iter()
            .zip(weights)
            .enumerate()
            .filter(|(bit, _)| used >> (*bit).min(63) & 1 == 1)
            .map(|(_, (places, &weight))| (weight, places[row_parity * 2 + column]))
            .collect();
        merged_variance(&parts)
    })
}

/// Variance of every exposure of every light, per place of the 2 x 2 cell.
pub(crate) fn exposure_variances(
    of: &Photographs,
    noise: LinearNoise,
    ambient: AmbientNoise,
) -> Vec<Vec<[VarianceModel; 4]>> {
    let of_exposure = |exposure: &Exposure, intensity: [f64; 3]| match of.layout {
        Layout::Rgb => {
            [grey_variance(intensity.map(|i| exposure_variance(noise, ambient, exposure, i))); 4]
        }
        layout => intensity_of_places(layout, 0, intensity)
            .map(|i| exposure_variance(noise, ambient, exposure, i)),
    };
    let of_light = |light: &PhotographedLight| {
        let intensity = light.calibrated.light.intensity();
        light.exposures.iter().map(|exposure| of_exposure(exposure, intensity)).collect()
    };
    of.lights.iter().map(of_light).collect()
}

/// Variance of the grey value of a colour pixel, for a grey surface.
fn grey_variance(channels: [VarianceModel; 3]) -> VarianceModel {
    let sum = |part: fn(&VarianceModel) -> f32| {
        channels.iter().zip(GREY).map(|(v, w)| w * w * part(v)).sum()
    };
    VarianceModel { shot: sum(|v| v.shot), floor: sum(|v| v.floor), kappa: channels[1].kappa }
}

/// Full scale of the sensor in raw numbers: the mean over the 2 x 2 cell, and the largest of all frames.
pub(crate) fn full_scale(of: &Photographs) -> f64 {
    let of_frame = |exposure: &Exposure| {
        let range = Reading::new(&exposure.frame, of.color).range();
        range.iter().map(|&range| f64::from(range)).sum::<f64>() / 4.0
    };
    let lit = of.lights.iter().flat_map(|light| &light.exposures);
    let largest = lit.map(of_frame).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}
