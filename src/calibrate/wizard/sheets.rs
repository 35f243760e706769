//! The white sheets so far. Each is read once, and how well they and the next one locate the lights is predicted once.

use super::rig_folder::RigFolder;
use super::task::{Placement, Pose, Task};
use crate::calibrate::{
    CalibrateError, Foreseen, Progress, SeenSheet, look_at_sheet, sheets_so_far,
};
use crate::files::sha256_of_file;
use crate::instrument::Calibration;
use crate::session::MANIFEST;
use nalgebra::{Point3, UnitVector3, Vector3};
use std::collections::HashMap;
use std::path::Path;
use weavelight_calibration::description::Plane;

/// Sheets that were read, and predictions from them, by the hashes of their inputs.
#[derive(Debug, Default)]
pub struct Sheets {
    seen: HashMap<String, SeenSheet>,
    foreseen: HashMap<String, Option<Foreseen>>,
}

impl Sheets {
    /// The sheet of a capture session, read on the first call.
    ///
    /// # Errors
    /// Where the sheet cannot be used.
    pub fn look(
        &mut self,
        home: &RigFolder,
        folder: &Path,
        progress: &Progress,
    ) -> Result<&SeenSheet, CalibrateError> {
        let key = key(home, folder);
        if !self.seen.contains_key(&key) {
            let lights = home.rig.lights.len();
            let seen = look_at_sheet(folder, &home.calibration(), lights, progress)?;
            self.seen.insert(key.clone(), seen);
        }
        Ok(&self.seen[&key])
    }

    /// How well the sheets so far locate the lights, and how well they would with the sheet that `task` asks for. `None` where
    /// the task is no sheet, or the sheets cannot be fitted: the fit then reports why.
    pub fn foresee(
        &mut self,
        home: &RigFolder,
        task: Task,
        progress: &Progress,
    ) -> Option<Foreseen> {
        let Task::Sheet(next) = task else { return None };
        if next == Pose::Check {
            return None;
        }
        let folders = Pose::FIT.iter().map(|pose| home.targets().join(pose.folder()));
        let folders: Vec<_> = folders.filter(|folder| home.is_complete(folder)).collect();
        let keys: Vec<String> = folders.iter().map(|folder| key(home, folder)).collect();
        let all = format!("{}{next:?}", keys.concat());
        if let Some(foreseen) = self.foreseen.get(&all) {
            return *foreseen;
        }
        let seen: Result<Vec<SeenSheet>, _> =
            folders.iter().map(|folder| self.look(home, folder, progress).cloned()).collect();
        let camera = Calibration::load(&home.calibration()).ok()?.camera?;
        let foreseen = sheets_so_far(&seen.ok()?, &home.rig, &camera, &planned(next)).ok();
        self.foreseen.insert(all, foreseen);
        foreseen
    }
}

/// What the reading depends on: the frames, and what is known of the camera.
fn key(home: &RigFolder, folder: &Path) -> String {
    let calibration = home.calibration();
    let files =
        [folder.join(MANIFEST), calibration.join("camera.toml"), calibration.join("color.toml")];
    files.iter().map(|file| sha256_of_file(file).unwrap_or_default()).collect()
}

/// The plane of a sheet in this pose.
fn planned(pose: Pose) -> Plane {
    let Placement { height_mm, tilt_deg, faces_deg } = pose.placement();
    let (tilt, faces) = (tilt_deg.to_radians(), faces_deg.to_radians());
    let normal = Vector3::new(tilt.sin() * faces.cos(), tilt.sin() * faces.sin(), tilt.cos());
    Plane { point_mm: Point3::new(0.0, 0.0, height_mm), normal: UnitVector3::new_normalize(normal) }
}
