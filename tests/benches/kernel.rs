//! Cost of the kernels as ratios to touching the same bytes once, in the same run, on the same threads.
//!
//! `cargo bench --bench kernel` prints three tables: methods, lights (3 to 64), megapixels (1 to 100, as bands); a name after
//! `--` prints only that one.
//! What is timed is everything from 16-bit samples to normals, albedo, expected error, residual and outcome. Medians of
//! repeats, in processor time, and all lines take turns: so that a busy machine slows them alike.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a benchmark prints a table and may stop at once"
)]

use std::hint::black_box;
use std::time::Instant;

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use weavelight::photometry::{
    FieldRow, Method, Normalisation, Outcome, RowInput, RowOutput, RowSolver, VarianceModel,
    normalise_row, reference_row,
};

const WIDTH: usize = 4928;
const STEP: usize = 64;
const BLACK: f32 = 600.0;
const FULL: f32 = 15_000.0;
const ELECTRONS_PER_DN: f64 = 2.7;

/// A band of raw rows under a near-light rig.
struct Band {
    rows: usize,
    frames: Vec<Vec<u16>>,
    /// Light vectors at the nodes of the first and of the last row.
    field: [Vec<[f64; 3]>; 2],
    variance: Vec<[VarianceModel; 2]>,
}

/// Random numbers (xorshift).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Nearly normal: the sum of four.
    fn gauss(&mut self) -> f64 {
        ((0..4).map(|_| self.uniform()).sum::<f64>() - 2.0) * 3.0_f64.sqrt()
    }
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
    /// Wavy cloth; the share `failing` of the photosites has one sample in shadow or in a highlight.
    fn new(lights: usize, rows: usize, failing: f64) -> Self {
        let positions = light_positions(lights);
        // The same at both ends: the samples below are made with one row's light vectors.
        let row = field_row(&positions, 10.0);
        let field = [row.clone(), row];
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let mut frames = vec![vec![0_u16; rows * WIDTH]; lights];
        let nodes = FieldRow { step: STEP, vectors: &field[0], lights };
        for place in 0..rows * WIDTH {
            let column = place % WIDTH;
            let (a, b) = ((0.4 * column as f64).sin(), (0.23 * (place / WIDTH) as f64).cos());
            let g = 0.5 * Vector3::new(0.5 * a, 0.5 * b, 1.0).normalize();
            let spoilt = if random.uniform() < failing {
                (random.uniform() * lights as f64) as usize
            } else {
                lights
            };
            for (i, frame) in frames.iter_mut().enumerate() {
                let mut y = g.dot(&nodes.at(column, i)).max(0.0);
                if i == spoilt {
                    y *= if random.uniform() < 0.5 { 0.1 } else { 1.6 };
                }
                let signal = y * f64::from(FULL) / 2.0;
                let noise = (signal / ELECTRONS_PER_DN + 3.0).sqrt() * random.gauss();
                frame[place] =
                    (f64::from(BLACK) + signal + noise).round().clamp(0.0, 16_383.0) as u16;
            }
        }
        Self { rows, frames, field, variance: vec![[noise(); 2]; lights] }
    }

    fn bytes(&self) -> usize {
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

/// The output of a band, and per-thread buffers of one row.
struct Output {
    normal: Vec<[f32; 3]>,
    albedo: Vec<f32>,
    error: Vec<f32>,
    residual: Vec<f32>,
    outcome: Vec<Outcome>,
}

impl Output {
    fn new(rows: usize) -> Self {
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
    fn rows(&mut self) -> impl IndexedParallelIterator<Item = (usize, RowOutput<'_>)> {
        let parts = self.normal.par_chunks_mut(WIDTH).zip(self.albedo.par_chunks_mut(WIDTH));
        let parts =
            parts.zip(self.error.par_chunks_mut(WIDTH)).zip(self.residual.par_chunks_mut(WIDTH));
        let parts = parts.zip(self.outcome.par_chunks_mut(WIDTH)).enumerate();
        parts.map(|(row, ((((normal, albedo), expected_error_deg), residual), outcome))| {
            (row, RowOutput { normal, albedo, expected_error_deg, residual, outcome, kept: None })
        })
    }
}

/// Reads every sample and writes every output once.
fn touch(band: &Band, output: &mut Output) {
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
fn with_row(
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

struct Buffers {
    signal: Vec<Vec<f32>>,
    vectors: Vec<[f64; 3]>,
    solver: RowSolver,
}

impl Buffers {
    fn new(band: &Band) -> Self {
        let signal = vec![vec![0.0; WIDTH]; band.frames.len()];
        Self { signal, vectors: band.field[0].clone(), solver: RowSolver::new() }
    }
}

fn solve(band: &Band, output: &mut Output, method: Method) {
    output.rows().for_each_init(
        || Buffers::new(band),
        |buffers, (row, mut out)| {
            with_row(band, row, buffers, |solver, input| {
                solver.solve(input, &mut out, method).unwrap();
            });
        },
    );
}

/// Float64 normal equations photosite by photosite, on one row in `thin`.
fn normal_equations(band: &Band, output: &mut Output, thin: usize) {
    output.rows().filter(|(row, _)| row % thin == 0).for_each_init(
        || Buffers::new(band),
        |buffers, (row, mut out)| {
            with_row(band, row, buffers, |_, input| {
                reference_row(input, &mut out, Method::LeastSquares);
            });
        },
    );
}

/// The published way: a singular value decomposition a photosite, four times over; on one row in `thin`.
fn svd_four_times(band: &Band, output: &mut Output, thin: usize) {
    output.rows().filter(|(row, _)| row % thin == 0).for_each_init(
        || Buffers::new(band),
        |buffers, (row, out)| {
            with_row(band, row, buffers, |_, input| {
                let lights = input.field.lights;
                for column in 0..WIDTH {
                    let vector = |i: usize, axis: usize| input.field.at(column, i)[axis];
                    let y = DVector::from_fn(lights, |i, _| f64::from(input.signal[i][column]));
                    let mut g = Vector3::zeros();
                    for _ in 0..4 {
                        let l = DMatrix::from_fn(lights, 3, vector);
                        let solved = l.svd(true, true).solve(black_box(&y), 1e-12).unwrap();
                        g = Vector3::new(solved[0], solved[1], solved[2]);
                    }
                    let normal = g.normalize().cast::<f32>();
                    out.normal[column] = normal.into();
                    out.albedo[column] = g.norm() as f32;
                }
            });
        },
    );
}

fn median(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

/// Processor time of all threads so far, seconds: what other programs take does not count. Wall time where the system does
/// not tell.
fn processor_seconds(since: Instant) -> f64 {
    let of_thread = |task: std::fs::DirEntry| -> Option<f64> {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    match std::fs::read_dir("/proc/self/task") {
        Ok(tasks) => 1e-9 * tasks.flatten().filter_map(of_thread).sum::<f64>(),
        Err(_) => since.elapsed().as_secs_f64(),
    }
}

fn time(since: Instant, mut work: impl FnMut()) -> f64 {
    let start = processor_seconds(since);
    work();
    processor_seconds(since) - start
}

type Work<'a> = Box<dyn FnMut(&mut Output) + 'a>;

/// Times the works in turn and prints them as ratios to the first of the same band. The factor is what a thinned work must
/// be multiplied by.
fn table(title: &str, repeats: usize, rows: usize, mut lines: Vec<(String, f64, Work)>) {
    println!("\n{title}");
    let mut output = Output::new(rows);
    let since = Instant::now();
    let mut seconds = vec![Vec::new(); lines.len()];
    for _ in 0..repeats {
        for ((_, factor, work), seconds) in lines.iter_mut().zip(&mut seconds) {
            seconds.push(*factor * time(since, || work(&mut output)));
        }
    }
    let mut touched = f64::NAN;
    for ((name, ..), seconds) in lines.iter().zip(seconds) {
        let seconds = median(seconds);
        if name.starts_with("touch") {
            touched = seconds;
        }
        println!(
            "{name:<44} {:8.2} x touch  {:8.1} ms of processor",
            seconds / touched,
            1e3 * seconds
        );
    }
    black_box(&output.normal);
}

fn line<'a>(
    name: impl Into<String>,
    work: impl FnMut(&mut Output) + 'a,
) -> (String, f64, Work<'a>) {
    (name.into(), 1.0, Box::new(work))
}

fn methods(repeats: usize, rows: usize) {
    let clean = Band::new(10, rows, 0.0);
    let failing: Vec<(f64, Band)> =
        [0.005, 0.01, 0.02, 0.05, 0.2].map(|f| (f, Band::new(10, rows, f))).into();
    let thin = 64;
    let mut lines = vec![
        line(format!("touch once ({} MB)", clean.bytes() / 1_000_000), |out| touch(&clean, out)),
        line("least squares", |out| solve(&clean, out, Method::LeastSquares)),
        line("weighted", |out| solve(&clean, out, Method::Weighted)),
        line("auto, clean", |out| solve(&clean, out, Method::Auto)),
    ];
    for (share, band) in &failing {
        let name = format!("auto, {:.1} % failing", 100.0 * share);
        lines.push(line(name, |out| solve(band, out, Method::Auto)));
    }
    lines.push(line("robust", |out| solve(&clean, out, Method::Robust)));
    lines.push((
        "normal equations per photosite, float64".into(),
        thin as f64,
        Box::new(|out| normal_equations(&clean, out, thin)),
    ));
    lines.push((
        "SVD per photosite x 4".into(),
        thin as f64,
        Box::new(|out| svd_four_times(&clean, out, thin)),
    ));
    table("Methods, 10 lights", repeats, rows, lines);
}

fn lights(repeats: usize, rows: usize) {
    let (repeats, rows) = (repeats.min(3), rows.div_ceil(4));
    for count in [3, 4, 6, 10, 14, 15, 24, 32, 48, 64] {
        let band = Band::new(count, rows, 0.01);
        let lines = vec![
            line("touch once", |out| touch(&band, out)),
            line("least squares", |out| solve(&band, out, Method::LeastSquares)),
            line("weighted", |out| solve(&band, out, Method::Weighted)),
            line("auto, 1 % failing", |out| solve(&band, out, Method::Auto)),
        ];
        table(&format!("{count} lights"), repeats, rows, lines);
    }
}

fn megapixels(repeats: usize, rows: usize) {
    let repeats = repeats.min(3);
    let band = Band::new(10, rows, 0.01);
    let per_band = (rows * WIDTH) as f64 / 1e6;
    for size in [1.0, 4.0, 16.0, 50.0, 100.0_f64] {
        let bands = (size / per_band).round().max(1.0) as usize;
        let repeated =
            |work: &dyn Fn(&mut Output), out: &mut Output| (0..bands).for_each(|_| work(out));
        let lines = vec![
            line("touch once", |out| repeated(&|out| touch(&band, out), out)),
            line("least squares", |out| {
                repeated(&|out| solve(&band, out, Method::LeastSquares), out);
            }),
            line("auto, 1 % failing", |out| repeated(&|out| solve(&band, out, Method::Auto), out)),
        ];
        table(&format!("{:.1} megapixels", bands as f64 * per_band), repeats, rows, lines);
    }
}

fn main() {
    // `cargo test` runs benches too, without `--bench`: then only see that it works.
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let full = arguments.iter().any(|a| a == "--bench");
    let (repeats, rows) = if full { (5, 256) } else { (1, 4) };
    println!("{} threads, bands of {WIDTH} x {rows}", rayon::current_num_threads());
    type Table = (&'static str, fn(usize, usize));
    let tables: [Table; 3] = [("methods", methods), ("lights", lights), ("megapixels", megapixels)];
    let named = |name: &str| arguments.iter().any(|a| a == name);
    let all = !tables.iter().any(|(name, _)| named(name));
    for (name, table) in tables {
        if named(name) || (all && (full || name == "methods")) {
            table(repeats, rows);
        }
    }
}
