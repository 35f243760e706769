//! What one frame shows, in a few numbers.

use crate::instrument::Color;
use crate::linear::Reading;
use crate::raw::{Frame, Layout};

/// Samples that the figures rest on: enough for a tenth of a per cent, few enough for milliseconds.
const SAMPLES: usize = 400_000;
/// Share of the samples that may be brighter than [`Look::high`]: highlights on cloth are small.
const HIGHLIGHTS: f64 = 0.005;
/// From here, as a fraction of the range, a sample counts as clipped.
const CLIPPED: f32 = 0.995;
/// Bins of a histogram.
pub const BINS: usize = 64;
/// Nodes of the sketch, along each side.
const SKETCH: usize = 48;
/// Side of the square that one node of the sketch averages, pixels.
const NODE: usize = 8;
/// Rows that the sharpness is measured in.
const SHARPNESS_ROWS: usize = 200;

/// One colour channel of a frame; brightness as fractions of the range from black to saturation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// R, G, B or grey.
    pub name: &'static str,
    /// Mean.
    pub mean: f64,
    /// Brightness that half a per cent of the samples exceed.
    pub high: f64,
    /// Share of clipped samples.
    pub clipped: f64,
    /// Share of the samples in each of [`BINS`] equal bins from black to saturation.
    pub histogram: Vec<f64>,
}

/// What one frame shows. Brightness as fractions of the range from black to saturation.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Width and height.
    pub size_px: [usize; 2],
    /// Per colour channel.
    pub channels: Vec<Channel>,
    /// Mean absolute difference of neighbours of the same colour relative to the mean: larger is sharper. Compares frames of
    /// one swatch under one light only.
    pub sharpness: f64,
    /// Means of small squares all over the frame.
    pub sketch: Vec<f32>,
}

impl Look {
    /// Looks at a frame.
    pub fn at(frame: &Frame) -> Self {
        let grid = Grid::new(frame);
        Self {
            size_px: [frame.width, frame.height],
            channels: grid.channels(),
            sharpness: grid.sharpness(),
            sketch: grid.sketch(),
        }
    }

    /// Mean over the channels.
    pub fn mean(&self) -> f64 {
        self.channels.iter().map(|c| c.mean).sum::<f64>() / self.channels.len().max(1) as f64
    }

    /// Of the brightest channel.
    pub fn high(&self) -> f64 {
        self.channels.iter().map(|c| c.high).fold(0.0, f64::max)
    }

    /// Share of clipped samples in the channel that clips most.
    pub fn clipped(&self) -> f64 {
        self.channels.iter().map(|c| c.clipped).fold(0.0, f64::max)
    }
}

/// How much two sketches differ beyond a common factor: the sine of the angle between them, 0 to 1. Infinite where their
/// sizes differ or one of them is black.
pub(super) fn difference(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::INFINITY;
    }
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
    if aa <= 0.0 || bb <= 0.0 {
        return f64::INFINITY;
    }
    (1.0 - (ab * ab / (aa * bb)).min(1.0)).sqrt()
}

struct Grid<'a> {
    frame: &'a Frame,
    channels: usize,
    reading: Reading<'a>,
}

impl<'a> Grid<'a> {
    fn new(frame: &'a Frame) -> Self {
        let reading = Reading::new(frame, &Color::default());
        Self { frame, channels: frame.layout.channels(), reading }
    }

    fn value(&self, x: usize, y: usize, channel: usize) -> f32 {
        let value = self.reading.share(x, y, channel);
        if value.is_finite() { value } else { 0.0 }
    }

    fn channels(&self) -> Vec<Channel> {
        let names: &[&str] =
            if self.frame.layout == Layout::Grey { &["grey"] } else { &["R", "G", "B"] };
        let mut values: Vec<Vec<f32>> = vec![Vec::new(); names.len()];
        let (width, height) = (self.frame.width, self.frame.height);
        // Odd, so that every place of the mosaic is visited.
        let step = ((width * height / SAMPLES) as f64).sqrt() as usize | 1;
        for y in (0..height).step_by(step) {
            for x in (0..width).step_by(step) {
                match self.frame.layout {
                    Layout::Mosaic(cfa) => {
                        values[cfa.channel(x, y) as usize].push(self.value(x, y, 0));
                    }
                    _ => (0..names.len()).for_each(|c| values[c].push(self.value(x, y, c))),
                }
            }
        }
        names.iter().zip(values).map(|(name, values)| channel(name, values)).collect()
    }

