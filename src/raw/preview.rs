use super::{Frame, Layout, Samples};
use weavelight_calibration::description::Image;

/// Cells of 2 x 2 looked at per side of a pixel of the preview: enough to calm noise, few enough that a frame takes
/// milliseconds.
const CELLS_PER_SIDE: usize = 4;

/// A frame made small, to be looked at: linear R, G, B as fractions of the range from black to saturation.
pub fn preview(frame: &Frame, longest_side: usize) -> Image<[f32; 3]> {
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
                columns.clone().for_each(|column| mean.add_cell(frame, column, row));
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
    fn add_cell(&mut self, frame: &Frame, column: usize, row: usize) {
        for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (x, y) = (column * 2 + dx, row * 2 + dy);
            if x < frame.width && y < frame.height {
                self.add_pixel(frame, x, y);
            }
        }
    }

    fn add_pixel(&mut self, frame: &Frame, x: usize, y: usize) {
        let place = (y & 1) * 2 + (x & 1);
        let (black, saturation) = (frame.black[place], frame.saturation[place]);
        let range = if saturation.is_finite() { saturation - black } else { 1.0 };
        let pixel = y * frame.width + x;
        match frame.layout {
            Layout::Mosaic(cfa) => {
                self.add(cfa.channel(x, y) as usize, (sample(frame, pixel) - black) / range);
            }
            Layout::Grey => {
                (0..3).for_each(|c| self.add(c, (sample(frame, pixel) - black) / range));
            }
            Layout::Rgb => {
                (0..3).for_each(|c| self.add(c, (sample(frame, 3 * pixel + c) - black) / range));
            }
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

fn sample(frame: &Frame, index: usize) -> f32 {
    match &frame.samples {
        Samples::U16(samples) => f32::from(samples[index]),
        Samples::F32(samples) => samples[index],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::Metadata;
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
