//! The wizard: what has been photographed, what is missing, how good the result is, and the one action that would improve
//! it most. A function of what lies in the folder: the window and `weavelight calibrate status` show the same.

use super::CalibrateError;
use super::action::{Action, SheetPose};
use super::sheet::exposure_advice;
use crate::files::Provenance;
use crate::instrument::{CalibratedLight, Calibration};
use nalgebra::{Point3, UnitVector3, Vector3};
use serde::Serialize;
use std::path::Path;
use weavelight_calibration::description::{Camera, Light, Plane};
use weavelight_calibration::lights::{PLAN_CELLS, Plan};

/// Where a calibration stands.
#[derive(Clone, Debug, Serialize)]
pub struct Status {
    /// The three steps in order.
    pub steps: Vec<Step>,
    /// Expected RMS error of the lights' positions, millimetres, if the lights are calibrated.
    pub position_sigma_mm: Option<f64>,
    /// What to do next.
    #[serde(skip)]
    pub action: Action,
    /// The same in the command line's words.
    pub next: String,
    /// What to change of the exposures of the sheets that were used, if anything.
    pub exposure: Vec<String>,
    /// What that would bring the position error to, where it can be foreseen.
    pub next_sigma_mm: Option<f64>,
}

/// One step of the calibration.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// "camera", "color" or "lights".
    pub name: &'static str,
    /// Done, to be improved, or missing.
    pub state: StepState,
    /// When.
    pub created: Option<String>,
    /// The capture sessions it was made from.
    pub inputs: Vec<String>,
    /// How good, in words.
    pub quality: String,
}

/// How far a step is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StepState {
    /// Nothing there.
    Missing,
    /// There, but more pictures would make it much better.
    Improvable,
    /// Good.
    Good,
}

/// Boards, reprojection error and position sigma from which a step is good.
const GOOD_BOARDS: i64 = 10;
const GOOD_REPROJECTION_PX: f64 = 0.3;
const GOOD_SIGMA_MM: f64 = 1.0;
const GOOD_DE2000: f64 = 1.5;

/// Looks at a calibration folder. An empty or absent one is where everybody starts.
///
/// # Errors
/// Where a file of the calibration is there and cannot be read.
pub fn status(folder: &Path) -> Result<Status, CalibrateError> {
    let nothing =
        ["camera.toml", "color.toml", "lights.toml"].iter().all(|name| !folder.join(name).exists());
    if nothing {
        return Ok(describe(None));
    }
    let calibration = Calibration::load(folder)?;
    let mut status = describe(Some(&calibration));
    if calibration.lights_of_another_camera()? {
        status.steps[2].state = StepState::Improvable;
        status.steps[2].quality += "; measured with another camera.toml";
        status.action = Action::LightsAgain;
        status.next = status.action.to_string();
        status.next_sigma_mm = None;
    }
    Ok(status)
}

fn describe(calibration: Option<&Calibration>) -> Status {
    let steps = vec![camera_step(calibration), color_step(calibration), lights_step(calibration)];
    let position_sigma_mm = calibration.and_then(|calibration| rms_sigma(&calibration.lights));
    let (action, next_sigma_mm) = next_action(calibration, &steps);
    let exposure = calibration.and_then(exposures).unwrap_or_default();
    Status { steps, position_sigma_mm, action, next: action.to_string(), exposure, next_sigma_mm }
}

/// The advice on each sheet's exposure.
fn exposures(calibration: &Calibration) -> Option<Vec<String>> {
    let quality = &calibration.provenance.lights.as_ref()?.quality;
    let names = quality.get("sheet_names")?.as_array()?.iter();
    let levels = quality.get("brightest_levels")?.as_array()?.iter();
    let advice = |(name, level): (&toml::Value, &toml::Value)| {
        exposure_advice(name.as_str()?, level.as_float()?)
    };
    Some(names.zip(levels).filter_map(advice).collect())
}

fn step(
    name: &'static str,
    provenance: Option<&Provenance>,
    state: StepState,
    quality: String,
) -> Step {
    let created = provenance.and_then(|p| p.created).map(|created| created.to_string());
    let inputs = provenance
        .map(|p| p.inputs.iter().map(|input| input.name.clone()).collect())
        .unwrap_or_default();
    Step { name, state, created, inputs, quality }
}

