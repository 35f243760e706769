use super::reading::Reading;
use crate::instrument::Color;
use crate::raw::{Frame, Layout};
use weavelight_calibration::description::Image;

/// Cells of 2 x 2 looked at per side of a pixel of the preview: enough to calm noise, few enough that a frame takes
/// milliseconds.
const CELLS_PER_SIDE: usize = 4;

/// A frame made small, to be looked at: linear R, G, B as fractions of the range from black to saturation.
pub fn preview(frame: &Frame, longest_side: usize) -> Image<[f32; 3]> {
    let reading = Reading::new(frame, &Color::default());
    let cells = (frame.width.div_ceil(2), frame.height.div_ceil(2));
    let factor = cells.0.max(cells.1).div_ceil(longest_side.max(1)).max(1);
    let (width, height) = (cells.0.div_ceil(factor), cells.1.div_ceil(factor));
    let step = factor.div_ceil(CELLS_PER_SIDE);
    let mut data = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let rows = (y * factor..((y + 1) * factor).min(cells.1)).step_by(step);
            let columns = (x * factor..((x + 1) * factor).min(cells.0)).step_by(step);
            let mut mean = Mean::default();
            rows.for_each(|row| {
                columns.clone().for_each(|column| mean.add_cell(&reading, column, row));
            });
            data.push(mean.color());
        }
    }
    Image { width, height, data }
}

#[derive(Default)]
struct Mean {
    sum: [f32; 3],
    count: [u32; 3],
}

impl Mean {
    /// The four pixels of a cell (fewer at the edge of a frame of odd size).
    fn add_cell(&mut self, reading: &Reading, column: usize, row: usize) {
        let frame = reading.frame();
        for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (x, y) = (column * 2 + dx, row * 2 + dy);
            if x < frame.width && y < frame.height {
                self.add_pixel(reading, x, y);
            }
        }
    }

    fn add_pixel(&mut self, reading: &Reading, x: usize, y: usize) {
        match reading.frame().layout {
            Layout::Mosaic(cfa) => self.add(cfa.channel(x, y) as usize, reading.share(x, y, 0)),
            Layout::Grey => (0..3).for_each(|c| self.add(c, reading.share(x, y, 0))),
            Layout::Rgb => (0..3).for_each(|c| self.add(c, reading.share(x, y, c))),
        }
    }

    fn add(&mut self, channel: usize, value: f32) {
        if value.is_finite() {
            self.sum[channel] += value;
            self.count[channel] += 1;
        }
    }

    fn color(&self) -> [f32; 3] {
        std::array::from_fn(|c| self.sum[c] / self.count[c].max(1) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::{Metadata, Samples};
    use weavelight_calibration::description::Cfa;

    fn frame(width: usize, height: usize, layout: Layout, samples: Vec<u16>) -> Frame {
        Frame {
            width,
            height,
            layout,
            samples: Samples::U16(samples),
            black: [10.0; 4],
            saturation: [110.0; 4],
            metadata: Metadata::default(),
        }
    }

    #[test]
    fn colours_of_one_cell() {
        let check = |layout, samples: &[u16], expected: [f32; 3]| {
            let width = samples.len() / layout_rows(layout) / Layout::channels(layout);
            let small = preview(&frame(width, layout_rows(layout), layout, samples.to_vec()), 1);
            assert_eq!(small.data, vec![expected], "{layout:?} {samples:?}");
        };
        check(Layout::Mosaic(Cfa::RGGB), &[60, 20, 40, 110], [0.5, 0.2, 1.0]);
        check(Layout::Grey, &[60, 60, 60, 60], [0.5; 3]);
        check(Layout::Rgb, &[10, 60, 110], [0.0, 0.5, 1.0]);
    }

    fn layout_rows(layout: Layout) -> usize {
        if layout == Layout::Rgb { 1 } else { 2 }
    }

    #[test]
    fn odd_sizes_are_covered_to_the_edge() {
        let small = preview(&frame(5, 3, Layout::Grey, vec![60; 15]), 2);
        assert_eq!((small.width, small.height), (2, 1));
        assert!(small.data.iter().all(|c| *c == [0.5; 3]));
    }
}
