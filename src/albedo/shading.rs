//! How dark relief makes a photosite, from the scan itself: log albedo regressed on features of the normals, window by
//! window, and whether the channels agree about it. Where they do not, it is dye and not shade.

use super::features::{FEATURES, FeatureRow};
use super::gram::{Coefficients, Gram, Samples, TERMS};
use super::grid::Grid;
use super::numeric::{ln, quantile, smoothstep};
use super::relief::Relief;
use multiversion::multiversion;
use rayon::prelude::*;
use weavelight_calibration::description::{Cfa, Image};

/// Cells of the grid; windows are twice as wide.
const CELL: usize = 256;
const RIDGE: f64 = 1e-3;
/// Solves, each with weights from the one before.
const PASSES: usize = 3;
/// Residuals beyond this many standard deviations count less (Huber).
const HUBER: f32 = 2.0;
/// Fewer photosites of a channel than this do not tell.
const FEWEST: usize = 1024;
/// Share of photosites that are darker than the crowns of the yarns, where no light is lost.
const CROWNS: f64 = 0.9;
/// Below this roughness cloth is flat, above the second it is not.
const FLAT: [f32; 2] = [0.0016, 0.0024];
/// Differences between what relief says of the channels (RMS of logs): one dye below, several above.
const DYES: [f32; 2] = [0.012, 0.022];
/// Channels that correlate less than this run against each other.
const AGAINST: f64 = -0.3;

/// What a window says.
#[derive(Clone, Debug)]
pub(super) struct Window {
    /// Mean over the channels, times the share that is shade.
    shade: Coefficients,
    /// What to take from it, so that it is 0 at the crowns.
    crowns: f64,
    /// 0: one dye; 1: several.
    pub(super) several: f32,
    /// Median roughness of the normals.
    pub(super) rough: f32,
    /// Of each channel.
    pub(super) channels: [Coefficients; 3],
    /// What is to be added to these.
    pub(super) constants: [f64; 3],
    /// How far the curve serves from one channel to another: not where a third dye or none of its order leads it.
    pub(super) trust: [[f32; 3]; 3],
    /// Where it does not: share of what relief says, beside interpolation.
    pub(super) by_relief: [f32; 3],
    /// -1: the channel runs against the one that varies most.
    pub(super) signs: [f32; 3],
    /// How far the crowns stand out of the rest, in logs.
    pub(super) contrast: f32,
    /// What of the crowns' place is not known.
    pub(super) known: bool,
}

/// Shading of the whole picture.
pub(super) struct Shading {
    pub(super) grid: Grid,
    pub(super) windows: Vec<Window>,
}

/// Photosites of a cell that take part.
struct Cell {
    channels: [Samples; 3],
    rough: Vec<f32>,
    neighbours: [Neighbours; 3],
    /// Standard deviation of the residuals.
    residual: [f32; 3],
}

/// Rows of which two take part, so that each part of the mosaic's cell does; more where the picture is small.
fn rows_apart(size: [usize; 2]) -> usize {
    match size[0] * size[1] {
        0..1_000_000 => 2,
        1_000_000..3_000_000 => 4,
        3_000_000..8_000_000 => 8,
        _ => 16,
    }
}

impl Shading {
    /// Estimates it; windows without enough photosites say nothing.
    pub(super) fn estimate(
        guarded: &Image<f32>,
        cfa: Cfa,
        normal: &Image<[f32; 3]>,
        mask: &Image<u8>,
    ) -> Self {
        let size = [guarded.width, guarded.height];
        let grid = Grid::new(size, CELL);
        let apart = rows_apart(size);
        let places: Vec<[usize; 2]> = (0..grid.x.cells() * grid.y.cells())
            .map(|k| [k % grid.x.cells(), k / grid.x.cells()])
            .collect();
        let mut cells: Vec<Cell> = places
            .par_iter()
            .map(|place| sample(guarded, cfa, normal, mask, &grid, *place, apart))
            .collect();
        let mut found: Vec<[Option<Coefficients>; 3]> = vec![[None; 3]; grid.nodes()];
        let mut equal = Vec::new();
        for pass in 0..PASSES {
            if pass > 0 {
                cells.par_iter_mut().zip(&places).for_each(|(cell, place)| {
                    cell.weigh(&mean_around(&grid, &found, *place));
                });
            }
            let grams: Vec<[Gram; 3]> = cells
                .par_iter()
                .map(|cell| [0, 1, 2].map(|c| Gram::of(&cell.channels[c])))
                .collect();
            let sums: Vec<[Gram; 3]> =
                (0..grid.nodes()).map(|node| sum_of(&grid, &grams, node)).collect();
            found = sums.par_iter().map(|sum| [0, 1, 2].map(|c| sum[c].fit(RIDGE))).collect();
            if pass == 0 {
                equal = sums;
            }
        }
        let windows = (0..grid.nodes())
            .into_par_iter()
            .map(|node| Window::new(&grid, node, &cells, &equal[node], &found[node]))
            .collect();
        Self { grid, windows }
    }