    /// Along rows: two pixels on is the same colour in every mosaic.
    fn sharpness(&self) -> f64 {
        let (width, height) = (self.frame.width, self.frame.height);
        let step = (height / SHARPNESS_ROWS) | 1;
        let (mut differences, mut sum) = (0.0, 0.0);
        for y in (0..height).step_by(step) {
            for x in 2..width {
                let (here, before) = (self.value(x, y, 0), self.value(x - 2, y, 0));
                differences += f64::from((here - before).abs());
                sum += f64::from(here.abs());
            }
        }
        if sum > 0.0 { differences / sum } else { 0.0 }
    }

    fn sketch(&self) -> Vec<f32> {
        let (width, height) = (self.frame.width, self.frame.height);
        let nodes = |length: usize| SKETCH.min(length / NODE).max(1);
        let (columns, rows) = (nodes(width), nodes(height));
        let start = |k: usize, nodes: usize, length: usize| k * length / nodes;
        let mut sketch = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            let top = start(row, rows, height) & !1;
            for column in 0..columns {
                sketch.push(self.square(start(column, columns, width) & !1, top));
            }
        }
        sketch
    }

    fn square(&self, left: usize, top: usize) -> f32 {
        let (right, bottom) =
            ((left + NODE).min(self.frame.width), (top + NODE).min(self.frame.height));
        let pixels = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
        let count = (right - left) * (bottom - top) * self.channels;
        let sum: f32 = pixels
            .flat_map(|(x, y)| (0..self.channels).map(move |c| (x, y, c)))
            .map(|(x, y, c)| self.value(x, y, c))
            .sum();
        sum / count.max(1) as f32
    }
}

fn channel(name: &'static str, mut values: Vec<f32>) -> Channel {
    let count = values.len().max(1) as f64;
    let mut histogram = vec![0.0; BINS];
    for value in &values {
        let bin = (value.clamp(0.0, 1.0) * BINS as f32) as usize;
        histogram[bin.min(BINS - 1)] += 1.0 / count;
    }
    let rank = ((values.len() as f64 * (1.0 - HIGHLIGHTS)) as usize).min(values.len().max(1) - 1);
    let high = if values.is_empty() {
        0.0
    } else {
        f64::from(*values.select_nth_unstable_by(rank, f32::total_cmp).1)
    };
    Channel {
        name,
        mean: values.iter().map(|v| f64::from(*v)).sum::<f64>() / count,
        high,
        clipped: values.iter().filter(|v| **v >= CLIPPED).count() as f64 / count,
        histogram,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::{Metadata, Samples};
    use weavelight_calibration::description::Cfa;

    fn frame(layout: Layout, value: impl Fn(usize, usize) -> u16) -> Frame {
        let (width, height) = (64, 48);
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let repeat = layout.channels();
        let samples = pixels.flat_map(|(x, y)| vec![value(x, y); repeat]).collect();
        Frame {
            width,
            height,
            layout,
            samples: Samples::U16(samples),
            black: [100.0; 4],
            saturation: [1100.0; 4],
            metadata: Metadata::default(),
        }
    }

    #[test]
    fn levels_per_channel() {
        // Red at 20 %, green at 50 %, blue clipped.
        let look = Look::at(&frame(Layout::Mosaic(Cfa::RGGB), |x, y| match (x & 1, y & 1) {
            (0, 0) => 300,
            (1, 1) => 1200,
            _ => 600,
        }));
        let means: Vec<f64> = look.channels.iter().map(|c| (c.mean * 100.0).round()).collect();
        assert_eq!(means, [20.0, 50.0, 110.0]);
        assert_eq!((look.channels[1].clipped, look.clipped()), (0.0, 1.0));
        assert!((look.channels[1].histogram[32] - 1.0).abs() < 1e-9);
        assert!((look.high() - 1.1).abs() < 1e-6);
        assert_eq!(look.sharpness, 0.0);
    }

    #[test]
    fn sharper_is_more() {
        let stripes = |depth: u16| {
            Look::at(&frame(Layout::Grey, |x, _| 500 + depth * u16::from(x % 4 < 2))).sharpness
        };
        assert!(stripes(200) > 1.5 * stripes(100));
    }

    #[test]
    fn nothing_measured_is_nothing() {
        for layout in [Layout::Grey, Layout::Rgb, Layout::Mosaic(Cfa::RGGB)] {
            let look = Look::at(&frame(layout, |_, _| 100));
            assert_eq!(
                (look.mean(), look.high(), look.clipped(), look.sharpness),
                (0.0, 0.0, 0.0, 0.0)
            );
        }
        let mut lost = frame(Layout::Grey, |_, _| 0);
        lost.samples = Samples::F32(vec![f32::NAN; 64 * 48]);
        lost.saturation = [f32::INFINITY; 4];
        assert_eq!(Look::at(&lost).mean(), 0.0);
    }
}
