//! Everything a solve needs, decoded and checked, in memory.

pub(crate) mod check;
pub(crate) mod checked;
mod exposures;
pub(crate) mod load;
pub(crate) mod reduce;

pub use checked::CheckedScene;

use crate::instrument::{Color, Defects};
use crate::linear::{Exposure, PhotographedLight, Photographs};
use crate::raw::Layout;
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

impl Scene {
    /// Every frame of a light and every ambient frame.
    pub fn exposures(&self) -> impl Iterator<Item = &Exposure> {
        self.lights.iter().flat_map(|light| &light.exposures).chain(&self.ambient)
    }

    /// Its frames, with what is known of lights and sensor.
    pub(crate) fn photographs(&self) -> Photographs<'_> {
        Photographs {
            layout: self.layout,
            size_px: self.size_px(),
            lights: &self.lights,
            ambient: &self.ambient,
            color: &self.color,
            defects: &self.defects,
        }
    }

    /// Width and height.
    pub(crate) fn size_px(&self) -> (usize, usize) {
        (self.width, self.height)
    }
}
