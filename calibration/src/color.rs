//! Colour: between CIE Lab under D50 and linear sRGB, and the matrix from a camera's RGB to linear sRGB.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// White of D50, Y = 1 (ICC).
const WHITE_D50: [f64; 3] = [0.964_22, 1.0, 0.825_21];

/// Linear sRGB from XYZ under D50: the sRGB primaries (IEC 61966-2-1) adapted from D65 to D50 by Bradford.
const SRGB_FROM_XYZ_D50: [[f64; 3]; 3] = [
    [3.133_856_1, -1.616_866_7, -0.490_614_6],
    [-0.978_768_4, 1.916_141_5, 0.033_454_0],
    [0.071_945_3, -0.228_991_4, 1.405_242_7],
];

/// Linear sRGB of a colour stated as CIE L*a*b* under D50.
pub fn linear_srgb_from_lab_d50([l, a, b]: [f64; 3]) -> Vector3<f64> {
    let fy = (l + 16.0) / 116.0;
    let decode = |f: f64| {
        if f > 6.0 / 29.0 { f.powi(3) } else { 3.0 * (6.0f64 / 29.0).powi(2) * (f - 4.0 / 29.0) }
    };
    let f = [fy + a / 500.0, fy, fy - b / 200.0];
    let xyz = Vector3::from_fn(|k, _| WHITE_D50[k] * decode(f[k]));
    matrix(&SRGB_FROM_XYZ_D50) * xyz
}

/// CIE L*a*b* under D50 of a linear sRGB colour.
pub fn lab_d50_from_linear_srgb(rgb: &Vector3<f64>) -> [f64; 3] {
    let xyz = matrix(&SRGB_FROM_XYZ_D50).try_inverse().unwrap_or_else(Matrix3::identity) * rgb;
    let encode = |t: f64| {
        let edge = 6.0f64 / 29.0;
        if t > edge.powi(3) { t.cbrt() } else { t / (3.0 * edge * edge) + 4.0 / 29.0 }
    };
    let [fx, fy, fz] = std::array::from_fn(|k| encode(xyz[k] / WHITE_D50[k]));
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

/// One patch of a colour chart: what the camera saw and what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorPatch {
    /// White-balanced camera RGB, relative to a perfect white under the same light.
    pub camera: [f64; 3],
    /// Stated CIE L*a*b* under D50.
    pub lab_d50: [f64; 3],
    /// Place in the chart, any unit; differences of illumination over the chart are a smooth function of it.
    pub place: [f64; 2],
}

/// A fitted matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorMatrix {
    /// Linear sRGB from white-balanced camera RGB; rows sum to 1, so that grey stays grey.
    pub srgb_from_camera: Matrix3<f64>,
    /// Per patch: illumination of its place relative to the chart's mean, divided out before comparing.
    pub illumination: Vec<f64>,
}

/// Least patches that carry a matrix (six unknowns) and the illumination (six).
const LEAST_PATCHES: usize = 8;

/// The matrix that brings the patches nearest to their stated colours, distances in CIE Lab.
///
/// First by linear least squares in turns with a smooth (quadratic) illumination over the chart, then Gauss-Newton on
/// Lab. `None` with fewer than eight patches or colours that do not span the space.
pub fn fit_color_matrix(patches: &[ColorPatch]) -> Option<ColorMatrix> {
    if patches.len() < LEAST_PATCHES {
        return None;
    }
    let targets: Vec<Vector3<f64>> =
        patches.iter().map(|p| linear_srgb_from_lab_d50(p.lab_d50)).collect();
    let mut illumination = vec![1.0; patches.len()];
    let mut found = Matrix3::identity();
    for _ in 0..30 {
        let camera: Vec<Vector3<f64>> =
            patches.iter().zip(&illumination).map(|(p, s)| Vector3::from(p.camera) / *s).collect();
        found = linear_fit(&camera, &targets)?;
        illumination = smooth_illumination(patches, &targets, &found)?;
    }
    let camera: Vec<Vector3<f64>> =
        patches.iter().zip(&illumination).map(|(p, s)| Vector3::from(p.camera) / *s).collect();
    let labs: Vec<[f64; 3]> = patches.iter().map(|p| p.lab_d50).collect();
    let srgb_from_camera = refine_in_lab(&camera, &labs, found);
    Some(ColorMatrix { srgb_from_camera, illumination })
}

