//! `calibrate check`: white sheets that the fit has not seen, solved with the calibration.
//!
//! A flat sheet alone proves nothing: gain maps make it read flat whatever the positions are. Tilted sheets tell.

use super::inputs::{check_out, load_all};
use super::sheet::{Known, observe, tilt_and_height};
use super::{CalibrateError, Progress};
use crate::files::{FileError, begin_owned, write_owned};
use crate::instrument::Calibration;
use crate::session::Kind;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use std::path::{Path, PathBuf};
use weavelight_calibration::description::{Image, Light};
use weavelight_calibration::gain::gain_at;
use weavelight_calibration::irradiance::light_vector_in_rig;
use weavelight_calibration::lights::{Cell, Sheet};

/// What to check.
#[derive(Clone, Debug)]
pub struct CheckOptions {
    /// The calibration folder.
    pub calibration: PathBuf,
    /// White capture sessions that `calibrate lights` has not seen.
    pub sessions: Vec<PathBuf>,
    /// Largest slope error that passes, degrees (RMS over a sheet).
    pub threshold_deg: f64,
    /// Where the residual maps go, if anywhere.
    pub out: Option<PathBuf>,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct CheckReport {
    /// Whether every sheet is within the threshold.
    pub passed: bool,
    /// Degrees.
    pub threshold_deg: f64,
    /// Every sheet.
    pub sheets: Vec<CheckedSheet>,
    /// Sentences.
    pub warnings: Vec<String>,
}

/// One sheet.
#[derive(Clone, Debug, Serialize)]
pub struct CheckedSheet {
    /// The capture session's name.
    pub name: String,
    /// Tilt from the table.
    pub tilt_deg: f64,
    /// Angle between solved and true normal over the field: root mean square, 95th percentile, largest.
    pub slope_rms_deg: f64,
    /// 95th percentile.
    pub slope_p95_deg: f64,
    /// Largest.
    pub slope_max_deg: f64,
    /// Albedo over the sheet's reflectance: mean, and root mean square about it.
    pub albedo: [f64; 2],
    /// Condition number of the light matrix: median and largest over the field.
    pub condition: [f64; 2],
    /// Per light: root mean square of what the model leaves over, relative.
    pub residual_rms: Vec<f64>,
    /// Residual map, if asked for.
    #[serde(serialize_with = "crate::files::serialize_maybe_path")]
    pub residual_map: Option<PathBuf>,
}

/// A residual that is fully red or blue in the maps.
const MAP_RANGE: f32 = 0.01;

/// Solves the sheets cell by cell and compares with their known planes.
///
/// # Errors
/// Where calibration or frames cannot be read, a sheet cannot serve, or the maps cannot be written.
pub fn check(options: &CheckOptions, progress: &Progress) -> Result<CheckReport, CalibrateError> {
    options.out.as_deref().map_or(Ok(()), crate::files::check_output_folder)?;
    let calibration = Calibration::load(&options.calibration)?;
    let Some(camera) = calibration.camera.clone().filter(|_| !calibration.lights.is_empty()) else {
        let remedy = "run `weavelight calibrate camera` and `weavelight calibrate lights` first";
        return Err(CalibrateError::target(
            &options.calibration,
            "camera or lights are not calibrated",
            remedy,
        ));
    };
    let known = Known {
        camera: &camera,
        optics: &calibration.optics,
        color: &calibration.color,
        defects: &calibration.defects,
        lights: calibration.lights.len(),
    };
    let _lock =
        options.out.as_ref().map(|out| begin_owned(out, "calibrate check", &[])).transpose()?;
    let mut report = CheckReport {
        passed: true,
        threshold_deg: options.threshold_deg,
        sheets: Vec::new(),
        warnings: Vec::new(),
    };
    options.out.as_deref().map_or(Ok(()), check_out)?;
    let sessions = load_all(&options.sessions, Kind::White)?;
    for (k, session) in sessions.iter().enumerate() {
        let part = |share: f64, what: &str| {
            progress((k as f64 + share) / sessions.len() as f64, what);
        };
        let observed = observe(session, known, &part)?;
        report.warnings.extend(observed.warnings);
        let pose_deg = observed.sheet.pose_sigma.tilt_rad.to_degrees();
        if pose_deg > 0.5 * options.threshold_deg {
            report.warnings.push(format!(
                "{}: its printed strip gives the sheet's tilt to {pose_deg:.2} degrees only; state [plane] to check more closely",
                session.name
            ));
        }
        let frame = (camera.width_px, camera.height_px);
        let solved = solve_sheet(&observed.sheet, &calibration, frame);
        let mut checked = describe(&observed.sheet, &solved, calibration.lights.len());
        if let Some(out) = &options.out {
            checked.residual_map =
                Some(write_map(out, &observed.sheet, &solved, calibration.lights.len())?);
        }
        report.passed &= checked.slope_rms_deg <= options.threshold_deg;
        report.sheets.push(checked);
    }
    if report.sheets.iter().all(|sheet| sheet.tilt_deg < 5.0) {
        report.warnings.push(
            "only flat sheets were checked, which proves nothing about positions; check a sheet tilted by 20 degrees or more"
                .to_owned(),
        );
    }
    Ok(report)
}

/// One cell solved.
struct SolvedCell {
    angle_deg: f64,
    albedo: f64,
    condition: f64,
    /// Per light, relative to the fitted signal.
    residuals: Vec<f64>,
}

fn solve_sheet(
    sheet: &Sheet,
    calibration: &Calibration,
    frame_px: (usize, usize),
) -> Vec<Option<SolvedCell>> {
    let solve = |(c, cell): (usize, &Cell)| {
        let (mut vectors, mut signals) = (Vec::new(), Vec::new());
        for (light, sample) in calibration.lights.iter().zip(sheet.samples_of(c)) {
            let gain =
                light.gain_map.as_ref().map_or([1.0; 3], |map| gain_at(map, frame_px, cell.pixel));
            let intensity = light.light.intensity();
            let signal =
                (0..3).map(|k| sample.signal[k] / (intensity[k] * gain[k])).sum::<f64>() / 3.0;
            let usable = if sample.is_usable() { signal } else { f64::NAN };
            vectors.push(light_vector(&light.light, cell));
            signals.push(usable);
        }
        solve_cell(&vectors, &signals, sheet)
    };
    sheet.cells.iter().enumerate().map(solve).collect()
}

fn light_vector(light: &Light, cell: &Cell) -> Vector3<f64> {
    light_vector_in_rig(light, &cell.point_mm)
}

/// Woodham's least squares, float64.
fn solve_cell(vectors: &[Vector3<f64>], signals: &[f64], sheet: &Sheet) -> Option<SolvedCell> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (vector, signal) in vectors.iter().zip(signals).filter(|(_, signal)| signal.is_finite()) {
        matrix += vector * vector.transpose();
        right += vector * *signal;
    }
    let scaled = matrix.try_inverse()? * right;
    let albedo = scaled.norm();
    let truth = sheet.plane.normal.into_inner();
    let eigenvalues = matrix.symmetric_eigenvalues();
    let residual = |(vector, signal): (&Vector3<f64>, &f64)| signal / vector.dot(&scaled) - 1.0;
    Some(SolvedCell {
        angle_deg: scaled.cross(&truth).norm().atan2(scaled.dot(&truth)).to_degrees(),
        albedo: albedo / sheet.reflectance,
        condition: (eigenvalues.max() / eigenvalues.min().max(f64::MIN_POSITIVE)).sqrt(),
        residuals: vectors.iter().zip(signals).map(residual).collect(),
    })
}

