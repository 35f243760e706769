//! Prints: where the colour changes over some ten photosites, it is smoothed within its edges first, and the curves find
//! only what is left.

use super::numeric::{exp, quantile, smoothstep};
use rayon::prelude::*;
use std::ops::Range;
use weavelight_calibration::description::{Cfa, Image};

/// Photosites along a side of what is summed first.
const FINE: usize = 4;
/// Photosites between values of the gate.
const STEP: usize = 8;
/// Spread of the means in photosites, and how far the gate looks, in steps.
const MEAN_SIGMA: f32 = 5.0;
const LOOK: usize = 4;
/// Span of log R - G and B - G: no print below, print above.
const SPAN: [f32; 2] = [0.35, 0.7];

/// How far a place is printed, every eighth photosite.
pub(super) struct Gate {
    width: usize,
    height: usize,
    shares: Vec<f32>,
}

impl Gate {
    pub(super) fn of(logs: &Image<f32>, cfa: Cfa) -> Self {
        let means = Means::of(logs, cfa).smoothed();
        let (width, height) = (means.width.div_ceil(2), means.height.div_ceil(2));
        let chroma: Vec<Option<[f32; 2]>> =
            (0..width * height).map(|k| means.chroma(2 * (k % width), 2 * (k / width))).collect();
        let span = |k: usize| {
            let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
            let around =
                |x: usize, length: usize| x.saturating_sub(LOOK)..(x + LOOK + 1).min(length);
            for y in around(k / width, height) {
                for x in around(k % width, width) {
                    for (j, c) in chroma[y * width + x].iter().flatten().enumerate() {
                        low[j] = low[j].min(*c);
                        high[j] = high[j].max(*c);
                    }
                }
            }
            let of = |j: usize| (high[j] - low[j]).max(0.0);
            of(0).hypot(of(1))
        };
        let spans: Vec<f32> = (0..width * height).into_par_iter().map(span).collect();
        let mean = |k: usize| {
            let (x, y) = (k % width, k / width);
            let near =
                |x: usize, d: usize, length: usize| (x + d).saturating_sub(1).min(length - 1);
            let sum: f32 =
                (0..9).map(|d| spans[near(y, d / 3, height) * width + near(x, d % 3, width)]).sum();
            smoothstep(sum / 9.0, SPAN[0], SPAN[1])
        };
        let shares = (0..width * height).map(mean).collect();
        Self { width, height, shares }
    }

    pub(super) fn is_open(&self) -> bool {
        self.shares.iter().any(|share| *share > 0.0)
    }

    pub(super) fn mean(&self) -> f64 {
        let sum: f64 = self.shares.iter().map(|share| f64::from(*share)).sum();
        sum / self.shares.len().max(1) as f64
    }

    pub(super) fn at(&self, [x, y]: [usize; 2]) -> f32 {
        let along = |x: usize, length: usize| {
            let k = (x / STEP).min(length - 1);
            (k, (k + 1).min(length - 1), (x - k * STEP).min(STEP) as f32 / STEP as f32)
        };
        let ((left, right, u), (top, bottom, v)) = (along(x, self.width), along(y, self.height));
        let row = |y: usize| {
            let (a, b) = (self.shares[y * self.width + left], self.shares[y * self.width + right]);
            a + (b - a) * u
        };
        let (a, b) = (row(top), row(bottom));
        a + (b - a) * v
    }

    /// Whether any of the part is printed.
    pub(super) fn touches(&self, columns: &Range<usize>, rows: &Range<usize>) -> bool {
        let steps = |range: &Range<usize>, length: usize| {
            (range.start / STEP).min(length - 1)..(range.end.div_ceil(STEP) + 1).min(length)
        };
        steps(rows, self.height).any(|y| {
            let columns = steps(columns, self.width);
            self.shares[y * self.width..][columns].iter().any(|share| *share > 0.0)
        })
    }
}

/// Sums of logs over small squares, and over how many photosites, for each channel.
struct Means {
    width: usize,
    height: usize,
    sums: Vec<[[f32; 2]; 3]>,
}

impl Means {
    fn of(logs: &Image<f32>, cfa: Cfa) -> Self {
        let (width, height) = (logs.width.div_ceil(FINE), logs.height.div_ceil(FINE));
        let mut sums = vec![[[0.0; 2]; 3]; width * height];
        sums.par_chunks_mut(width).enumerate().for_each(|(row, sums)| {
            for y in row * FINE..((row + 1) * FINE).min(logs.height) {
                let channels = [0, 1].map(|x| cfa.channel(x, y) as usize);
                for (x, log) in logs.row(y).iter().enumerate().filter(|(_, log)| !log.is_nan()) {
                    let sum = &mut sums[x / FINE][channels[x & 1]];
                    sum[0] += log;
                    sum[1] += 1.0;
                }
            }
        });
        Self { width, height, sums }
    }