    /// Whether no window could be fitted.
    pub(super) fn is_unknown(&self) -> bool {
        self.windows.iter().all(|window| !window.known)
    }

    /// Share of the windows with several dyes.
    pub(super) fn several_share(&self) -> f64 {
        let sum = self.windows.iter().map(|window| f64::from(window.several)).sum::<f64>();
        sum / self.windows.len() as f64
    }

    /// How much too low the level may be, relative; the median over the windows.
    pub(super) fn reads_low(&self) -> f64 {
        let known = self.windows.iter().filter(|window| window.known);
        let mut all: Vec<f32> = known.map(Window::reads_low).collect();
        quantile(&mut all, 0.5).map_or(0.0, f64::from)
    }

    /// The window nearest to a place.
    pub(super) fn nearest(&self, [x, y]: [usize; 2]) -> &Window {
        let node = self.grid.y.nearest(y) * self.grid.x.nodes() + self.grid.x.nearest(x);
        &self.windows[node]
    }

    /// The log of the shade in row `y` into `out`.
    pub(super) fn row(&self, y: usize, features: &FeatureRow, out: &mut [f32]) {
        self.blend_row(y, features, &Window::line, out);
        for (out, rough) in out.iter_mut().zip(&features.rough) {
            *out = bounded(*out, *rough);
        }
    }

    /// The log of a channel in row `y`, as relief alone tells it, into `out`.
    pub(super) fn channel_row(
        &self,
        y: usize,
        features: &FeatureRow,
        channel: usize,
        out: &mut [f32],
    ) {
        let line = |window: &Window| {
            let (terms, constant) = (&window.channels[channel], window.constants[channel]);
            std::array::from_fn(|k| if k < TERMS { terms[k] } else { constant })
        };
        self.blend_row(y, features, &line, out);
    }

    /// Blends what the windows' lines say of a row.
    fn blend_row(
        &self,
        y: usize,
        features: &FeatureRow,
        line: &dyn Fn(&Window) -> [f64; TERMS + 1],
        out: &mut [f32],
    ) {
        let ([top, bottom], v) = self.grid.y.between(y);
        let columns = self.grid.x.nodes();
        let between = |column: usize| -> Line {
            let a = line(&self.windows[top * columns + column]);
            let b = line(&self.windows[bottom * columns + column]);
            std::array::from_fn(|k| (a[k] + (b[k] - a[k]) * f64::from(v)) as f32)
        };
        for span in self.grid.x.spans(usize::MAX / 2) {
            let first = between(span.nodes[0]);
            let second = between(span.nodes[1]);
            let change: Line = std::array::from_fn(|k| second[k] - first[k]);
            let places = span.places.clone();
            let values = features.values.each_ref().map(|values| &values[places.clone()]);
            add_lines(&first, &change, [span.first, span.step], values, &mut out[places]);
        }
    }
}

/// Puts what a line says, as it changes along the row, into `out`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn add_lines(
    first: &Line,
    change: &Line,
    [start, step]: [f32; 2],
    values: [&[f32]; FEATURES],
    out: &mut [f32],
) {
    let length = out.len();
    let values = values.map(|values| &values[..length]);
    for (k, out) in out.iter_mut().enumerate() {
        let (mut a, mut b) = (first[TERMS], change[TERMS]);
        for f in 0..FEATURES {
            let value = values[f][k];
            a += value * (first[f] + value * first[FEATURES + f]);
            b += value * (change[f] + value * change[FEATURES + f]);
        }
        *out = a + (start + step * k as f32) * b;
    }
}

/// Shade takes light away, and not more than the spread of the normals lets it.
fn bounded(log_shade: f32, rough: f32) -> f32 {
    log_shade.min(0.0).max(-4.0 * rough.max(0.0))
}

/// Coefficients of the terms, then a constant.
type Line = [f32; TERMS + 1];

