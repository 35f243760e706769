//! The colours of a cloth in a window lie on a curve: each channel is a function of one hidden variable. A photosite sees
//! one channel of it; the distributions of the channels over the window say where the other two lie.

use super::grid::Grid;
use rayon::prelude::*;
use std::ops::Range;
use weavelight_calibration::description::{Cfa, Image};

/// Shares of a window's photosites at which a curve has a knot; symmetric, so that a channel can run backwards.
const SHARES: [f32; KNOTS] = [0.02, 0.06, 0.15, 0.3, 0.5, 0.7, 0.85, 0.94, 0.98];
const KNOTS: usize = 9;
/// Beyond the outermost knots a channel follows another with this slope at most, or one over it.
const STEEPEST: f32 = 3.0;
/// Photosites of a channel that a window needs.
const FEWEST: u32 = 64;
/// Histograms of logs.
const BINS: usize = 2048;
const LOWEST: f32 = -6.5;
const HIGHEST: f32 = 2.0;

/// How logs of the channels belong together: knots of the same index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Curve {
    /// Log values, rising; of a channel that runs backwards, times -1.
    knots: [[f32; KNOTS]; 3],
    signs: [f32; 3],
}

/// How many photosites of each channel have which log.
struct Histogram {
    counts: Vec<u32>,
}

impl Histogram {
    fn none() -> Self {
        Self { counts: vec![0; 3 * BINS] }
    }

    fn add_part(
        &mut self,
        logs: &Image<f32>,
        cfa: Cfa,
        columns: &Range<usize>,
        rows: Range<usize>,
    ) {
        const SCALE: f32 = BINS as f32 / (HIGHEST - LOWEST);
        for y in rows {
            let channels = [0, 1].map(|k| cfa.channel(columns.start + k, y) as usize * BINS);
            let row = &logs.data[y * logs.width..][columns.clone()];
            for (k, value) in row.iter().enumerate() {
                // Not-a-number marks what is unsolved.
                if *value >= LOWEST {
                    let bin = ((value - LOWEST) * SCALE) as usize;
                    self.counts[channels[k & 1] + bin.min(BINS - 1)] += 1;
                }
            }
        }
    }

    fn add(&mut self, other: &Self) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(sum, count)| *sum += count);
    }

    fn channel(&self, c: usize) -> &[u32] {
        &self.counts[c * BINS..(c + 1) * BINS]
    }

    /// The logs below which each of `shares` lies, rising shares; `None` of too few.
    fn quantiles<const N: usize>(counts: &[u32], shares: [f32; N]) -> Option<[f32; N]> {
        let total: u32 = counts.iter().sum();
        if total < FEWEST {
            return None;
        }
        let (mut bin, mut below) = (0, 0);
        Some(shares.map(|share| {
            let wanted = share * total as f32;
            while bin + 1 < BINS && ((below + counts[bin]) as f32) < wanted {
                below += counts[bin];
                bin += 1;
            }
            let inside = (wanted - below as f32) / (counts[bin].max(1) as f32);
            LOWEST + (bin as f32 + inside.clamp(0.0, 1.0)) * (HIGHEST - LOWEST) / BINS as f32
        }))
    }

    fn curve(&self, signs: [f32; 3]) -> Option<Curve> {
        let found = [0, 1, 2].map(|c| Self::quantiles(self.channel(c), SHARES));
        let [Some(r), Some(g), Some(b)] = found else { return None };
        let mut knots = [r, g, b];
        for (channel, sign) in knots.iter_mut().zip(signs) {
            if sign < 0.0 {
                channel.reverse();
                channel.iter_mut().for_each(|log| *log = -*log);
            }
        }
        if signs.iter().all(|sign| *sign > 0.0) {
            let mut all = vec![0; BINS];
            for c in 0..3 {
                all.iter_mut().zip(self.channel(c)).for_each(|(sum, count)| *sum += count);
            }
            let spread = Self::quantiles(&all, [0.07, 0.93]).map_or(0.0, |[l, h]| (h - l) / 3.1);
            let rarest = [0, 2].map(|c| self.channel(c).iter().sum::<u32>());
            shrink(&mut knots, spread, rarest[0].min(rarest[1]) as f32);
        }
        for channel in &mut knots {
            for k in 1..KNOTS {
                channel[k] = channel[k].max(channel[k - 1] + 1e-6);
            }
        }
        Some(Curve { knots, signs })
    }
}

