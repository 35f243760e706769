//! From a subject to raw numbers: tiles of the frame, all lights at once, rows of tiles over threads.

mod blur;
mod bounce;
mod fabric;
mod relief;
mod shoot;

pub(crate) use blur::Kernel;
pub(crate) use fabric::TABLE_ALBEDO;
pub use fabric::{Bounce, Extent, Fabric};
pub use shoot::{Frames, Shot, Truth, auto_exposure, shoot, shoot_with_truth};

use crate::view::View;
use weavelight_calibration::description::{Cfa, Light};

/// What stands around the subject.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The camera.
    pub view: View,
    /// The lamps, by index.
    pub lights: Vec<Light>,
    /// Light that does not come from the lamps: what a perfect white diffuser on the table gives per second at ISO 100,
    /// as a fraction of the sensor's range, per camera channel.
    pub ambient: [f64; 3],
    /// The sensor's colour filters.
    pub cfa: Cfa,
}

/// A rectangle of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Left column.
    pub x: usize,
    /// Top row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Tile {
    /// Number of photosites.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }
}

/// What reaches the photosites of a tile, per second at ISO 100, as a fraction of the sensor's range. Row by row.
#[derive(Clone, Debug)]
pub struct Signals {
    /// Per light.
    pub lights: Vec<Vec<f32>>,
    /// From everything else.
    pub ambient: Vec<f32>,
    /// What is there, if the subject knows it: filled where asked for.
    pub truth: Option<Truth>,
}

/// Something to photograph.
pub trait Subject: Sync {
    /// The light that reaches the photosites of a tile.
    fn expose(&self, stage: &Stage, tile: Tile, signals: &mut Signals);
}

#[cfg(test)]
mod tests;