impl Window {
    fn line(&self) -> [f64; TERMS + 1] {
        let crowns = self.crowns;
        std::array::from_fn(|k| if k < TERMS { self.shade[k] } else { -crowns })
    }

    /// Where yarns are resolved, normals spread more than light does: the middle lies about 0.6 times the roughness below
    /// the crowns. On simulated linen and knit of 1 to 5 photosites a yarn the level falls by the share below for what is
    /// beyond that.
    fn reads_low(&self) -> f32 {
        const RESOLVED: f32 = 0.6;
        const PER_RATIO: f32 = 0.22;
        const MOST: f32 = 0.3;
        const SEVERAL: f32 = 0.15;
        let ratio = self.contrast / self.rough.max(1e-4);
        let unresolved = (PER_RATIO * (ratio - RESOLVED)).clamp(0.0, MOST);
        let structured = smoothstep(self.rough, 0.004, 0.008);
        structured * (unresolved + (SEVERAL - unresolved) * self.several)
    }

    fn unknown(rough: f32) -> Self {
        Self {
            shade: Coefficients::zeros(),
            crowns: 0.0,
            several: 0.0,
            rough,
            channels: [Coefficients::zeros(); 3],
            constants: [0.0; 3],
            trust: [[1.0; 3]; 3],
            by_relief: [0.0; 3],
            signs: [1.0; 3],
            contrast: 0.0,
            known: false,
        }
    }

    fn new(
        grid: &Grid,
        node: usize,
        cells: &[Cell],
        equal: &[Gram; 3],
        found: &[Option<Coefficients>; 3],
    ) -> Self {
        let [column, row] = grid.place_of(node);
        let inside: Vec<&Cell> = cells_of(grid, [column, row]).map(|k| &cells[k]).collect();
        let mut rough: Vec<f32> = inside.iter().flat_map(|cell| cell.rough.clone()).collect();
        let rough = quantile(&mut rough, 0.5).unwrap_or(0.0);
        let count = [0, 1, 2].map(|c| inside.iter().map(|cell| cell.channels[c].len()).sum());
        let &[Some(r), Some(g), Some(b)] = found else { return Self::unknown(rough) };
        if count.iter().any(|&count: &usize| count < FEWEST) {
            return Self::unknown(rough);
        }
        let channels = [r, g, b];
        let residual = [0, 1, 2].map(|c| {
            let of = |cell: &&Cell| cell.channels[c].len() as f32 * cell.residual[c].powi(2);
            (inside.iter().map(of).sum::<f32>() / count[c] as f32).sqrt()
        });
        let mut all = Gram::none();
        equal.iter().for_each(|gram| all.add(gram));
        let covariance = all.covariance();
        let product = |a: &Coefficients, b: &Coefficients| (a.transpose() * covariance * b)[0];
        let mean = (r + g + b) / 3.0;
        let apart = channels.iter().map(|c| product(&(c - mean), &(c - mean)).max(0.0));
        let apart = (apart.sum::<f64>() / 3.0).sqrt() as f32;
        let noise = (0..3).map(|c| residual[c].powi(2) * TERMS as f32 / count[c] as f32);
        let noise = (noise.sum::<f32>() / 3.0).sqrt();
        let area = grid.x.window(column).len() * grid.y.window(row).len();
        let several = several_dyes(apart, noise, area);
        let spread = channels.map(|c| product(&c, &c).max(0.0).sqrt());
        let correlation: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                product(&channels[i], &channels[j]) / (spread[i] * spread[j] + 1e-12)
            })
        });
        let widest = (0..3).max_by(|a, b| spread[*a].total_cmp(&spread[*b])).unwrap_or(1);
        let flat = smoothstep(rough, FLAT[0], FLAT[1]);
        let signs = [0, 1, 2].map(|c| {
            let against = several > 0.5 && flat > 0.5 && correlation[widest][c] < AGAINST;
            if against { -1.0 } else { 1.0 }
        });
        let [crowns, middle] = crowns_and_middle(&inside, &mean);
        let share = f64::from((1.0 - several) * flat);
        let deviation = [0, 1, 2].map(|c| equal[c].deviation() as f32);
        let trust = match several > 0.5 && flat > 0.5 {
            true => trust(&correlation, &deviation),
            false => [[1.0; 3]; 3],
        };
        Self {
            shade: mean * share,
            crowns: f64::from(crowns) * share,
            several: several * flat,
            rough,
            channels,
            constants: [0, 1, 2].map(|c| equal[c].constant(&channels[c])),
            trust,
            by_relief: by_relief(&inside, &residual, &deviation),
            signs,
            contrast: crowns - middle,
            known: true,
        }
    }
}

