//! Generated rows of raw numbers, and solving them from there with the kernels alone: no files, no camera, no masks.
//!
//! What a band needs does not grow with the picture that it stands for: a hundred megapixels are one band again and again.

use crate::photometry::{
    FieldRow, Method, Normalisation, Outcome, RowInput, RowOutput, RowSolver, VarianceModel,
    normalise_row,
};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Photosites in a row.
pub const WIDTH: usize = 4928;
const STEP: usize = 64;
const BLACK: f32 = 600.0;
const FULL: f32 = 15_000.0;
const ELECTRONS_PER_DN: f64 = 2.7;

/// A band of raw rows under a near-light rig.
pub struct Band {
    rows: usize,
    frames: Vec<Vec<u16>>,
    /// Light vectors at the nodes of the first and of the last row.
    field: [Vec<[f64; 3]>; 2],
    variance: Vec<[VarianceModel; 2]>,
}

/// Nearly normal: the sum of four.
fn gauss(random: &mut fastrand::Rng) -> f64 {
    ((0..4).map(|_| random.f64()).sum::<f64>() - 2.0) * 3.0_f64.sqrt()
}

fn light_positions(count: usize) -> Vec<Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let light = |i: usize| {
        let share = (i as f64 + 0.5) / count as f64;
        let z = 0.6 + 0.35 * share;
        let radius = (1.0 - z * z).sqrt();
        560.0
            * Vector3::new(
                radius * (golden * i as f64).cos(),
                radius * (golden * i as f64).sin(),
                z,
            )
    };
    (0..count).map(light).collect()
}

fn field_row(lights: &[Vector3<f64>], y_mm: f64) -> Vec<[f64; 3]> {
    let node =
        |node: usize| Vector3::new(0.085 * (node * STEP) as f64 - 0.0425 * WIDTH as f64, y_mm, 0.0);
    let vector = move |light: &Vector3<f64>, at: Vector3<f64>| {
        let to_light = light - at;
        (to_light * 560.0_f64.powi(2) / to_light.norm().powi(3)).into()
    };
    (0..=WIDTH.div_ceil(STEP))
        .flat_map(|k| lights.iter().map(move |l| vector(l, node(k))))
        .collect()
}

impl Band {
    /// Rows of wavy cloth under `lights` lights; the share `failing` of the photosites has one sample in shadow or in a highlight.
    pub fn new(lights: usize, rows: usize, failing: f64) -> Self {
        let positions = light_positions(lights);
        // The same at both ends: the samples below are made with one row's light vectors.
        let row = field_row(&positions, 10.0);
        let field = [row.clone(), row];
        let mut random = fastrand::Rng::with_seed(0x9e37_79b9_7f4a_7c15);
        let mut frames = vec![vec![0_u16; rows * WIDTH]; lights];
        let nodes = FieldRow { step: STEP, vectors: &field[0], lights };
        for place in 0..rows * WIDTH {
            let column = place % WIDTH;
            let (a, b) = ((0.4 * column as f64).sin(), (0.23 * (place / WIDTH) as f64).cos());
            let g = 0.5 * Vector3::new(0.5 * a, 0.5 * b, 1.0).normalize();
            let spoilt = if random.f64() < failing {
                (random.f64() * lights as f64) as usize
            } else {
                lights
            };
            for (i, frame) in frames.iter_mut().enumerate() {
                let mut y = g.dot(&nodes.at(column, i)).max(0.0);
                if i == spoilt {
                    y *= if random.f64() < 0.5 { 0.1 } else { 1.6 };
                }
                let signal = y * f64::from(FULL) / 2.0;
                let noise = (signal / ELECTRONS_PER_DN + 3.0).sqrt() * gauss(&mut random);
                frame[place] =
                    (f64::from(BLACK) + signal + noise).round().clamp(0.0, 16_383.0) as u16;
            }
        }
        Self { rows, frames, field, variance: vec![[noise(); 2]; lights] }
    }

    /// Bytes of samples and of what comes out.
    pub fn bytes(&self) -> usize {
        self.rows * WIDTH * (2 * self.frames.len() + std::mem::size_of::<Site>())
    }
}

fn noise() -> VarianceModel {
    let full = f64::from(FULL) / 2.0;
    VarianceModel {
        shot: (1.0 / ELECTRONS_PER_DN / full) as f32,
        floor: (3.1 / full / full) as f32,
        kappa: 0.0,
    }
}

