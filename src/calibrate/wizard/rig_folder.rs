//! The folder of a rig: calibration, pictures of targets and history lie beside its `rig.toml`.

use crate::files::FileError;
use crate::instrument::{Calibration, LIGHTS_FILE, Rig};
use crate::session::Session;
use std::path::{Path, PathBuf};

/// Name of the rig's file.
pub const RIG_FILE: &str = "rig.toml";

/// A rig and where its calibration is made.
#[derive(Clone, Debug)]
pub struct RigFolder {
    /// The folder.
    pub folder: PathBuf,
    /// What `rig.toml` says.
    pub rig: Rig,
}

impl RigFolder {
    /// Opens the folder of a rig, or the rig's file itself.
    ///
    /// # Errors
    /// Where there is no rig, or it cannot be read.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let file = if path.is_dir() { path.join(RIG_FILE) } else { path.to_owned() };
        let rig = Rig::load(&file)?;
        let folder = file.parent().unwrap_or(Path::new(".")).to_owned();
        Ok(Self { folder, rig })
    }

    /// The rig's file.
    pub fn rig_file(&self) -> PathBuf {
        self.folder.join(RIG_FILE)
    }

    /// The calibration in use.
    pub fn calibration(&self) -> PathBuf {
        self.folder.join("calibration")
    }

    /// Capture sessions of calibration targets.
    pub fn targets(&self) -> PathBuf {
        self.folder.join("targets")
    }

    /// Earlier calibrations and pictures.
    pub fn history(&self) -> PathBuf {
        self.folder.join("history")
    }

    /// Whether a capture session holds every light, the ambient light, and the first light again.
    pub fn is_complete(&self, session: &Path) -> bool {
        Session::load(session).is_ok_and(|read| read.frames.len() >= self.rig.lights.len() + 2)
    }

    /// Whether maps can be made: lights are measured. Asks the disk.
    pub fn is_calibrated(&self) -> bool {
        self.calibration().join(LIGHTS_FILE).exists()
    }

    /// Age of the oldest part of the calibration, days; `None` where there is none that can be read.
    pub fn calibration_age_days(&self) -> Option<i64> {
        Calibration::load(&self.calibration()).ok().as_ref().and_then(age_days)
    }
}

/// Age of a calibration's oldest part, days; `None` where no part says when it was made.
pub fn age_days(calibration: &Calibration) -> Option<i64> {
    let of = &calibration.provenance;
    let parts = [of.camera.as_ref(), of.color.as_ref(), of.lights.as_ref()];
    let oldest = parts.into_iter().flatten().filter_map(|part| part.created).min()?;
    Some(jiff::Timestamp::now().duration_since(oldest).as_hours() / 24)
}
