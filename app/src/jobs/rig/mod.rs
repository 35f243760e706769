//! Jobs of the Rig room.

pub mod act;

use crate::model::project::Project;
use weavelight::device::scan::CameraFinding;
use weavelight::doctor::LightBoard;
use weavelight::instrument::CalibratedLight;

/// Requests of the Rig room.
#[derive(Clone, Debug)]
pub enum Command {
    /// Look for board and camera.
    Find,
    /// Light one of the rig's lights; `None`: all off.
    Light(Option<usize>),
    /// One light after the other.
    TestEach,
    /// What a rig's calibration says of the lights.
    ReadCalibration(Box<Project>),
}

/// Updates for the Rig room.
#[derive(Debug)]
pub enum Event {
    /// What was found.
    Found {
        /// Light boards, and ports without one.
        boards: Vec<LightBoard>,
        /// Cameras.
        cameras: Vec<CameraFinding>,
    },
    /// What is lit now.
    Lit(Option<usize>),
    /// The calibrated lights; empty where there are none.
    Lights(Vec<CalibratedLight>),
}
