//! `calibrate color`: levels, response, noise, white balance and colour from a grey or colour chart.

use super::color_matrix::{color_patches, matrix};
use super::inputs::{self, check_out};
use super::lights::nominal_camera;
use super::patches::{ChartFrame, ChartFrames, PatchStats, read_chart};
use super::sheet::optics_warnings;
use super::{CalibrateError, Inputs, Progress};
use super::{levels as light_levels, plausible};
use crate::files::{Provenance, begin_owned, check_output_folder};
use crate::instrument::{
    CAMERA_FILE, COLOR_FILE, Calibration, Color, DEFECTS_FILE, Defects, Noise, Optics, Rig,
    write_color, write_defects,
};
use crate::linear::Levels;
use crate::raw::Ceiling;
use crate::session::{Kind, Patch, Session};
use serde::Serialize;
use std::path::{Path, PathBuf};
use weavelight_calibration::response::{
    Reading, Response, Spread, fit_black, fit_noise, fit_response,
};

/// What to calibrate from.
#[derive(Clone, Debug)]
pub struct ColorOptions {
    /// `rig.toml`.
    pub rig: PathBuf,
    /// The grey capture session.
    pub session: PathBuf,
    /// The calibration folder to add to.
    pub out: PathBuf,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct ColorReport {
    /// Raw numbers, 2 x 2 from the top left.
    pub black_level: [f64; 4],
    /// Where the black level comes from.
    pub black_from: &'static str,
    /// Raw number, black included.
    pub saturation_level: f64,
    /// As written.
    pub response: Vec<f64>,
    /// Departure from proportionality as measured; none where no light was taken at several exposures.
    pub nonlinearity: Option<f64>,
    /// Gains R, G, B per light.
    pub white_balance: Vec<[f64; 3]>,
    /// Electrons per raw number and read noise.
    pub electrons_per_dn: Option<f64>,
    /// Electrons.
    pub read_noise_e: Option<f64>,
    /// Rows; linear sRGB from white-balanced camera RGB.
    pub camera_to_linear_srgb: Option<[[f64; 3]; 3]>,
    /// Where the matrix comes from.
    pub matrix_from: Option<&'static str>,
    /// CIEDE2000 of every colour patch without and with the matrix.
    pub patches_de2000: Vec<[f64; 2]>,
    /// How many photosites are hot and dead; `defects.toml` lists them.
    pub hot: usize,
    /// See `hot`.
    pub dead: usize,
    /// Sentences.
    pub warnings: Vec<String>,
}

/// Everything the steps share.
pub(super) struct Chart {
    pub(super) session: Session,
    pub(super) patches: Vec<Patch>,
    pub(super) frames: Vec<ChartFrame>,
    defects: Defects,
    lights: usize,
    /// Of every frame, in the session's order.
    fingerprints: Vec<u64>,
    /// Where a file's exposure is not the manifest's.
    other_exposure: Option<String>,
    /// Where the pictures clip, if that is below the files' full scale.
    ceiling: Option<Ceiling>,
}

/// Calibrates levels, response, noise and colour and writes `color.toml` and `defects.toml`.
///
/// # Errors
/// Where frames cannot be read, the chart is not where the capture session says, or files cannot be written.
pub fn color(options: &ColorOptions, progress: &Progress) -> Result<ColorReport, CalibrateError> {
    check_output_folder(&options.out)?;
    let rig = Rig::load(&options.rig)?;
    check_out(&options.out)?;
    let _lock = begin_owned(&options.out, "calibrate color", &[COLOR_FILE, DEFECTS_FILE])?;
    let before = before(&options.out)?;
    let chart = load(options, &rig, progress)?;
    // By the files' own levels first: of a picture that is all white nothing else can be said.
    check_usable(&chart, &levels(&chart, &Color::default()))?;
    check_lit(&chart)?;
    inputs::no_copies(&chart.session, &chart.fingerprints)?;
    let mut warnings = other_optics(&chart, before.as_ref());
    warnings.extend(chart.other_exposure.clone());
    warnings.extend(chart.ceiling.map(|ceiling| ceiling.sentence()));
    let (black, black_from) = black_level(&chart);
    let mut color = Color {
        black_level: Some(black),
        saturation_level: Some(saturation_level(&chart, &black)),
        ..Color::default()
    };
    let response = response(&chart, &levels(&chart, &color));
    if let Some(response) = &response {
        plausible::check_response(&chart.session.manifest_path(), response)?;
        color.response = response.coefficients.clone();
    }
    warnings.extend(response_warning(response.as_ref()));
    let levels = levels(&chart, &color);
    check_usable(&chart, &levels)?;
    check_place(&chart, &levels)?;
    color.white_balance = (0..chart.lights)
        .map(|light| white_balance(&chart, &levels, light))
        .collect::<Result<_, _>>()?;
    let measured = noise(&chart, &levels);
    let noise = measured.filter(plausible::is_noise);
    if measured.is_some() && noise.is_none() {
        warnings.push(
            "gain and read noise could not be measured: the patches' noise does not grow with their light"
                .to_owned(),
        );
    }
    color.noise = noise.map(|(electrons_per_dn, read_noise_e)| Noise {
        electrons_per_dn,
        read_noise_e,
        // Of the lights: their own step found it.
        kappa: before.as_ref().and_then(|c| c.color.noise).map_or(0.0, |noise| noise.kappa),
    });
    let camera = before.and_then(|c| c.camera).or_else(|| nominal_camera(&rig));
    let colors = color_patches(&chart, &levels, &color.white_balance, &rig, camera.as_ref());
    let (matrix, matrix_from, differences) = match matrix(&chart, &colors) {
        (Some(found), from, _) if !plausible::is_matrix(&found) => {
            warnings.push(format!(
                "the colour matrix from {} makes no sense and was left out; check the patches' lab_d50",
                from.unwrap_or("the frames")
            ));
            (None, None, Vec::new())
        }
        found => found,
    };
    color.camera_to_linear_srgb = matrix;
    let report = ColorReport {
        black_level: black,
        black_from,
        saturation_level: color.saturation_level.unwrap_or(f64::NAN),
        response: color.response.clone(),
        nonlinearity: response.map(|response| response.deviation),
        white_balance: color.white_balance.clone(),
        electrons_per_dn: noise.map(|noise| noise.0),
        read_noise_e: noise.map(|noise| noise.1),
        camera_to_linear_srgb: matrix
            .map(|m| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))),
        matrix_from,
        patches_de2000: differences,
        hot: chart.defects.hot().len(),
        dead: chart.defects.dead().len(),
        warnings,
    };
    let inputs = Inputs::of(&options.rig, std::slice::from_ref(&chart.session))?;
    let provenance =
        Provenance::of_this_program(Some(jiff::Timestamp::now()), inputs, quality(&report));
    write_color(&options.out, &color, &provenance)?;
    write_defects(&options.out, &chart.defects, &provenance)?;
    progress(1.0, "done");
    Ok(report)
}

