//! The white sheets so far: each is read once, and what they and the next one tell of the lights' places is foreseen once.

use super::task::{Pose, Task};
use super::work::is_complete;
use crate::place::Place;
use nalgebra::{Point3, UnitVector3, Vector3};
use std::collections::HashMap;
use std::path::Path;
use weavelight::calibrate::{
    CalibrateError, Foreseen, Progress, SeenSheet, look_at_sheet, sheets_so_far,
};
use weavelight::files::sha256_of_file;
use weavelight::instrument::Calibration;
use weavelight::session::MANIFEST;
use weavelight_calibration::description::Plane;

/// What was read and foreseen, by the hashes of what it was made from.
#[derive(Debug, Default)]
pub(super) struct Sheets {
    seen: HashMap<String, SeenSheet>,
    foreseen: HashMap<String, Option<Foreseen>>,
}

impl Sheets {
    /// The sheet of a capture session; it is read where it was not yet.
    ///
    /// # Errors
    /// Where it cannot serve.
    pub(super) fn look(
        &mut self,
        place: &Place,
        folder: &Path,
        progress: &Progress,
    ) -> Result<&SeenSheet, CalibrateError> {
        let key = key(place, folder);
        if !self.seen.contains_key(&key) {
            let lights = place.rig.lights.len();
            let seen = look_at_sheet(folder, &place.calibration(), lights, progress)?;
            self.seen.insert(key.clone(), seen);
        }
        Ok(&self.seen[&key])
    }

    /// What the sheets so far tell of the lights' places, and what the one that `task` asks for would; `None` where it asks
    /// for none, or they cannot be fitted: then the fit itself will say why.
    pub(super) fn foresee(
        &mut self,
        place: &Place,
        task: Task,
        progress: &Progress,
    ) -> Option<Foreseen> {
        let Task::Sheet(next) = task else { return None };
        if next == Pose::Check {
            return None;
        }
        let folders = Pose::FIT.iter().map(|pose| place.targets().join(pose.folder()));
        let folders: Vec<_> = folders.filter(|folder| is_complete(folder, &place.rig)).collect();
        let keys: Vec<String> = folders.iter().map(|folder| key(place, folder)).collect();
        let all = format!("{}{next:?}", keys.concat());
        if let Some(foreseen) = self.foreseen.get(&all) {
            return *foreseen;
        }
        let seen: Result<Vec<SeenSheet>, _> =
            folders.iter().map(|folder| self.look(place, folder, progress).cloned()).collect();
        let camera = Calibration::load(&place.calibration()).ok()?.camera?;
        let foreseen = sheets_so_far(&seen.ok()?, &place.rig, &camera, &planned(next)).ok();
        self.foreseen.insert(all, foreseen);
        foreseen
    }
}

/// What the reading depends on: the frames, and what is known of the camera.
fn key(place: &Place, folder: &Path) -> String {
    let calibration = place.calibration();
    let files =
        [folder.join(MANIFEST), calibration.join("camera.toml"), calibration.join("color.toml")];
    files.iter().map(|file| sha256_of_file(file).unwrap_or_default()).collect()
}

/// Where a sheet will lie.
fn planned(pose: Pose) -> Plane {
    let [height_mm, tilt_deg, towards_deg] = pose.lies();
    let ((sin_tilt, cos_tilt), (sin, cos)) =
        (tilt_deg.to_radians().sin_cos(), towards_deg.to_radians().sin_cos());
    Plane {
        point_mm: Point3::new(0.0, 0.0, height_mm),
        normal: UnitVector3::new_normalize(Vector3::new(sin_tilt * cos, sin_tilt * sin, cos_tilt)),
    }
}