    fn smoothed(self) -> Self {
        // The squares spread by themselves.
        let sigma = (MEAN_SIGMA.powi(2) - (FINE * FINE) as f32 / 12.0).sqrt() / FINE as f32;
        let kernel: [f32; 5] = std::array::from_fn(|k| exp(-0.5 * (k as f32 / sigma).powi(2)));
        let Self { width, height, sums } = self;
        let blur = |sums: &[[[f32; 2]; 3]], at: &(dyn Fn(usize, isize) -> Option<usize> + Sync)| {
            let one = |k: usize| {
                let mut sum = [[0.0f32; 2]; 3];
                for d in -4isize..=4 {
                    let Some(from) = at(k, d) else { continue };
                    let weight = kernel[d.unsigned_abs()];
                    for (sum, from) in sum.iter_mut().flatten().zip(sums[from].iter().flatten()) {
                        *sum += weight * from;
                    }
                }
                sum
            };
            (0..width * height).into_par_iter().map(one).collect::<Vec<_>>()
        };
        let across = blur(&sums, &|k, d| {
            let x = (k % width).checked_add_signed(d).filter(|x| *x < width)?;
            Some(k / width * width + x)
        });
        let sums = blur(&across, &|k, d| {
            let y = (k / width).checked_add_signed(d).filter(|y| *y < height)?;
            Some(y * width + k % width)
        });
        Self { width, height, sums }
    }

    /// Log R - G and B - G; `None` where a channel is missing.
    fn chroma(&self, x: usize, y: usize) -> Option<[f32; 2]> {
        let [r, g, b] = self.sums[y.min(self.height - 1) * self.width + x.min(self.width - 1)];
        let mean = |[sum, count]: [f32; 2]| (count > 0.5).then(|| sum / count);
        let (r, g, b) = (mean(r)?, mean(g)?, mean(b)?);
        Some([r - g, b - g])
    }
}

/// Photosites between values of the smoothed colour.
const APART: usize = 2;
const FINE_SIGMA: f32 = 1.5;
const WIDE_SIGMA: f32 = 8.0;
const BLOCK: usize = 16;

/// Smoothed logs of the three channels, every second photosite; not-a-number where nothing is printed.
pub(super) struct Base {
    width: usize,
    height: usize,
    values: Vec<[f32; 3]>,
}

impl Base {
    pub(super) fn of(logs: &Image<f32>, cfa: Cfa, gate: &Gate) -> Self {
        let (width, height) = (logs.width.div_ceil(APART), logs.height.div_ceil(APART));
        let size = [width, height];
        let blocks = [width.div_ceil(BLOCK), height.div_ceil(BLOCK)];
        let printed: Vec<bool> = (0..blocks[0] * blocks[1])
            .map(|k| {
                let part = |k: usize| APART * BLOCK * k..APART * BLOCK * (k + 1);
                gate.touches(&part(k % blocks[0]), &part(k / blocks[0]))
            })
            .collect();
        let near = grown(&printed, blocks);
        let wide = grown(&near, blocks);
        let in_blocks =
            |flags: &[bool], k: usize| flags[k / width / BLOCK * blocks[0] + k % width / BLOCK];
        let fine: Vec<[f32; 3]> = (0..width * height)
            .into_par_iter()
            .map(|k| match in_blocks(&wide, k) {
                true => channel_means(logs, cfa, [APART * (k % width), APART * (k / width)]),
                false => [f32::NAN; 3],
            })
            .collect();
        let moire = moire_level(&fine, size, &wide);
        let tolerance =
            |k: usize| (3.0 * moire[k / width / BLOCK * blocks[0] + k % width / BLOCK]).max(0.06);
        let once = smooth_within(&fine, &fine, size, 10, &tolerance, &|k| in_blocks(&near, k));
        let narrow = |k: usize| (0.4 * tolerance(k)).max(0.06);
        let values = smooth_within(&once, &fine, size, 8, &narrow, &|k| in_blocks(&printed, k));
        Self { width, height, values }
    }

    /// The three logs at a photosite; `None` where nothing is printed near.
    pub(super) fn at(&self, [x, y]: [usize; 2]) -> Option<[f32; 3]> {
        let (left, top) = (x / APART, y / APART);
        let (right, bottom) =
            ((left + x % APART).min(self.width - 1), (top + y % APART).min(self.height - 1));
        let value = |x: usize, y: usize| self.values[y * self.width + x];
        let corners =
            [value(left, top), value(right, top), value(left, bottom), value(right, bottom)];
        let known = corners.iter().filter(|corner| !corner[0].is_nan());
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for corner in known {
            sum.iter_mut().zip(corner).for_each(|(sum, c)| *sum += c);
            count += 1.0;
        }
        (count > 0.0).then(|| sum.map(|sum: f32| sum / count))
    }
}

/// Blocks that are flagged or beside one that is.
fn grown(flags: &[bool], [width, height]: [usize; 2]) -> Vec<bool> {
    (0..width * height)
        .map(|k| {
            let around = |x: usize, length: usize| x.saturating_sub(1)..(x + 2).min(length);
            around(k / width, height)
                .any(|y| around(k % width, width).any(|x| flags[y * width + x]))
        })
        .collect()
}