fn response_warning(response: Option<&Response>) -> Option<String> {
    let Some(response) = response else {
        return Some(
            "no light was taken at several exposures: linearity was not tested".to_owned(),
        );
    };
    (response.coefficients.len() > 2).then(|| {
        format!(
            "the sensor departs from proportionality by {:.2} %; the response is corrected",
            100.0 * response.deviation
        )
    })
}

/// What the folder holds so far, if anything; a broken file is told before an hour of work is lost on it.
fn before(out: &Path) -> Result<Option<Calibration>, CalibrateError> {
    let there = [CAMERA_FILE, COLOR_FILE].iter().any(|name| out.join(name).exists());
    Ok(there.then(|| Calibration::load(out)).transpose()?)
}

fn other_optics(chart: &Chart, before: Option<&Calibration>) -> Vec<String> {
    let frames: Vec<Optics> = chart.frames.iter().map(|f| Optics::of(&f.metadata)).collect();
    before.map_or_else(Vec::new, |before| {
        optics_warnings(&chart.session, &before.optics, frames.iter())
    })
}

fn load(options: &ColorOptions, rig: &Rig, progress: &Progress) -> Result<Chart, CalibrateError> {
    let session = inputs::load(&options.session, Kind::Grey)?;
    let place = session.manifest_path();
    session.check_lights(rig.lights.len())?;
    let patches = session.target.as_ref().map(|target| target.patches.clone()).unwrap_or_default();
    if patches.is_empty() {
        let remedy = "add [[target.patches]] with rect_px and reflectance";
        return Err(CalibrateError::target(place, "no patch is described", remedy));
    }
    let missing: Vec<usize> = (0..rig.lights.len())
        .filter(|light| !session.frames.iter().any(|frame| frame.light == Some(*light)))
        .collect();
    if !missing.is_empty() {
        let what = format!("no frame of light {missing:?}");
        return Err(CalibrateError::target(
            place,
            what,
            "photograph the chart under every light of the rig",
        ));
    }
    progress(0.1, "reading the chart");
    let ChartFrames { frames, defects, fingerprints, other_exposure, ceiling } =
        read_chart(&session, &patches)?;
    let size = [rig.camera.width_px, rig.camera.height_px];
    if let Some(k) = frames.iter().position(|frame| frame.size != size) {
        let (frame, rig) = (session.frame_path(&session.frames[k]), options.rig.clone());
        return Err(CalibrateError::WrongSize {
            frame,
            found: frames[k].size,
            rig,
            expected: size,
        });
    }
    let lights = rig.lights.len();
    Ok(Chart { session, patches, frames, defects, lights, fingerprints, other_exposure, ceiling })
}

