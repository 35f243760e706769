//! The instrument on disk: `rig.toml` as the technician describes it, and the calibration folder.

mod calibration;
mod camera_file;
mod color_file;
mod defects;
mod defects_file;
mod gain_map;
mod lights_file;
mod optics;
mod rig_file;
#[cfg(test)]
mod round_trip;
#[cfg(test)]
mod tests;

pub use calibration::CalibrationProvenance;
pub use camera_file::{CAMERA_FILE, MeasuredCamera, write_camera};
pub use color_file::{COLOR_FILE, update_color, write_color};
pub use defects::Defects;
pub use defects_file::{DEFECTS_FILE, write_defects};
pub use lights_file::{LIGHTS_FILE, write_lights};
pub use optics::Optics;

use nalgebra::{Matrix3, Point3, UnitVector3};
use std::ops::RangeInclusive;
use std::path::PathBuf;
use weavelight_calibration::description::{Camera, Image, Light};

/// How many lights a rig has.
pub const LIGHT_COUNT: RangeInclusive<usize> = 3..=256;

/// `rig.toml`: the instrument as the technician describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// As in "bench rig".
    pub name: String,
    /// The camera.
    pub camera: RigCamera,
    /// The light board, if described.
    pub controller: Option<Controller>,
    /// One per LED; the order is the light's index.
    pub lights: Vec<RigLight>,
}

/// The camera of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigCamera {
    /// How pictures are taken.
    pub kind: CameraKind,
    /// As in "Nikon D5100".
    pub model: Option<String>,
    /// Width of the decoder's visible area.
    pub width_px: usize,
    /// Height of the decoder's visible area.
    pub height_px: usize,
    /// Nominal focal length.
    pub focal_length_mm: Option<f64>,
    /// Distance between photosites, micrometres.
    pub pixel_pitch_um: Option<f64>,
    /// Camera above the table, by ruler.
    pub height_mm: Option<f64>,
}

/// How pictures are taken.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraKind {
    /// Through libgphoto2.
    Tethered {
        /// libgphoto2 port, if several cameras are there.
        port: Option<String>,
    },
    /// A folder into which another program saves.
    Watched {
        /// That folder.
        folder: PathBuf,
    },
    /// The simulated rig's.
    Simulated,
}

/// The light board of a rig.
#[derive(Clone, Debug, PartialEq)]
pub enum Controller {
    /// Behind a serial port.
    Serial {
        /// Path of the port; found by identifying where absent.
        port: Option<String>,
    },
    /// The simulated one.
    Simulated,
}

/// One LED of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigLight {
    /// Output of the controller; where absent, the light's index.
    pub channel: Option<u32>,
    /// Where it is.
    pub place: RigLightPlace,
}

/// Where a light of the rig is, as far as the ruler knows.
#[derive(Clone, Debug, PartialEq)]
pub enum RigLightPlace {
    /// Near.
    Point {
        /// Rig frame, millimetres, by ruler.
        position_mm: Point3<f64>,
        /// How well the ruler did (default 10).
        position_sigma_mm: f64,
    },
    /// Far.
    Directional {
        /// From the surface to the light.
        direction: UnitVector3<f64>,
    },
}

/// A calibration folder: what is known of camera, colour and lights.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The folder.
    pub folder: PathBuf,
    /// `camera.toml`; absent for imported picture sets under directional light, and before `calibrate camera`.
    pub camera: Option<Camera>,
    /// Root mean square distance of the board's corners from where the camera model puts them.
    pub rms_reprojection_px: Option<f64>,
    /// The camera and lens that took the boards.
    pub optics: Optics,
    /// `color.toml`; where there is none, everything comes from the frames.
    pub color: Color,
    /// `defects.toml`; none where there is no such file.
    pub defects: Defects,
    /// `lights.toml`, in the rig's order; empty before `calibrate lights`.
    pub lights: Vec<CalibratedLight>,
    /// What each file records of its making.
    pub provenance: CalibrationProvenance,
}

/// `color.toml`. What is absent comes from the frame's own file.
#[derive(Clone, Debug, PartialEq)]
pub struct Color {
    /// Raw numbers, row-major 2 x 2 from the frame's top left.
    pub black_level: Option<[f64; 4]>,
    /// Raw number, black included.
    pub saturation_level: Option<f64>,
    /// Raw number from which samples are clipped, where that is below the end of the range: found in the frames, and in no
    /// file.
    pub clip_level: Option<f64>,
    /// linear = sum c_i x^i with x = (raw - black) / (saturation - black); `[0, 1]` is linear.
    pub response: Vec<f64>,
    /// Applies to white-balanced RGB; rows sum to 1.
    pub camera_to_linear_srgb: Option<Matrix3<f64>>,
    /// Gains R, G, B per light, green = 1; for showing single frames.
    pub white_balance: Vec<[f64; 3]>,
    /// Sensor noise, estimated from residuals where absent.
    pub noise: Option<Noise>,
}

/// Sensor noise: variance in electrons = signal + read^2 + (LSB^2)/12 + (kappa signal)^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Electrons per raw number.
    pub electrons_per_dn: f64,
    /// Read noise in electrons.
    pub read_noise_e: f64,
    /// What the light model leaves over, relative to the signal.
    pub kappa: f64,
}

/// One light of `lights.toml`.
#[derive(Clone, Debug)]
pub struct CalibratedLight {
    /// The light.
    pub light: Light,
    /// Multiplies the model's irradiance: R, G, B, spans the frame at any resolution, bilinear; vignetting is in it.
    pub gain_map: Option<Image<[f32; 3]>>,
    /// RMS over axes, correlated residuals accounted for.
    pub position_sigma_mm: Option<f64>,
    /// False where the pictures cannot carry a position.
    pub position_claimed: Option<bool>,
    /// What the fit had to say.
    pub warnings: Vec<String>,
}

impl Default for Color {
    fn default() -> Self {
        Self {
            black_level: None,
            saturation_level: None,
            clip_level: None,
            response: vec![0.0, 1.0],
            camera_to_linear_srgb: None,
            white_balance: Vec::new(),
            noise: None,
        }
    }
}

impl CalibratedLight {
    /// A light of which nothing but its model is known.
    pub fn new(light: Light) -> Self {
        Self {
            light,
            gain_map: None,
            position_sigma_mm: None,
            position_claimed: None,
            warnings: Vec::new(),
        }
    }
}
