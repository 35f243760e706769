//! Bands of rows over threads: each row of frames is normalised, solved and written to the maps while it is in the
//! cache. Every row is solved by itself, so that the result cannot depend on how rows are shared out.

mod device;
mod inspect;
mod on_gpu;
#[cfg(test)]
pub(crate) mod reference;
pub(crate) mod residual;
mod rows;
mod solve;

#[cfg(test)]
pub(crate) use device::faster;
pub use rows::Rows;
pub use solve::SolvedScene;
#[cfg(test)]
pub(crate) use solve::noise;

use crate::linear::{
    AmbientNoise, LinearNoise, Normalizer, SignalRows, exposure_variances, variance_of_row,
};
use crate::photometry::{Albedo, Counts, Maps};
use crate::photometry::{
    FieldRow, Method, Outcome, RowError, RowInput, RowOutput, RowSolver, Support, VarianceModel,
};
use crate::raw::Layout;
use crate::solve::bands::on_gpu::{OnGpu, TileRows};
use crate::solve::bands::residual::{ResidualRows, residual_row};
use crate::solve::light_field::{FieldRows, LightField};
use crate::solve::scene::Scene;
use rayon::prelude::*;
use std::ops::Range;
use weavelight_calibration::description::Image;

/// Rows of a band: several rows of light-field nodes each, and enough bands for many threads.
const BAND_ROWS: usize = 64;
/// The same where a graphics processor takes part: several tiles.
const BAND_ROWS_ON_GPU: usize = 128;

/// A scene with everything that its rows share.
pub(crate) struct Run<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) field: &'a LightField<'a>,
    pub(crate) normalizer: Normalizer<'a>,
    pub(crate) method: Method,
    /// Per light and exposure: share in the mean, and variance per place of the 2 x 2 cell.
    weights: Vec<Vec<f64>>,
    exposure_variance: Vec<Vec<[VarianceModel; 4]>>,
    /// Whether any light has more than one exposure.
    several_exposures: bool,
    /// Per row parity and light: variance at even and odd columns with every exposure used.
    pub(crate) variance: [Vec<[VarianceModel; 2]>; 2],
    /// Who wants what the fit leaves over.
    pub(crate) residuals: Option<ResidualRows<'a>>,
}

/// Mutable parts of the maps that one band owns.
pub(crate) struct Band<'m> {
    pub(crate) first_row: usize,
    normal: &'m mut [[f32; 3]],
    albedo: &'m mut [f32],
    rgb: &'m mut [[f32; 3]],
    expected_error_deg: &'m mut [f32],
    pub(crate) outcome: &'m mut [Outcome],
}

/// What a thread keeps from row to row.
#[derive(Default)]
pub(crate) struct Worker {
    rows: SignalRows,
    solver: RowSolver,
    residual: Vec<f32>,
    support: Vec<Support>,
    /// Whether `support` is filled where the albedo does not need it.
    notes_support: bool,
    /// The tile under way, and the one being prepared.
    pub(crate) tiles: [TileRows; 2],
    /// What the fit leaves over of one light, as wide as the frame.
    of_light: Vec<f32>,
}

/// A row as the kernels want it.
pub(crate) struct ReadRow<'r> {
    pub(crate) y: usize,
    pub(crate) columns: Range<usize>,
    pub(crate) rows: &'r mut SignalRows,
    pub(crate) field: FieldRow<'r>,
}

