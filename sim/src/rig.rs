//! The reference rig: a camera 0.61 m above the table, six LEDs at about 45 degrees of elevation and four at about 62, on
//! a hemisphere of about 0.56 m.

use crate::random::Key;
use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, UnitVector3, Vector3};
use weavelight_calibration::description::{Camera, PointLight};

/// Size of the reference camera's frame, pixels.
pub const REFERENCE_SIZE_PX: [usize; 2] = [4928, 3264];
/// Nominal focal length, millimetres.
pub const REFERENCE_FOCAL_LENGTH_MM: f64 = 35.0;
/// Distance of the photosites at the reference size, micrometres.
pub const REFERENCE_PITCH_UM: f64 = 4.78;
/// Camera above the table, millimetres.
pub const REFERENCE_HEIGHT_MM: f64 = 610.0;

/// What a camera's maker and a ruler say of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalCamera {
    /// Pixels.
    pub size_px: [usize; 2],
    /// Millimetres.
    pub focal_length_mm: f64,
    /// Micrometres.
    pub pitch_um: f64,
    /// Above the table, millimetres.
    pub height_mm: f64,
}

impl NominalCamera {
    /// The reference camera at any size: the same field of view, so the pitch grows as the width shrinks.
    pub fn reference(width_px: usize, height_px: usize) -> Self {
        Self {
            size_px: [width_px, height_px],
            focal_length_mm: REFERENCE_FOCAL_LENGTH_MM,
            pitch_um: REFERENCE_PITCH_UM * REFERENCE_SIZE_PX[0] as f64 / width_px as f64,
            height_mm: REFERENCE_HEIGHT_MM,
        }
    }

    /// The true camera behind these figures: as real ones do, it misses the nominal focal length by a few parts in a
    /// thousand, is mounted with half a degree of tilt, a little off the middle, and its lens distorts.
    pub fn true_camera(&self, seed: u64) -> Camera {
        let key = Key::new(seed).with(0xca3e);
        let draw = |k: u64| key.with(k).signed_unit();
        let [width, height] = self.size_px.map(|n| n as f64);
        let focal_px = self.focal_length_mm * 1000.0 / self.pitch_um * (1.0 + 0.004 * draw(0));
        let down = Camera::looking_down(self.height_mm);
        let lean = Rotation3::from_euler_angles(0.008 * draw(1), 0.008 * draw(2), 0.006 * draw(3));
        let rotation = lean * down.rotation;
        let center =
            Point3::new(1.5 * draw(4), 1.5 * draw(5), self.height_mm * (1.0 + 0.002 * draw(6)));
        Camera {
            width_px: self.size_px[0],
            height_px: self.size_px[1],
            fx: focal_px,
            fy: focal_px * (1.0 + 1e-4 * draw(7)),
            cx: 0.5 * (width - 1.0) + 0.004 * width * draw(8),
            cy: 0.5 * (height - 1.0) + 0.004 * width * draw(9),
            distortion: [
                -0.085 * (1.0 + 0.1 * draw(10)),
                0.045 * (1.0 + 0.1 * draw(11)),
                2.5e-4 * draw(12),
                2.5e-4 * draw(13),
                -0.006 * (1.0 + 0.1 * draw(14)),
            ],
            camera_from_rig: IsometryMatrix3::from_parts(
                Translation3::from(-(rotation * center.coords)),
                rotation,
            ),
        }
    }
}

/// The reference rig's true camera at any size.
pub fn reference_camera(width_px: usize, height_px: usize, seed: u64) -> Camera {
    NominalCamera::reference(width_px, height_px).true_camera(seed)
}

/// Where the reference rig's ten LEDs are, rig frame, millimetres. Nothing is quite regular, as on a bench.
pub const REFERENCE_LIGHTS_MM: [[f64; 3]; 10] = [
    [412.0, 0.0, 380.0],
    [197.0, 338.0, 401.0],
    [-204.0, 347.0, 390.0],
    [-399.0, 6.0, 394.0],
    [-191.0, -343.0, 398.0],
    [203.0, -351.0, 384.0],
    [189.0, 182.0, 497.0],
    [-183.0, 190.0, 494.0],
    [-188.0, -179.0, 500.0],
    [181.0, -187.0, 496.0],
];

/// True LEDs at given places: axes towards the middle of the table but for a few degrees, exponents 1 to 1.5, and
/// intensities that spread by a few per cent in strength and colour.
pub fn leds_at(positions_mm: &[Point3<f64>], seed: u64) -> Vec<PointLight> {
    positions_mm.iter().enumerate().map(|(index, position)| led(*position, index, seed)).collect()
}

fn led(position_mm: Point3<f64>, index: usize, seed: u64) -> PointLight {
    let key = Key::new(seed).with(0x1ed).with(index as u64);
    let aim = Point3::new(25.0 * key.with(1).signed_unit(), 25.0 * key.with(2).signed_unit(), 0.0);
    PointLight {
        position_mm,
        axis: UnitVector3::try_new(aim - position_mm, 1e-9).unwrap_or_else(|| -Vector3::z_axis()),
        exponent: 1.0 + 0.5 * key.with(3).unit(),
        intensity: spread_intensity(key),
    }
}

/// Strength of a white LED per camera channel: green about 1, red and blue less, as a sensor's filters have it.
pub fn spread_intensity(key: Key) -> [f64; 3] {
    let strength = 1.0 + 0.08 * key.with(4).signed_unit();
    let tint = |k: u64| 1.0 + 0.03 * key.with(k).signed_unit();
    [0.52 * strength * tint(5), strength, 0.66 * strength * tint(6)]
}