/// Makes the curves as parallel as chance alone can have made them differ: of one dye they are.
fn shrink(knots: &mut [[f32; KNOTS]; 3], spread: f32, count: f32) {
    let mean: [f32; KNOTS] =
        std::array::from_fn(|k| (knots[0][k] + knots[1][k] + knots[2][k]) / 3.0);
    let offset = [0, 1, 2].map(|c| {
        let mut apart: [f32; KNOTS] = std::array::from_fn(|k| knots[c][k] - mean[k]);
        apart.sort_by(f32::total_cmp);
        apart[KNOTS / 2]
    });
    let bend = |c: usize, k: usize| knots[c][k] - mean[k] - offset[c];
    let squares: f32 = (0..3)
        .flat_map(|c| (0..KNOTS).map(move |k| (c, k)))
        .map(|(c, k)| bend(c, k).powi(2))
        .sum::<f32>()
        / (2.0 * KNOTS as f32);
    let chance = spread * spread / (count / 8.0);
    let kept = (1.0 - 2.0 * chance / squares.max(1e-12)).max(0.0);
    *knots =
        std::array::from_fn(|c| std::array::from_fn(|k| mean[k] + offset[c] + kept * bend(c, k)));
}

impl Curve {
    /// What to add to the log of a photosite of channel `from` for that of channel `to`.
    fn difference(&self, from: usize, to: usize, log: f32) -> f32 {
        let (a, b) = (&self.knots[from], &self.knots[to]);
        let value = log * self.signs[from];
        const LAST: usize = KNOTS - 1;
        let overall = ((b[LAST] - b[0]) / (a[LAST] - a[0])).clamp(1.0 / STEEPEST, STEEPEST);
        let there = if value <= a[0] {
            b[0] + overall * (value - a[0])
        } else if value >= a[LAST] {
            b[LAST] + overall * (value - a[LAST])
        } else {
            let k = a[1..LAST].partition_point(|knot| *knot <= value);
            b[k] + (b[k + 1] - b[k]) * (value - a[k]) / (a[k + 1] - a[k])
        };
        there * self.signs[to] - log
    }

    /// Least and greatest knot of a channel, as logs.
    fn range(&self, channel: usize) -> [f32; 2] {
        let knots = &self.knots[channel];
        let (a, b) = (knots[0] * self.signs[channel], knots[KNOTS - 1] * self.signs[channel]);
        [a.min(b), a.max(b)]
    }
}

/// Curves of windows that overlap by half.
pub(super) struct Curves {
    pub(super) grid: Grid,
    windows: Vec<Curve>,
}

impl Curves {
    /// Of windows twice as wide as `cell`; those that `wanted` refuses, and those with too few photosites, take the curve
    /// of the whole picture. `None` where that has none.
    pub(super) fn of(
        logs: &Image<f32>,
        cfa: Cfa,
        cell: usize,
        signs: &(dyn Fn([usize; 2]) -> [f32; 3] + Sync),
        wanted: &(dyn Fn([Range<usize>; 2]) -> bool + Sync),
    ) -> Option<Self> {
        let grid = Grid::new([logs.width, logs.height], cell);
        let cells: Vec<Option<Histogram>> = (0..grid.x.cells() * grid.y.cells())
            .into_par_iter()
            .map(|k| {
                let columns = grid.x.cell(k % grid.x.cells());
                let rows = grid.y.cell(k / grid.x.cells());
                wanted([columns.clone(), rows.clone()]).then(|| {
                    let mut histogram = Histogram::none();
                    histogram.add_part(logs, cfa, &columns, rows);
                    histogram
                })
            })
            .collect();
        let mut all = Histogram::none();
        cells.iter().flatten().for_each(|cell| all.add(cell));
        let whole = all.curve([1.0; 3])?;
        let windows = (0..grid.nodes()).into_par_iter().map(|node| {
            let [column, row] = grid.place_of(node);
            let mut sum = Histogram::none();
            for y in grid.y.cells_of(row) {
                for x in grid.x.cells_of(column) {
                    if let Some(cell) = &cells[y * grid.x.cells() + x] {
                        sum.add(cell);
                    }
                }
            }
            let middle = |range: Range<usize>| (range.start + range.end) / 2;
            let place = [middle(grid.x.window(column)), middle(grid.y.window(row))];
            sum.curve(signs(place)).unwrap_or(whole)
        });
        let windows = windows.collect();
        Some(Self { grid, windows })
    }

