//! From raw numbers to linear light, one row of one frame at a time: black level, range, saturation, response.

use super::levels::{Levels, raw_at};
use crate::instrument::Color;
use crate::photometry::{Normalisation, normalise_row};
use crate::raw::{Frame, Layout, Samples};
use std::ops::Range;

/// How the raw numbers of one frame are read, row by row in float32.
pub(crate) struct Reading<'a> {
    frame: &'a Frame,
    channels: usize,
    /// In the precision of the rows.
    levels: Levels,
    /// Per place of the 2 x 2 cell.
    black: [f32; 4],
    /// From here on a sample is clipped.
    saturation: [f32; 4],
    /// End of the range - black: raw numbers from 0 to 1.
    range: [f32; 4],
    response: Option<Vec<f32>>,
}

impl<'a> Reading<'a> {
    /// By [`Levels::of`] the frame.
    pub(crate) fn new(frame: &'a Frame, color: &Color) -> Self {
        let levels = Levels::of(frame, color).in_single_precision();
        let of_places = |level: fn(&Levels, usize) -> f64| {
            [0, 1, 2, 3].map(|place| level(&levels, place) as f32)
        };
        let (saturation, range) = (of_places(Levels::saturated_from), of_places(Levels::range));
        let response = levels.response().iter().map(|&c| c as f32).collect::<Vec<_>>();
        Self {
            frame,
            channels: frame.layout.channels(),
            black: levels.black.map(|level| level as f32),
            saturation,
            range,
            response: (!response.is_empty()).then_some(response),
            levels,
        }
    }

    /// The frame.
    pub(crate) fn frame(&self) -> &'a Frame {
        self.frame
    }

    /// Raw numbers from black to saturation, per place of the 2 x 2 cell.
    pub(crate) fn range(&self) -> [f32; 4] {
        self.range
    }

    /// Black level and saturation, raw numbers, per place of the 2 x 2 cell.
    pub(crate) fn levels(&self) -> [(f32, f32); 4] {
        [0, 1, 2, 3].map(|place| (self.black[place], self.saturation[place]))
    }

    /// Linear light of one sample in float64 (fraction of full scale); NaN where it is saturated or not finite. The plain
    /// definition of [`Reading::row`].
    pub(crate) fn at(&self, x: usize, y: usize, channel: usize) -> f64 {
        let place = (y & 1) * 2 + (x & 1);
        self.levels.linear(raw_at(self.frame, x, y, channel), place).unwrap_or(f64::NAN)
    }

    /// Where a sample lies between black (0) and the end of the range (1), saturated or not and before the response curve:
    /// for pictures and histograms of what the camera wrote.
    pub(crate) fn share(&self, x: usize, y: usize, channel: usize) -> f32 {
        let place = (y & 1) * 2 + (x & 1);
        (raw_at(self.frame, x, y, channel) as f32 - self.black[place]) / self.range[place]
    }

    /// Linear light times `factor`, for one channel of the given columns of row `y`; NaN where the sample is saturated or
    /// not finite.
    ///
    /// `factor` is per place of the 2 x 2 cell; light is a fraction of full scale. `columns` starts at an even column.
    pub(crate) fn row(
        &self,
        y: usize,
        channel: usize,
        columns: Range<usize>,
        factor: [f32; 4],
        out: &mut [f32],
    ) {
        let cell = Cell::new(self, y, factor);
        let normalisation = cell.normalisation();
        let start = (y * self.frame.width + columns.start) * self.channels;
        let end = (y * self.frame.width + columns.end) * self.channels;
        match &self.frame.samples {
            Samples::U16(samples) if self.channels == 1 => {
                normalise_row(&samples[start..end], &normalisation, out);
            }
            Samples::U16(samples) => cell.strided(
                samples[start..end].iter().map(|&v| f32::from(v)),
                channel,
                self.channels,
                out,
            ),
            Samples::F32(samples) => {
                cell.strided(samples[start..end].iter().copied(), channel, self.channels, out);
            }
        }
        if let Some(response) = &self.response {
            bend(response, y, factor, out);
        }
    }

    /// True where a sample of the row is saturated in any channel; ORed into `out`.
    pub(crate) fn mark_saturated(&self, y: usize, columns: Range<usize>, out: &mut [bool]) {
        let row = y * self.frame.width;
        let span = (row + columns.start) * self.channels..(row + columns.end) * self.channels;
        let limit = |column: usize| self.saturation[(y & 1) * 2 + (column & 1)];
        match &self.frame.samples {
            Samples::U16(samples) => {
                for (column, (pixel, out)) in
                    samples[span].chunks_exact(self.channels).zip(out).enumerate()
                {
                    *out |= pixel.iter().any(|&value| f32::from(value) >= limit(column));
                }
            }
            Samples::F32(samples) => {
                for (column, (pixel, out)) in
                    samples[span].chunks_exact(self.channels).zip(out).enumerate()
                {
                    *out |= pixel.iter().any(|&value| value >= limit(column));
                }
            }
        }
    }
}

