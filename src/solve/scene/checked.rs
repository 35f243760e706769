//! A scene whose parts belong together, with its light field.

use super::Scene;
use super::check::{check_frames, check_light_field};
use crate::instrument::CAMERA_FILE;
use crate::solve::SolveError;
use crate::solve::light_field::{LightField, Unseen};

/// A scene that can be solved: frames, lights and camera belong together, and the light vectors span a volume. Its light field
/// is computed once and serves every solve of it.
pub struct CheckedScene<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) field: LightField<'a>,
    /// Sentences.
    pub(crate) warnings: Vec<String>,
}

impl Scene {
    /// Checks the scene and computes its light field.
    ///
    /// # Errors
    /// Where the frames, the lights and the camera do not belong together or say too little.
    pub fn check(&self) -> Result<CheckedScene<'_>, SolveError> {
        check_frames(self)?;
        let field = light_field(self)?;
        let warnings = check_light_field(self, &field)?;
        Ok(CheckedScene { scene: self, field, warnings })
    }
}

/// The light field of a scene's lights.
pub(crate) fn light_field(scene: &Scene) -> Result<LightField<'_>, SolveError> {
    let lights = scene.lights.iter().map(|light| &light.calibrated.light).collect();
    LightField::new(lights, scene.camera.as_ref(), &scene.plane, scene.size_px())
        .map_err(|unseen| unseen_pixel(scene, unseen))
}

/// A pixel that shows no point of the plane, as an error.
pub(crate) fn unseen_pixel(scene: &Scene, unseen: Unseen) -> SolveError {
    SolveError::Unseen {
        calibration: scene.origin.calibration.join(CAMERA_FILE),
        u: unseen.pixel[0],
        v: unseen.pixel[1],
    }
}