fn describe(sheet: &Sheet, solved: &[Option<SolvedCell>], lights: usize) -> CheckedSheet {
    let cells: Vec<&SolvedCell> = solved.iter().flatten().collect();
    let count = f64::max(cells.len() as f64, 1.0);
    let rms =
        |values: &mut dyn Iterator<Item = f64>| (values.map(|v| v * v).sum::<f64>() / count).sqrt();
    let sorted = |value: &dyn Fn(&SolvedCell) -> f64| {
        let mut values: Vec<f64> = cells.iter().map(|cell| value(cell)).collect();
        values.sort_unstable_by(f64::total_cmp);
        values
    };
    let angles = sorted(&|cell| cell.angle_deg);
    let conditions = sorted(&|cell| cell.condition);
    let at = |values: &[f64], share: f64| {
        values
            .get((share * values.len() as f64) as usize)
            .or(values.last())
            .copied()
            .unwrap_or(f64::NAN)
    };
    let mean_albedo = cells.iter().map(|cell| cell.albedo).sum::<f64>() / count;
    let of_light = |i: usize| {
        let residuals: Vec<f64> =
            cells.iter().map(|cell| cell.residuals[i]).filter(|r| r.is_finite()).collect();
        (residuals.iter().map(|r| r * r).sum::<f64>() / f64::max(residuals.len() as f64, 1.0))
            .sqrt()
    };
    CheckedSheet {
        name: sheet.name.clone(),
        tilt_deg: tilt_and_height(&sheet.plane).0,
        slope_rms_deg: rms(&mut cells.iter().map(|cell| cell.angle_deg)),
        slope_p95_deg: at(&angles, 0.95),
        slope_max_deg: at(&angles, 1.0),
        albedo: [mean_albedo, rms(&mut cells.iter().map(|cell| cell.albedo - mean_albedo))],
        condition: [at(&conditions, 0.5), at(&conditions, 1.0)],
        residual_rms: (0..lights).map(of_light).collect(),
        residual_map: None,
    }
}

