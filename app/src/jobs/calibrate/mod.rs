//! Jobs of the Calibrate room.

pub mod act;

use crate::model::activity::Ended;
use crate::model::targets::TargetSettings;
use crate::viewer::target_picture::Picture;
use std::path::PathBuf;
use weavelight::calibrate::wizard::{Entry, State, Step, Task};
use weavelight::calibrate::{CameraReport, CheckReport, ColorReport, LightsReport};

/// Requests of the Calibrate room.
#[derive(Debug)]
pub enum Command {
    /// What is there.
    Refresh,
    /// The pictures of a task.
    Take(Task, TargetSettings),
    /// A test shot of what lies there, with what is found in it; nothing is kept.
    Look(Task, TargetSettings),
    /// The fit of a step.
    Fit(Step),
    /// The pictures of a step into the history, to take them again; the calibration stays until the new one is made.
    Again(Step),
    /// Everything into the history, and from the beginning.
    StartOver,
    /// An earlier calibration, or a step's pictures, back.
    Restore(Entry),
}

/// What came of a fit.
#[derive(Debug)]
pub enum Report {
    /// Of the camera.
    Camera(Box<CameraReport>),
    /// Of levels and colour.
    Color(Box<ColorReport>),
    /// Of the lights.
    Lights(Box<LightsReport>),
    /// Of the sheet that the fit has not seen.
    Check(Box<CheckReport>),
}

/// Updates for the Calibrate room.
#[derive(Debug)]
pub enum Event {
    /// What is there.
    State(Box<State>),
    /// What the camera saw.
    Picture(Box<Picture>),
    /// What came of a fit.
    Report(Report),
    /// What was there before is in this folder now.
    Kept(PathBuf),
    /// Something failed or was stopped: automatic steps end.
    Halted(Ended),
}
