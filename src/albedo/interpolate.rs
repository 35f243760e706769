//! Demosaicing of parts without structure.
//!
//! Green along the edge (after Menon, Andriani, Calvagno, "Demosaicing with directional filtering and a posteriori
//! decision", IEEE Trans. Image Processing 2007), red and blue by interpolated residuals of a guided filter (after Kiku,
//! Monno, Tanaka, Okutomi, "Residual interpolation for color image demosaicking", ICIP 2013).

use std::ops::Range;
use weavelight_calibration::description::{Cfa, Channel};

/// What the interpolation of a photosite looks at.
const MARGIN: usize = 16;
const GUIDE_REACH: usize = 5;
const GUIDE_NOISE: f32 = 1e-6;

/// A part of the mosaic with a margin; what is unknown is filled in.
pub(super) struct Part {
    pub(super) width: usize,
    height: usize,
    /// Linear values.
    pub(super) own: Vec<f32>,
    pub(super) channel: Vec<u8>,
}

/// Red, green and blue of a part, row by row. `value` gives the mosaic, `None` where unknown.
pub(super) fn residual_interpolation(
    [width, height]: [usize; 2],
    cfa: Cfa,
    value: &dyn Fn(usize, usize) -> Option<f32>,
    columns: &Range<usize>,
    rows: &Range<usize>,
) -> Vec<[f32; 3]> {
    let part = Part::new([width, height], cfa, value, columns, rows);
    let green = part.green();
    let [red, blue] = [Channel::R, Channel::B].map(|c| part.beside_green(&green, c as u8));
    let mut out = Vec::with_capacity(columns.len() * rows.len());
    for y in 0..rows.len() {
        for x in 0..columns.len() {
            let at = part.at([x, y]);
            let mut rgb = [red[at], green[at], blue[at]].map(|value| value.max(0.0));
            rgb[usize::from(part.channel[at])] = part.own[at];
            out.push(rgb);
        }
    }
    out
}

/// Place of a margin's column or row, turned back at the ends so that it keeps its filter.
fn reflected(place: isize, length: usize) -> usize {
    let last = length as isize - 1;
    if last < 2 {
        return place.clamp(0, last) as usize;
    }
    let period = 2 * last;
    let turned = place.rem_euclid(period);
    (if turned > last { period - turned } else { turned }) as usize
}

impl Part {
    /// Of some columns and rows.
    pub(super) fn new(
        [width, height]: [usize; 2],
        cfa: Cfa,
        value: &dyn Fn(usize, usize) -> Option<f32>,
        columns: &Range<usize>,
        rows: &Range<usize>,
    ) -> Self {
        let size = [columns.len() + 2 * MARGIN, rows.len() + 2 * MARGIN];
        let place = |k: usize, start: usize, length: usize| {
            reflected((start + k) as isize - MARGIN as isize, length)
        };
        let mut part = Self {
            width: size[0],
            height: size[1],
            own: Vec::with_capacity(size[0] * size[1]),
            channel: Vec::with_capacity(size[0] * size[1]),
        };
        for k in 0..size[1] {
            let y = place(k, rows.start, height);
            for k in 0..size[0] {
                let x = place(k, columns.start, width);
                part.own.push(value(x, y).unwrap_or(f32::NAN));
                part.channel.push(cfa.channel(x, y) as u8);
            }
        }
        part.fill();
        part
    }

    /// Index of a place without the margin.
    pub(super) fn at(&self, [x, y]: [usize; 2]) -> usize {
        (y + MARGIN) * self.width + x + MARGIN
    }

    /// Gives unknown photosites the mean of the known ones of their channel near by, else of the whole part.
    fn fill(&mut self) {
        if self.own.iter().all(|own| !own.is_nan()) {
            return;
        }
        let mean = |at: &mut dyn Iterator<Item = usize>, channel: u8| {
            let (mut sum, mut count) = (0.0, 0.0);
            for at in at.filter(|at| self.channel[*at] == channel && !self.own[*at].is_nan()) {
                sum += self.own[at];
                count += 1.0;
            }
            (count > 0.0).then(|| sum / count)
        };
        let whole = [0, 1, 2].map(|c| mean(&mut (0..self.own.len()), c).unwrap_or(0.0));
        let filled: Vec<(usize, f32)> = (0..self.own.len())
            .filter(|at| self.own[*at].is_nan())
            .map(|at| {
                let (x, y) = (at % self.width, at / self.width);
                let near = |k: usize, length: usize| k.saturating_sub(2)..(k + 3).min(length);
                let (width, height) = (self.width, self.height);
                let mut around =
                    near(y, height).flat_map(|v| near(x, width).map(move |u| v * width + u));
                let channel = self.channel[at];
                (at, mean(&mut around, channel).unwrap_or(whole[usize::from(channel)]))
            })
            .collect();
        filled.into_iter().for_each(|(at, value)| self.own[at] = value);
    }

