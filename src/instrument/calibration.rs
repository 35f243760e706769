use super::{
    CAMERA_FILE, Calibration, LIGHTS_FILE, camera_file, color_file, defects_file, lights_file,
};
use crate::files::{FileError, Provenance, sha256_of_file};
use std::path::Path;

/// What each file of a calibration records of its making; `None` where the file is absent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationProvenance {
    /// Of `camera.toml`.
    pub camera: Option<Provenance>,
    /// Of `color.toml`.
    pub color: Option<Provenance>,
    /// Of `lights.toml`.
    pub lights: Option<Provenance>,
}

impl Calibration {
    /// Reads a calibration folder. Each of its three files may be absent: the commands that make them add one at a time,
    /// and whoever uses the calibration asks for what it needs.
    ///
    /// # Errors
    /// Where the folder holds none of the three, or one of them cannot be read or says something impossible.
    pub fn load(folder: &Path) -> Result<Self, FileError> {
        let camera = camera_file::read(folder)?;
        let color = color_file::read(folder)?;
        let lights = lights_file::read(folder)?;
        let defects = defects_file::read(folder)?;
        if camera.is_none() && color.is_none() && lights.is_none() {
            let none = std::io::Error::new(std::io::ErrorKind::NotFound, "no calibration");
            return Err(FileError::read(&folder.join(LIGHTS_FILE), none));
        }
        let (camera, of_camera) = camera.map(|read| (read.measured, read.provenance)).unzip();
        let (color, of_color) = color.unzip();
        let (lights, of_lights) = lights.unzip();
        let provenance =
            CalibrationProvenance { camera: of_camera, color: of_color, lights: of_lights };
        Ok(Self {
            folder: folder.to_owned(),
            rms_reprojection_px: camera.as_ref().and_then(|m| m.rms_reprojection_px),
            optics: camera.as_ref().map(|m| m.optics.clone()).unwrap_or_default(),
            camera: camera.map(|m| m.camera),
            color: color.unwrap_or_default(),
            defects,
            lights: lights.unwrap_or_default(),
            provenance,
        })
    }

    /// Whether the lights were calibrated with a `camera.toml` that is no longer there: their positions are then in the rig
    /// frame of the old one. False where `lights.toml` does not say.
    ///
    /// # Errors
    /// Where `camera.toml` cannot be read.
    pub fn lights_of_another_camera(&self) -> Result<bool, FileError> {
        let of_lights = self.provenance.lights.iter().flat_map(|made| &made.inputs);
        match of_lights.rev().find(|input| input.name == CAMERA_FILE) {
            Some(used) if self.camera.is_some() => {
                Ok(sha256_of_file(&self.folder.join(CAMERA_FILE))? != used.sha256)
            }
            _ => Ok(false),
        }
    }
}