/// What one photosite takes in the output.
type Site = ([f32; 3], f32, f32, f32, Outcome);

/// The output of a band.
pub struct Output {
    normal: Vec<[f32; 3]>,
    albedo: Vec<f32>,
    error: Vec<f32>,
    residual: Vec<f32>,
    outcome: Vec<Outcome>,
}

impl Output {
    /// Room for the output of a band of `rows` rows.
    pub fn new(rows: usize) -> Self {
        let n = rows * WIDTH;
        Self {
            normal: vec![[0.0; 3]; n],
            albedo: vec![0.0; n],
            error: vec![0.0; n],
            residual: vec![0.0; n],
            outcome: vec![Outcome::Masked; n],
        }
    }

    /// Rows with their number, in parallel.
    pub fn rows(&mut self) -> impl IndexedParallelIterator<Item = (usize, RowOutput<'_>)> {
        let parts = self.normal.par_chunks_mut(WIDTH).zip(self.albedo.par_chunks_mut(WIDTH));
        let parts =
            parts.zip(self.error.par_chunks_mut(WIDTH)).zip(self.residual.par_chunks_mut(WIDTH));
        let parts = parts.zip(self.outcome.par_chunks_mut(WIDTH)).enumerate();
        parts.map(|(row, ((((normal, albedo), expected_error_deg), residual), outcome))| {
            (
                row,
                RowOutput { normal, albedo, expected_error_deg, residual, outcome, support: None },
            )
        })
    }
}

/// Reads every sample and writes every output once.
pub fn touch(band: &Band, output: &mut Output) {
    output.rows().for_each(|(row, out)| {
        let place = row * WIDTH..(row + 1) * WIDTH;
        let sum =
            |frame: &Vec<u16>| frame[place.clone()].iter().map(|&v| u32::from(v)).sum::<u32>();
        let value = band.frames.iter().map(sum).sum::<u32>() as f32;
        out.normal.fill([value; 3]);
        out.albedo.fill(value);
        out.expected_error_deg.fill(value);
        out.residual.fill(value);
        out.outcome.fill(Outcome::Fitted);
    });
}

/// Normalises a row and hands it to `solve`.
pub fn with_row(
    band: &Band,
    row: usize,
    buffers: &mut Buffers,
    solve: impl FnOnce(&mut RowSolver, &RowInput),
) {
    let lights = band.frames.len();
    let scale = 2.0 / FULL;
    let with = Normalisation { black: [BLACK; 2], scale: [scale; 2], saturation: [16_383; 2] };
    for (frame, y) in band.frames.iter().zip(&mut buffers.signal) {
        normalise_row(&frame[row * WIDTH..(row + 1) * WIDTH], &with, y);
    }
    let t = row as f64 / band.rows as f64;
    for (v, (a, b)) in buffers.vectors.iter_mut().zip(band.field[0].iter().zip(&band.field[1])) {
        *v = [0, 1, 2].map(|axis| a[axis] + t * (b[axis] - a[axis]));
    }
    let signal: Vec<&[f32]> = buffers.signal.iter().map(Vec::as_slice).collect();
    let field = FieldRow { step: STEP, vectors: &buffers.vectors, lights };
    let input = RowInput { signal: &signal, field, variance: &band.variance, noise_scale: None };
    solve(&mut buffers.solver, &input);
}

/// What a thread keeps from row to row.
pub struct Buffers {
    signal: Vec<Vec<f32>>,
    vectors: Vec<[f64; 3]>,
    solver: RowSolver,
}

impl Buffers {
    /// Buffers that fit a band.
    pub fn new(band: &Band) -> Self {
        let signal = vec![vec![0.0; WIDTH]; band.frames.len()];
        Self { signal, vectors: band.field[0].clone(), solver: RowSolver::new() }
    }
}

/// Solves a band with the fast kernels.
pub fn solve(band: &Band, output: &mut Output, method: Method) {
    output.rows().for_each_init(
        || Buffers::new(band),
        |buffers, (row, mut out)| {
            with_row(band, row, buffers, |solver, input| {
                // A band's rows fit together; did they not, the row would say that it is unsolved.
                if solver.solve(input, &mut out, method).is_err() {
                    out.outcome.fill(Outcome::TooFewLights);
                }
            });
        },
    );
}
