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

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use weavelight::bench::band::{Band, Buffers, Output, WIDTH, solve, touch, with_row};
use weavelight::bench::timed;
use weavelight::photometry::{Method, reference_row};

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

type Work<'a> = Box<dyn FnMut(&mut Output) + 'a>;

/// Times the works in turn and prints them as ratios to the first of the same band. The factor is what a thinned work must
/// be multiplied by.
fn table(title: &str, repeats: usize, rows: usize, mut lines: Vec<(String, f64, Work)>) {
    println!("\n{title}");
    let mut output = Output::new(rows);
    let mut seconds = vec![Vec::new(); lines.len()];
    for _ in 0..repeats {
        for ((_, factor, work), seconds) in lines.iter_mut().zip(&mut seconds) {
            seconds.push(*factor * timed(|| work(&mut output)).0.processor_s);
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
    black_box(&output);
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