/// One photosite of a row, as the run solves it.
pub(crate) struct Lone {
    pub(crate) normal: [f32; 3],
    pub(crate) albedo: f32,
    pub(crate) expected_error_deg: f32,
    pub(crate) residual: f32,
    pub(crate) outcome: Outcome,
    /// Which samples it rests on.
    pub(crate) support: Support,
    /// Per light: y, NaN where unusable; and its vector.
    pub(crate) signal: Vec<f32>,
    pub(crate) vectors: Vec<[f64; 3]>,
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        scene: &'a Scene,
        field: &'a LightField<'a>,
        noise: LinearNoise,
        method: Method,
    ) -> Self {
        let equal: Vec<Vec<f64>> =
            scene.lights.iter().map(|light| vec![1.0; light.exposures.len()]).collect();
        let rate = Normalizer::new(&scene.photographs(), &equal).mean_ambient_rate();
        let ambient = AmbientNoise::new(&scene.ambient, rate, noise);
        let exposure_variance = exposure_variances(&scene.photographs(), noise, ambient);
        let weights: Vec<Vec<f64>> =
            exposure_variance.iter().map(|of| exposure_weights(of)).collect();
        let variance = [0, 1].map(|parity| {
            let all = exposure_variance.iter().zip(&weights);
            all.map(|(of, weights)| variance_of_row(of, weights, parity, u64::MAX)).collect()
        });
        let normalizer = Normalizer::new(&scene.photographs(), &weights);
        Self {
            scene,
            field,
            normalizer,
            method,
            several_exposures: weights.iter().any(|weights| weights.len() > 1),
            weights,
            exposure_variance,
            variance,
            residuals: None,
        }
    }

    /// The kernel's method.
    pub(crate) fn method(&self) -> Method {
        self.method
    }

    /// Lights that were photographed.
    pub(crate) fn lights(&self) -> usize {
        self.scene.lights.len()
    }

    /// Photosites inside the mask.
    pub(crate) fn photosites(&self) -> usize {
        let all = self.scene.width * self.scene.height;
        let inside = |mask: &Image<bool>| mask.data.iter().filter(|&&inside| inside).count();
        self.scene.mask.as_ref().map_or(all, inside)
    }

    /// From the first to the last row inside the mask.
    pub(crate) fn rows_inside(&self) -> Range<usize> {
        let inside = |y: &usize| self.columns_inside(*y).is_some();
        let first = (0..self.scene.height).find(inside).unwrap_or(0);
        let last = (0..self.scene.height).rfind(inside).unwrap_or(0);
        first..last + 1
    }

    /// Solves rows on the current thread pool, their complete neighbours on a graphics processor where there is one. `done`
    /// is told of every finished row.
    pub(crate) fn solve_rows(
        &self,
        rows: Range<usize>,
        on: Option<&OnGpu>,
        done: &(dyn Fn(usize) + Sync),
    ) -> Maps {
        let (width, height) = (self.scene.width, rows.len());
        let band_rows = if on.is_some() { BAND_ROWS_ON_GPU } else { BAND_ROWS };
        let mut normal = Image::filled(width, height, [0.0_f32; 3]);
        let mut expected_error_deg = Image::filled(width, height, 0.0_f32);
        let mut outcome = Image::filled(width, height, Outcome::Masked);
        let colour = self.scene.layout == Layout::Rgb;
        let mut rgb = Image::filled(if colour { width } else { 0 }, height, [0.0_f32; 3]);
        let mut albedo = Image::filled(width, height, 0.0_f32);
        let pixels = width * band_rows;
        // A picture without colour has bands of no pixels there.
        let mut rgb_bands: Vec<&mut [[f32; 3]]> = rgb.data.chunks_mut(pixels).collect();
        rgb_bands.resize_with(height.div_ceil(band_rows), || &mut []);
        let bands = normal
            .data
            .par_chunks_mut(pixels)
            .zip(albedo.data.par_chunks_mut(pixels))
            .zip(expected_error_deg.data.par_chunks_mut(pixels))
            .zip(outcome.data.par_chunks_mut(pixels))
            .zip(rgb_bands)
            .enumerate()
            .map(|(index, ((((normal, albedo), expected_error_deg), outcome), rgb))| Band {
                first_row: rows.start + index * band_rows,
                normal,
                albedo,
                rgb,
                expected_error_deg,
                outcome,
            });
        let parts: Vec<Counts> = bands
            .map_init(Worker::default, |worker, mut band| match on {
                Some(on) if on.serves(self.method) => {
                    self.solve_band_on(on, worker, &mut band, done)
                }
                _ => self.solve_band(worker, &mut band, done),
            })
            .collect();
        let mut counts = Counts::default();
        parts.iter().for_each(|part| counts.add(part));
        let albedo = match self.scene.layout {
            Layout::Mosaic(cfa) => Albedo::Mosaic(albedo, cfa),
            Layout::Grey => Albedo::Grey(albedo),
            Layout::Rgb => Albedo::Rgb(rgb),
        };
        Maps { normal, albedo, expected_error_deg, outcome, counts }
    }

    /// Solves columns `columns` of row `y` and hands over each photosite. They must begin where [`Run::columns_inside`] could.
    pub(crate) fn solve_some(
        &self,
        y: usize,
        columns: Range<usize>,
        mut take: impl FnMut(usize, Lone),
    ) {
        let width = self.scene.width;
        let mut worker = Worker { notes_support: true, ..Worker::default() };
        let (mut normal, mut rgb) = (vec![[0.0; 3]; width], vec![[0.0; 3]; width]);
        let (mut albedo, mut expected_error_deg) = (vec![0.0; width], vec![0.0; width]);
        let mut outcome = vec![Outcome::Masked; width];
        let mut band = Band {
            first_row: y,
            normal: &mut normal,
            albedo: &mut albedo,
            rgb: &mut rgb,
            expected_error_deg: &mut expected_error_deg,
            outcome: &mut outcome,
        };
        let (mut fields, mut rows) = (FieldRows::new(self.field), SignalRows::default());
        self.read_row(y, columns.clone(), &mut rows);
        let field = fields.row(y, columns.start);
        let read = ReadRow { y, columns: columns.clone(), rows: &mut rows, field };
        let mut counts = Counts::default();
        self.write_row(&mut worker, &mut band, read, &mut counts, |solver, input, output| {
            solver.solve(input, output, self.method)
        });
        let signals = rows.signals();
        for x in columns.clone() {
            let at = x - columns.start;
            let lone = Lone {
                normal: normal[x],
                albedo: albedo[x],
                expected_error_deg: expected_error_deg[x],
                residual: worker.residual[at],
                outcome: outcome[x],
                support: worker.support[at],
                signal: signals.iter().map(|row| row[at]).collect(),
                vectors: (0..field.lights).map(|light| field.at(at, light).into()).collect(),
            };
            take(x, lone);
        }
    }

    fn solve_band(
        &self,
        worker: &mut Worker,
        band: &mut Band,
        done: &(dyn Fn(usize) + Sync),
    ) -> Counts {
        let width = self.scene.width;
        let mut field = FieldRows::new(self.field);
        let mut counts = Counts::default();
        let mut rows = std::mem::take(&mut worker.rows);
        for y in band.first_row..band.first_row + band.outcome.len() / width {
            if let Some(columns) = self.columns_inside(y) {
                self.read_row(y, columns.clone(), &mut rows);
                let field = field.row(y, columns.start);
                let read = ReadRow { y, columns, rows: &mut rows, field };
                self.write_row(worker, band, read, &mut counts, |solver, input, output| {
                    solver.solve(input, output, self.method)
                });
            } else {
                counts.outcomes[Outcome::Masked as usize] += width;
                self.no_residuals(worker, y);
            }
            done(1);
        }
        worker.rows = rows;
        counts
    }

    /// The columns from the first to the last inside the mask, begun where a node of the light field stands at an even
    /// column; `None` where the whole row is outside.
    pub(crate) fn columns_inside(&self, y: usize) -> Option<Range<usize>> {
        let Some(mask) = &self.scene.mask else { return Some(0..self.scene.width) };
        let row = mask.row(y);
        let (first, last) =
            (row.iter().position(|&inside| inside)?, row.iter().rposition(|&inside| inside)?);
        let align = self.field.alignment();
        Some(first / align * align..last + 1)
    }

    /// Normalises the columns of a row; unusable outside the mask.
    pub(crate) fn read_row(&self, y: usize, columns: Range<usize>, rows: &mut SignalRows) {
        self.normalizer.row(y, columns.clone(), rows);
        if let Some(inside) = self.inside(y, &columns) {
            rows.blank(inside);
        }
    }

    fn inside(&self, y: usize, columns: &Range<usize>) -> Option<&[bool]> {
        self.scene.mask.as_ref().map(|mask| &mask.row(y)[columns.clone()])
    }

    /// Solves a row by `kernel` and writes it to the maps.
    pub(crate) fn write_row(
        &self,
        worker: &mut Worker,
        band: &mut Band,
        ReadRow { y, columns, rows, field }: ReadRow,
        counts: &mut Counts,
        kernel: impl FnOnce(&mut RowSolver, &RowInput, &mut RowOutput) -> Result<(), RowError>,
    ) {
        let Worker { solver, residual, support, notes_support, of_light, .. } = worker;
        let inside = self.inside(y, &columns);
        residual.resize(columns.len(), 0.0);
        support.resize(columns.len(), Support::default());
        let at = (y - band.first_row) * self.scene.width;
        let span = at + columns.start..at + columns.end;
        let mut output = RowOutput {
            normal: &mut band.normal[span.clone()],
            albedo: &mut band.albedo[span.clone()],
            expected_error_deg: &mut band.expected_error_deg[span.clone()],
            residual,
            outcome: &mut band.outcome[span.clone()],
            support: (*notes_support || self.scene.layout == Layout::Rgb)
                .then_some(support.as_mut_slice()),
        };
        let signal: Vec<&[f32]> = rows.signals().iter().map(Vec::as_slice).collect();
        let (variance, noise_scale) = (&self.variance[y & 1], rows.noise_scale());
        let input = RowInput { signal: &signal, field, variance, noise_scale };
        // The slices are cut to fit above; were they not, the row would stay unsolved and say so.
        if kernel(solver, &input, &mut output).is_err() {
            output.outcome.fill(Outcome::TooFewLights);
        }
        if self.several_exposures {
            self.solve_incomplete(solver, rows, y, &input, &mut output);
        }
        if self.scene.layout == Layout::Rgb {
            albedo_of_channels(rows, &input.field, &output, &mut band.rgb[span]);
        }
        self.mark_defects(y, columns.clone(), output.outcome);
        if let Some(inside) = inside {
            let outside = inside.iter().enumerate().filter(|(_, inside)| !**inside);
            outside.for_each(|(column, _)| {
                output.outcome[column] = Outcome::Masked;
                rows.saturated[column] = false;
            });
        }
        if let Some(hand_out) = self.residuals {
            of_light.clear();
            of_light.resize(self.scene.width, f32::NAN);
            for (light, signal) in rows.signals().iter().enumerate() {
                let inside = &mut of_light[columns.clone()];
                residual_row(light, signal, &field, &output, inside);
                hand_out(light, y, of_light);
            }
        }
        counts.add_row(output.outcome, output.residual);
        counts.outcomes[Outcome::Masked as usize] += self.scene.width - columns.len();
        counts.saturated += rows.saturated.iter().filter(|&&saturated| saturated).count();
    }

    /// Hands out a row that is wholly outside the mask.
    pub(crate) fn no_residuals(&self, worker: &mut Worker, y: usize) {
        let Some(hand_out) = self.residuals else { return };
        worker.of_light.clear();
        worker.of_light.resize(self.scene.width, f32::NAN);
        (0..self.scene.lights.len()).for_each(|light| hand_out(light, y, &worker.of_light));
    }

    fn mark_defects(&self, y: usize, columns: Range<usize>, outcome: &mut [Outcome]) {
        let defects = self.scene.defects.columns(y, columns.start);
        for column in defects.take_while(|x| *x < columns.end) {
            outcome[column - columns.start] = Outcome::Defective;
        }
    }

    /// Photosites at which some exposures of a light clip and others do not have variances of their own: solved again,
    /// one by one.
    fn solve_incomplete(
        &self,
        solver: &mut RowSolver,
        rows: &SignalRows,
        y: usize,
        input: &RowInput,
        output: &mut RowOutput,
    ) {
        for column in 0..output.outcome.len() {
            if !self.is_incomplete(rows, column) {
                continue;
            }
            let signal: Vec<&[f32]> =
                input.signal.iter().map(|row| &row[column..=column]).collect();
            let vectors: Vec<[f64; 3]> =
                (0..input.field.lights).map(|light| input.field.at(column, light).into()).collect();
            let variance: Vec<[VarianceModel; 2]> = (0..input.field.lights)
                .map(|light| {
                    let used = rows.used[light].get(column).copied().unwrap_or(u64::MAX);
                    let of_row = variance_of_row(
                        &self.exposure_variance[light],
                        &self.weights[light],
                        y & 1,
                        used,
                    );
                    [of_row[column & 1]; 2]
                })
                .collect();
            let alone = RowInput {
                signal: &signal,
                field: FieldRow { step: 1, vectors: &vectors, lights: input.field.lights },
                variance: &variance,
                noise_scale: input.noise_scale.map(|scale| &scale[column..=column]),
            };
            let mut place = RowOutput {
                normal: &mut output.normal[column..=column],
                albedo: &mut output.albedo[column..=column],
                expected_error_deg: &mut output.expected_error_deg[column..=column],
                residual: &mut output.residual[column..=column],
                outcome: &mut output.outcome[column..=column],
                support: output.support.as_deref_mut().map(|of| &mut of[column..=column]),
            };
            if solver.solve(&alone, &mut place, self.method).is_err() {
                place.outcome.fill(Outcome::TooFewLights);
            }
        }
    }

    fn is_incomplete(&self, rows: &SignalRows, column: usize) -> bool {
        rows.used.iter().zip(&self.weights).any(|(used, weights)| {
            let all = all_exposures(weights.len());
            used.get(column).is_some_and(|&used| used != 0 && used & all != all)
        })
    }
}