/// Whether relief says different things of the channels, from their distance and its noise; a smaller window tells less.
fn several_dyes(apart: f32, noise: f32, area: usize) -> f32 {
    let smaller = (2.0 * CELL as f32 / (area as f32).sqrt()).clamp(1.0, 4.0);
    let least = DYES[0] * smaller.powf(1.32);
    let most = DYES[1] * smaller.powf(1.86);
    smoothstep(apart, least.max(3.0 * noise), most.max(6.0 * noise))
}

/// What the terms say at the crowns of the yarns, and at the median.
fn crowns_and_middle(inside: &[&Cell], coefficients: &Coefficients) -> [f32; 2] {
    let mut predicted: Vec<f32> = Vec::new();
    let mut line = Vec::new();
    for samples in inside.iter().flat_map(|cell| &cell.channels) {
        samples.predict(coefficients, &mut line);
        predicted.extend(&line);
    }
    [CROWNS, 0.5].map(|share| quantile(&mut predicted, share).unwrap_or(0.0))
}

/// Share of relief beside interpolation, by what either leaves over of a channel's spread (fourth powers).
fn by_relief(inside: &[&Cell], residual: &[f32; 3], deviation: &[f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|c| {
        let pairs = inside.iter().map(|cell| &cell.neighbours[c]);
        let apart = (1.0 - Neighbours::correlation(pairs).powi(2)).max(1e-3);
        let unexplained = (residual[c] / deviation[c].max(1e-6)).powi(4);
        (apart * apart) as f32 / ((apart * apart) as f32 + unexplained)
    })
}

/// How far a curve leads from each channel to each other: they must rise or fall together, and the second must not vary so
/// much more that it makes noise of what the first does not see.
fn trust(correlation: &[[f64; 3]; 3], deviation: &[f32; 3]) -> [[f32; 3]; 3] {
    std::array::from_fn(|from| {
        std::array::from_fn(|to| {
            let together = correlation[from][to] as f32;
            let alike = match together > 0.0 {
                true => smoothstep(together, 0.85, 0.95),
                false => smoothstep(-together, 0.5, 0.7),
            };
            let steeper = deviation[to] / deviation[from].max(1e-6);
            if from == to { 1.0 } else { alike * (1.0 - smoothstep(steeper, 2.6, 3.6)) }
        })
    })
}

/// Sums over photosites and the mean of their four neighbours of the same channel.
#[derive(Clone, Copy, Default)]
struct Neighbours {
    sums: [f64; 6],
}

impl Neighbours {
    fn add(&mut self, own: f32, around: f32) {
        let (a, b) = (f64::from(own), f64::from(around));
        let terms = [1.0, a, b, a * a, b * b, a * b];
        self.sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }

    fn correlation<'a>(all: impl Iterator<Item = &'a Self>) -> f64 {
        let mut total = [0.0; 6];
        all.for_each(|one| total.iter_mut().zip(one.sums).for_each(|(sum, part)| *sum += part));
        let [count, a, b, aa, bb, ab] = total.map(|sum| sum / total[0].max(1.0));
        let (va, vb) = ((aa - a * a).max(0.0), (bb - b * b).max(0.0));
        if count > 0.0 { (ab - a * b) / (va * vb).sqrt().max(1e-12) } else { 0.0 }
    }
}

impl Cell {
    /// Weights by how well the coefficients explain each photosite.
    fn weigh(&mut self, coefficients: &[Option<Coefficients>; 3]) {
        let mut predicted = Vec::new();
        for ((samples, coefficients), residual) in
            self.channels.iter_mut().zip(coefficients).zip(&mut self.residual)
        {
            let Some(coefficients) = coefficients else { continue };
            samples.predict(coefficients, &mut predicted);
            predicted.iter_mut().zip(&samples.y).for_each(|(p, y)| *p = y - *p);
            let mut sorted = predicted.clone();
            let Some(middle) = quantile(&mut sorted, 0.5) else { continue };
            predicted.iter_mut().for_each(|p| *p = (*p - middle).abs());
            sorted.copy_from_slice(&predicted);
            let spread = 1.48 * quantile(&mut sorted, 0.5).unwrap_or(0.0);
            *residual = spread;
            let limit = (HUBER * spread).max(1e-6);
            let weights = samples.weight.iter_mut().zip(&predicted);
            weights.for_each(|(weight, off)| *weight = 1.0 / (off / limit).max(1.0));
        }
    }
}

