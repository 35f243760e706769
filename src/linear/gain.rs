//! Gain maps along one row of the frame.

use std::ops::Range;
use weavelight_calibration::description::Image;
use weavelight_calibration::gain::{Between, between};

/// A gain map made ready for row after row.
pub(crate) struct GainRows<'a> {
    map: &'a Image<[f32; 3]>,
    frame_px: (usize, usize),
    /// Stretches of columns between the same two texels.
    stretches: Vec<Stretch>,
}

struct Stretch {
    columns: Range<usize>,
    texels: (usize, usize),
    /// Share of the second texel at the first column, and its growth from column to column.
    weight: f32,
    growth: f32,
}

impl<'a> GainRows<'a> {
    pub(crate) fn new(map: &'a Image<[f32; 3]>, frame_px: (usize, usize)) -> Self {
        let width = frame_px.0;
        let place = |column: usize| between(column as f64, width, map.width);
        let growth = if map.width < 2 { 0.0 } else { map.width as f32 / width as f32 };
        let mut stretches: Vec<Stretch> = vec![];
        for column in 0..width {
            let Between { low, high, weight } = place(column);
            match stretches.last_mut() {
                Some(last) if last.texels == (low, high) => last.columns.end = column + 1,
                _ => stretches.push(Stretch {
                    columns: column..column + 1,
                    texels: (low, high),
                    weight: weight as f32,
                    growth,
                }),
            }
        }
        Self { map, frame_px, stretches }
    }

    /// Gain at `columns` (from an even one on) of row `y`, for the channels of even and odd columns.
    pub(crate) fn row(
        &self,
        y: usize,
        columns: Range<usize>,
        channels: [usize; 2],
        out: &mut [f32],
    ) {
        let down = between(y as f64, self.frame_px.1, self.map.height);
        let texel = |column: usize, channel: usize| {
            let (a, b) =
                (self.map.at(column, down.low)[channel], self.map.at(column, down.high)[channel]);
            a + (b - a) * down.weight as f32
        };
        for stretch in &self.stretches {
            let start = stretch.columns.start.max(columns.start);
            let end = stretch.columns.end.min(columns.end);
            if start >= end {
                continue;
            }
            let ends = channels.map(|c| (texel(stretch.texels.0, c), texel(stretch.texels.1, c)));
            let skipped = (start - stretch.columns.start) as f32;
            let first = stretch.weight + stretch.growth * skipped;
            for (k, out) in out[start - columns.start..end - columns.start].iter_mut().enumerate() {
                let (a, b) = ends[(start + k) & 1];
                *out = a + (b - a) * (first + stretch.growth * k as f32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight_calibration::gain::gain_at;

    #[test]
    fn rows_agree_with_the_plain_definition_at_any_resolution() {
        for (width, height) in [(1, 1), (2, 3), (7, 5), (64, 40), (100, 61)] {
            let texel = |i: usize| [0, 1, 2].map(|c| 0.5 + ((i * 7 + c * 3) % 11) as f32 / 11.0);
            let map = Image { width, height, data: (0..width * height).map(texel).collect() };
            let rows = GainRows::new(&map, (64, 40));
            for y in [0, 1, 17, 39] {
                for columns in [0..64, 12..13, 30..64] {
                    let mut out = vec![0.0; columns.len()];
                    rows.row(y, columns.clone(), [0, 2], &mut out);
                    for (column, found) in columns.zip(out) {
                        let expected =
                            gain_at(&map, (64, 40), [column as f64, y as f64])[[0, 2][column & 1]];
                        let off = (f64::from(found) - expected).abs();
                        assert!(
                            off < 1e-5,
                            "{width}x{height}, row {y}, column {column}: {found} not {expected}"
                        );
                    }
                }
            }
        }
    }
}
