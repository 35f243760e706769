use super::scenes::{Recipe, albedo_at, scene};
use super::{angle_deg, solve};
use crate::instrument::{Calibration, CalibrationProvenance};
use crate::live::{Accumulator, Preview};
use crate::photometry::Maps;
use crate::photometry::Method;
use crate::solution::Scale;
use crate::solve::*;
use nalgebra::Vector3;

/// Interpolating the inverse of the normal equations over the grid of the light field.
const SAME_PREVIEW_DEG: f64 = 0.02;
/// Where lights clip, the few that are left may nearly lie in a plane, and the normal equations square what float32 sums
/// lose then.
const SAME_WITH_CLIPPING_DEG: f64 = 0.1;

fn preview(scene: &Scene, scale: Scale, order: &[usize]) -> Option<Preview> {
    let calibration = Calibration {
        folder: "made".into(),
        camera: scene.camera.clone(),
        rms_reprojection_px: None,
        optics: Default::default(),
        color: scene.color.clone(),
        defects: scene.defects.clone(),
        lights: scene.lights.iter().map(|light| light.calibrated.clone()).collect(),
        provenance: CalibrationProvenance::default(),
    };
    let mut sums = Accumulator::new(
        calibration,
        scene.plane.clone(),
        &scene.lights[0].exposures[0].frame,
        scale,
    );
    for ambient in &scene.ambient {
        sums.add_ambient(ambient.clone()).unwrap();
    }
    for &light in order {
        sums.add(light, scene.lights[light].exposures[0].clone()).unwrap();
    }
    sums.preview().unwrap()
}

/// The streamed preview of the exposure that `keep` leaves, beside plain least squares.
fn check_full_resolution(recipe: Recipe, keep: usize, tolerance_deg: f64) -> Maps {
    let mut scene = scene(Recipe { exposures: 2, ..recipe });
    scene.lights.iter_mut().for_each(|light| drop(light.exposures.remove(1 - keep)));
    let batch = solve(&scene, Method::LeastSquares);
    let streamed = preview(&scene, Scale::Full, &[3, 0, 9, 1, 2, 8, 4, 7, 6, 5]).unwrap();
    let mut compared = 0;
    for (a, b) in streamed.normal.data.iter().zip(&batch.normal.data) {
        assert_eq!(*a == [0.0; 3], *b == [0.0; 3]);
        if *b != [0.0; 3] {
            let off = angle_deg(&Vector3::from(*a).cast(), &Vector3::from(*b).cast());
            assert!(off < tolerance_deg, "{recipe:?}, exposure {keep}: {off} degrees");
            compared += 1;
        }
    }
    assert!(compared > 1000, "only {compared} compared");
    batch
}

#[test]
fn full_resolution_is_plain_least_squares() {
    let all = Recipe { ambient: true, gain_maps: true, bent_response: true, ..Recipe::default() };
    for recipe in [Recipe::default(), all] {
        let short = check_full_resolution(recipe, 0, SAME_PREVIEW_DEG);
        assert_eq!(short.counts.saturated, 0);
        let long = check_full_resolution(recipe, 1, SAME_WITH_CLIPPING_DEG);
        assert!(long.counts.saturated > 100, "{}", long.counts.saturated);
    }
}

#[test]
fn binned_previews_show_the_same_surface() {
    let scene = scene(Recipe { mm_per_px: 0.5, ambient: true, ..Recipe::default() });
    for (scale, size) in [(Scale::Half, 2), (Scale::Quarter, 4), (Scale::Eighth, 8)] {
        let small = preview(&scene, scale, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]).unwrap();
        assert_eq!(
            (small.normal.width, small.normal.height),
            (70_usize.div_ceil(size), 50_usize.div_ceil(size))
        );
        assert_eq!(small.lights.len(), 10);
        let at = (8 / size, 8 / size);
        let lit = small.albedo.at(at.0, at.1);
        assert!(lit.iter().all(|&value| value > 0.05 && value < 1.0), "{lit:?}");
    }
    // Blocks of two inside one patch of colour have its albedo, up to the bend of the surface within a block.
    let half = preview(&scene, Scale::Half, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]).unwrap();
    for (x, y) in [(1, 1), (2, 2), (6, 4), (20, 15)] {
        let (expected, found) = (albedo_at(2 * x, 2 * y), half.albedo.at(x, y));
        if albedo_at(2 * x + 1, 2 * y + 1) == expected && albedo_at(2 * x, 2 * y + 1) == expected {
            let off =
                (0..3).map(|c| (f64::from(found[c]) / expected[c] - 1.0).abs()).fold(0.0, f64::max);
            assert!(off < 0.05, "({x}, {y}): {found:?}, expected {expected:?}");
        }
    }
}

#[test]
fn before_three_lights_there_is_nothing_to_see() {
    let scene = scene(Recipe::default());
    assert_eq!(preview(&scene, Scale::Quarter, &[]), None);
    assert_eq!(preview(&scene, Scale::Quarter, &[1, 5]), None);
    assert_eq!(preview(&scene, Scale::Quarter, &[1, 5, 5]), None);
    assert!(preview(&scene, Scale::Quarter, &[1, 5, 6]).is_some());
}