fn cells_of(grid: &Grid, [column, row]: [usize; 2]) -> impl Iterator<Item = usize> {
    let across = grid.x.cells_of(column);
    let columns = grid.x.cells();
    grid.y.cells_of(row).flat_map(move |y| across.clone().map(move |x| y * columns + x))
}

fn sum_of(grid: &Grid, grams: &[[Gram; 3]], node: usize) -> [Gram; 3] {
    let mut sum = [Gram::none(), Gram::none(), Gram::none()];
    for cell in cells_of(grid, grid.place_of(node)) {
        sum.iter_mut().zip(&grams[cell]).for_each(|(sum, gram)| sum.add(gram));
    }
    sum
}

/// Mean of the coefficients of the windows that hold a cell.
fn mean_around(
    grid: &Grid,
    found: &[[Option<Coefficients>; 3]],
    place: [usize; 2],
) -> [Option<Coefficients>; 3] {
    let [x, y] = place;
    let nodes = |k: usize, count: usize| k.saturating_sub(1)..(k + 1).min(count);
    [0, 1, 2].map(|c| {
        let mut sum = Coefficients::zeros();
        let mut count = 0.0;
        for row in nodes(y, grid.y.nodes()) {
            for column in nodes(x, grid.x.nodes()) {
                if let Some(found) = &found[row * grid.x.nodes() + column][c] {
                    sum += found;
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    })
}

fn sample(
    guarded: &Image<f32>,
    cfa: Cfa,
    normal: &Image<[f32; 3]>,
    mask: &Image<u8>,
    grid: &Grid,
    [column, row]: [usize; 2],
    apart: usize,
) -> Cell {
    let mut cell = Cell {
        channels: std::array::from_fn(|_| Samples::default()),
        rough: Vec::new(),
        neighbours: [Neighbours::default(); 3],
        residual: [0.0; 3],
    };
    let (across, along) = (grid.x.cell(column), grid.y.cell(row));
    let mut features = FeatureRow::new(across.len());
    let whole = |x: usize, y: usize| {
        let rows = y.saturating_sub(1)..(y + 2).min(mask.height);
        rows.into_iter().all(|v| {
            let columns = x.saturating_sub(1)..(x + 2).min(mask.width);
            mask.data[v * mask.width..][columns].iter().all(|solved| *solved != 0)
        })
    };
    for (pair, start) in along.clone().step_by(apart).enumerate() {
        // Where a pair of rows starts changes from pair to pair: a weave's own period does not hide from it.
        let start = start + (pair * 5 % 4 * apart / 4) / 2 * 2;
        let end = (start + 2).min(along.end);
        if start >= end {
            continue;
        }
        let relief = Relief::of_part(normal, mask, across.clone(), start..end);
        for y in start..end {
            features.fill(&relief, y - start);
            for (k, x) in across.clone().enumerate() {
                let value = guarded.data[y * guarded.width + x];
                if value <= 0.0 || !whole(x, y) {
                    continue;
                }
                let channel = cfa.channel(x, y) as usize;
                if let Some(around) = mean_around_site(guarded, [x, y]) {
                    cell.neighbours[channel].add(ln(value), around);
                }
                let samples = &mut cell.channels[channel];
                for (all, values) in samples.features.iter_mut().zip(&features.values) {
                    all.push(values[k]);
                }
                samples.y.push(ln(value));
                samples.weight.push(1.0);
                cell.rough.push(features.rough[k]);
            }
        }
    }
    cell
}

/// Mean log of the four photosites at a distance of two; `None` where one has no value.
fn mean_around_site(guarded: &Image<f32>, [x, y]: [usize; 2]) -> Option<f32> {
    let inside = x >= 2 && y >= 2 && x + 2 < guarded.width && y + 2 < guarded.height;
    if !inside {
        return None;
    }
    let at = y * guarded.width + x;
    let all = [at - 2, at + 2, at - 2 * guarded.width, at + 2 * guarded.width];
    let values = all.map(|at| guarded.data[at]);
    values.iter().all(|value| *value > 0.0).then(|| values.map(ln).iter().sum::<f32>() / 4.0)
}