fn levels(chart: &Chart, color: &Color) -> Levels {
    let first = &chart.frames[0];
    Levels::new(first.black, first.saturation, color)
}

/// Highest share of the range that still counts as dark: whatever bends the response does not show there.
const DARK_SHARE: f64 = 0.08;

/// Where one light at several exposures meets exposure zero; else where the grey patches of the ambient frame meet
/// reflectance zero; else what the file says.
fn black_level(chart: &Chart) -> ([f64; 4], &'static str) {
    let stated = chart.frames[0].black.map(f64::from);
    let range = f64::from(chart.frames[0].saturation[0]) - stated[0];
    let of_place = |place: usize| {
        let dark = |r: &Reading| r.value - stated[place] < DARK_SHARE * range;
        let readings: Vec<Reading> = series(chart, |frame, patch| {
            let stats = &frame.patches[patch];
            vec![(place, stats.mean[place], (stats.variance[place] / stats.count[place]).sqrt())]
        })
        .into_iter()
        .filter(dark)
        .collect();
        fit_black(&readings)
            .filter(|[_, sigma]| *sigma < BLACK_SIGMA_SHARE * range)
            .and_then(|[black, _]| plausible::black(black, stated[place], range))
    };
    let fitted: Vec<f64> = (0..4).filter_map(of_place).collect();
    match <[f64; 4]>::try_from(fitted) {
        Ok(black) => (black, "one light at several exposures, extrapolated to none"),
        Err(_) => black_of_ambient(chart, range)
            .map_or((stated, "the frames' own files"), |black| {
                (black, "the ambient frame, extrapolated to a patch that reflects nothing")
            }),
    }
}

/// Ambient light is uneven over the chart: above this share of the range that would show in the black level.
const AMBIENT_SHARE: f64 = 0.02;

