//! `weavelight calibrate`

use super::calibrate_status;
use super::output::{Failure, Output, WORK_FAILED};
use super::progress::Progress;
use crate::calibrate::{self, CameraOptions, CheckOptions, ColorOptions, LightsOptions, StepState};
use crate::quantity::ANGLE_DEG;
use clap::Subcommand;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Measure the instrument from pictures of targets
///
/// Three commands add to one calibration folder: `camera` from pictures of a chessboard, `color` from a grey chart, `lights`
/// from white sheets. `status` says what there is and what to photograph next, `check` solves white sheets that the fit has
/// not seen. Whatever fails, the old calibration stands.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  weavelight calibrate camera --rig rig.toml board --out calibration\n  \
    weavelight calibrate color --rig rig.toml grey --out calibration\n  \
    weavelight calibrate lights --rig rig.toml white-flat white-raised white-tilt-* --out calibration"
)]
pub(super) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Lens, sensor and the table's pose from pictures of a chessboard
    #[command(
        after_help = "Example:\n  weavelight calibrate camera --rig rig.toml board --out calibration"
    )]
    Camera {
        /// The rig's description
        #[arg(long, value_name = "rig.toml")]
        rig: PathBuf,
        /// Board capture sessions
        #[arg(value_name = "BOARD_SESSION", required = true)]
        sessions: Vec<PathBuf>,
        /// Calibration folder to add to
        #[arg(long, value_name = "CALIB")]
        out: PathBuf,
    },
    /// Black level, response, noise, white balance and colour from a grey or colour chart
    #[command(
        after_help = "Example:\n  weavelight calibrate color --rig rig.toml grey --out calibration"
    )]
    Color {
        /// The rig's description
        #[arg(long, value_name = "rig.toml")]
        rig: PathBuf,
        /// Grey capture session
        #[arg(value_name = "GREY_SESSION")]
        session: PathBuf,
        /// Calibration folder to add to
        #[arg(long, value_name = "CALIB")]
        out: PathBuf,
    },
    /// Every LED's position, beam and strength from white sheets
    ///
    /// One flat sheet gives strengths and gain maps and keeps the ruler's positions; sheets flat, raised by 100 mm and tilted
    /// by 20 degrees in four directions measure the positions too.
    #[command(
        after_help = "Example:\n  weavelight calibrate lights --rig rig.toml white-flat white-raised white-tilt-* --out calibration"
    )]
    Lights {
        /// The rig's description
        #[arg(long, value_name = "rig.toml")]
        rig: PathBuf,
        /// White capture sessions
        #[arg(value_name = "WHITE_SESSION", required = true)]
        sessions: Vec<PathBuf>,
        /// Calibration folder to add to; needs its camera.toml
        #[arg(long, value_name = "CALIB")]
        out: PathBuf,
    },
    /// What there is, how good it is, and what to photograph next
    ///
    /// Of a rig's folder it also says which pictures the window's wizard has taken, and the command that continues there.
    #[command(
        after_help = "Examples:\n  weavelight calibrate status calibration\n  weavelight calibrate status rig"
    )]
    Status {
        /// Calibration folder, or the folder of a rig
        #[arg(value_name = "CALIB")]
        calibration: PathBuf,
    },
    /// Solve white sheets that the fit has not seen, flat and tilted
    ///
    /// Exit status 1 where a sheet's slope error exceeds the threshold.
    #[command(
        after_help = "Example:\n  weavelight calibrate check calibration white-tilt-4 --out residuals"
    )]
    Check {
        /// Calibration folder
        #[arg(value_name = "CALIB")]
        calibration: PathBuf,
        /// White capture sessions
        #[arg(value_name = "WHITE_SESSION", required = true)]
        sessions: Vec<PathBuf>,
        /// Largest RMS slope error over a sheet that passes
        #[arg(long, value_name = "DEG", default_value_t = 0.1, value_parser = |text: &str| ANGLE_DEG.parse(text))]
        threshold_deg: f64,
        /// Folder for the residual maps
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let bar = Progress::new();
    let progress = |share: f64, what: &str| bar.set(share, what);
    match &args.what {
        What::Camera { rig, sessions, out } => {
            let options =
                CameraOptions { rig: rig.clone(), sessions: sessions.clone(), out: out.clone() };
            let report = calibrate::camera(&options, &progress).map_err(Failure::work)?;
            Ok(output(camera_text(&report), &report, &report.warnings))
        }
        What::Color { rig, session, out } => {
            let options =
                ColorOptions { rig: rig.clone(), session: session.clone(), out: out.clone() };
            let report = calibrate::color(&options, &progress).map_err(Failure::work)?;
            Ok(output(color_text(&report), &report, &report.warnings))
        }
        What::Lights { rig, sessions, out } => {
            let options =
                LightsOptions { rig: rig.clone(), sessions: sessions.clone(), out: out.clone() };
            let report = calibrate::lights(&options, &progress).map_err(Failure::work)?;
            Ok(output(lights_text(&report), &report, &report.warnings))
        }
        What::Status { calibration } => {
            if calibrate_status::is_rig(calibration) {
                return calibrate_status::run(calibration, status_text);
            }
            let status = calibrate::status(calibration).map_err(Failure::work)?;
            Ok(output(status_text(&status), &status, &[]))
        }
        What::Check { calibration, sessions, threshold_deg, out } => {
            if !(*threshold_deg > 0.0 && *threshold_deg <= 90.0) {
                return Err(Failure::call(
                    "--threshold-deg is an angle above 0, 0.1 for a good rig",
                ));
            }
            let options = CheckOptions {
                calibration: calibration.clone(),
                sessions: sessions.clone(),
                threshold_deg: *threshold_deg,
                out: out.clone(),
            };
            let report = calibrate::check(&options, &progress).map_err(Failure::work)?;
            let status = if report.passed { 0 } else { WORK_FAILED };
            Ok(Output { status, ..output(check_text(&report), &report, &report.warnings) })
        }
    }
}

