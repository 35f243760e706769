//! `calibrate lights`: every LED's position, beam and strength from white sheets.

use super::inputs::{check_out, load_all, no_copied_sessions};
use super::sheet::{Known, Observed, observe, tilt_and_height};
use super::{CalibrateError, Inputs, Progress, plausible};
use crate::files::{Input, Owned, Provenance, begin_owned, check_output_folder, sha256_of_file};
use crate::instrument::{
    CAMERA_FILE, COLOR_FILE, CalibratedLight, Calibration, LIGHTS_FILE, Noise, Rig, RigLightPlace,
    update_color, write_lights,
};
use crate::session::Kind;
use nalgebra::{Point3, UnitVector3, Vector3};
use serde::Serialize;
use std::path::{Path, PathBuf};
use weavelight_calibration::description::{Camera, Light};
use weavelight_calibration::lights::{
    Emitter, Fit, FittedLight, Gains, Place, Prior, Settings, Sheet, fit, gains, has_several_poses,
    mismatches,
};

/// What to calibrate from.
#[derive(Clone, Debug)]
pub struct LightsOptions {
    /// `rig.toml`: the ruler's positions.
    pub rig: PathBuf,
    /// White capture sessions.
    pub sessions: Vec<PathBuf>,
    /// The calibration folder to add to; holds `camera.toml`.
    pub out: PathBuf,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct LightsReport {
    /// "one flat sheet" or "sheets at several poses".
    pub method: &'static str,
    /// Every light.
    pub lights: Vec<LightReport>,
    /// Every sheet.
    pub sheets: Vec<SheetReport>,
    /// Linearisations until the positions were settled.
    pub iterations: usize,
    /// RMS of what the fit leaves over, relative.
    pub residual_rms: f64,
    /// RMS of slow, light-dependent errors that the pictures show, relative.
    pub slow_error_rms: f64,
    /// Factor that the pictures put on the ruler's sigma.
    pub ruler_scale: f64,
    /// Peak to peak of the sheet's own unevenness, where several poses tell it from vignetting.
    pub sheet_unevenness: Option<f64>,
    /// Wall-clock seconds of the fit alone.
    pub fit_seconds: f64,
    /// Sentences.
    pub warnings: Vec<String>,
}

/// One light.
#[derive(Clone, Debug, Serialize)]
pub struct LightReport {
    /// As written, millimetres; none for far lights.
    pub position_mm: Option<[f64; 3]>,
    /// RMS over axes of its expected error.
    pub position_sigma_mm: Option<f64>,
    /// Whether the pictures carry it.
    pub position_claimed: bool,
    /// How far the most probable position lies from the rig's.
    pub from_rig_mm: Option<f64>,
    /// Emission exponent.
    pub exponent: Option<f64>,
    /// R, G, B.
    pub intensity: [f64; 3],
    /// RMS of what the model leaves over, relative.
    pub residual_rms: f64,
    /// Share of its samples left out (shadows, dust).
    pub rejected: f64,
}

/// One sheet.
#[derive(Clone, Debug, Serialize)]
pub struct SheetReport {
    /// The capture session's name.
    pub name: String,
    /// From the table.
    pub tilt_deg: f64,
    /// Over the table at its middle.
    pub height_mm: f64,
    /// Share of full scale that the brightest light's brightest cells reach; 0.5 to 0.9 is good.
    pub brightest: f64,
    /// Cells used.
    pub cells: usize,
    /// What the fit corrected of the stated pose: two tilts in degrees, offset in millimetres.
    pub correction: [f64; 3],
}

/// Spread of an LED's axis about the direction to the scan area's middle, and of its exponent, before any picture.
const AXIS_SIGMA_RAD: f64 = 0.26;
const USUAL_EXPONENT: f64 = 1.0;
const EXPONENT_SIGMA: f64 = 2.0;
/// A far light's direction by ruler.
const DIRECTION_SIGMA_RAD: f64 = 0.05;
/// Texels across the gain maps.
const MAP_WIDTH: usize = 64;

/// Calibrates the lights and writes `lights.toml` and its gain maps.
///
/// # Errors
/// Where frames cannot be read, the sheets cannot serve (each named, with what to photograph instead), the fit does not
/// settle, or the file cannot be written. The old calibration then stands.
pub fn lights(
    options: &LightsOptions,
    progress: &Progress,
) -> Result<LightsReport, CalibrateError> {
    check_output_folder(&options.out)?;
    let rig = Rig::load(&options.rig)?;
    check_out(&options.out)?;
    let _lock = begin_owned(&options.out, "calibrate lights", &[LIGHTS_FILE])?;
    let calibration = with_camera(&options.out)?;
    let Some(camera) = &calibration.camera else { return Err(no_camera(&options.out)) };
    let known = Known {
        camera,
        optics: &calibration.optics,
        color: &calibration.color,
        defects: &calibration.defects,
        lights: rig.lights.len(),
    };
    let sessions = load_all(&options.sessions, Kind::White)?;
    let mut fingerprints = Vec::new();
    let mut warnings = Vec::new();
    let (mut sheets, mut brightest): (Vec<Sheet>, Vec<f64>) = (Vec::new(), Vec::new());
    for (k, session) in sessions.iter().enumerate() {
        let part = |share: f64, what: &str| {
            progress(0.8 * (k as f64 + share) / sessions.len() as f64, what);
        };
        let observed: Observed = observe(session, known, &part)?;
        warnings.extend(observed.warnings);
        sheets.push(observed.sheet);
        brightest.push(observed.brightest);
        fingerprints.push(observed.fingerprints);
    }
    no_copied_sessions(&sessions, &fingerprints)?;
    let priors = priors(&rig);
    check_poses(&sheets, &options.rig)?;
    check_wiring(&sheets, &priors, &options.rig)?;
    progress(0.85, "fitting the lights");
    let started = std::time::Instant::now();
    let fitted = fit(&sheets, &priors, &Settings::default())?;
    let height = (MAP_WIDTH * camera.height_px).div_ceil(camera.width_px).max(1);
    let found = gains(&sheets, &fitted, [camera.width_px, camera.height_px], [MAP_WIDTH, height]);
    let fit_seconds = started.elapsed().as_secs_f64();
    let calibrated: Vec<CalibratedLight> = fitted
        .lights
        .iter()
        .enumerate()
        .map(|(i, light)| calibrated(light, &found, &priors[i], i))
        .collect();
    plausible::check_lights(&options.rig, &calibrated)?;
    warnings.extend(light_warnings(&calibrated));
    let mut report = report(&sheets, &fitted, &found, &calibrated, &priors, fit_seconds, warnings);
    report.sheets.iter_mut().zip(&brightest).for_each(|(sheet, level)| sheet.brightest = *level);
    let mut inputs = Inputs::of(&options.rig, &sessions)?;
    // The rig frame is this camera's: `solve` warns where another one stands beside the lights.
    inputs.push(Input {
        name: CAMERA_FILE.to_owned(),
        sha256: sha256_of_file(&options.out.join(CAMERA_FILE))?,
    });
    let quality = quality(&report, &sheets, &priors);
    let provenance = Provenance::of_this_program(Some(jiff::Timestamp::now()), inputs, quality);
    progress(0.95, "writing");
    write_lights(&options.out, &calibrated, &provenance)?;
    report.warnings.extend(note_kappa(&options.out, &calibration, fitted.slow_error_rms)?);
    progress(1.0, "done");
    Ok(report)
}

/// What the folder holds so far; a broken file is told, an absent camera has its own message.
fn with_camera(out: &Path) -> Result<Calibration, CalibrateError> {
    if !out.join(CAMERA_FILE).exists() {
        return Err(no_camera(out));
    }
    Ok(Calibration::load(out)?)
}

fn no_camera(out: &Path) -> CalibrateError {
    let remedy = "run `weavelight calibrate camera` into the same folder first";
    CalibrateError::target(out, "the camera is not calibrated yet", remedy)
}

/// What the rig file says of the lights.
pub(super) fn priors(rig: &Rig) -> Vec<Prior> {
    rig.lights.iter().map(|light| prior(&light.place)).collect()
}

fn prior(place: &RigLightPlace) -> Prior {
    match place {
        RigLightPlace::Point { position_mm, position_sigma_mm } => {
            let axis =
                UnitVector3::try_new(-position_mm.coords, 1e-9).unwrap_or(-Vector3::z_axis());
            let place = Place::Near { position_mm: *position_mm, axis, exponent: USUAL_EXPONENT };
            Prior {
                emitter: Emitter { place, log_intensity: 0.0 },
                position_sigma_mm: *position_sigma_mm,
                angle_sigma_rad: AXIS_SIGMA_RAD,
                exponent_sigma: EXPONENT_SIGMA,
            }
        }
        RigLightPlace::Directional { direction } => Prior {
            emitter: Emitter { place: Place::Far { direction: *direction }, log_intensity: 0.0 },
            position_sigma_mm: 1.0,
            angle_sigma_rad: DIRECTION_SIGMA_RAD,
            exponent_sigma: 1.0,
        },
    }
}

/// Several sheets must not all lie alike: they would carry no more than one.
fn check_poses(sheets: &[Sheet], place: &Path) -> Result<(), CalibrateError> {
    if sheets.len() < 2 || has_several_poses(sheets) {
        return Ok(());
    }
    let what = format!("all {} sheets lie at the same pose", sheets.len());
    let remedy = "photograph the sheet also raised by about 100 mm and tilted by 20 degrees in four directions (or give one flat sheet only)";
    Err(CalibrateError::target(place, what, remedy))
}

fn check_wiring(sheets: &[Sheet], priors: &[Prior], rig: &Path) -> Result<(), CalibrateError> {
    let wrong = mismatches(sheets, priors);
    if wrong.is_empty() {
        return Ok(());
    }
    let pairs: Vec<String> = wrong
        .iter()
        .map(|m| format!("light {} shines from where light {} should be", m.light, m.shines_like))
        .collect();
    let remedy =
        "swap the wires back, or the channels in the rig file, and photograph the sheets again";
    Err(CalibrateError::target(rig, pairs.join(", "), remedy))
}

fn calibrated(light: &FittedLight, gains: &Gains, prior: &Prior, i: usize) -> CalibratedLight {
    let mut warnings = Vec::new();
    if !light.position_claimed {
        warnings.push(format!(
            "light {i}: these pictures do not carry its position ({:.1} mm); the rig file's stays. Photograph the sheet raised and tilted too",
            light.position_sigma_mm.unwrap_or(f64::NAN)
        ));
    }
    if let Some(moved) =
        from_rig(light, prior).filter(|moved| *moved > 5.0 * prior.position_sigma_mm)
    {
        warnings.push(format!(
            "light {i} is {moved:.0} mm from where the rig file has it; check the rig file"
        ));
    }
    if light.rejected > SHADOWED {
        warnings.push(format!(
            "light {i}: {:.0} % of its samples were left out (shadow of a hand, dust, reflection)",
            100.0 * light.rejected
        ));
    }
    CalibratedLight {
        light: light.emitter.light(gains.intensity[i]),
        gain_map: Some(gains.maps[i].clone()),
        position_sigma_mm: light.position_sigma_mm,
        position_claimed: light.position_sigma_mm.map(|_| light.position_claimed),
        warnings,
    }
}

/// Share of a light's samples left out that is told.
const SHADOWED: f64 = 0.03;

fn from_rig(light: &FittedLight, prior: &Prior) -> Option<f64> {
    match &prior.emitter.place {
        Place::Near { position_mm, .. } => {
            light.estimated_position_mm.map(|found| (found - position_mm).norm())
        }
        Place::Far { .. } => None,
    }
}

fn light_warnings(lights: &[CalibratedLight]) -> Vec<String> {
    lights.iter().flat_map(|light| light.warnings.iter().cloned()).collect()
}

fn report(
    sheets: &[Sheet],
    fit: &Fit,
    gains: &Gains,
    calibrated: &[CalibratedLight],
    priors: &[Prior],
    fit_seconds: f64,
    warnings: Vec<String>,
) -> LightsReport {
    let light = |i: usize| {
        let (position, exponent) = match &calibrated[i].light {
            Light::Point(light) => (Some(light.position_mm.coords.into()), Some(light.exponent)),
            Light::Directional(_) => (None, None),
        };
        LightReport {
            position_mm: position,
            position_sigma_mm: fit.lights[i].position_sigma_mm,
            position_claimed: fit.lights[i].position_claimed,
            from_rig_mm: from_rig(&fit.lights[i], &priors[i]),
            exponent,
            intensity: gains.intensity[i],
            residual_rms: fit.lights[i].residual_rms,
            rejected: fit.lights[i].rejected,
        }
    };
    let sheet = |(sheet, [a, b, offset]): (&Sheet, &[f64; 3])| {
        let (tilt_deg, height_mm) = tilt_and_height(&sheet.plane);
        let correction = [a.to_degrees(), b.to_degrees(), *offset];
        SheetReport {
            name: sheet.name.clone(),
            tilt_deg,
            height_mm,
            brightest: f64::NAN,
            cells: sheet.cells.len(),
            correction,
        }
    };
    LightsReport {
        method: if has_several_poses(sheets) {
            "sheets at several poses"
        } else {
            "one flat sheet"
        },
        lights: (0..calibrated.len()).map(light).collect(),
        sheets: sheets.iter().zip(&fit.pose_corrections).map(sheet).collect(),
        iterations: fit.iterations,
        residual_rms: fit.residual_rms,
        slow_error_rms: fit.slow_error_rms,
        ruler_scale: fit.ruler_scale,
        sheet_unevenness: gains.sheet_unevenness,
        fit_seconds,
        warnings,
    }
}

/// What `calibrate status` needs to say how good this is and what would improve it.
fn quality(report: &LightsReport, sheets: &[Sheet], priors: &[Prior]) -> toml::Table {
    let float = toml::Value::Float;
    let row = |values: &[f64]| toml::Value::Array(values.iter().map(|v| float(*v)).collect());
    let plane = |sheet: &Sheet| {
        let (p, n): (Point3<f64>, Vector3<f64>) =
            (sheet.plane.point_mm, sheet.plane.normal.into_inner());
        row(&[p.x, p.y, p.z, n.x, n.y, n.z])
    };
    let mut table = toml::Table::new();
    table.insert("method".into(), toml::Value::String(report.method.to_owned()));
    table.insert("iterations".into(), toml::Value::Integer(report.iterations as i64));
    table.insert("residual_rms".into(), float(report.residual_rms));
    table.insert("slow_error_rms".into(), float(report.slow_error_rms));
    table.insert(
        "cells".into(),
        toml::Value::Integer(sheets.iter().map(|s| s.cells.len() as i64).sum()),
    );
    table.insert(
        "ruler_sigma_mm".into(),
        row(&priors.iter().map(|p| p.position_sigma_mm).collect::<Vec<_>>()),
    );
    table.insert(
        "sheet_names".into(),
        toml::Value::Array(report.sheets.iter().map(|s| s.name.clone().into()).collect()),
    );
    table.insert(
        "brightest_levels".into(),
        row(&report.sheets.iter().map(|s| s.brightest).collect::<Vec<_>>()),
    );
    table.insert("sheet_planes".into(), toml::Value::Array(sheets.iter().map(plane).collect()));
    table
}

/// What the light model leaves over is part of the noise that a solve weighs by: `color.toml` has it in its noise. Says where
/// that file was edited, and so stays as it is.
fn note_kappa(
    out: &Path,
    calibration: &Calibration,
    kappa: f64,
) -> Result<Option<String>, CalibrateError> {
    let (Some(noise), Some(provenance)) = (calibration.color.noise, &calibration.provenance.color)
    else {
        return Ok(None);
    };
    let color = crate::instrument::Color {
        noise: Some(Noise { kappa, ..noise }),
        ..calibration.color.clone()
    };
    let edited = update_color(out, &color, provenance)? == Owned::NotOurs;
    let path = out.join(COLOR_FILE);
    let tell = || {
        format!(
            "{} was edited and stays as it is; these sheets give kappa = {kappa:.6} in its [noise], not {:.6}",
            path.display(),
            noise.kappa
        )
    };
    Ok(edited.then(tell))
}

/// The camera that a rig file describes, looking straight down: good enough for shading a chart.
pub(super) fn nominal_camera(rig: &Rig) -> Option<Camera> {
    let camera = &rig.camera;
    let focal_px = camera.focal_length_mm? / camera.pixel_pitch_um? * 1000.0;
    Some(Camera {
        width_px: camera.width_px,
        height_px: camera.height_px,
        fx: focal_px,
        fy: focal_px,
        cx: (camera.width_px as f64 - 1.0) / 2.0,
        cy: (camera.height_px as f64 - 1.0) / 2.0,
        distortion: [0.0; 5],
        camera_from_rig: Camera::looking_down(camera.height_mm?),
    })
}
