//! The colour matrix: from the patches of a colour chart, else from the camera's own.

use super::color::{Chart, light_of, neutral};
use crate::instrument::{Rig, RigLightPlace};
use crate::linear::Levels;
use crate::session::Patch;
use nalgebra::{Matrix3, UnitVector3, Vector3};
use palette::color_difference::Ciede2000;
use palette::white_point::D50;
use weavelight_calibration::color::{ColorPatch, fit_color_matrix, lab_d50_from_linear_srgb};
use weavelight_calibration::description::{Camera, Light, Plane, PointLight};
use weavelight_calibration::irradiance::light_vector_in_rig;
use weavelight_calibration::projection::Projector;

/// Colour patches as white-balanced camera RGB, the lights' shading over the chart divided out as far as the rig file and
/// the camera know it.
pub(super) fn color_patches(
    chart: &Chart,
    levels: &Levels,
    white_balance: &[[f64; 3]],
    rig: &Rig,
    camera: Option<&Camera>,
) -> Vec<ColorPatch> {
    let plane = chart.session.plane.clone().unwrap_or_else(Plane::table);
    let place = |patch: &Patch| {
        let [u0, v0, u1, v1] = patch.rect_px;
        let centre = [(u0 + u1) / 2.0, (v0 + v1) / 2.0];
        let seen = camera.and_then(|camera| Projector::new(camera).on_plane(centre, &plane));
        (seen, seen.map_or(centre, |p| [p.x, p.y]))
    };
    let shade = |light: usize, patch: &Patch| {
        let RigLightPlace::Point { position_mm, .. } = &rig.lights[light].place else { return 1.0 };
        let Some(point) = place(patch).0 else { return 1.0 };
        let axis = UnitVector3::new_normalize(-position_mm.coords);
        let led =
            PointLight { position_mm: *position_mm, axis, exponent: 1.0, intensity: [1.0; 3] };
        light_vector_in_rig(&Light::Point(led), &point).dot(&plane.normal).max(1e-6)
    };
    let mean = |k: usize, patch: &Patch| -> Option<[f64; 3]> {
        let mut sum = [0.0; 3];
        for (light, gains) in white_balance.iter().enumerate() {
            let value = light_of(chart, levels, light, k)?;
            (0..3).for_each(|c| sum[c] += value[c] * gains[c] / shade(light, patch));
        }
        Some(sum)
    };
    let values: Vec<Option<[f64; 3]>> =
        chart.patches.iter().enumerate().map(|(k, patch)| mean(k, patch)).collect();
    // White is 1: from the grey patches.
    let greys = chart.patches.iter().zip(&values).filter(|(patch, _)| neutral(patch));
    let (light, reflectance) = greys.fold((0.0, 0.0), |(light, reflectance), (patch, value)| {
        value.map_or((light, reflectance), |value| {
            (light + value[1], reflectance + patch.reflectance)
        })
    });
    let colored = chart.patches.iter().zip(&values).filter_map(|(patch, value)| {
        let camera = value.map(|value| value.map(|v| v * reflectance / light))?;
        Some(ColorPatch { camera, lab_d50: patch.lab_d50?, place: place(patch).1 })
    });
    colored.collect()
}

pub(super) type MatrixFound = (Option<Matrix3<f64>>, Option<&'static str>, Vec<[f64; 2]>);

/// From the chart's stated colours, else from the camera's own matrix.
pub(super) fn matrix(chart: &Chart, colors: &[ColorPatch]) -> MatrixFound {
    if let Some(fit) = fit_color_matrix(colors) {
        let difference = |(patch, illumination): (&ColorPatch, &f64)| {
            let camera = Vector3::from(patch.camera) / *illumination;
            [camera, fit.srgb_from_camera * camera]
                .map(|rgb| ciede2000(lab_d50_from_linear_srgb(&rgb), patch.lab_d50))
        };
        let differences = colors.iter().zip(&fit.illumination).map(difference).collect();
        return (Some(fit.srgb_from_camera), Some("the colour chart"), differences);
    }
    let own = chart.frames[0].metadata.camera_from_xyz.and_then(|rows| srgb_from_own_matrix(&rows));
    (own, own.map(|_| "the camera's own matrix"), Vec::new())
}

fn ciede2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let lab = |[l, a, b]: [f64; 3]| palette::Lab::<D50, f64>::new(l, a, b);
    lab(a).difference(lab(b))
}

/// Linear sRGB's primaries in XYZ under D65 (IEC 61966-2-1).
const XYZ_FROM_SRGB: [[f64; 3]; 3] = [
    [0.412_390_8, 0.357_584_3, 0.180_480_8],
    [0.212_639_0, 0.715_168_7, 0.072_192_3],
    [0.019_330_8, 0.119_194_8, 0.950_532_2],
];

/// The inverse of camera-from-sRGB with its rows scaled so that white is (1, 1, 1) in both.
fn srgb_from_own_matrix(camera_from_xyz: &[[f64; 3]; 3]) -> Option<Matrix3<f64>> {
    let rows = |rows: &[[f64; 3]; 3]| Matrix3::from_fn(|i, j| rows[i][j]);
    let mut camera_from_srgb = rows(camera_from_xyz) * rows(&XYZ_FROM_SRGB);
    for mut row in camera_from_srgb.row_iter_mut() {
        let white = row.sum();
        row /= white;
    }
    camera_from_srgb.try_inverse().filter(|matrix| matrix.iter().all(|v| v.is_finite()))
}
