//! Matrices between primaries, white points adapted with Bradford's cone responses.
//!
//! SMPTE RP 177-1993 (matrices from chromaticities); Lam, "Metamerism and colour constancy", 1985 (Bradford), as in ICC.1:2022,
//! annex E.

use nalgebra::{Matrix3, Vector3};

/// ITU-R BT.709-6: red, green, blue.
pub(crate) const BT_709: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
/// D65, as BT.709 and sRGB round it.
pub(crate) const D65: [f64; 2] = [0.3127, 0.3290];
/// The white of ICC profiles: ICC.1:2022, 7.2.16.
const PCS_WHITE: [f64; 3] = [0.9642, 1.0, 0.8249];

/// Elements of a matrix closer to the identity than this come from rounded digits.
const SAME_PRIMARIES: f64 = 2e-3;
/// How far a profile's white may be from where it must be.
const WHITE_SLACK: f64 = 0.05;

/// Linear Rec. 709 from linear RGB of these primaries and white; `None` where they span no colours.
pub(crate) fn linear_srgb_from(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Option<[[f64; 3]; 3]> {
    let to_d65 = adaptation(xyz(white)?, xyz(D65)?)?;
    let matrix =
        xyz_from_rgb(BT_709, D65)?.try_inverse()? * to_d65 * xyz_from_rgb(primaries, white)?;
    tidied(matrix)
}

/// Linear Rec. 709 from the linear RGB of an ICC profile: X, Y, Z of its red, green and blue under the profile connection
/// space's white.
pub(crate) fn linear_srgb_from_colorants(colorants: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let pcs = Vector3::from(PCS_WHITE);
    let srgb = adaptation(xyz(D65)?, pcs)? * xyz_from_rgb(BT_709, D65)?;
    let profile = Matrix3::from_columns(&colorants.map(Vector3::from));
    tidied(srgb.try_inverse()? * profile)
}

/// Rows that sum to 1, as white stays white.
fn tidied(matrix: Matrix3<f64>) -> Option<[[f64; 3]; 3]> {
    let mut rows: [[f64; 3]; 3] = matrix.transpose().into();
    for row in &mut rows {
        let sum: f64 = row.iter().sum();
        if sum.is_nan() || (sum - 1.0).abs() > WHITE_SLACK {
            return None;
        }
        row.iter_mut().for_each(|value| *value /= sum);
    }
    let identity: [[f64; 3]; 3] = Matrix3::identity().into();
    let same = rows.iter().flatten().zip(identity.iter().flatten());
    let same = same.fold(true, |same, (a, b)| same & ((a - b).abs() <= SAME_PRIMARIES));
    Some(if same { identity } else { rows })
}

fn xyz([x, y]: [f64; 2]) -> Option<Vector3<f64>> {
    let white = Vector3::new(x / y, 1.0, (1.0 - x - y) / y);
    (y > 0.0 && white.iter().all(|value| value.is_finite())).then_some(white)
}

fn xyz_from_rgb(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Option<Matrix3<f64>> {
    let columns = primaries.map(|[x, y]| Vector3::new(x, y, 1.0 - x - y));
    let unscaled = Matrix3::from_columns(&columns);
    let volume = unscaled.determinant().abs();
    if volume.is_nan() || volume < 1e-4 {
        return None;
    }
    let scale = unscaled.try_inverse()? * xyz(white)?;
    Some(unscaled * Matrix3::from_diagonal(&scale))
}

/// X, Y, Z under white `from` to X, Y, Z under white `to`.
fn adaptation(from: Vector3<f64>, to: Vector3<f64>) -> Option<Matrix3<f64>> {
    let bradford =
        Matrix3::new(0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296);
    let gains = (bradford * to).component_div(&(bradford * from));
    Some(bradford.try_inverse()? * Matrix3::from_diagonal(&gains) * bradford)
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn check(found: Option<[[f64; 3]; 3]>, expected: [[f64; 3]; 3], slack: f64) {
        let found = found.unwrap();
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected).abs() < slack, "{found} {expected}");
        }
    }

    #[test]
    fn its_own_primaries_are_the_identity() {
        assert_eq!(linear_srgb_from(BT_709, D65), Some(IDENTITY));
        // The D50 colorants that every sRGB profile holds.
        let colorants =
            [[0.43607, 0.22249, 0.01392], [0.38515, 0.71687, 0.09708], [0.14307, 0.06061, 0.7141]];
        assert_eq!(linear_srgb_from_colorants(colorants), Some(IDENTITY));
    }

    /// Published matrices: Display P3 (CSS Color 4, section 10.3) and ACEScg (Ocio's aces config), to linear sRGB.
    #[test]
    fn published_matrices() {
        let p3 = [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]];
        let expected = [
            [1.224_940, -0.224_940, 0.0],
            [-0.042_057, 1.042_057, 0.0],
            [-0.019_638, -0.078_636, 1.098_274],
        ];
        check(linear_srgb_from(p3, D65), expected, 2e-5);
        let ap1 = [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]];
        let expected =
            [[1.7051, -0.6218, -0.0833], [-0.1303, 1.1408, -0.0105], [-0.0240, -0.1290, 1.1530]];
        check(linear_srgb_from(ap1, [0.32168, 0.33767]), expected, 5e-3);
    }

    #[test]
    fn what_spans_no_colours_is_none() {
        assert_eq!(linear_srgb_from([[0.0; 2]; 3], [0.0; 2]), None);
        assert_eq!(linear_srgb_from([[0.3, 0.3]; 3], D65), None);
        assert_eq!(linear_srgb_from(BT_709, [f64::NAN, 0.3]), None);
        assert_eq!(linear_srgb_from_colorants([[0.0; 3]; 3]), None);
    }
}
