use super::Device;
use super::preview::Scale;
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
    /// Where the swatch is.
    pub mask: MaskChoice,
    /// Which maps are made.
    pub outputs: Outputs,
    /// Photosites that a pixel of the maps spans, each way; a preview where that is more than one.
    pub scale: Scale,
    /// Threads; `None`: one per core. The result does not depend on it.
    pub threads: Option<usize>,
    /// Who solves photosites that have all their samples.
    pub device: Device,
    /// Whether a solution that is up to date is made again.
    pub reuse: Reuse,
    /// Whether what the fit leaves over of each light is written too.
    pub residuals: Residuals,
    /// What the albedo means.
    pub albedo: AlbedoKind,
}

/// What the albedo means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AlbedoKind {
    /// Reflectance: the shading of relief that the sensor does not resolve is divided out, and kept beside it.
    #[default]
    Reflectance,
    /// With that shading: with one normal a pixel this gives the photographs back.
    Appearance,
}

impl AlbedoKind {
    /// As a report and the command line have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reflectance => "reflectance",
            Self::Appearance => "appearance",
        }
    }
}

/// What becomes of what the fit leaves over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Residuals {
    /// It is not even computed.
    #[default]
    Leave,
    /// One file a light, see [`residual_exr`](crate::solution::residual_exr).
    Write,
}

/// Where the swatch is: the table around it is not solved.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum MaskChoice {
    /// In the capture session's own mask; everywhere if it has none.
    #[default]
    OfSession,
    /// Everywhere.
    Everything,
    /// Where it is found in the frames; everywhere if it cannot be told from the table.
    Found,
    /// In a picture of the frames' size, where it is not black.
    File(PathBuf),
}

/// The maps of a solution; the mask and the report are always made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// `normal.exr`.
    pub normal: bool,
    /// `albedo.exr`.
    pub albedo: bool,
    /// `shade.exr`.
    pub shade: bool,
    /// `confidence.exr`.
    pub confidence: bool,
    /// `normal.png` and `albedo.png`, of those maps that are made.
    pub png: bool,
}

impl Outputs {
    /// Every map.
    pub const ALL: Self =
        Self { normal: true, albedo: true, shade: true, confidence: true, png: true };
    /// No map.
    pub const NONE: Self =
        Self { normal: false, albedo: false, shade: false, confidence: false, png: false };
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
    /// The default way: method auto, every map at full resolution on the sensor's grid, +y up, the capture session's mask, all
    /// cores, no graphics processor.
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
            mask: MaskChoice::OfSession,
            outputs: Outputs::ALL,
            scale: Scale::Full,
            threads: None,
            device: Device::Cpu,
            reuse: Reuse::IfCurrent,
            residuals: Residuals::Leave,
            albedo: AlbedoKind::Reflectance,
        }
    }
}
