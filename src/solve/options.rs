use crate::gpu::Device;
use crate::photometry::Method;
use crate::solution::{AlbedoKind, Grid, NormalY, Outputs, Residuals, Reuse, Scale};
use crate::swatch::MaskChoice;
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
    /// What a spectrophotometer reads of the same cloth: CIE L*a*b*, D50, 2 degrees, mean over its aperture. The albedo is
    /// scaled to that lightness.
    pub reference_lab: Option<[f64; 3]>,
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
            reference_lab: None,
        }
    }
}
