//! The board and the camera that a rig describes.

use super::ScanError;
use crate::device::board::{Board, PortChoice};
use crate::device::camera::{
    Camera, CameraError, SimulatedCamera, UsbCamera, Waiting, WatchedCamera, usb_cameras,
};
use crate::instrument::{CameraKind, Rig};
use crate::simulate::Scene;
use std::fmt;
use std::path::Path;

/// A light board and a camera.
pub struct Instruments {
    /// The light board.
    pub board: Board,
    /// The camera.
    pub camera: Box<dyn Camera>,
}

impl fmt::Debug for Instruments {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let camera = self.camera.describe();
        f.debug_struct("Instruments").field("board", &self.board).field("camera", &camera).finish()
    }
}

/// Opens what `rig`, read from `path`, describes. A watched folder that is not absolute is beside the rig's file.
///
/// # Errors
/// Where board or camera are not there, not ours, or not as the rig says.
pub fn open(rig: &Rig, path: &Path) -> Result<Instruments, ScanError> {
    let choice = PortChoice::of_rig(rig);
    // The camera first: whatever is wrong with it is told before the lights flash.
    let camera = open_camera(rig, path, &choice)?;
    let board = Board::open(choice, Some(rig.lights.len()))?;
    Ok(Instruments { board, camera })
}

/// What `doctor` tells of one camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraFinding {
    /// Who it is, or where it was looked for.
    pub what: String,
    /// What is wrong and what to do; `None` where all is well.
    pub problem: Option<String>,
}

/// Looks for the camera that `rig`, read from `path`, describes; without a rig, for any on the USB. None is opened.
pub fn diagnose_camera(rig: Option<(&Rig, &Path)>) -> Vec<CameraFinding> {
    let finding = |what: &str, result: Result<(), String>| {
        vec![CameraFinding { what: what.to_owned(), problem: result.err() }]
    };
    match rig {
        Some((rig, path)) if !matches!(rig.camera.kind, CameraKind::Tethered { .. }) => {
            let choice = PortChoice::of_rig(rig);
            let opened = open_camera(rig, path, &choice).map_err(|error| error.to_string());
            let what = opened.as_ref().map_or("rig.toml".to_owned(), |c| c.describe().model);
            finding(&what, opened.map(drop))
        }
        _ => {
            let cameras = usb_cameras();
            if cameras.is_empty() {
                return finding("USB", Err(CameraError::NoneFound.to_string()));
            }
            let one = |camera: UsbCamera| CameraFinding {
                problem: camera.problem().map(|problem| problem.to_string()),
                what: camera.name,
            };
            cameras.into_iter().map(one).collect()
        }
    }
}

fn open_camera(rig: &Rig, path: &Path, choice: &PortChoice) -> Result<Box<dyn Camera>, ScanError> {
    match &rig.camera.kind {
        CameraKind::Simulated => {
            let PortChoice::Simulated(board) = choice.clone() else { return Err(ScanError::Blind) };
            let eyes = Box::new(move || board.pins());
            Ok(Box::new(SimulatedCamera::new(rig, Scene::beside(path)?, eyes)?))
        }
        CameraKind::Watched { folder } => {
            let folder = path.parent().unwrap_or(Path::new(".")).join(folder);
            let model = rig.camera.model.as_deref();
            let camera = WatchedCamera::new(&folder, model, Waiting::default());
            camera.check()?;
            Ok(Box::new(camera))
        }
        CameraKind::Tethered { .. } => Err(CameraError::Other {
            what: "tethered cameras are not part of this build; choose kind = \"watched\" with a folder = \"...\" in rig.toml, and let another program save there".to_owned(),
        }
        .into()),
    }
}
