//! The whole way from a mosaic of albedo to colours and shade.

use super::curve::Curves;
use super::features::FeatureRow;
use super::flat::Structure;
use super::guard::{DARKEST, guard};
use super::interpolate::residual_interpolation;
use super::numeric::{exp, ln};
use super::print::{Base, Gate};
use super::relief::Relief;
use super::shading::{Shading, Window};
use rayon::prelude::*;
use std::ops::Range;
use weavelight_calibration::description::{Cfa, Channel, Image};

/// Rows that a thread takes at a time.
const BAND: usize = 32;
/// Columns that are interpolated at a time where cloth is flat: the margin around them costs less the more they are.
const FLAT_COLUMNS: usize = 192;
/// Cells of the windows in which a cloth's colours are compared; a window holds four.
const WIDE: usize = 128;
/// The same for prints.
const NARROW: usize = 24;
/// Relative error of the level where the crowns of the yarns are resolved, on simulated cloth.
const LEVEL_SIGMA: f64 = 0.02;
/// A side shorter than this has no window of its own.
const SHORTEST: usize = 128;

/// What the solve found.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Albedo of each photosite under its own filter.
    pub mosaic: &'a Image<f32>,
    /// Its filters.
    pub cfa: Cfa,
    /// Unit normals, rig frame.
    pub normal: &'a Image<[f32; 3]>,
    /// 0 where unsolved.
    pub mask: &'a Image<u8>,
}

/// Reflectance in the camera's channels, and what was divided out; 0 where unsolved.
pub struct Colours {
    /// Times the shade, a photosite's own channel is its own value.
    pub reflectance: Image<[f32; 3]>,
    /// At most 1.
    pub shade: Image<f32>,
    /// For the report.
    pub figures: Figures,
}

/// What a report says of the colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Photosites far out of their neighbourhood, brought back.
    pub limited: usize,
    /// Share of windows in which relief says different things of the channels.
    pub several_share: f64,
    /// Share of the picture that is printed.
    pub gated_share: f64,
    /// How much too low the level may be, relative, as yarns are not resolved or their shade is not told from dye.
    pub reads_low: f64,
    /// Expected relative error of the level: with that, what is left where crowns are resolved.
    pub level_sigma: f64,
}

/// Why the colours cannot be found this way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// Another arrangement of filters.
    #[error("the sensor's filters are not in a Bayer pattern")]
    NotBayer,
    /// No window fits.
    #[error(
        "the picture or what is solved of it is smaller than {SHORTEST} x {SHORTEST} photosites"
    )]
    TooSmall,
    /// A channel without a photosite.
    #[error("no photosite has a value in {0}")]
    Missing(&'static str),
    /// No fit.
    #[error("the solved parts are too thin or too few to compare colours with the relief")]
    NoWindow,
}

fn check(input: &Input, guarded: &Image<f32>) -> Result<(), Refused> {
    use Channel::{B, G, R};
    let bayer = matches!(input.cfa.cell, [R, G, G, B] | [B, G, G, R] | [G, R, B, G] | [G, B, R, G]);
    if !bayer {
        return Err(Refused::NotBayer);
    }
    let mut count = [0usize; 3];
    for y in 0..guarded.height {
        for (x, value) in guarded.row(y).iter().enumerate() {
            count[input.cfa.channel(x, y) as usize] += usize::from(*value > 0.0);
        }
    }
    let solved: usize = count.iter().sum();
    let short = guarded.width.min(guarded.height) < SHORTEST;
    if let Some(k) = (0..3).find(|k| count[*k] == 0 && solved > 0) {
        return Err(Refused::Missing(["red", "green", "blue"][k]));
    }
    if short || solved < SHORTEST * SHORTEST {
        return Err(Refused::TooSmall);
    }
    Ok(())
}

/// A mask of what has a value and a normal.
fn usable(input: &Input) -> Image<u8> {
    let solved = |k: usize| {
        let n = input.normal.data[k];
        let upward = n.iter().all(|c| c.is_finite()) && n[2] > 0.0;
        if input.mask.data[k] != 0 && upward { 255 } else { 0 }
    };
    let data = (0..input.mask.data.len()).into_par_iter().map(solved).collect();
    Image { width: input.mask.width, height: input.mask.height, data }
}