fn output(text: String, report: &impl Serialize, warnings: &[String]) -> Output {
    let json = serde_json::to_value(report).unwrap_or_default();
    Output { text, json, warnings: warnings.to_vec(), status: 0 }
}

fn camera_text(report: &calibrate::CameraReport) -> String {
    let kept = report.boards.iter().filter(|board| board.dropped.is_none()).count();
    let names = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];
    let values = report.intrinsics_px.iter().chain(&report.distortion);
    let mut text = format!(
        "{kept} of {} boards, reprojection error {:.3} px, camera {:.1} mm over the table\n",
        report.boards.len(),
        report.rms_reprojection_px,
        report.height_mm
    );
    for ((name, value), sigma) in names.iter().zip(values).zip(report.sigma) {
        let _ = writeln!(text, "{name} {value:12.5} +- {sigma:.5}");
    }
    let [rx, ry, rz, x, y, z] = report.pose_sigma;
    let _ = writeln!(
        text,
        "pose over the table +- {rx:.4}, {ry:.4}, {rz:.4} degrees about x, y, z; +- {x:.3}, {y:.3}, {z:.3} mm"
    );
    text.push_str("corners found in each field of the picture:\n");
    for row in report.coverage.chunks(report.coverage_grid[0]) {
        let _ = writeln!(text, "{}", row.iter().map(|n| format!("{n:5}")).collect::<String>());
    }
    for board in report.boards.iter().filter(|board| board.dropped.is_none()) {
        let _ = writeln!(text, "{}: {:.3} px", board.file, board.rms_px.unwrap_or(f64::NAN));
    }
    text
}

