//! Slow errors of several kinds: each differs from light to light, as whatever all lights share cancels.

use crate::rig::{Dice, Seen};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// A random cubic surface for each light and sheet.
    Cubic,
    /// A random plane or saddle for each light and sheet: as slow as errors come.
    Bilinear,
    /// Sine waves, about one across the frame, for each light and sheet.
    Waves,
    /// The same surface for a light on every sheet: its lobe, a flare, what vignetting leaves over.
    Fixed,
    /// Light that goes by way of the room.
    Stray,
    /// Paper that darkens towards grazing light and brightens towards the lamp's own direction.
    Paper,
    /// LEDs that change from sheet to sheet.
    Drift,
    /// A bit of everything.
    Mixed,
}

pub(crate) const KINDS: [Kind; 8] = [
    Kind::Cubic,
    Kind::Bilinear,
    Kind::Waves,
    Kind::Fixed,
    Kind::Stray,
    Kind::Paper,
    Kind::Drift,
    Kind::Mixed,
];

const PARTS: [Kind; 6] =
    [Kind::Cubic, Kind::Waves, Kind::Fixed, Kind::Stray, Kind::Paper, Kind::Drift];

pub(crate) struct SlowErrors {
    kind: Kind,
    lights: usize,
    seed: u64,
}

impl SlowErrors {
    pub(crate) fn new(kind: Kind, lights: usize, seed: u64) -> Self {
        Self { kind, lights, seed }
    }

    /// Whether the values are in units of the RMS as they are.
    pub(crate) fn keeps_mean(&self) -> bool {
        matches!(self.kind, Kind::Drift | Kind::Mixed)
    }

    pub(crate) fn at(&self, light: usize, sheet: usize, seen: &Seen) -> f64 {
        match self.kind {
            Kind::Mixed => {
                let share = (PARTS.len() as f64).sqrt();
                PARTS.iter().map(|part| self.of(*part, light, sheet, seen)).sum::<f64>() / share
            }
            kind => self.of(kind, light, sheet, seen),
        }
    }

    fn of(&self, kind: Kind, light: usize, sheet: usize, seen: &Seen) -> f64 {
        let own = if kind == Kind::Fixed { 0 } else { sheet + 1 };
        let mut dice = Dice(
            self.seed.wrapping_mul(0x9e37_79b1)
                + (kind as usize * 40_009 + light * 211 + own) as u64,
        );
        let [x, y] = seen.place;
        match kind {
            Kind::Cubic | Kind::Fixed => {
                let of_degree = |n: i32| -> f64 {
                    (0..=n).map(|k| dice.normal() * x.powi(n - k) * y.powi(k)).sum()
                };
                0.75 * (1..=3).map(of_degree).sum::<f64>()
            }
            Kind::Bilinear => dice.normal() * x + dice.normal() * y + dice.normal() * x * y,
            Kind::Waves => {
                let [a, b, c, d] = [(); 4].map(|()| dice.uniform() * std::f64::consts::TAU);
                (3.4 * x + a).sin() * (2.1 * y + b).sin()
                    + (2.2 * x + c).cos() * (3.3 * y + d).cos()
            }
            // A share of the light, spread over the table: it weighs more where the light itself is weak.
            Kind::Stray => {
                let mut of_light = Dice(self.seed.wrapping_mul(77) + light as u64);
                let bend = [0.3 * of_light.normal(), 0.3 * of_light.normal()];
                let strength = 2.5 * of_light.between(0.3, 1.7);
                strength * (1.0 + bend[0] * x + bend[1] * y) / seen.level.max(1e-3) / 1.5
            }
            Kind::Paper => {
                let grazing = (1.0 - seen.cos_in) * (1.0 - seen.cos_out).max(0.02);
                let back = (4.0 * (seen.cos_phase - 1.0)).exp();
                // Also the LED's own lobe, which is no power of a cosine.
                10.0 * (1.0 - seen.cos_in).powi(2)
                    + 20.0 * grazing
                    + 2.0 * back
                    + 2.0 * (3.0 * seen.emission_rad).cos() * (light as f64 / self.lights as f64)
            }
            Kind::Drift => dice.normal(),
            Kind::Mixed => 0.0,
        }
    }
}