/// Gaussian means of each channel's logs around a photosite; not-a-number where one has none.
fn channel_means(logs: &Image<f32>, cfa: Cfa, [x, y]: [usize; 2]) -> [f32; 3] {
    const REACH: usize = 5;
    const WEIGHTS: [f32; REACH + 1] = {
        // exp(-k^2 / (2 x 1.5^2))
        [1.0, 0.800_737_4, 0.411_112_3, 0.135_335_3, 0.028_565_5, 0.003_865_9]
    };
    const _: () = assert!(FINE_SIGMA == 1.5);
    let (mut sum, mut total) = ([0.0f32; 3], [0.0f32; 3]);
    for v in y.saturating_sub(REACH)..(y + REACH + 1).min(logs.height) {
        let row = logs.row(v);
        let channels = [0, 1].map(|u| cfa.channel(u, v) as usize);
        let down = WEIGHTS[v.abs_diff(y)];
        for u in x.saturating_sub(REACH)..(x + REACH + 1).min(logs.width) {
            if !row[u].is_nan() {
                let weight = down * WEIGHTS[u.abs_diff(x)];
                sum[channels[u & 1]] += weight * row[u];
                total[channels[u & 1]] += weight;
            }
        }
    }
    match total.iter().all(|total| *total > 0.0) {
        true => [0, 1, 2].map(|c| sum[c] / total[c]),
        false => [f32::NAN; 3],
    }
}

fn chroma([r, g, b]: [f32; 3]) -> [f32; 2] {
    [r - g, b - g]
}

/// How far moire turns the colour of the means, for each block: their distance from wider means, below the middle, so that
/// edges of the print count little.
fn moire_level(fine: &[[f32; 3]], size: [usize; 2], wanted: &[bool]) -> Vec<f32> {
    let [width, height] = size;
    let blocks = [width.div_ceil(BLOCK), height.div_ceil(BLOCK)];
    let kernel: [f32; 7] = std::array::from_fn(|k| exp(-(k as f32 / 2.0).powi(2) / 2.0));
    let wide = |k: usize| {
        let (mut sum, mut total) = ([0.0f32; 2], 0.0f32);
        let (x, y) = (k % width, k / width);
        for v in y.saturating_sub(6)..(y + 7).min(height) {
            for u in x.saturating_sub(6)..(x + 7).min(width) {
                let [a, b] = chroma(fine[v * width + u]);
                if !a.is_nan() {
                    let weight = kernel[v.abs_diff(y)] * kernel[u.abs_diff(x)];
                    sum[0] += weight * a;
                    sum[1] += weight * b;
                    total += weight;
                }
            }
        }
        sum.map(|sum| sum / total)
    };
    let level = |block: usize| {
        if !wanted[block] {
            return 0.0;
        }
        let around = |k: usize, length: usize| {
            (k * BLOCK).saturating_sub(BLOCK / 2)..((k + 1) * BLOCK + BLOCK / 2).min(length)
        };
        let mut all = Vec::new();
        for y in around(block / blocks[0], height).step_by(2) {
            for x in around(block % blocks[0], width).step_by(2) {
                let own = chroma(fine[y * width + x]);
                if !own[0].is_nan() {
                    let wide = wide(y * width + x);
                    all.push((own[0] - wide[0]).hypot(own[1] - wide[1]));
                }
            }
        }
        quantile(&mut all, 0.3).unwrap_or(0.0) / 0.84
    };
    (0..blocks[0] * blocks[1]).into_par_iter().map(level).collect()
}

/// Gaussian means over what has about the same colour in `guide` (Tukey's biweight).
fn smooth_within(
    guide: &[[f32; 3]],
    values: &[[f32; 3]],
    [width, height]: [usize; 2],
    reach: usize,
    tolerance: &(dyn Fn(usize) -> f32 + Sync),
    wanted: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<[f32; 3]> {
    let sigma = WIDE_SIGMA / APART as f32;
    let kernel: Vec<f32> = (0..=reach).map(|k| exp(-0.5 * (k as f32 / sigma).powi(2))).collect();
    let one = |k: usize| {
        if !wanted(k) || guide[k][0].is_nan() {
            return [f32::NAN; 3];
        }
        let own = chroma(guide[k]);
        let per = 1.0 / (3.0 * tolerance(k)).powi(2);
        let (x, y) = (k % width, k / width);
        let (mut sum, mut total) = ([0.0f32; 3], 0.0f32);
        for v in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            for u in x.saturating_sub(reach)..(x + reach + 1).min(width) {
                let there = chroma(guide[v * width + u]);
                let off = (there[0] - own[0]).powi(2) + (there[1] - own[1]).powi(2);
                let near = 1.0 - off * per;
                // Not-a-number is not near.
                if near > 0.0 {
                    let weight = near * near * kernel[v.abs_diff(y)] * kernel[u.abs_diff(x)];
                    let from = values[v * width + u];
                    sum.iter_mut().zip(from).for_each(|(sum, from)| *sum += weight * from);
                    total += weight;
                }
            }
        }
        sum.map(|sum| sum / total)
    };
    (0..width * height).into_par_iter().map(one).collect()
}