/// What the reference needs to solve the same run by the book.
#[cfg(test)]
impl<'a> Run<'a> {
    /// The scene that is solved.
    pub(crate) fn scene(&self) -> &Scene {
        self.scene
    }

    /// Where the lights are.
    pub(crate) fn field(&self) -> &LightField<'a> {
        self.field
    }

    /// Share of an exposure in the mean of its light.
    pub(crate) fn weight(&self, light: usize, exposure: usize) -> f64 {
        self.weights[light][exposure]
    }

    /// Variance of a light's signal at a place of the 2 x 2 cell, with the exposures whose bit is set.
    pub(crate) fn variance_of(&self, light: usize, place: usize, used: u64) -> VarianceModel {
        variance_of_row(&self.exposure_variance[light], &self.weights[light], place / 2, used)
            [place % 2]
    }
}

/// A bit for every exposure.
fn all_exposures(count: usize) -> u64 {
    u64::MAX >> (64 - count.clamp(1, 64))
}

/// The weights that give the mean of several exposures the least variance, for a signal that fills half the range of the
/// longest.
fn exposure_weights(variance: &[[VarianceModel; 4]]) -> Vec<f64> {
    // Shot noise in units of the signal is 1 / (electrons per unit), so half of the longest exposure's range is known
    // only relative to the others; white (y = 1) times one half serves all.
    let at_half = |v: &VarianceModel| {
        1.0 / (f64::from(v.shot) * 0.5 + f64::from(v.floor)).max(f64::MIN_POSITIVE)
    };
    let weights: Vec<f64> =
        variance.iter().map(|places| places.iter().map(at_half).sum()).collect();
    let largest = weights.iter().copied().fold(0.0, f64::max);
    weights.iter().map(|weight| weight / largest).collect()
}

/// Albedo of each channel of colour pictures: least squares over the samples that the normal rests on.
fn albedo_of_channels(
    rows: &SignalRows,
    field: &FieldRow,
    output: &RowOutput,
    rgb: &mut [[f32; 3]],
) {
    let Some(support) = &output.support else { return };
    for (column, rgb) in rgb.iter_mut().enumerate() {
        let normal = nalgebra::Vector3::from(output.normal[column]).cast::<f64>();
        let (mut along, mut square) = ([0.0; 3], 0.0);
        for light in (0..field.lights).filter(|light| support[column].kept.contains(*light)) {
            let shading = field.at(column, light).dot(&normal);
            square += shading * shading;
            for (channel, along) in along.iter_mut().enumerate() {
                *along += shading * f64::from(rows.planes[light * 3 + channel][column]);
            }
        }
        *rgb = if square > 0.0 { along.map(|sum| (sum / square) as f32) } else { [0.0; 3] };
    }
}