fn missing(name: &'static str) -> Step {
    step(name, None, StepState::Missing, "not calibrated yet".to_owned())
}

fn float(provenance: Option<&Provenance>, key: &str) -> Option<f64> {
    provenance.and_then(|p| p.quality.get(key)).and_then(toml::Value::as_float)
}

fn camera_step(calibration: Option<&Calibration>) -> Step {
    let Some(calibration) = calibration.filter(|calibration| calibration.camera.is_some()) else {
        return missing("camera");
    };
    let provenance = calibration.provenance.camera.as_ref();
    let boards =
        provenance.and_then(|p| p.quality.get("boards_kept")).and_then(toml::Value::as_integer);
    let rms = calibration.rms_reprojection_px.unwrap_or(0.0);
    let good = boards.is_none_or(|boards| boards >= GOOD_BOARDS) && rms <= GOOD_REPROJECTION_PX;
    let state = if good { StepState::Good } else { StepState::Improvable };
    let boards = boards.map_or("an unknown number of".to_owned(), |boards| boards.to_string());
    step("camera", provenance, state, format!("{boards} boards, reprojection error {rms:.3} px"))
}

fn color_step(calibration: Option<&Calibration>) -> Step {
    let there = |calibration: &&Calibration| {
        calibration.color.black_level.is_some() || calibration.provenance.color.is_some()
    };
    let Some(calibration) = calibration.filter(there) else { return missing("color") };
    let provenance = calibration.provenance.color.as_ref();
    let difference = float(provenance, "mean_de2000");
    let good = calibration.color.camera_to_linear_srgb.is_some()
        && difference.is_none_or(|d| d <= GOOD_DE2000);
    let state = if good { StepState::Good } else { StepState::Improvable };
    let matrix = match (calibration.color.camera_to_linear_srgb, difference) {
        (Some(_), Some(difference)) => format!("colour matrix with mean CIEDE2000 {difference:.2}"),
        (Some(_), None) => "colour matrix of the camera itself".to_owned(),
        (None, _) => "no colour matrix".to_owned(),
    };
    step("color", provenance, state, matrix)
}

fn lights_step(calibration: Option<&Calibration>) -> Step {
    let Some(calibration) = calibration.filter(|calibration| !calibration.lights.is_empty()) else {
        return missing("lights");
    };
    let provenance = calibration.provenance.lights.as_ref();
    let sigma = rms_sigma(&calibration.lights);
    let claimed =
        calibration.lights.iter().filter(|light| light.position_claimed != Some(false)).count();
    let good =
        claimed == calibration.lights.len() && sigma.is_none_or(|sigma| sigma <= GOOD_SIGMA_MM);
    let state = if good { StepState::Good } else { StepState::Improvable };
    let sigma = sigma.map_or("unknown".to_owned(), |sigma| format!("{sigma:.2} mm"));
    let quality = format!(
        "{} lights, {claimed} positions known; expected position error {sigma}",
        calibration.lights.len()
    );
    step("lights", provenance, state, quality)
}

fn rms_sigma(lights: &[CalibratedLight]) -> Option<f64> {
    let sigmas: Vec<f64> = lights.iter().filter_map(|light| light.position_sigma_mm).collect();
    (!sigmas.is_empty())
        .then(|| (sigmas.iter().map(|s| s * s).sum::<f64>() / sigmas.len() as f64).sqrt())
}

/// The single action that would improve the calibration most.
fn next_action(calibration: Option<&Calibration>, steps: &[Step]) -> (Action, Option<f64>) {
    let [camera, color, lights] = [0, 1, 2].map(|k| steps[k].state);
    let action = match (camera, color, lights) {
        (StepState::Missing, ..) => Action::Boards,
        (StepState::Improvable, ..) => Action::BetterBoards,
        (_, StepState::Missing, _) => Action::Chart,
        (_, _, StepState::Missing) => Action::FlatSheet,
        (_, _, StepState::Improvable) => return next_sheet(calibration),
        (_, StepState::Improvable, _) => Action::ColorChart,
        _ => Action::Check,
    };
    (action, None)
}