/// Rows that sum to 1: t - g = m_r (r - g) + m_b (b - g), weighted by 1 / (luminance + 0.03).
fn linear_fit(camera: &[Vector3<f64>], targets: &[Vector3<f64>]) -> Option<Matrix3<f64>> {
    let mut normal = nalgebra::Matrix2::zeros();
    let mut right = nalgebra::Matrix2x3::zeros();
    for (c, t) in camera.iter().zip(targets) {
        let row = nalgebra::Vector2::new(c.x - c.y, c.z - c.y);
        let weight = (t.sum() / 3.0 + 0.03).powi(-2);
        normal += row * row.transpose() * weight;
        right += row * (t.transpose() - nalgebra::RowVector3::repeat(c.y)) * weight;
    }
    let determinant = normal.determinant();
    if determinant.is_nan() || determinant <= 1e-9 * normal.trace().powi(2) {
        return None;
    }
    let solution = normal.try_inverse()? * right;
    Some(from_free(&Vector6::from_fn(|k, _| solution[(k % 2, k / 2)])))
}

/// Per output channel the weights of red and blue; green makes the row sum to 1.
fn from_free(free: &Vector6<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| match j {
        0 => free[2 * i],
        2 => free[2 * i + 1],
        _ => 1.0 - free[2 * i] - free[2 * i + 1],
    })
}

/// Quadratic surface through measured over stated luminance, mean 1; rejects nothing, patches are few.
fn smooth_illumination(
    patches: &[ColorPatch],
    targets: &[Vector3<f64>],
    found: &Matrix3<f64>,
) -> Option<Vec<f64>> {
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    let centre = patches.iter().fold([0.0; 2], |sum, p| [sum[0] + p.place[0], sum[1] + p.place[1]]);
    let centre = centre.map(|c| c / patches.len() as f64);
    let reach = patches
        .iter()
        .map(|p| (p.place[0] - centre[0]).abs().max((p.place[1] - centre[1]).abs()))
        .fold(1e-9, f64::max);
    let row = |p: &ColorPatch| {
        let [x, y] = std::array::from_fn(|k| (p.place[k] - centre[k]) / reach);
        Vector6::new(1.0, x, y, x * x, x * y, y * y)
    };
    for (patch, target) in patches.iter().zip(targets) {
        let luminance = |c: &Vector3<f64>| c.dot(&Vector3::new(0.2126, 0.7152, 0.0722));
        let seen = luminance(&(found * Vector3::from(patch.camera)));
        let stated = luminance(target);
        // Dark patches are mostly noise and stray light.
        let weight = stated.max(0.0).powi(2) / (stated + 0.05).powi(2);
        let row = row(patch);
        normal += row * row.transpose() * weight;
        right += row * (weight * seen / stated.max(1e-3));
    }
    // A chart in one row has no second dimension: a trace of ridge keeps that direction flat.
    normal += Matrix6::identity() * (1e-6 * patches.len() as f64);
    let surface = normal.try_inverse()? * right;
    let values: Vec<f64> = patches.iter().map(|p| row(p).dot(&surface).max(1e-3)).collect();
    Some(values)
}

