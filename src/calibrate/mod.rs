//! From capture sessions of targets to a calibration: observations for the estimators, and what came of them.
//!
//! `calibrate camera`, `calibrate color` and `calibrate lights` each add one file to a calibration folder. A file is replaced
//! only once its successor is whole: whatever fails, the old calibration stands.

mod action;
mod boards;
mod camera;
mod check;
mod color;
mod color_matrix;
mod defective;
mod error;
mod frames;
mod inputs;
mod levels;
mod lights;
mod moved;
mod patches;
mod plausible;
mod seen;
mod sheet;
mod sheet_pose;
mod status;
pub mod wizard;

pub use action::{Action, SheetPose};
pub use camera::{BoardReport, CameraOptions, CameraReport, camera};
pub use check::{CheckOptions, CheckReport, CheckedSheet, check};
pub use color::{ColorOptions, ColorReport, color};
pub use error::CalibrateError;
pub use lights::{LightReport, LightsOptions, LightsReport, SheetReport, lights};
pub use seen::{
    BoardsSoFar, SeenBoard, SeenSheet, boards_so_far, find_board, look_at_sheet, sheets_so_far,
};
pub use status::{Status, Step, StepState, status};

pub use weavelight_calibration::lights::Foreseen;

use crate::files::{FileError, Input, sha256_of_file};
use crate::session::Session;
use std::path::Path;

/// Told the share done (0..1) and what is going on, possibly from several threads.
pub type Progress<'a> = dyn Fn(f64, &str) + Sync + 'a;

/// What a calibration file was made from.
struct Inputs;

impl Inputs {
    /// The rig's file and the sessions' manifests, which hold the hashes of their frames.
    fn of(rig: &Path, sessions: &[Session]) -> Result<Vec<Input>, FileError> {
        let mut inputs =
            vec![Input { name: rig.display().to_string(), sha256: sha256_of_file(rig)? }];
        for session in sessions {
            let sha256 = sha256_of_file(&session.manifest_path())?;
            inputs.push(Input { name: session.name.clone(), sha256 });
        }
        Ok(inputs)
    }
}