/// Tries every likely pose of the sheet and names the one after which the positions would be known best.
fn next_sheet(calibration: Option<&Calibration>) -> (Action, Option<f64>) {
    let best = calibration.and_then(|calibration| {
        let camera = calibration.camera.as_ref()?;
        let provenance = calibration.provenance.lights.as_ref()?;
        best_pose(calibration, camera, provenance)
    });
    best.map_or((Action::MoreSheets, None), |(pose, sigma)| (Action::Sheet(pose), Some(sigma)))
}

fn best_pose(
    calibration: &Calibration,
    camera: &Camera,
    provenance: &Provenance,
) -> Option<(SheetPose, f64)> {
    let quality = &provenance.quality;
    let numbers = |value: &toml::Value| -> Option<Vec<f64>> {
        value.as_array()?.iter().map(toml::Value::as_float).collect()
    };
    let planes: Vec<Plane> = quality
        .get("sheet_planes")?
        .as_array()?
        .iter()
        .map(|row| plane(&numbers(row)?))
        .collect::<Option<_>>()?;
    let ruler_sigma_mm = numbers(quality.get("ruler_sigma_mm")?)?;
    let cells = quality.get("cells")?.as_integer()? as f64 / planes.len() as f64;
    let lights: Vec<Light> = calibration.lights.iter().map(|light| light.light.clone()).collect();
    let plan = Plan {
        camera,
        lights: &lights,
        ruler_sigma_mm: &ruler_sigma_mm,
        // Fewer, larger cells with the same information.
        cell_noise: float(Some(provenance), "residual_rms")? * (PLAN_CELLS as f64 / cells).sqrt(),
        slow_error_rms: float(Some(provenance), "slow_error_rms")?,
    };
    let after = |extra: &Plane| {
        let sigma =
            plan.expected_sigma_mm(&[planes.as_slice(), std::slice::from_ref(extra)].concat())?;
        let near: Vec<f64> = sigma.into_iter().filter(|s| s.is_finite()).collect();
        Some((near.iter().map(|s| s * s).sum::<f64>() / near.len() as f64).sqrt())
    };
    let scored =
        candidates(&lights).into_iter().filter_map(|(pose, plane)| Some((pose, after(&plane)?)));
    scored.filter(|(_, sigma)| sigma.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))
}

fn plane(row: &[f64]) -> Option<Plane> {
    let [x, y, z, nx, ny, nz] = row.try_into().ok()?;
    let normal = UnitVector3::try_new(Vector3::new(nx, ny, nz), 1e-9)?;
    Some(Plane { point_mm: Point3::new(x, y, z), normal })
}

/// Heights and tilts of a sheet that are easily done; tilts towards the lights.
const TILT_DEG: f64 = 20.0;
const RAISED_MM: f64 = 100.0;

fn candidates(lights: &[Light]) -> Vec<(SheetPose, Plane)> {
    let level =
        |height: f64| Plane { point_mm: Point3::new(0.0, 0.0, height), normal: Vector3::z_axis() };
    let mut all = vec![
        (SheetPose::Flat, level(0.0)),
        (SheetPose::Raised { mm: RAISED_MM }, level(RAISED_MM)),
    ];
    for (i, light) in lights.iter().enumerate() {
        let towards = match light {
            Light::Point(light) => light.position_mm.coords,
            Light::Directional(light) => light.direction.into_inner(),
        };
        let Some(level) = Vector3::new(towards.x, towards.y, 0.0).try_normalize(1e-9) else {
            continue;
        };
        let (sin, cos) = TILT_DEG.to_radians().sin_cos();
        let normal = UnitVector3::new_normalize(level * sin + Vector3::z() * cos);
        let point_mm = Point3::new(0.0, 0.0, RAISED_MM / 2.0);
        all.push((SheetPose::Tilted { light: i, deg: TILT_DEG }, Plane { point_mm, normal }));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_folder_asks_for_the_board_first() {
        let folder = tempfile::tempdir().unwrap();
        let status = status(folder.path()).unwrap();
        assert!(status.steps.iter().all(|step| step.state == StepState::Missing));
        assert!(status.next.contains("chessboard"), "{}", status.next);
    }
}