    /// Green everywhere inside a margin of 4.
    fn green(&self) -> Vec<f32> {
        let own = &self.own;
        let stride = self.width;
        let along = |at: usize, step: usize| {
            let gradient = 2.0 * own[at] - own[at - 2 * step] - own[at + 2 * step];
            0.5 * (own[at - step] + own[at + step]) + 0.25 * gradient
        };
        // Colour differences along rows and columns, and how much they change along their own direction.
        let mut differences = [vec![0.0f32; own.len()], vec![0.0f32; own.len()]];
        let inside = |margin: usize| {
            (margin..self.height - margin)
                .flat_map(move |y| (margin..stride - margin).map(move |x| y * stride + x))
        };
        for at in inside(2) {
            let green = self.channel[at] == Channel::G as u8;
            for (difference, step) in differences.iter_mut().zip([1, stride]) {
                let there = along(at, step);
                difference[at] = if green { own[at] - there } else { there - own[at] };
            }
        }
        let [across, down] = &differences;
        let mut changes = [vec![0.0f32; own.len()], vec![0.0f32; own.len()]];
        for at in inside(4) {
            changes[0][at] = (across[at] - across[at + 2]).abs();
            changes[1][at] = (down[at] - down[at + 2 * stride]).abs();
        }
        let mut green = own.clone();
        for at in inside(8) {
            if self.channel[at] == Channel::G as u8 {
                continue;
            }
            let sum = |values: &[f32]| {
                let mut sum = 0.0;
                for v in 0..5 {
                    let start = at + v * stride - 2 * stride - 2;
                    for (u, value) in values[start..start + 5].iter().enumerate() {
                        sum += if u == 2 || v == 2 { 3.0 } else { 1.0 } * value;
                    }
                }
                sum
            };
            let [change_across, change_down] = [sum(&changes[0]), sum(&changes[1])];
            let difference = match change_across <= change_down {
                true => across[at],
                false => down[at],
            };
            green[at] = own[at] + difference;
        }
        green
    }

    /// Red or blue, guided by green.
    fn beside_green(&self, green: &[f32], channel: u8) -> Vec<f32> {
        let own = &self.own;
        let here = |at: usize| if self.channel[at] == channel { 1.0f32 } else { 0.0 };
        let masked = |f: &dyn Fn(usize) -> f32| -> Vec<f32> {
            (0..own.len()).map(|at| if here(at) > 0.0 { f(at) } else { 0.0 }).collect()
        };
        let box_sum = |values: &[f32]| self.box_sum(values);
        let count = box_sum(&masked(&|_| 1.0));
        let sum_guide = box_sum(&masked(&|at| green[at]));
        let sum_own = box_sum(&masked(&|at| own[at]));
        let sum_product = box_sum(&masked(&|at| green[at] * own[at]));
        let sum_square = box_sum(&masked(&|at| green[at] * green[at]));
        let line = |at: usize| {
            let n = count[at].max(1.0);
            let (guide, mean) = (sum_guide[at] / n, sum_own[at] / n);
            let slope = (sum_product[at] / n - guide * mean)
                / ((sum_square[at] / n - guide * guide).max(0.0) + GUIDE_NOISE);
            (slope, mean - slope * guide)
        };
        let (slopes, constants): (Vec<f32>, Vec<f32>) = (0..own.len()).map(line).unzip();
        let area = (2 * GUIDE_REACH + 1).pow(2) as f32;
        let (slopes, constants) = (box_sum(&slopes), box_sum(&constants));
        let guided: Vec<f32> =
            (0..own.len()).map(|at| (slopes[at] * green[at] + constants[at]) / area).collect();
        let residual = masked(&|at| own[at] - guided[at]);
        let mut out = guided;
        let stride = self.width;
        for y in 1..self.height - 1 {
            for x in 1..stride - 1 {
                let at = y * stride + x;
                let r = |v: usize, u: usize| residual[at + v * stride + u - stride - 1];
                out[at] += r(1, 1)
                    + 0.5 * (r(0, 1) + r(1, 0) + r(1, 2) + r(2, 1))
                    + 0.25 * (r(0, 0) + r(0, 2) + r(2, 0) + r(2, 2));
            }
        }
        out
    }

    /// Sums over a square; short of the border they are of what is there.
    fn box_sum(&self, values: &[f32]) -> Vec<f32> {
        let (width, height) = (self.width, self.height);
        let mut across = vec![0.0f32; values.len()];
        for (sums, row) in across.chunks_mut(width).zip(values.chunks(width)) {
            // One shift after the other, so that the additions of a row do not wait for each other.
            for shift in 0..2 * GUIDE_REACH + 1 {
                let to = GUIDE_REACH.saturating_sub(shift);
                let from = shift.saturating_sub(GUIDE_REACH);
                let shifted = sums.iter_mut().skip(to).zip(&row[from..]);
                shifted.for_each(|(sum, value)| *sum += value);
            }
        }
        let mut out = vec![0.0f32; values.len()];
        for y in 0..height {
            let (above, below) = (y.saturating_sub(GUIDE_REACH), (y + GUIDE_REACH + 1).min(height));
            let (_, rest) = out.split_at_mut(y * width);
            let line = &mut rest[..width];
            for v in above..below {
                line.iter_mut().zip(&across[v * width..]).for_each(|(sum, value)| *sum += value);
            }
        }
        out
    }
}
