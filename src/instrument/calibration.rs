use super::{Calibration, camera_file, color_file, lights_file};
use crate::files::{FileError, Provenance};
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
        if camera.is_none() && color.is_none() && lights.is_none() {
            let none = std::io::Error::new(std::io::ErrorKind::NotFound, "no calibration");
            return Err(FileError::read(&folder.join(lights_file::LIGHTS_FILE), none));
        }
        let (camera, rms_reprojection_px, of_camera) = match camera {
            Some((camera, rms, provenance)) => (Some(camera), rms, Some(provenance)),
            None => (None, None, None),
        };
        let (color, of_color) = color.unzip();
        let (lights, of_lights) = lights.unzip();
        let provenance =
            CalibrationProvenance { camera: of_camera, color: of_color, lights: of_lights };
        Ok(Self {
            folder: folder.to_owned(),
            camera,
            rms_reprojection_px,
            color: color.unwrap_or_default(),
            lights: lights.unwrap_or_default(),
            provenance,
        })
    }
}
