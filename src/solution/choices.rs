//! What a solution can be asked to hold.

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

/// How many photosites a preview pixel spans, each way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// One: full resolution.
    Full = 1,
    /// Two.
    Half = 2,
    /// Four.
    Quarter = 4,
    /// Eight.
    Eighth = 8,
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

/// Whether the fit's residual of each light is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Residuals {
    /// It is not even computed.
    #[default]
    Leave,
    /// One file a light, see [`residual_exr`](crate::solution::residual_exr).
    Write,
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