/// Finds colours and shade.
///
/// # Errors
/// Where the mosaic is of another kind, or there is too little of it.
pub fn find_colours(input: &Input) -> Result<Colours, Refused> {
    let mask = usable(input);
    let guarded = guard(input.mosaic, &mask);
    check(input, &guarded.values)?;
    let shading = Shading::estimate(&guarded.values, input.cfa, input.normal, &mask);
    if shading.is_unknown() {
        return Err(Refused::NoWindow);
    }
    let mut shade = Image::filled(input.mosaic.width, input.mosaic.height, 0.0);
    let logs = take_shade_out(&guarded.values, &shading, input.normal, &mask, &mut shade);
    let found = Found::new(&logs, input.cfa, &shading).ok_or(Refused::NoWindow)?;
    let reflectance = found.colours(input.normal, &mask, &guarded.values, &shade);
    let several_share = shading.several_share();
    let reads_low = shading.reads_low();
    let figures = Figures {
        limited: guarded.limited,
        several_share,
        gated_share: found.gate.mean(),
        reads_low,
        level_sigma: LEVEL_SIGMA.hypot(reads_low),
    };
    Ok(Colours { reflectance, shade, figures })
}

/// Logs without the shade, not-a-number where unsolved; the shade itself into `shade`.
fn take_shade_out(
    guarded: &Image<f32>,
    shading: &Shading,
    normal: &Image<[f32; 3]>,
    mask: &Image<u8>,
    shade: &mut Image<f32>,
) -> Image<f32> {
    let (width, height) = (guarded.width, guarded.height);
    let mut logs = Image::filled(width, height, f32::NAN);
    let bands = logs.data.par_chunks_mut(BAND * width).zip(shade.data.par_chunks_mut(BAND * width));
    bands.enumerate().for_each(|(band, (logs, shade))| {
        let first = band * BAND;
        let rows = first..(first + BAND).min(height);
        let relief = Relief::of_part(normal, mask, 0..width, rows);
        let mut features = FeatureRow::new(width);
        let mut line = vec![0.0; width];
        for (k, (logs, shade)) in logs.chunks_mut(width).zip(shade.chunks_mut(width)).enumerate() {
            features.fill(&relief, k);
            shading.row(first + k, &features, &mut line);
            let own = guarded.row(first + k);
            for (x, (log, shade)) in logs.iter_mut().zip(shade).enumerate() {
                if own[x] > 0.0 {
                    *shade = exp(line[x]);
                    *log = ln(own[x]) - line[x];
                }
            }
        }
    });
    logs
}

/// What the windows say, for the last sweep.
struct Found<'a> {
    logs: &'a Image<f32>,
    cfa: Cfa,
    shading: &'a Shading,
    wide: Curves,
    /// Where there is a print near.
    narrow: Option<Curves>,
    /// Share of the narrow windows, by the wide ones' nodes.
    narrow_share: Vec<f32>,
    structure: Structure,
    gate: Gate,
    print: Option<Print>,
}

/// Smoothed colours of a print, and curves of what is left.
struct Print {
    base: Base,
    rest: Image<f32>,
    curves: Curves,
}

impl<'a> Found<'a> {
    fn new(logs: &'a Image<f32>, cfa: Cfa, shading: &'a Shading) -> Option<Self> {
        let gate = Gate::of(logs, cfa);
        let signs = |place: [usize; 2]| shading.nearest(place).signs;
        let wide = Curves::of(logs, cfa, WIDE, &signs, &|_| true)?;
        let share = |node: usize| {
            let [column, row] = wide.grid.place_of(node);
            let (columns, rows) = (wide.grid.x.window(column), wide.grid.y.window(row));
            if gate.is_open() && gate.touches(&columns, &rows) { 1.0 } else { 0.0 }
        };
        let narrow_share: Vec<f32> = (0..wide.grid.nodes()).map(share).collect();
        let near = |[columns, rows]: [Range<usize>; 2]| {
            wide.grid.y.windows_around(&rows).any(|row| {
                wide.grid
                    .x
                    .windows_around(&columns)
                    .any(|column| narrow_share[row * wide.grid.x.nodes() + column] > 0.0)
            })
        };
        let any = narrow_share.iter().any(|share| *share > 0.0);
        let narrow = any.then(|| Curves::of(logs, cfa, NARROW, &signs, &near)).flatten();
        let print = gate.is_open().then(|| Print::new(logs, cfa, &gate, &signs)).flatten();
        let structure = Structure::of(logs, cfa);
        Some(Self { logs, cfa, shading, wide, narrow, narrow_share, structure, gate, print })
    }

