//! How raw numbers become linear light.

use crate::instrument::Color;
use crate::raw::{Frame, Samples};
use std::ops::Sub;

/// Black level, range, clipping and response curve; levels per place of the 2 x 2 cell.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    /// Raw numbers without light.
    pub(crate) black: [f64; 4],
    /// Raw number at the end of the range, black included; infinite where the format has no ceiling.
    pub(crate) saturation: [f64; 4],
    /// Raw number from which samples are clipped below the end of the range; infinite where they are not.
    clip: f64,
    range: [f64; 4],
    /// Coefficients of the response curve, lowest power first; empty where it is straight.
    response: Vec<f64>,
}

impl Levels {
    /// The calibration's levels override the file's.
    pub(crate) fn of(frame: &Frame, color: &Color) -> Self {
        let clip = color.clip_level.unwrap_or(f64::INFINITY);
        Self::new(frame.black, frame.saturation, color).clipped_from(clip)
    }

    /// From the levels that a file states, where the calibration's do not override them.
    pub(crate) fn new(black: [f32; 4], saturation: [f32; 4], color: &Color) -> Self {
        let black = color.black_level.unwrap_or(black.map(f64::from));
        let saturation =
            color.saturation_level.map_or(saturation.map(f64::from), |level| [level; 4]);
        let range = [0, 1, 2, 3].map(|place| range_between(black[place], saturation[place]));
        let is_straight = matches!(color.response.as_slice(), [] | [0.0, 1.0]);
        let response = if is_straight { vec![] } else { color.response.clone() };
        Self { black, saturation, clip: f64::INFINITY, range, response }
    }

    fn clipped_from(self, clip: f64) -> Self {
        Self { clip, ..self }
    }

    /// The same in the precision of whole rows, so that a single sample agrees with them about what is saturated.
    pub(crate) fn in_single_precision(&self) -> Self {
        let single = |values: [f64; 4]| values.map(|value| value as f32);
        let (black, saturation) = (single(self.black), single(self.saturation));
        let range = [0, 1, 2, 3].map(|place| range_between(black[place], saturation[place]));
        Self {
            black: black.map(f64::from),
            saturation: saturation.map(f64::from),
            clip: f64::from(self.clip as f32),
            range: range.map(f64::from),
            response: self.response.iter().map(|&c| f64::from(c as f32)).collect(),
        }
    }

    /// Raw numbers from black to the end of the range.
    pub(crate) fn range(&self, place: usize) -> f64 {
        self.range[place]
    }

    /// The raw number from which a sample does not count.
    pub(crate) fn saturated_from(&self, place: usize) -> f64 {
        self.saturation[place].min(self.clip)
    }

    /// The coefficients of the response curve, lowest power first; empty where it is straight.
    pub(crate) fn response(&self) -> &[f64] {
        &self.response
    }

    /// Share of the range, before the response curve, that is left below the clipping.
    pub(crate) fn usable_share(&self) -> f64 {
        (0..4).map(|place| (self.clip - self.black[place]) / self.range[place]).fold(1.0, f64::min)
    }

    /// Light as a fraction of full scale of a raw number; `None` where it is saturated or not finite.
    pub(crate) fn linear(&self, raw: f64, place: usize) -> Option<f64> {
        let usable = raw.is_finite() && raw < self.saturated_from(place);
        usable.then(|| self.bent((raw - self.black[place]) / self.range[place]))
    }

    fn bent(&self, x: f64) -> f64 {
        match self.response.as_slice() {
            [] => x,
            response => response.iter().rev().fold(0.0, |sum, c| sum * x + c),
        }
    }
}

/// Raw numbers from the black level to the end of the range. A format without a ceiling counts 1.0 as full scale.
pub(crate) fn range_between<T>(black: T, saturation: T) -> T
where
    T: Copy + Sub<Output = T> + From<f32> + Into<f64>,
{
    let range = saturation - black;
    if range.into().is_finite() { range } else { T::from(1.0) }
}

/// The raw number of one sample.
pub(crate) fn raw_at(frame: &Frame, x: usize, y: usize, channel: usize) -> f64 {
    let at = (y * frame.width + x) * frame.layout.channels() + channel;
    match &frame.samples {
        Samples::U16(samples) => f64::from(samples[at]),
        Samples::F32(samples) => f64::from(samples[at]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_ceiling_is_one() {
        assert_eq!(range_between(0.25_f32, f32::INFINITY), 1.0);
        assert_eq!(range_between(0.0, f64::INFINITY), 1.0);
        assert_eq!(range_between(600.0, 16_383.0), 15_783.0);
        let levels = Levels::new([0.0; 4], [f32::INFINITY; 4], &Color::default());
        assert_eq!(levels.linear(3.5, 0), Some(3.5));
        assert_eq!(levels.linear(f64::INFINITY, 0), None);
    }

    #[test]
    fn the_calibration_overrides_the_file() {
        let color = Color {
            black_level: Some([100.0, 101.0, 102.0, 103.0]),
            saturation_level: Some(1100.0),
            response: vec![0.0, 0.5, 0.5],
            ..Color::default()
        };
        let levels = Levels::new([0.0; 4], [4095.0; 4], &color);
        assert_eq!((levels.range(0), levels.range(3)), (1000.0, 997.0));
        assert_eq!(levels.linear(600.0, 0), Some(0.375));
        assert_eq!(levels.linear(1100.0, 0), None);
    }
}