/// Grey patches under the same weak light: what they read over their reflectance meets black at reflectance 0.
fn black_of_ambient(chart: &Chart, range: f64) -> Option<[f64; 4]> {
    let stated = chart.frames[0].black.map(f64::from);
    let of_place = |place: usize| {
        let mut readings = Vec::new();
        for (series, frame) in chart.frames.iter().filter(|f| f.light.is_none()).enumerate() {
            for (patch, stats) in
                chart.patches.iter().zip(&frame.patches).filter(|(p, _)| neutral(p))
            {
                let sigma = (stats.variance[place] / stats.count[place]).sqrt();
                let (exposure, value) = (patch.reflectance, stats.mean[place]);
                readings.push(Reading { series, exposure, value, sigma });
            }
        }
        let dark = readings.iter().all(|r| r.value - stated[place] < AMBIENT_SHARE * range);
        let found = fit_black(&readings).filter(|_| dark);
        found
            .filter(|[_, sigma]| *sigma < BLACK_SIGMA_SHARE * range)
            .and_then(|[black, _]| plausible::black(black, stated[place], range))
    };
    let found: Vec<f64> = (0..4).filter_map(of_place).collect();
    found.try_into().ok()
}

/// A black level known worse than this share of the range is not used.
const BLACK_SIGMA_SHARE: f64 = 2e-4;

/// Readings of every patch under every light that was taken at several exposures; `values` gives (place, value, sigma).
fn series(
    chart: &Chart,
    values: impl Fn(&ChartFrame, usize) -> Vec<(usize, f64, f64)>,
) -> Vec<Reading> {
    let mut readings = Vec::new();
    for frame in &chart.frames {
        let Some(light) = frame.light else { continue };
        for patch in 0..chart.patches.len() {
            for (place, value, sigma) in values(frame, patch) {
                let series = (light * chart.patches.len() + patch) * 4 + place;
                readings.push(Reading { series, exposure: frame.exposure, value, sigma });
            }
        }
    }
    readings
}

/// Samples that pile up below this share of the range have not reached the sensor's ceiling: they are dark.
const CEILING_SHARE: f64 = 0.05;

/// The frames' own white level, unless the samples pile up below it.
fn saturation_level(chart: &Chart, black: &[f64; 4]) -> f64 {
    let stated = chart.frames[0].saturation.iter().copied().fold(f32::INFINITY, f32::min);
    let darkest = black.iter().copied().fold(0.0, f64::max);
    let least = darkest + CEILING_SHARE * (f64::from(stated) - darkest);
    let highest = chart.frames.iter().map(|frame| frame.top.0).fold(0.0, f64::max);
    let piled: usize =
        chart.frames.iter().filter(|frame| frame.top.0 == highest).map(|frame| frame.top.1).sum();
    let samples = chart.frames[0].size[0] * chart.frames[0].size[1];
    let ceiling = highest > least && highest < f64::from(stated);
    if piled > samples / 2000 && ceiling { highest } else { f64::from(stated) }
}

/// Some light must be there at all: of a black picture nobody can say that the chart lies elsewhere.
fn check_lit(chart: &Chart) -> Result<(), CalibrateError> {
    let brightest = |lit: bool| {
        let frames = chart.frames.iter().filter(|frame| frame.light.is_some() == lit);
        let share = |frame: &ChartFrame, stats: &PatchStats| {
            let of_place = |k: usize| {
                let black = f64::from(frame.black[k]);
                (stats.mean[k] - black) / (f64::from(frame.saturation[k]) - black)
            };
            (0..4).map(of_place).filter(|v| v.is_finite()).fold(0.0, f64::max)
        };
        let shares = frames.flat_map(|frame| frame.patches.iter().map(|s| share(frame, s)));
        shares.fold(0.0, f64::max)
    };
    let ambient = brightest(false);
    light_levels::check_lit(&chart.session.manifest_path(), brightest(true) - ambient, ambient)
}

/// Under every light some grey patch must be neither black nor clipped.
fn check_usable(chart: &Chart, levels: &Levels) -> Result<(), CalibrateError> {
    let greys: Vec<usize> =
        (0..chart.patches.len()).filter(|k| neutral(&chart.patches[*k])).collect();
    let clipped = |light: usize| {
        !greys.is_empty() && greys.iter().all(|k| light_of(chart, levels, light, *k).is_none())
    };
    let Some(light) = (0..chart.lights).find(|light| clipped(*light)) else { return Ok(()) };
    let what = format!("every grey patch is overexposed under light {light}");
    let remedy = "shorten the exposure until the white patch reads 50-90 % of full scale, and photograph the chart again";
    Err(CalibrateError::target(chart.session.manifest_path(), what, remedy))
}