/// A few Gauss-Newton steps on the Lab distances, keeping the best matrix.
fn refine_in_lab(camera: &[Vector3<f64>], labs: &[[f64; 3]], start: Matrix3<f64>) -> Matrix3<f64> {
    let mut free = Vector6::from_fn(|k, _| start[(k / 2, 2 * (k % 2))]);
    let residuals = |free: &Vector6<f64>| -> Vec<f64> {
        let matrix = from_free(free);
        let of_patch = |(c, lab): (&Vector3<f64>, &[f64; 3])| {
            let found = lab_d50_from_linear_srgb(&(matrix * c));
            std::array::from_fn::<f64, 3, _>(|k| found[k] - lab[k])
        };
        camera.iter().zip(labs).flat_map(of_patch).collect()
    };
    let square = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>();
    let mut now = residuals(&free);
    for _ in 0..10 {
        let h = 1e-6;
        let columns: Vec<Vec<f64>> = (0..6)
            .map(|k| {
                let mut moved = free;
                moved[k] += h;
                residuals(&moved).iter().zip(&now).map(|(a, b)| (a - b) / h).collect()
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let normal = Matrix6::from_fn(|i, j| dot(&columns[i], &columns[j]));
        let right = Vector6::from_fn(|i, _| -dot(&columns[i], &now));
        let Some(inverse) = normal.try_inverse() else { break };
        let next = free + inverse * right;
        let then = residuals(&next);
        if square(&then) >= square(&now) {
            break;
        }
        (free, now) = (next, then);
    }
    from_free(&free)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published L*a*b* of a usual chart's patches (D50), rounded.
    const LABS: [[f64; 3]; 12] = [
        [37.99, 13.56, 14.06],
        [65.71, 18.13, 17.81],
        [49.93, -4.88, -21.93],
        [43.14, -13.10, 21.91],
        [55.11, 8.84, -25.40],
        [70.72, -33.40, -0.20],
        [62.66, 36.07, 57.10],
        [40.02, 10.41, -45.96],
        [51.12, 48.24, 16.25],
        [81.26, -0.64, -0.34],
        [50.87, -0.15, -0.27],
        [20.46, -0.08, -0.97],
    ];

    fn camera_matrix() -> Matrix3<f64> {
        Matrix3::new(1.7, -0.6, -0.1, -0.25, 1.6, -0.35, 0.02, -0.5, 1.48)
    }

    fn patches(shade: impl Fn(f64, f64) -> f64) -> Vec<ColorPatch> {
        let camera_from_srgb = camera_matrix().try_inverse().unwrap();
        let patch = |(k, lab): (usize, &[f64; 3])| {
            let place = [(k % 4) as f64, (k / 4) as f64];
            let camera =
                camera_from_srgb * linear_srgb_from_lab_d50(*lab) * shade(place[0], place[1]);
            ColorPatch { camera: camera.into(), lab_d50: *lab, place }
        };
        LABS.iter().enumerate().map(patch).collect()
    }

    #[test]
    fn white_is_white_and_lab_goes_both_ways() {
        assert!((linear_srgb_from_lab_d50([100.0, 0.0, 0.0]) - Vector3::repeat(1.0)).norm() < 2e-4);
        for lab in LABS {
            let back = lab_d50_from_linear_srgb(&linear_srgb_from_lab_d50(lab));
            assert!((0..3).all(|k| (back[k] - lab[k]).abs() < 1e-9), "{back:?}");
        }
    }

    #[test]
    fn the_matrix_is_found_under_even_and_uneven_light() {
        for bend in [0.0, 0.04] {
            let shade = |x: f64, y: f64| 1.0 + bend * (x - 1.0) - bend * (y - 1.0).powi(2);
            let fit = fit_color_matrix(&patches(shade)).unwrap();
            assert!(
                (fit.srgb_from_camera - camera_matrix()).norm() < 0.02,
                "{}",
                fit.srgb_from_camera
            );
            assert!(
                (fit.srgb_from_camera * Vector3::repeat(1.0) - Vector3::repeat(1.0)).norm() < 1e-12
            );
        }
    }

    #[test]
    fn greys_alone_carry_no_matrix() {
        let grey = |k: usize| ColorPatch {
            camera: [0.05 + 0.08 * k as f64; 3],
            lab_d50: [30.0 + 6.0 * k as f64, 0.0, 0.0],
            place: [k as f64, 0.0],
        };
        assert_eq!(fit_color_matrix(&(0..10).map(grey).collect::<Vec<_>>()), None);
        assert_eq!(fit_color_matrix(&[]), None);
    }
}