/// The constants of one row: even columns, odd columns.
struct Cell {
    black: [f32; 2],
    scale: [f32; 2],
    saturation: [f32; 2],
}

impl Cell {
    fn new(reading: &Reading, y: usize, factor: [f32; 4]) -> Self {
        let place = |column: usize| (y & 1) * 2 + column;
        // A bent response needs the fraction itself; the factor comes after it.
        let scale = |column: usize| match reading.response {
            None => factor[place(column)] / reading.range[place(column)],
            Some(_) => 1.0 / reading.range[place(column)],
        };
        Self {
            black: [0, 1].map(|column| reading.black[place(column)]),
            scale: [0, 1].map(scale),
            saturation: [0, 1].map(|column| reading.saturation[place(column)]),
        }
    }

    fn normalisation(&self) -> Normalisation {
        // The first integer at or beyond the level.
        let saturation =
            self.saturation.map(|level| level.ceil().clamp(0.0, f32::from(u16::MAX)) as u16);
        Normalisation { black: self.black, scale: self.scale, saturation }
    }

    fn value(&self, raw: f32, column: usize) -> f32 {
        let parity = column & 1;
        if raw.is_finite() && raw < self.saturation[parity] {
            (raw - self.black[parity]) * self.scale[parity]
        } else {
            f32::NAN
        }
    }

    fn strided(
        &self,
        samples: impl Iterator<Item = f32>,
        channel: usize,
        channels: usize,
        out: &mut [f32],
    ) {
        for (column, (raw, out)) in samples.skip(channel).step_by(channels).zip(out).enumerate() {
            *out = self.value(raw, column);
        }
    }
}

/// Applies linear = sum c_i x^i and the factor.
fn bend(response: &[f32], y: usize, factor: [f32; 4], out: &mut [f32]) {
    for (column, value) in out.iter_mut().enumerate() {
        let bent = response.iter().rev().fold(0.0, |sum, &c| sum * *value + c);
        *value = bent * factor[(y & 1) * 2 + (column & 1)];
    }
}

/// Weights of red, green and blue in the grey value of colour pictures.
pub(crate) const GREY: [f32; 3] = [0.2989, 0.587, 0.114];

/// The strength of a light for one channel of the frame, per place of the 2 x 2 cell.
pub(crate) fn intensity_of_places(layout: Layout, channel: usize, intensity: [f64; 3]) -> [f64; 4] {
    match layout {
        Layout::Mosaic(cfa) => cfa.cell.map(|filter| intensity[filter as usize]),
        Layout::Rgb => [intensity[channel]; 4],
        Layout::Grey => {
            [(0..3).map(|c| f64::from(GREY[c]) * intensity[c]).sum::<f64>() / grey_sum(); 4]
        }
    }
}

fn grey_sum() -> f64 {
    GREY.iter().map(|&w| f64::from(w)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::Metadata;

    /// The level at which samples clip ends what counts, and leaves the scale alone.
    #[test]
    fn samples_that_clip_below_the_range_do_not_count() {
        let frame = Frame {
            width: 4,
            height: 1,
            layout: Layout::Grey,
            samples: Samples::U16(vec![100, 4094, 4095, 5000]),
            black: [0.0; 4],
            saturation: [65_535.0; 4],
            metadata: Metadata::default(),
        };
        let color = Color { clip_level: Some(4095.0), ..Color::default() };
        let reading = Reading::new(&frame, &color);
        let mut row = [0.0; 4];
        reading.row(0, 0, 0..4, [65_535.0; 4], &mut row);
        assert_eq!(&row[..2], [100.0, 4094.0]);
        assert!(row[2].is_nan() && row[3].is_nan() && reading.at(2, 0, 0).is_nan());
        assert_eq!(reading.range(), [65_535.0; 4]);
        let mut saturated = [false; 4];
        reading.mark_saturated(0, 0..4, &mut saturated);
        assert_eq!(saturated, [false, false, true, true]);
    }
}