fn response(chart: &Chart, levels: &Levels) -> Option<Response> {
    let readings = series(chart, |frame, patch| {
        let stats = &frame.patches[patch];
        let clipped =
            stats.highest >= levels.saturation.iter().copied().fold(f64::INFINITY, f64::min);
        let value = |place: usize| {
            let x = (stats.mean[place] - levels.black[place]) / levels.range(place);
            let sigma = (stats.variance[place] / stats.count[place]).sqrt() / levels.range(place);
            (place, x, sigma.hypot(STRAY))
        };
        if clipped { Vec::new() } else { (0..4).map(value).collect() }
    });
    fit_response(&readings)
}

/// Error of a patch's mean that does not average out, as a share of the range.
const STRAY: f64 = 1e-5;

/// Light of a patch under a light per second at ISO 100, ambient light removed, per channel; clipped exposures do not count.
pub(super) fn light_of(
    chart: &Chart,
    levels: &Levels,
    light: usize,
    patch: usize,
) -> Option<[f64; 3]> {
    let clean = |frame: &&ChartFrame| {
        frame.light == Some(light) && frame.light_in(patch, levels).iter().all(|v| v.is_finite())
    };
    let frame =
        chart.frames.iter().filter(clean).max_by(|a, b| a.exposure.total_cmp(&b.exposure))?;
    let dark: Vec<[f64; 3]> = chart
        .frames
        .iter()
        .filter(|frame| frame.light.is_none())
        .map(|frame| frame.light_in(patch, levels).map(|v| v / frame.exposure))
        .collect();
    let ambient =
        |c: usize| dark.iter().map(|v| v[c]).sum::<f64>() / f64::max(dark.len() as f64, 1.0);
    let lit = frame.light_in(patch, levels);
    Some(std::array::from_fn(|c| lit[c] / frame.exposure - ambient(c)))
}

/// Patches without colour: those that state none, or next to none.
pub(super) fn neutral(patch: &Patch) -> bool {
    patch.lab_d50.is_none_or(|[_, a, b]| a.hypot(b) < 3.0)
}

fn white_balance(chart: &Chart, levels: &Levels, light: usize) -> Result<[f64; 3], CalibrateError> {
    let mut sum = [0.0; 3];
    for (k, _) in chart.patches.iter().enumerate().filter(|(_, patch)| neutral(patch)) {
        if let Some(value) = light_of(chart, levels, light, k) {
            (0..3).for_each(|c| sum[c] += value[c]);
        }
    }
    if sum.iter().all(|s| *s > 0.0) {
        let gains = sum.map(|s| sum[1] / s);
        plausible::check_white_balance(&chart.session.manifest_path(), light, gains)?;
        return Ok(gains);
    }
    let what = format!("no grey patch is usable under light {light}: dark or overexposed");
    let remedy = "check the light, expose the white patch to 50-90 % of full scale, and photograph the chart again";
    Err(CalibrateError::target(chart.session.manifest_path(), what, remedy))
}

/// How far a neutral patch may be from its reflectance times one light, before the shading of the chart.
const MISPLACED: f64 = 2.5;

