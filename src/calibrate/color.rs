//! `calibrate color`: levels, response, noise, white balance and colour from a grey or colour chart.

use super::frames::Levels;
use super::lights::nominal_camera;
use super::patches::{ChartFrame, ChartFrames, read_chart};
use super::sheet::optics_warnings;
use super::{CalibrateError, Inputs, Progress};
use crate::files::{Provenance, begin_owned};
use crate::instrument::{
    CAMERA_FILE, COLOR_FILE, Calibration, Color, DEFECTS_FILE, Defects, Noise, Optics, Rig,
    RigLightPlace, write_color, write_defects,
};
use crate::session::{Kind, Patch, Session};
use nalgebra::{Matrix3, Vector3};
use palette::color_difference::Ciede2000;
use palette::white_point::D50;
use serde::Serialize;
use std::path::{Path, PathBuf};
use weavelight_calibration::color::{ColorPatch, fit_color_matrix, lab_d50_from_linear_srgb};
use weavelight_calibration::description::{Camera, Light, Plane, PointLight};
use weavelight_calibration::irradiance::light_vector_in_rig;
use weavelight_calibration::projection::Projector;
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
struct Chart {
    session: Session,
    patches: Vec<Patch>,
    frames: Vec<ChartFrame>,
    defects: Defects,
    lights: usize,
}

/// Calibrates levels, response, noise and colour and writes `color.toml` and `defects.toml`.
///
/// # Errors
/// Where frames cannot be read, the chart is not where the capture session says, or files cannot be written.
pub fn color(options: &ColorOptions, progress: &Progress) -> Result<ColorReport, CalibrateError> {
    let rig = Rig::load(&options.rig)?;
    let _lock = begin_owned(&options.out, "calibrate color", &[COLOR_FILE, DEFECTS_FILE])?;
    let chart = load(options, &rig, progress)?;
    let before = before(&options.out)?;
    let mut warnings = other_optics(&chart, before.as_ref());
    let (black, black_from) = black_level(&chart);
    let mut color = Color {
        black_level: Some(black),
        saturation_level: Some(saturation_level(&chart)),
        ..Color::default()
    };
    let response = response(&chart, &levels(&chart, &color));
    match &response {
        Some(response) => color.response = response.coefficients.clone(),
        None => warnings
            .push("no light was taken at several exposures: linearity was not tested".to_owned()),
    }
    if let Some(response) = response.as_ref().filter(|response| response.coefficients.len() > 2) {
        warnings.push(format!(
            "the sensor departs from proportionality by {:.2} %; the response is corrected",
            100.0 * response.deviation
        ));
    }
    let levels = levels(&chart, &color);
    check_place(&chart, &levels)?;
    color.white_balance = (0..chart.lights)
        .map(|light| white_balance(&chart, &levels, light))
        .collect::<Result<_, _>>()?;
    let noise = noise(&chart, &levels);
    color.noise = noise.map(|(electrons_per_dn, read_noise_e)| Noise {
        electrons_per_dn,
        read_noise_e,
        // Of the lights: their own step found it.
        kappa: before.as_ref().and_then(|c| c.color.noise).map_or(0.0, |noise| noise.kappa),
    });
    let camera = before.and_then(|c| c.camera).or_else(|| nominal_camera(&rig));
    let colors = color_patches(&chart, &levels, &color.white_balance, &rig, camera.as_ref());
    let (matrix, matrix_from, differences) = matrix(&chart, &colors);
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
    let session = Session::load(&options.session)?;
    let place = session.manifest_path();
    if session.kind != Kind::Grey {
        return Err(CalibrateError::WrongKind { session: place, expected: "grey" });
    }
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
    let ChartFrames { frames, defects } = read_chart(&session, &patches)?;
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
    Ok(Chart { session, patches, frames, defects, lights: rig.lights.len() })
}

