//! The board and the camera that a rig describes.

use super::ScanError;
use crate::device::board::{Board, PortChoice};
use crate::device::camera::tethered::{self, FoundCamera};
use crate::device::camera::{
    Camera, CameraError, SimulatedCamera, Tether, TetheredCamera, UsbCamera, Waiting,
    WatchedCamera, usb_cameras,
};
use crate::files::{FileError, Lock};
use crate::instrument::{CameraKind, Rig};
use std::fmt;
use std::path::Path;

/// A light board and a camera.
pub struct Instruments {
    /// The light board.
    pub board: Board,
    /// The camera.
    pub camera: Box<dyn Camera>,
    /// Keeps other processes from the same rig for as long as these are open.
    pub lock: Lock,
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
/// Where another process has the rig open, or board or camera are not there, not ours, or not as the rig says.
pub fn open(rig: &Rig, path: &Path) -> Result<Instruments, ScanError> {
    // The name of what is locked by is that of the file: every scan names it.
    let lock = Lock::beside(path, "rig").map_err(FileError::from)?;
    let choice = PortChoice::of_rig(rig);
    // The camera first: whatever is wrong with it is told before the lights flash.
    let camera = open_camera(rig, path, &choice)?;
    let board = Board::open(choice, Some(rig.lights.len()))?;
    Ok(Instruments { board, camera, lock })
}

/// What `doctor` tells of one camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraFinding {
    /// Who it is, or where it was looked for.
    pub what: String,
    /// What is wrong and what to do; `None` where all is well.
    pub problem: Option<String>,
}

/// Looks for the camera that `rig`, read from `path`, describes; without a rig, for any on the USB. A tethered one is held for a
/// moment; nothing is set or released.
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
        Some((rig, _)) => {
            let CameraKind::Tethered { port } = &rig.camera.kind else { return Vec::new() };
            tethered_cameras(port.clone())
        }
        None => tethered_cameras(None),
    }
}

/// As libgphoto2 sees them; without it, as the system does.
fn tethered_cameras(port: Option<String>) -> Vec<CameraFinding> {
    let found = tethered::diagnose(&Tether::new(port));
    let version = CameraFinding {
        what: found
            .libgphoto2
            .as_ref()
            .map_or("tethering".to_owned(), |v| format!("libgphoto2 {v}")),
        problem: found.libgphoto2.as_ref().err().map(ToString::to_string),
    };
    let on_usb = |camera: UsbCamera| CameraFinding {
        problem: camera.problem().map(|problem| problem.to_string()),
        what: camera.name,
    };
    let held = |camera: FoundCamera| {
        let battery = camera.battery_percent.map(|percent| format!(", battery {percent} %"));
        CameraFinding {
            what: format!("{} at {}{}", camera.model, camera.port, battery.unwrap_or_default()),
            problem: camera.problem.map(|problem| problem.to_string()),
        }
    };
    let mut cameras: Vec<CameraFinding> = match found.libgphoto2 {
        Ok(_) => found.cameras.into_iter().map(held).collect(),
        Err(_) => usb_cameras().into_iter().map(on_usb).collect(),
    };
    if cameras.is_empty() {
        let problem = Some(CameraError::NoneFound.to_string());
        cameras.push(CameraFinding { what: "USB".to_owned(), problem });
    }
    cameras.insert(0, version);
    cameras
}

fn open_camera(rig: &Rig, path: &Path, choice: &PortChoice) -> Result<Box<dyn Camera>, ScanError> {
    match &rig.camera.kind {
        CameraKind::Simulated => {
            let PortChoice::Simulated(board) = choice.clone() else { return Err(ScanError::Blind) };
            let eyes = Box::new(move || board.pins());
            Ok(Box::new(SimulatedCamera::over_table(rig, path, eyes)?))
        }
        CameraKind::Watched { folder } => {
            let folder = path.parent().unwrap_or(Path::new(".")).join(folder);
            let model = rig.camera.model.as_deref();
            let camera = WatchedCamera::new(&folder, model, Waiting::default());
            camera.check()?;
            Ok(Box::new(camera))
        }
        CameraKind::Tethered { port } => {
            Ok(Box::new(TetheredCamera::open(Tether::new(port.clone()))?))
        }
    }
}