    fn colours(
        &self,
        normal: &Image<[f32; 3]>,
        mask: &Image<u8>,
        guarded: &Image<f32>,
        shade: &Image<f32>,
    ) -> Image<[f32; 3]> {
        let (width, height) = (self.logs.width, self.logs.height);
        let mut out = Image::filled(width, height, [0.0; 3]);
        out.data.par_chunks_mut(BAND * width).enumerate().for_each(|(band, out)| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            self.wide.apply(self.logs, self.cfa, rows.clone(), &|_, _| true, out);
            self.mix_narrow(rows.clone(), out);
            self.mix_relief([normal.width, normal.height], rows.clone(), out, &|columns| {
                Relief::of_part(normal, mask, columns, rows.clone())
            });
            self.mix_print(rows.clone(), out);
            for (at, rgb) in (rows.start * width..rows.end * width).zip(out.iter_mut()) {
                *rgb = if guarded.data[at] > 0.0 { rgb.map(exp) } else { [0.0; 3] };
            }
            self.mix_flat(rows.clone(), out);
            for (y, line) in rows.zip(out.chunks_mut(width)) {
                for (x, rgb) in line.iter_mut().enumerate() {
                    let at = y * width + x;
                    if guarded.data[at] > 0.0 {
                        rgb[self.cfa.channel(x, y) as usize] = guarded.data[at] / shade.data[at];
                    }
                }
            }
        });
        out
    }

    fn mix_narrow(&self, rows: Range<usize>, out: &mut [[f32; 3]]) {
        let Some(narrow) = &self.narrow else { return };
        let width = self.logs.width;
        let share = |x: usize, y: usize| self.wide.grid.blend(&self.narrow_share, [x, y]);
        let wanted = |columns: Range<usize>, rows: Range<usize>| {
            let last = [columns.end - 1, rows.end - 1];
            [columns.start, last[0]]
                .iter()
                .any(|&x| [rows.start, last[1]].iter().any(|&y| share(x, y) > 0.0))
        };
        let mut found = vec![[f32::NAN; 3]; out.len()];
        narrow.apply(self.logs, self.cfa, rows.clone(), &wanted, &mut found);
        for (k, (out, found)) in out.iter_mut().zip(&found).enumerate() {
            if !found[0].is_nan() {
                mix(out, *found, share(k % width, rows.start + k / width));
            }
        }
    }

    /// Channels that no curve leads to: as relief tells them, or interpolated.
    fn mix_relief(
        &self,
        size: [usize; 2],
        rows: Range<usize>,
        out: &mut [[f32; 3]],
        relief: &dyn Fn(Range<usize>) -> Relief,
    ) {
        let columns = self.shading.grid.x.nodes();
        let distrusted = |window: &Window| window.trust.iter().flatten().any(|trust| *trust < 1.0);
        let around = self.shading.grid.y.windows_around(&rows);
        if !around
            .flat_map(|row| row * columns..(row + 1) * columns)
            .any(|node| distrusted(&self.shading.windows[node]))
        {
            return;
        }
        let width = size[0];
        let relief = relief(0..width);
        let mut features = FeatureRow::new(width);
        let mut lines = [0, 1, 2].map(|_| vec![0.0f32; width]);
        let linear = |x: usize, y: usize| {
            let log = self.logs.data[y * width + x];
            (!log.is_nan()).then(|| exp(log))
        };
        let flat = residual_interpolation(size, self.cfa, &linear, &(0..width), &rows);
        for (k, y) in rows.clone().enumerate() {
            features.fill(&relief, k);
            for (c, line) in lines.iter_mut().enumerate() {
                self.shading.channel_row(y, &features, c, line);
            }
            let ([top, bottom], v) = self.shading.grid.y.between(y);
            #[allow(clippy::needless_range_loop, reason = "a place in several rows and channels")]
            for x in 0..width {
                let at = k * width + x;
                let log = self.logs.data[y * width + x];
                if log.is_nan() {
                    continue;
                }
                let from = self.cfa.channel(x, y) as usize;
                let ([left, right], u) = self.shading.grid.x.between(x);
                let blend = |of: &dyn Fn(&Window) -> f32| {
                    let value = |row: usize, column: usize| {
                        of(&self.shading.windows[row * columns + column])
                    };
                    let upper = value(top, left) * (1.0 - u) + value(top, right) * u;
                    let lower = value(bottom, left) * (1.0 - u) + value(bottom, right) * u;
                    upper * (1.0 - v) + lower * v
                };
                for to in (0..3).filter(|to| *to != from) {
                    let trust = blend(&|window| window.trust[from][to]);
                    if trust < 1.0 {
                        let share = blend(&|window| window.by_relief[to]);
                        let told = lines[to][x] + 0.5 * (log - lines[from][x]);
                        let interpolated = ln(flat[at][to].max(DARKEST));
                        let other = share * told + (1.0 - share) * interpolated;
                        out[at][to] = trust * out[at][to] + (1.0 - trust) * other;
                    }
                }
            }
        }
    }

    fn mix_print(&self, rows: Range<usize>, out: &mut [[f32; 3]]) {
        let Some(print) = &self.print else { return };
        let width = self.logs.width;
        let wanted = |columns: Range<usize>, rows: Range<usize>| self.gate.touches(&columns, &rows);
        let mut found = vec![[f32::NAN; 3]; out.len()];
        print.curves.apply(&print.rest, self.cfa, rows.clone(), &wanted, &mut found);
        for (k, (out, found)) in out.iter_mut().zip(&found).enumerate() {
            let place = [k % width, rows.start + k / width];
            let (false, Some(base)) = (found[0].is_nan(), print.base.at(place)) else { continue };
            mix(out, [0, 1, 2].map(|c| base[c] + found[c]), self.gate.at(place));
        }
    }

    /// Flat parts, in linear values.
    fn mix_flat(&self, rows: Range<usize>, out: &mut [[f32; 3]]) {
        let (width, height) = (self.logs.width, self.logs.height);
        let value = |x: usize, y: usize| {
            let log = self.logs.data[y * width + x];
            (!log.is_nan()).then(|| exp(log))
        };
        for start in (0..width).step_by(FLAT_COLUMNS) {
            let columns = start..(start + FLAT_COLUMNS).min(width);
            if self.structure.fills(&columns, &rows) {
                continue;
            }
            let flat = residual_interpolation([width, height], self.cfa, &value, &columns, &rows);
            for (k, flat) in flat.into_iter().enumerate() {
                let (x, y) = (columns.start + k % columns.len(), rows.start + k / columns.len());
                let rgb = &mut out[(y - rows.start) * width + x];
                if *rgb != [0.0; 3] {
                    mix(rgb, flat, 1.0 - self.structure.at([x, y]));
                }
            }
        }
    }
}

impl Print {
    fn new(
        logs: &Image<f32>,
        cfa: Cfa,
        gate: &Gate,
        signs: &(dyn Fn([usize; 2]) -> [f32; 3] + Sync),
    ) -> Option<Self> {
        let base = Base::of(logs, cfa, gate);
        let width = logs.width;
        let mut rest = Image::filled(width, logs.height, f32::NAN);
        rest.data.par_chunks_mut(width).enumerate().for_each(|(y, rest)| {
            for (x, rest) in rest.iter_mut().enumerate() {
                if let Some(base) = base.at([x, y]) {
                    *rest = logs.data[y * width + x] - base[cfa.channel(x, y) as usize];
                }
            }
        });
        let touched = |[columns, rows]: [Range<usize>; 2]| gate.touches(&columns, &rows);
        let curves = Curves::of(&rest, cfa, NARROW, signs, &touched)?;
        Some(Self { base, rest, curves })
    }
}

fn mix(value: &mut [f32; 3], other: [f32; 3], share: f32) {
    value.iter_mut().zip(other).for_each(|(value, other)| *value += (other - *value) * share);
}
