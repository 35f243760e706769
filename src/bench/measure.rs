//! Times and errors of every contender on one set.

use super::clock::{Spent, timed};
use super::methods::{Contender, Pace};
use super::report::{MethodReport, SetReport, Touch};
use super::sets::Set;
use super::{BenchError, Effort, pareto_front};
use crate::compare::{NormalFigures, Pair, compare_normals};
use crate::photometry::Outcome;
use crate::raw::{Frame, Samples};
use crate::solve::{Rows, Scene};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::hint::black_box;
use std::ops::Range;
use weavelight_calibration::description::Image;

/// A contender is not run again once it has taken so long.
const BUDGET_S: f64 = 2.0;
const BUDGET_OF_SLOW_S: f64 = 0.5;
/// Rows of a band when touching.
const BAND_ROWS: usize = 64;

/// A contender's runs.
struct Runs {
    figures: Figures,
    robust_share: Option<f64>,
    spent: Vec<Spent>,
}

/// Errors, and how many photosites have none.
struct Figures {
    errors: NormalFigures,
    unsolved_share: f64,
}

/// Measures every contender on a set, all in turns.
pub(super) fn of_set(
    set: &Set,
    contenders: &[Contender],
    effort: Effort,
) -> Result<SetReport, BenchError> {
    let step = rows_step(set, effort);
    let (touches, runs) =
        Rows::with(&set.scene, |rows| take_turns(set, rows, contenders, step, effort))??;
    let touched = Spent::median(&touches);
    let points: Vec<[f64; 2]> = contenders
        .iter()
        .zip(&runs)
        .map(|(contender, runs)| {
            [times_touch(contender, runs, touched), runs.figures.errors.mean_deg]
        })
        .collect();
    let methods = contenders.iter().zip(&runs).zip(pareto_front(&points));
    let methods = methods.map(|((contender, runs), on_front)| MethodReport {
        on_front,
        ..method_report(contender, runs, touched)
    });
    Ok(SetReport {
        name: set.name.clone(),
        about: set.about.clone(),
        size_px: [set.scene.width, set.scene.height],
        lights: set.scene.lights.len(),
        rows_step: step,
        compared: compared(set, step).count(),
        touch: Touch {
            bytes: touched_bytes(&set.scene),
            milliseconds: 1e3 * touched.wall_s,
            processor_milliseconds: 1e3 * touched.processor_s,
        },
        methods: methods.collect(),
        warnings: set.warnings.clone(),
    })
}

/// Median time over that of touching: the processor's, or on the wall where a graphics processor takes part.
fn times_touch(contender: &Contender, runs: &Runs, touched: Spent) -> f64 {
    let spent = Spent::median(&runs.spent);
    match contender.adapter {
        Some(_) => spent.wall_s / touched.wall_s,
        None => spent.processor_s / touched.processor_s,
    }
}

fn method_report(contender: &Contender, runs: &Runs, touched: Spent) -> MethodReport {
    let NormalFigures { mean_deg, median_deg, rms_deg, p95_deg, .. } = runs.figures.errors;
    let spent = Spent::median(&runs.spent);
    MethodReport {
        name: contender.name.to_owned(),
        about: contender.about.to_owned(),
        times_touch: times_touch(contender, runs, touched),
        adapter: contender.adapter.clone(),
        milliseconds: 1e3 * spent.wall_s,
        processor_milliseconds: 1e3 * spent.processor_s,
        repeats: runs.spent.len(),
        mean_deg,
        median_deg,
        rms_deg,
        p95_deg,
        unsolved_share: runs.figures.unsolved_share,
        robust_share: runs.robust_share,
        on_front: false,
    }
}

/// One row in how many slow methods solve; odd, so that both kinds of rows of the mosaic have their turn.
fn rows_step(set: &Set, effort: Effort) -> usize {
    let known = set.truth.data.iter().filter(|normal| is_known(normal)).count();
    let step = (known / effort.sampled_photosites()).clamp(1, set.truth.height.max(1));
    step | 1
}

fn is_known(normal: &[f32; 3]) -> bool {
    normal.iter().all(|c| c.is_finite()) && normal.iter().any(|&c| c != 0.0)
}

/// Places of the photosites that errors are taken over.
fn compared(set: &Set, step: usize) -> impl Iterator<Item = usize> {
    let width = set.truth.width;
    let rows = (0..set.truth.height).step_by(step);
    rows.flat_map(move |y| y * width..(y + 1) * width)
        .filter(|&place| is_known(&set.truth.data[place]))
}