fn color_text(report: &calibrate::ColorReport) -> String {
    let mut text = format!(
        "black {:.2?} ({}), saturation {:.0}\n",
        report.black_level, report.black_from, report.saturation_level
    );
    if let Some(nonlinearity) = report.nonlinearity {
        let _ = writeln!(
            text,
            "nonlinearity {:.3} %, response {:?}",
            100.0 * nonlinearity,
            report.response
        );
    }
    if let (Some(gain), Some(read)) = (report.electrons_per_dn, report.read_noise_e) {
        let _ =
            writeln!(text, "{gain:.3} electrons per raw number, read noise {read:.2} electrons");
    }
    let _ = writeln!(text, "{} hot and {} dead photosites", report.hot, report.dead);
    if let Some(from) = report.matrix_from {
        let _ = writeln!(text, "colour matrix from {from}");
    }
    for (k, [before, after]) in report.patches_de2000.iter().enumerate() {
        let _ = writeln!(
            text,
            "colour patch {k}: CIEDE2000 {before:.2} without the matrix, {after:.2} with it"
        );
    }
    text
}

fn lights_text(report: &calibrate::LightsReport) -> String {
    let mut text = format!(
        "{} lights from {} ({} iterations, {:.1} s); residual {:.3} %, slow errors {:.3} %\n",
        report.lights.len(),
        report.method,
        report.iterations,
        report.fit_seconds,
        100.0 * report.residual_rms,
        100.0 * report.slow_error_rms
    );
    for (i, light) in report.lights.iter().enumerate() {
        let _ = match (light.position_mm, light.position_sigma_mm) {
            (Some([x, y, z]), Some(sigma)) => writeln!(
                text,
                "light {i}: [{x:.2}, {y:.2}, {z:.2}] mm +- {sigma:.2}{}, {:.1} mm from the rig file's",
                if light.position_claimed { "" } else { " (the rig file's, not measured)" },
                light.from_rig_mm.unwrap_or(f64::NAN)
            ),
            _ => writeln!(text, "light {i}: directional"),
        };
    }
    text
}

fn status_text(status: &calibrate::Status) -> String {
    let mut text = String::new();
    for step in &status.steps {
        let state = match step.state {
            StepState::Missing => "missing",
            StepState::Improvable => "can be better",
            StepState::Good => "good",
        };
        let created =
            step.created.as_deref().map_or(String::new(), |created| format!(", made {created}"));
        let _ = writeln!(text, "{}: {state}; {}{created}", step.name, step.quality);
    }
    let foreseen = status
        .next_sigma_mm
        .map_or(String::new(), |sigma| format!(" (position error then about {sigma:.2} mm)"));
    for advice in &status.exposure {
        let _ = writeln!(text, "exposure: {advice}");
    }
    let _ = writeln!(text, "next: {}{foreseen}", status.next);
    text
}

fn check_text(report: &calibrate::CheckReport) -> String {
    let verdict = if report.passed { "passed" } else { "failed" };
    let mut text = format!("{verdict}: slope error at most {} degrees RMS\n", report.threshold_deg);
    for sheet in &report.sheets {
        let _ = writeln!(
            text,
            "{} ({:.1} degrees): slope error {:.3} degrees RMS, {:.3} at 95 %, {:.3} at most; albedo {:.4} +- {:.4}; condition {:.1} to {:.1}",
            sheet.name,
            sheet.tilt_deg,
            sheet.slope_rms_deg,
            sheet.slope_p95_deg,
            sheet.slope_max_deg,
            sheet.albedo[0],
            sheet.albedo[1],
            sheet.condition[0],
            sheet.condition[1]
        );
        for (i, residual) in sheet.residual_rms.iter().enumerate() {
            let _ = write!(
                text,
                "{}light {i} {:.2} %",
                if i == 0 { "  residuals: " } else { ", " },
                100.0 * residual
            );
        }
        text.push('\n');
        if let Some(map) = &sheet.residual_map {
            let _ = writeln!(text, "  {}", map.display());
        }
    }
    text
}
