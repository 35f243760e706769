//! The simulated sensor's colour: which camera RGB a reflectance gives, and the CIE values of a patch.
//!
//! The sensor sees white-balanced camera RGB = M^-1 (linear sRGB), M = [`CAMERA_TO_LINEAR_SRGB`]; the colour of light and
//! filters is in the lights' intensities.

use nalgebra::{Matrix3, Vector3};

/// White-balanced camera RGB to linear sRGB; rows sum to 1.
pub const CAMERA_TO_LINEAR_SRGB: [[f64; 3]; 3] =
    [[1.72, -0.60, -0.12], [-0.16, 1.44, -0.28], [0.04, -0.42, 1.38]];

/// Linear sRGB (D65) to CIE XYZ, IEC 61966-2-1.
const XYZ_FROM_SRGB: [[f64; 3]; 3] = [
    [0.412_390_8, 0.357_584_3, 0.180_480_8],
    [0.212_639_0, 0.715_168_7, 0.072_192_3],
    [0.019_330_8, 0.119_194_8, 0.950_532_2],
];
/// CIE XYZ under D65 to XYZ under D50, Bradford.
const D50_FROM_D65: [[f64; 3]; 3] = [
    [1.047_929_8, 0.022_946_8, -0.050_192_2],
    [0.029_627_8, 0.990_434_5, -0.017_073_8],
    [-0.009_243_1, 0.015_055_1, 0.751_874_3],
];

fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

/// [`CAMERA_TO_LINEAR_SRGB`] as a matrix.
pub fn camera_to_linear_srgb() -> Matrix3<f64> {
    matrix(CAMERA_TO_LINEAR_SRGB)
}

/// Linear sRGB to white-balanced camera RGB.
pub fn camera_from_linear_srgb() -> Matrix3<f64> {
    camera_to_linear_srgb().try_inverse().unwrap_or_else(Matrix3::identity)
}

/// The rows of [`camera_from_linear_srgb`], one per channel, for the inner loop.
pub(crate) fn channel_rows() -> [[f32; 3]; 3] {
    let m = camera_from_linear_srgb();
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)] as f32))
}

/// DNG's ColorMatrix1: CIE XYZ (D65) to camera RGB as it comes, given the camera's answer to white (green = 1).
pub fn camera_from_xyz(neutral: [f64; 3]) -> Matrix3<f64> {
    let srgb_from_xyz = matrix(XYZ_FROM_SRGB).try_inverse().unwrap_or_else(Matrix3::identity);
    Matrix3::from_diagonal(&Vector3::from(neutral)) * camera_from_linear_srgb() * srgb_from_xyz
}

/// Linear sRGB from the 8-bit sRGB numbers in which colours are published.
pub fn linear_from_srgb8(srgb: [u8; 3]) -> [f64; 3] {
    srgb.map(|v| {
        let v = f64::from(v) / 255.0;
        if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    })
}

/// Relative luminance Y of a linear sRGB colour.
pub fn luminance(linear_srgb: [f64; 3]) -> f64 {
    (0..3).map(|c| XYZ_FROM_SRGB[1][c] * linear_srgb[c]).sum()
}

/// CIE L*a*b* under D50 (Bradford-adapted) of a linear sRGB reflectance.
pub fn lab_d50(linear_srgb: [f64; 3]) -> [f64; 3] {
    let to_d50 = matrix(D50_FROM_D65) * matrix(XYZ_FROM_SRGB);
    let white = to_d50 * Vector3::repeat(1.0);
    let xyz = to_d50 * Vector3::from(linear_srgb);
    let f = |i: usize| {
        let t = xyz[i] / white[i];
        if t > (6.0f64 / 29.0).powi(3) {
            t.cbrt()
        } else {
            t * (29.0f64 / 6.0).powi(2) / 3.0 + 4.0 / 29.0
        }
    };
    [116.0 * f(1) - 16.0, 500.0 * (f(0) - f(1)), 200.0 * (f(1) - f(2))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_stays_white() {
        for row in CAMERA_TO_LINEAR_SRGB {
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        let lab = lab_d50([1.0; 3]);
        assert!((lab[0] - 100.0).abs() < 1e-9 && lab[1].abs() < 1e-9 && lab[2].abs() < 1e-9);
        let answer =
            camera_from_xyz([0.5, 1.0, 0.6]) * matrix(XYZ_FROM_SRGB) * Vector3::repeat(1.0);
        assert!((answer - Vector3::new(0.5, 1.0, 0.6)).norm() < 1e-9);
    }

    #[test]
    fn lab_of_known_colours() {
        // sRGB primaries under D50, as published by B. Lindbloom's calculator.
        for (srgb, expected) in [
            ([255, 0, 0], [54.29, 80.81, 69.89]),
            ([0, 255, 0], [87.82, -79.29, 80.99]),
            ([0, 0, 255], [29.57, 68.30, -112.03]),
        ] {
            let lab = lab_d50(linear_from_srgb8(srgb));
            let off = (0..3).map(|i| (lab[i] - expected[i]).abs()).fold(0.0, f64::max);
            assert!(off < 0.05, "{srgb:?}: {lab:?}");
        }
    }
}
