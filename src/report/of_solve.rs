//! The page of a solve: what it shows of a solution, of its frames, and of the truth where that is known.

use super::distribution::{Distribution, number};
use super::picture::{self, LONGEST_SIDE, Thumbnail};
use super::solution::{Figure, SolutionPage, TruthErrors, Verdict};
use crate::compare::{ColorPairs, angle_deg, compare_colors};
use crate::solution::Report;
use crate::solve::{Shown, Stage};
use weavelight_calibration::description::Image;

/// Values that a distribution is taken from at most; of more, every k-th is.
const MOST_VALUES: usize = 1 << 20;
/// Upper end of the scale of the error pictures, as a multiple of the 95th percentile.
const SCALE_OVER_P95: f64 = 1.25;

/// The true maps, on the grid of the solution.
pub struct Truth {
    /// Unit normals, rig frame.
    pub normal: Image<[f32; 3]>,
    /// Linear RGB, in the solution's colour space.
    pub albedo: Image<[f32; 3]>,
}

/// The page of a solution as one self-contained HTML file.
pub fn page_of_solve(shown: &Shown, truth: Option<&Truth>) -> String {
    let report = shown.report;
    let expected = expected_error(shown);
    let angles = truth.map(|truth| angles(&shown.maps.normal, &truth.normal));
    let errors = angles.as_ref().map(|angles| errors(shown, truth, angles));
    SolutionPage {
        title: shown.name.to_owned(),
        subtitle: subtitle(report),
        verdicts: verdicts(report, expected.as_ref(), errors.as_ref()),
        warnings: report.warnings.clone(),
        maps: maps(shown, expected.as_ref(), angles.as_ref(), errors.as_ref()),
        expected_error: expected,
        truth: errors,
        seconds: seconds(report),
        frames: frames(shown),
    }
    .html()
}

/// How the expected errors of the normals spread, degrees; `None` where nothing is solved.
pub fn expected_error(shown: &Shown) -> Option<Distribution> {
    Distribution::of(strided(&shown.maps.confidence.data).filter(|error| *error > 0.0))
}

fn strided(values: &[f32]) -> impl Iterator<Item = f32> {
    values.iter().copied().step_by(values.len().div_ceil(MOST_VALUES).max(1))
}

fn subtitle(report: &Report) -> String {
    let [width, height] = report.size_px;
    let scale = report.mm_per_px.map_or(String::new(), |mm| format!(", {mm:.4} mm per pixel"));
    let lights = report.lights_used.len();
    format!(
        "{width} x {height} pixels{scale}; {lights} lights, method {}; albedo in {}",
        report.method, report.color_space
    )
}

fn verdicts(
    report: &Report,
    expected: Option<&Distribution>,
    errors: Option<&TruthErrors>,
) -> Vec<Verdict> {
    let verdict = |value: String, label: &str| Verdict { value, label: label.to_owned() };
    let share = |part: u64| format!("{:.2} %", 100.0 * part as f64 / report.pixels.max(1) as f64);
    let mut all = Vec::new();
    if let Some(normal) = errors.and_then(|errors| errors.normal.as_ref()) {
        all.push(verdict(
            format!("{} deg", number(normal.rms)),
            "error of the normals against the truth, RMS",
        ));
    }
    if let Some(expected) = expected {
        all.push(verdict(
            format!("{} deg", number(expected.median)),
            "expected error of a normal, median",
        ));
    }
    all.push(verdict(share(report.solved), "of the photosites solved"));
    all.push(verdict(share(report.saturated_pixels), "with a clipped sample"));
    let total: f64 = report.seconds.values().sum();
    all.push(verdict(format!("{total:.2} s"), "from files to maps"));
    all
}

/// Angle between two maps, degrees; 0 where either is unsolved.
fn angles(a: &Image<[f32; 3]>, b: &Image<[f32; 3]>) -> Image<[f32; 1]> {
    let angle = |(a, b): (&[f32; 3], &[f32; 3])| {
        if *a == [0.0; 3] || *b == [0.0; 3] {
            [0.0]
        } else {
            [angle_deg(a.map(f64::from), b.map(f64::from)) as f32]
        }
    };
    Image {
        width: a.width,
        height: a.height,
        data: a.data.iter().zip(&b.data).map(angle).collect(),
    }
}