    /// The logs of all three channels of a band of rows into `out`; a photosite keeps its own. Only where `wanted`.
    pub(super) fn apply(
        &self,
        logs: &Image<f32>,
        cfa: Cfa,
        rows: Range<usize>,
        wanted: &dyn Fn(Range<usize>, Range<usize>) -> bool,
        out: &mut [[f32; 3]],
    ) {
        let width = logs.width;
        let bands = self.grid.y.spans(usize::MAX / 2);
        let bands = bands.iter().filter(|b| b.places.start < rows.end && b.places.end > rows.start);
        for band in bands {
            let inside = band.places.start.max(rows.start)..band.places.end.min(rows.end);
            for span in self.grid.x.spans(usize::MAX / 2) {
                if !wanted(span.places.clone(), inside.clone()) {
                    continue;
                }
                let columns = self.grid.x.nodes();
                let corners = [0, 1].map(|v| {
                    [0, 1].map(|u| &self.windows[band.nodes[v] * columns + span.nodes[u]])
                });
                let tables = [0, 1, 2].map(|c| Table::new(corners, c));
                for y in inside.clone() {
                    let down = band.first + band.step * (y - band.places.start) as f32;
                    let tables = [0, 1].map(|k| {
                        let c = cfa.channel(span.places.start + k, y) as usize;
                        (c, tables[c].at_row(down))
                    });
                    let own = &logs.data[y * width..][span.places.clone()];
                    let out = &mut out[(y - rows.start) * width..][span.places.clone()];
                    for (k, (out, log)) in out.iter_mut().zip(own).enumerate() {
                        let (channel, table) = &tables[k & 1];
                        let [next, last] = table.look_up(*log, span.first + span.step * k as f32);
                        out[*channel] = *log;
                        out[(channel + 1) % 3] = log + next;
                        out[(channel + 2) % 3] = log + last;
                    }
                }
            }
        }
    }
}

const ENTRIES: usize = 64;

/// Differences of one channel to the next two, at evenly spaced logs.
struct Table {
    lowest: f32,
    per_log: f32,
    /// At the top and at the bottom: next channel left and right, the one after left and right.
    rows: [[[f32; 4]; ENTRIES]; 2],
}

/// The same between top and bottom.
struct RowTable {
    lowest: f32,
    per_log: f32,
    entries: [[f32; 4]; ENTRIES],
}

impl Table {
    fn new(corners: [[&Curve; 2]; 2], channel: usize) -> Self {
        let ranges = corners.iter().flatten().map(|curve| curve.range(channel));
        let [low, high] =
            ranges.fold([f32::MAX, f32::MIN], |[low, high], [a, b]| [low.min(a), high.max(b)]);
        // One step beyond the knots, so that the first and the last step have the slope beyond them.
        let step = ((high - low) / (ENTRIES - 3) as f32).max(1e-5);
        let lowest = low - step;
        let rows = corners.map(|[left, right]| {
            std::array::from_fn(|k| {
                let log = lowest + step * k as f32;
                let [next, last] = [(channel + 1) % 3, (channel + 2) % 3];
                [
                    left.difference(channel, next, log),
                    right.difference(channel, next, log),
                    left.difference(channel, last, log),
                    right.difference(channel, last, log),
                ]
            })
        });
        Self { lowest, per_log: 1.0 / step, rows }
    }

    fn at_row(&self, down: f32) -> RowTable {
        let [top, bottom] = &self.rows;
        let entries = std::array::from_fn(|k| {
            std::array::from_fn(|j| top[k][j] + (bottom[k][j] - top[k][j]) * down)
        });
        RowTable { lowest: self.lowest, per_log: self.per_log, entries }
    }
}

