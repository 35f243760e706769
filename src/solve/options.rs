use super::Device;
use crate::photometry::Method;
use std::path::PathBuf;

/// What to solve and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The capture session's folder.
    pub session: PathBuf,
    /// The calibration's folder.
    pub calibration: PathBuf,
    /// The solution's folder.
    pub out: PathBuf,
    /// The estimator.
    pub method: Method,
    /// Whether the maps lie on the sensor's distorted grid or on an undistorted one.
    pub grid: Grid,
    /// Where green points in `normal.png`.
    pub normal_y: NormalY,
    /// The swatch, white on black; instead of the capture session's own mask.
    pub mask: Option<PathBuf>,
    /// Threads; `None`: one per core. The result does not depend on it.
    pub threads: Option<usize>,
    /// Who solves photosites that have all their samples.
    pub device: Device,
    /// Whether a solution that is up to date is made again.
    pub reuse: Reuse,
}

/// What to do where the same solution stands already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reuse {
    /// Leave it, if inputs and settings are the same.
    #[default]
    IfCurrent,
    /// Make it again.
    Never,
}

/// The pixel grid of the maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grid {
    /// The sensor's own, with the lens's distortion.
    #[default]
    Sensor,
    /// That of a pinhole camera with the same focal length and principal point.
    Undistorted,
}

/// The convention of `normal.png`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalY {
    /// +y is up, as OpenGL has it.
    #[default]
    Up,
    /// +y is down, as DirectX has it.
    Down,
}

impl Options {
    /// The default way: method auto, the sensor's grid, +y up, the capture session's mask, all cores, no graphics processor.
    pub fn new(
        session: impl Into<PathBuf>,
        calibration: impl Into<PathBuf>,
        out: impl Into<PathBuf>,
    ) -> Self {
        Self {
            session: session.into(),
            calibration: calibration.into(),
            out: out.into(),
            method: Method::Auto,
            grid: Grid::Sensor,
            normal_y: NormalY::Up,
            mask: None,
            threads: None,
            device: Device::Cpu,
            reuse: Reuse::IfCurrent,
        }
    }
}