/// Every patch must be about as bright as it says: else the chart lies elsewhere.
fn check_place(chart: &Chart, levels: &Levels) -> Result<(), CalibrateError> {
    let brightness = |k: usize| {
        let values =
            (0..chart.lights).filter_map(|light| light_of(chart, levels, light, k)).map(|v| v[1]);
        values.sum::<f64>() / chart.patches[k].reflectance.max(1e-3)
    };
    let greys: Vec<usize> =
        (0..chart.patches.len()).filter(|k| neutral(&chart.patches[*k])).collect();
    let mut sorted: Vec<f64> = greys.iter().map(|k| brightness(*k)).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(typical) = sorted.get(sorted.len() / 2).copied() else {
        let remedy = "describe at least one grey patch (without lab_d50, or with a and b near 0)";
        return Err(CalibrateError::target(
            chart.session.manifest_path(),
            "the chart has no grey patch",
            remedy,
        ));
    };
    let off = |k: &usize| {
        let ratio = brightness(*k) / typical;
        ratio.is_nan() || !(1.0 / MISPLACED..MISPLACED).contains(&ratio)
    };
    check_edges(chart, levels)?;
    let wrong: Vec<usize> = greys.iter().copied().filter(off).collect();
    let Some(first) = wrong.first() else { return Ok(()) };
    let what = format!(
        "{} of {} grey patches do not read as stated (patch {first} at {:?} is {:.2} times its reflectance)",
        wrong.len(),
        greys.len(),
        chart.patches[*first].rect_px,
        brightness(*first) / typical
    );
    let remedy = "the chart lies elsewhere: put it back, or correct rect_px and reflectance";
    Err(CalibrateError::target(chart.session.manifest_path(), what, remedy))
}

/// A patch whose samples scatter about its mean by more than this, noise aside, has an edge in it. Shading stays below.
const EDGE_SHARE: f64 = 0.15;

/// Every rectangle must lie within its patch: half on the patch and half beside it, it may be as bright as it should by chance.
fn check_edges(chart: &Chart, levels: &Levels) -> Result<(), CalibrateError> {
    let unevenness = |k: usize| {
        let clean = chart.frames.iter().filter(|frame| {
            frame.light.is_some() && frame.light_in(k, levels).iter().all(|v| v.is_finite())
        });
        let Some(frame) = clean.max_by(|a, b| a.exposure.total_cmp(&b.exposure)) else {
            return 0.0;
        };
        let of_place = |place: usize| {
            let stats = &frame.patches[k];
            let scatter = (stats.spread[place] - stats.variance[place]).max(0.0).sqrt();
            scatter / (stats.mean[place] - levels.black[place]).max(1e-3 * levels.range(place))
        };
        (0..4).map(of_place).fold(0.0, f64::max)
    };
    let cut: Vec<usize> =
        (0..chart.patches.len()).filter(|k| unevenness(*k) > EDGE_SHARE).collect();
    let Some(first) = cut.first() else { return Ok(()) };
    let what = format!(
        "{} of {} patches have an edge in their rectangle (patch {first} at {:?} is uneven by {:.0} %)",
        cut.len(),
        chart.patches.len(),
        chart.patches[*first].rect_px,
        100.0 * unevenness(*first)
    );
    let remedy =
        "the chart lies elsewhere: put it back and photograph it again, or correct rect_px";
    Err(CalibrateError::target(chart.session.manifest_path(), what, remedy))
}

/// Electrons per raw number and read noise.
fn noise(chart: &Chart, levels: &Levels) -> Option<(f64, f64)> {
    let mut spreads = Vec::new();
    for frame in &chart.frames {
        for stats in frame.patches.iter().filter(|stats| stats.highest < levels.saturation[0]) {
            spreads.extend((0..4).map(|place| Spread {
                mean: stats.mean[place] - levels.black[place],
                variance: stats.variance[place],
                count: stats.count[place] / 2.0,
            }));
        }
    }
    fit_noise(&spreads).map(|noise| (noise.electrons_per_dn, noise.read_noise_e))
}

fn quality(report: &ColorReport) -> toml::Table {
    let mut table = toml::Table::new();
    let mut put = |name: &str, value: Option<f64>| {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            table.insert(name.to_owned(), toml::Value::Float(value));
        }
    };
    put("nonlinearity", report.nonlinearity);
    let mean = |k: usize| {
        report.patches_de2000.iter().map(|d| d[k]).sum::<f64>() / report.patches_de2000.len() as f64
    };
    put("mean_de2000_without_matrix", Some(mean(0)));
    put("mean_de2000", Some(mean(1)));
    put("hot_photosites", Some(report.hot as f64));
    put("dead_photosites", Some(report.dead as f64));
    table.insert("black_from".into(), toml::Value::String(report.black_from.to_owned()));
    table
}