/// What every touch took, and the runs of every contender. The first round warms up; it counts only for contenders that have
/// no time for another.
fn take_turns(
    set: &Set,
    rows: &Rows,
    contenders: &[Contender],
    step: usize,
    effort: Effort,
) -> Result<(Vec<Spent>, Vec<Runs>), BenchError> {
    let mut first = Vec::new();
    let mut runs = Vec::new();
    for contender in contenders {
        let (spent, answer) = timed(|| (contender.solve)(rows, step));
        let answer = answer?;
        let figures = figures(set, &answer.normal, step)
            .ok_or_else(|| BenchError::Nothing { set: set.name.clone() })?;
        runs.push(Runs { figures, robust_share: answer.robust_share, spent: vec![] });
        first.push(spent);
    }
    let mut touches = Vec::new();
    for _ in 0..effort.rounds() {
        touches.push(timed(|| touch(&set.scene)).0);
        for ((contender, runs), first) in contenders.iter().zip(&mut runs).zip(&first) {
            let wall_s = first.wall_s + runs.spent.iter().map(|spent| spent.wall_s).sum::<f64>();
            if wall_s < budget_s(contender.pace) {
                let (spent, answer) = timed(|| (contender.solve)(rows, step));
                answer?;
                runs.spent.push(spent);
            }
        }
    }
    let share = set.scene.height as f64 / set.scene.height.div_ceil(step) as f64;
    for ((contender, runs), first) in contenders.iter().zip(&mut runs).zip(first) {
        if runs.spent.is_empty() {
            runs.spent.push(first);
        }
        if contender.pace == Pace::Rows {
            runs.spent.iter_mut().for_each(|spent| *spent = spent.times(share));
        }
    }
    Ok((touches, runs))
}

fn budget_s(pace: Pace) -> f64 {
    match pace {
        Pace::Frames => BUDGET_S,
        Pace::Rows => BUDGET_OF_SLOW_S,
    }
}

/// Errors over the photosites of every `step`th row that have a truth; `None` where there is none.
fn figures(set: &Set, normal: &Image<[f32; 3]>, step: usize) -> Option<Figures> {
    let mut unsolved = 0;
    let pair = |place: usize| -> Pair {
        let (found, truth) = (normal.data[place], set.truth.data[place].map(f64::from));
        if is_known(&found) {
            return (found.map(f64::from), truth);
        }
        unsolved += 1;
        (across(truth), truth)
    };
    let pairs: Vec<Pair> = compared(set, step).map(pair).collect();
    let errors = compare_normals(&pairs)?;
    Some(Figures { errors, unsolved_share: unsolved as f64 / pairs.len() as f64 })
}

/// Any direction 90 degrees off.
fn across(normal: [f64; 3]) -> [f64; 3] {
    let normal = Vector3::from(normal);
    let least = normal.iamin();
    normal.cross(&Vector3::from_fn(|axis, _| if axis == least { 1.0 } else { 0.0 })).into()
}

/// The maps that a solve returns, as plain memory.
struct Touched {
    normal: Vec<[f32; 3]>,
    albedo: Vec<f32>,
    error: Vec<f32>,
    outcome: Vec<Outcome>,
}

/// Bytes of every sample and of every map.
fn touched_bytes(scene: &Scene) -> usize {
    let of_frame = |frame: &Frame| match &frame.samples {
        Samples::U16(samples) => 2 * samples.len(),
        Samples::F32(samples) => 4 * samples.len(),
    };
    let site = size_of::<[f32; 3]>() + 2 * size_of::<f32>() + size_of::<Outcome>();
    scene.exposures().map(|e| of_frame(&e.frame)).sum::<usize>() + scene.width * scene.height * site
}

/// Reads every sample once and writes every byte of the maps once, on the same threads, into fresh memory like a solve.
fn touch(scene: &Scene) {
    let pixels = scene.width * scene.height;
    let mut out = Touched {
        normal: vec![[0.0; 3]; pixels],
        albedo: vec![0.0; pixels],
        error: vec![0.0; pixels],
        outcome: vec![Outcome::Masked; pixels],
    };
    let band = scene.width * BAND_ROWS;
    let bands = out.normal.par_chunks_mut(band).zip(out.albedo.par_chunks_mut(band));
    let bands = bands.zip(out.error.par_chunks_mut(band)).zip(out.outcome.par_chunks_mut(band));
    bands.enumerate().for_each(|(index, (((normal, albedo), error), outcome))| {
        let span = index * band..index * band + albedo.len();
        let value: f32 = scene.exposures().map(|e| sum_of(&e.frame, span.clone())).sum();
        normal.fill([value; 3]);
        albedo.fill(value);
        error.fill(value);
        outcome.fill(Outcome::Fitted);
    });
    black_box(&out.normal);
    black_box((&out.albedo, &out.error, &out.outcome));
}

/// Some value that depends on every sample of a span of pixels.
fn sum_of(frame: &Frame, span: Range<usize>) -> f32 {
    let channels = frame.layout.channels();
    let span = span.start * channels..span.end * channels;
    match &frame.samples {
        Samples::U16(samples) => {
            samples[span].iter().fold(0_u32, |sum, &v| sum.wrapping_add(u32::from(v))) as f32
        }
        Samples::F32(samples) => f32::from_bits(
            samples[span].iter().fold(0_u32, |sum, v| sum.wrapping_add(v.to_bits())) & 0x3fff_ffff,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_unsolved_counts_ninety_degrees() {
        for normal in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [0.3, 0.4, 0.866]] {
            let angle = crate::compare::angle_deg(across(normal), normal);
            assert!((angle - 90.0).abs() < 1e-9, "{normal:?}: {angle}");
        }
    }
}
