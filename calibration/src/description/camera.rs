use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

/// A calibrated camera: OpenCV's pinhole with Brown-Conrady distortion, and its pose.
///
/// A point (x, y) = (X/Z, Y/Z) in the camera frame lands at (fx x'' + cx, fy y'' + cy), with x'' the distorted point.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Width of the frame in pixels.
    pub width_px: usize,
    /// Height of the frame in pixels.
    pub height_px: usize,
    /// Focal length along u, in pixels.
    pub fx: f64,
    /// Focal length along v, in pixels.
    pub fy: f64,
    /// Principal point, u, in pixels.
    pub cx: f64,
    /// Principal point, v, in pixels.
    pub cy: f64,
    /// k1, k2, p1, p2, k3 in OpenCV's order.
    pub distortion: [f64; 5],
    /// Pose: `p_in_camera = camera_from_rig * p_in_rig`, millimetres.
    pub camera_from_rig: IsometryMatrix3<f64>,
}

impl Camera {
    /// The pose of a camera that looks straight down at the origin from `height_mm`, picture axes along the rig's.
    pub fn looking_down(height_mm: f64) -> IsometryMatrix3<f64> {
        let rotation = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        IsometryMatrix3::from_parts(Translation3::new(0.0, 0.0, height_mm), rotation)
    }
}