impl RowTable {
    fn look_up(&self, log: f32, right: f32) -> [f32; 2] {
        let place = (log - self.lowest) * self.per_log;
        let k = (place as usize).min(ENTRIES - 2);
        let share = place - k as f32;
        let (a, b) = (&self.entries[k], &self.entries[k + 1]);
        let at = |j: usize| a[j] + (b[j] - a[j]) * share;
        [at(0) + (at(1) - at(0)) * right, at(2) + (at(3) - at(2)) * right]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Logs of a cloth whose channels are straight functions of one hidden variable.
    fn logs(slopes: [f32; 3], offsets: [f32; 3], size: [usize; 2]) -> Image<f32> {
        let [width, height] = size;
        let hidden = |x: usize, y: usize| {
            let (u, v) = (x as f32 / 2.6, y as f32 / 2.9);
            (std::f32::consts::TAU * u).sin() * (std::f32::consts::TAU * v).cos() + 0.002 * x as f32
        };
        let value = |k: usize| {
            let c = Cfa::RGGB.channel(k % width, k / width) as usize;
            offsets[c] + slopes[c] * hidden(k % width, k / width)
        };
        Image { width, height, data: (0..width * height).map(value).collect() }
    }

    /// Blends the windows' differences at one place, in float64.
    fn reference(curves: &Curves, logs: &Image<f32>, [x, y]: [usize; 2]) -> [f64; 3] {
        let ([left, right], u) = curves.grid.x.between(x);
        let ([top, bottom], v) = curves.grid.y.between(y);
        let (u, v) = (f64::from(u), f64::from(v));
        let log = *logs.at(x, y);
        let from = Cfa::RGGB.channel(x, y) as usize;
        [0, 1, 2].map(|to| {
            let at = |column: usize, row: usize| {
                let curve = &curves.windows[row * curves.grid.x.nodes() + column];
                f64::from(curve.difference(from, to, log))
            };
            let upper = at(left, top) * (1.0 - u) + at(right, top) * u;
            let lower = at(left, bottom) * (1.0 - u) + at(right, bottom) * u;
            f64::from(log) + if to == from { 0.0 } else { upper * (1.0 - v) + lower * v }
        })
    }

    #[test]
    fn tables_agree_with_the_curves() {
        let logs = logs([0.3, 0.5, 0.4], [-1.0, -0.8, -1.4], [300, 200]);
        let curves = Curves::of(&logs, Cfa::RGGB, 64, &|_| [1.0; 3], &|_| true).unwrap();
        let mut out = vec![[0.0; 3]; 300 * 40];
        curves.apply(&logs, Cfa::RGGB, 90..130, &|_, _| true, &mut out);
        for (k, found) in out.iter().enumerate() {
            let place = [k % 300, 90 + k / 300];
            let expected = reference(&curves, &logs, place);
            for c in 0..3 {
                // A table's straight pieces cut the corners at the knots.
                let off = (f64::from(found[c]) - expected[c]).abs();
                assert!(off < 0.012, "{place:?}, {c}: {found:?}, not {expected:?}");
            }
        }
    }

    #[test]
    fn hidden_channels_are_found_also_where_one_runs_backwards() {
        for (slopes, signs) in [([0.3, 0.5, 0.4], [1.0; 3]), ([0.5, -0.4, 0.3], [1.0, -1.0, 1.0])] {
            let offsets = [-1.0, -0.8, -1.4];
            let logs = logs(slopes, offsets, [256, 256]);
            let curves = Curves::of(&logs, Cfa::RGGB, 128, &|_| signs, &|_| true).unwrap();
            let mut out = vec![[0.0; 3]; 256 * 256];
            curves.apply(&logs, Cfa::RGGB, 0..256, &|_, _| true, &mut out);
            let (mut sum, mut count) = (0.0, 0.0);
            for (k, found) in out.iter().enumerate() {
                let own = Cfa::RGGB.channel(k % 256, k / 256) as usize;
                let hidden = (logs.data[k] - offsets[own]) / slopes[own];
                for c in (0..3).filter(|c| *c != own) {
                    sum += (found[c] - offsets[c] - slopes[c] * hidden).powi(2);
                    count += 1.0;
                }
            }
            let off = (sum / count as f32).sqrt();
            assert!(off < 0.03, "{slopes:?}: {off}");
        }
    }
}