fn levels(chart: &Chart, color: &Color) -> Levels {
    let first = &chart.frames[0];
    Levels::from_parts(
        color.black_level.unwrap_or(first.black.map(f64::from)),
        color.saturation_level.map_or(first.saturation.map(f64::from), |level| [level; 4]),
        color.response.clone(),
    )
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
            .map(|[black, _]| black)
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
        found.filter(|[_, sigma]| *sigma < BLACK_SIGMA_SHARE * range).map(|[black, _]| black)
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

/// The frames' own white level, unless the samples pile up below it.
fn saturation_level(chart: &Chart) -> f64 {
    let stated = chart.frames[0].saturation.iter().copied().fold(f32::INFINITY, f32::min);
    let highest = chart.frames.iter().map(|frame| frame.top.0).fold(0.0, f64::max);
    let piled: usize =
        chart.frames.iter().filter(|frame| frame.top.0 == highest).map(|frame| frame.top.1).sum();
    let samples = chart.frames[0].size[0] * chart.frames[0].size[1];
    if piled > samples / 2000 && highest < f64::from(stated) { highest } else { f64::from(stated) }
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
fn light_of(chart: &Chart, levels: &Levels, light: usize, patch: usize) -> Option<[f64; 3]> {
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
fn neutral(patch: &Patch) -> bool {
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
        return Ok(sum.map(|s| sum[1] / s));
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

/// Colour patches as white-balanced camera RGB, the lights' shading over the chart divided out as far as the rig file and
/// the camera know it.
fn color_patches(
    chart: &Chart,
    levels: &Levels,
    white_balance: &[[f64; 3]],
    rig: &Rig,
    camera: Option<&Camera>,
) -> Vec<ColorPatch> {
    let plane = chart.session.plane.clone().unwrap_or_else(Plane::table);
    let place = |patch: &Patch| {
        let [u0, v0, u1, v1] = patch.rect_px;
        let centre = [(u0 + u1) / 2.0, (v0 + v1) / 2.0];
        let seen = camera.and_then(|camera| Projector::new(camera).on_plane(centre, &plane));
        (seen, seen.map_or(centre, |p| [p.x, p.y]))
    };
    let shade = |light: usize, patch: &Patch| {
        let RigLightPlace::Point { position_mm, .. } = &rig.lights[light].place else { return 1.0 };
        let Some(point) = place(patch).0 else { return 1.0 };
        let axis = nalgebra::UnitVector3::new_normalize(-position_mm.coords);
        let led =
            PointLight { position_mm: *position_mm, axis, exponent: 1.0, intensity: [1.0; 3] };
        light_vector_in_rig(&Light::Point(led), &point).dot(&plane.normal).max(1e-6)
    };
    let mean = |k: usize, patch: &Patch| -> Option<[f64; 3]> {
        let mut sum = [0.0; 3];
        for (light, gains) in white_balance.iter().enumerate() {
            let value = light_of(chart, levels, light, k)?;
            (0..3).for_each(|c| sum[c] += value[c] * gains[c] / shade(light, patch));
        }
        Some(sum)
    };
    let values: Vec<Option<[f64; 3]>> =
        chart.patches.iter().enumerate().map(|(k, patch)| mean(k, patch)).collect();
    // White is 1: from the grey patches.
    let greys = chart.patches.iter().zip(&values).filter(|(patch, _)| neutral(patch));
    let (light, reflectance) = greys.fold((0.0, 0.0), |(light, reflectance), (patch, value)| {
        value.map_or((light, reflectance), |value| {
            (light + value[1], reflectance + patch.reflectance)
        })
    });
    let colored = chart.patches.iter().zip(&values).filter_map(|(patch, value)| {
        let camera = value.map(|value| value.map(|v| v * reflectance / light))?;
        Some(ColorPatch { camera, lab_d50: patch.lab_d50?, place: place(patch).1 })
    });
    colored.collect()
}

type MatrixFound = (Option<Matrix3<f64>>, Option<&'static str>, Vec<[f64; 2]>);

/// From the chart's stated colours, else from the camera's own matrix.
fn matrix(chart: &Chart, colors: &[ColorPatch]) -> MatrixFound {
    if let Some(fit) = fit_color_matrix(colors) {
        let difference = |(patch, illumination): (&ColorPatch, &f64)| {
            let camera = Vector3::from(patch.camera) / *illumination;
            [camera, fit.srgb_from_camera * camera]
                .map(|rgb| ciede2000(lab_d50_from_linear_srgb(&rgb), patch.lab_d50))
        };
        let differences = colors.iter().zip(&fit.illumination).map(difference).collect();
        return (Some(fit.srgb_from_camera), Some("the colour chart"), differences);
    }
    let own = chart.frames[0].metadata.camera_from_xyz.and_then(|rows| srgb_from_own_matrix(&rows));
    (own, own.map(|_| "the camera's own matrix"), Vec::new())
}

fn ciede2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let lab = |[l, a, b]: [f64; 3]| palette::Lab::<D50, f64>::new(l, a, b);
    lab(a).difference(lab(b))
}

/// Linear sRGB's primaries in XYZ under D65 (IEC 61966-2-1).
const XYZ_FROM_SRGB: [[f64; 3]; 3] = [
    [0.412_390_8, 0.357_584_3, 0.180_480_8],
    [0.212_639_0, 0.715_168_7, 0.072_192_3],
    [0.019_330_8, 0.119_194_8, 0.950_532_2],
];

/// The inverse of camera-from-sRGB with its rows scaled so that white is (1, 1, 1) in both.
fn srgb_from_own_matrix(camera_from_xyz: &[[f64; 3]; 3]) -> Option<Matrix3<f64>> {
    let rows = |rows: &[[f64; 3]; 3]| Matrix3::from_fn(|i, j| rows[i][j]);
    let mut camera_from_srgb = rows(camera_from_xyz) * rows(&XYZ_FROM_SRGB);
    for mut row in camera_from_srgb.row_iter_mut() {
        let white = row.sum();
        row /= white;
    }
    camera_from_srgb.try_inverse().filter(|matrix| matrix.iter().all(|v| v.is_finite()))
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