fn errors(shown: &Shown, truth: Option<&Truth>, angles: &Image<[f32; 1]>) -> TruthErrors {
    let solved =
        |data: &[[f32; 1]]| Distribution::of(strided(data.as_flattened()).filter(|v| *v > 0.0));
    let pairs = |truth: &Truth| {
        let both = shown.maps.albedo.data.iter().zip(&truth.albedo.data).enumerate();
        let (places, pairs) = both
            .filter(|(_, (a, b))| **a != [0.0; 3] && **b != [0.0; 3])
            .map(|(k, (a, b))| (k, (a.map(f64::from), b.map(f64::from))))
            .unzip();
        ColorPairs { width: truth.albedo.width, places, pairs }
    };
    let color = truth.and_then(|truth| compare_colors(&pairs(truth)));
    let figures = color.map_or(Vec::new(), |color| {
        vec![
            ("albedo, mean CIEDE2000".to_owned(), format!("{:.2}", color.mean_de2000)),
            ("albedo, 95 % below, CIEDE2000".to_owned(), format!("{:.2}", color.p95_de2000)),
            (
                "albedo, means of 4 x 4 pixels, CIEDE2000".to_owned(),
                color.mean_de2000_4x4.map_or_else(|| "-".to_owned(), |mean| format!("{mean:.2}")),
            ),
            ("albedo, false colour (a*, b*)".to_owned(), format!("{:.2}", color.false_color)),
            ("albedo, RMS of the linear values".to_owned(), format!("{:.4}", color.rms)),
        ]
    });
    TruthErrors { normal: solved(&angles.data), figures }
}

fn maps(
    shown: &Shown,
    expected: Option<&Distribution>,
    angles: Option<&Image<[f32; 1]>>,
    errors: Option<&TruthErrors>,
) -> Vec<Figure> {
    let figure = |picture, caption: String| Figure { picture, caption };
    let albedo = picture::shrink(&shown.maps.albedo, LONGEST_SIDE);
    let gain = picture::display_gain(&albedo).min(1.0);
    let mut maps = vec![
        figure(
            picture::normals(&picture::shrink(&shown.maps.normal, LONGEST_SIDE)),
            "Normal: red = x, green = y (up), blue = z".into(),
        ),
        figure(picture::colors(&albedo, gain), albedo_caption(gain)),
    ];
    maps.extend(shade(&shown.maps.shade));
    if let Some(expected) = expected {
        let values: Vec<[f32; 1]> = shown.maps.confidence.data.iter().map(|v| [*v]).collect();
        let (width, height) = (shown.maps.confidence.width, shown.maps.confidence.height);
        maps.push(scaled(
            &Image { width, height, data: values },
            expected,
            "Expected error of the normal",
        ));
    }
    if let (Some(angles), Some(normal)) = (angles, errors.and_then(|errors| errors.normal.as_ref()))
    {
        maps.push(scaled(angles, normal, "Error of the normal against the truth"));
    }
    maps
}

/// What was divided out of the albedo, where anything was.
fn shade(shade: &Image<f32>) -> Option<Figure> {
    if !shade.data.iter().any(|&shade| shade > 0.0 && shade < 1.0) {
        return None;
    }
    let data = shade.data.iter().map(|&shade| [shade; 3]).collect();
    let shade = Image { width: shade.width, height: shade.height, data };
    Some(Figure {
        picture: picture::colors(&picture::shrink(&shade, LONGEST_SIDE), 1.0),
        caption: "Shade of relief that is not resolved, divided out of the albedo".into(),
    })
}

fn albedo_caption(gain: f32) -> String {
    if gain < 1.0 {
        format!("Albedo, shown at {gain:.2} of its brightness")
    } else {
        "Albedo".into()
    }
}

fn scaled(values: &Image<[f32; 1]>, distribution: &Distribution, what: &str) -> Figure {
    let top = distribution.p95 * SCALE_OVER_P95;
    let picture: Thumbnail = picture::heat(&picture::shrink(values, LONGEST_SIDE), top as f32);
    Figure {
        picture,
        caption: format!("{what}: from 0 (dark) to {} degrees (bright)", number(top)),
    }
}

fn seconds(report: &Report) -> Vec<(String, f64)> {
    let stages = [Stage::Read, Stage::Solve, Stage::Colour, Stage::Write];
    let of = |name: &str| report.seconds.get(name).map(|seconds| (name.to_owned(), *seconds));
    stages.iter().filter_map(|stage| of(stage.name())).collect()
}

/// All at one gain, so that a light that is too dark looks it.
fn frames(shown: &Shown) -> Vec<Figure> {
    let gain = shown
        .frames
        .iter()
        .map(|(_, frame)| picture::display_gain(frame))
        .fold(f32::INFINITY, f32::min);
    let gain = if gain.is_finite() { gain } else { 1.0 };
    let figure = |(caption, frame): &(String, Image<[f32; 3]>)| Figure {
        picture: picture::colors(frame, gain),
        caption: caption.clone(),
    };
    shown.frames.iter().map(figure).collect()
}
