//! Everything a solve needs, decoded and checked, in memory.

use crate::instrument::{CalibratedLight, Color, Defects};
use crate::raw::{Frame, Layout};
use std::path::PathBuf;
use weavelight_calibration::description::{Camera, Image, Plane};

/// A capture session ready to be solved.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Photosites in a row of every frame.
    pub width: usize,
    /// Rows of every frame.
    pub height: usize,
    /// What one pixel of every frame holds.
    pub layout: Layout,
    /// The lights that were photographed, by ascending index.
    pub lights: Vec<PhotographedLight>,
    /// Frames with every LED off.
    pub ambient: Vec<Exposure>,
    /// May be missing where every light is far away.
    pub camera: Option<Camera>,
    /// The imaged surface.
    pub plane: Plane,
    /// What the calibration says of the sensor.
    pub color: Color,
    /// Photosites that do not measure light; they stay unsolved.
    pub defects: Defects,
    /// True where the swatch is, row by row; `None`: everywhere.
    pub mask: Option<Image<bool>>,
    /// Where all of it came from, for messages.
    pub origin: Origin,
}

/// The folders of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// The capture session's manifest.
    pub session: PathBuf,
    /// The calibration's folder.
    pub calibration: PathBuf,
}

/// A light and its frames.
#[derive(Clone, Debug)]
pub struct PhotographedLight {
    /// Its number in the rig, from 0.
    pub index: usize,
    /// What the calibration says of it.
    pub calibrated: CalibratedLight,
    /// At least one; by ascending exposure, then by content, so that nothing depends on the order of the files.
    pub exposures: Vec<Exposure>,
}

/// One frame and how it was exposed.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// The picture.
    pub frame: Frame,
    /// Exposure time, seconds.
    pub exposure_s: f64,
    /// Sensitivity.
    pub iso: f64,
    /// Where it came from, for messages.
    pub path: PathBuf,
}

impl Scene {
    /// Every frame of a light and every ambient frame.
    pub fn exposures(&self) -> impl Iterator<Item = &Exposure> {
        self.lights.iter().flat_map(|light| &light.exposures).chain(&self.ambient)
    }

    /// Width and height.
    pub(crate) fn size_px(&self) -> (usize, usize) {
        (self.width, self.height)
    }
}

impl Exposure {
    /// Seconds at ISO 100 that give the same signal.
    pub fn seconds_at_iso_100(&self) -> f64 {
        self.exposure_s * self.iso / 100.0
    }
}