/// One tile per light, side by side in rows of five: red where the sheet is brighter than the model, blue where darker.
fn write_map(
    out: &Path,
    sheet: &Sheet,
    solved: &[Option<SolvedCell>],
    lights: usize,
) -> Result<PathBuf, CalibrateError> {
    const SCALE: usize = 6;
    const GAP: usize = 4;
    std::fs::create_dir_all(out).map_err(|source| FileError::write(out, source))?;
    let tile = sheet.grid.map(|cells| cells * SCALE + GAP);
    let columns = lights.min(5);
    let rows = lights.div_ceil(columns);
    let mut image = Image::filled(columns * tile[0], rows * tile[1], [40u8; 3]);
    for (cell, solved) in sheet.cells.iter().zip(solved) {
        for i in 0..lights {
            let residual = solved.as_ref().map_or(f64::NAN, |solved| solved.residuals[i]) as f32;
            let corner = [
                (i % columns) * tile[0] + cell.place[0] * SCALE,
                (i / columns) * tile[1] + cell.place[1] * SCALE,
            ];
            for k in 0..SCALE * SCALE {
                let (x, y) = (corner[0] + k % SCALE, corner[1] + k / SCALE);
                image.data[y * image.width + x] = diverging(residual / MAP_RANGE);
            }
        }
    }
    let path = out.join(format!("residuals-{}.png", file_name(&sheet.name)));
    write_png(&path, &image)?;
    Ok(path)
}

/// A capture session's name is free text.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

/// Blue (-1) through white to red (+1); grey for nothing.
fn diverging(value: f32) -> [u8; 3] {
    if !value.is_finite() {
        return [90; 3];
    }
    let fade = |share: f32| (255.0 * (1.0 - share.clamp(0.0, 1.0))) as u8;
    if value >= 0.0 { [255, fade(value), fade(value)] } else { [fade(-value), fade(-value), 255] }
}

fn write_png(path: &Path, image: &Image<[u8; 3]>) -> Result<(), FileError> {
    let failed = |error: png::EncodingError| {
        FileError::write(path, std::io::Error::other(error.to_string()))
    };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&image.data.concat()).map_err(failed)?;
    writer.finish().map_err(failed)?;
    write_owned(path, &bytes)
}
