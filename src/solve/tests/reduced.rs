//! Previews of a finished capture session: what they are means of, and that the last of them is the solution itself.

use super::scenes::{Recipe, scene};
use super::{angle_deg, check_scene_against_reference, solve};
use crate::instrument::{Calibration, CalibrationProvenance, Defects};
use crate::linear::Reading;
use crate::live::Accumulator;
use crate::photometry::Method;
use crate::raw::{Frame, Layout, Samples};
use crate::solution::Scale;
use crate::solve::*;
use nalgebra::Vector3;
use weavelight_calibration::description::{Cfa, Image};
use weavelight_calibration::projection::Projector;

/// The sums of a scan take the lights as seen half a photosite from the middle of a block, and interpolate the inverse of the
/// normal equations.
const SAME_PREVIEW_DEG: f64 = 0.05;
/// float32 sums of up to 64 samples.
const SAME_MEAN: f64 = 2e-6;

/// Mean linear light of one channel over a block of photosites that count, by the book; `None` where one clips.
fn mean(
    scene: &Scene,
    frame: &Frame,
    rows: [usize; 2],
    columns: [usize; 2],
    channel: usize,
) -> Option<f64> {
    let reading = Reading::new(frame, &scene.color);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in rows[0]..rows[1].min(scene.height) {
        for x in columns[0]..columns[1].min(scene.width) {
            let defective = scene.defects.columns(y, x).next() == Some(x);
            let outside = scene.mask.as_ref().is_some_and(|mask| !mask.at(x, y));
            let (own, plane) = match scene.layout {
                Layout::Mosaic(cfa) => (cfa.channel(x, y) as usize, 0),
                _ => (channel, channel),
            };
            if own == channel && !defective && !outside {
                sum += reading.at(x, y, plane);
                count += 1.0;
            }
        }
    }
    (sum.is_finite() && count > 0.0).then_some(sum / count)
}

fn check_means(what: &str, scene: &Scene, scale: Scale) {
    let (small, side) = (scene.reduced(scale), scale as usize);
    assert_eq!(
        (small.width, small.height),
        (scene.width.div_ceil(side), scene.height.div_ceil(side))
    );
    let channels = small.layout.channels();
    let mut compared = 0;
    for (light, exposure) in small
        .lights
        .iter()
        .zip(&scene.lights)
        .flat_map(|(small, light)| small.exposures.iter().zip(&light.exposures))
    {
        let Samples::F32(samples) = &light.frame.samples else { panic!("means are no integers") };
        for (at, &sample) in samples.iter().enumerate() {
            let (pixel, channel) = (at / channels, at % channels);
            let (row, column) = (pixel / small.width * side, pixel % small.width * side);
            // The last block reaches into its neighbour where it would lack a filter.
            let (row, column) = (row.min(scene.height - 2), column.min(scene.width - 2));
            let block = [[row, row + side], [column, column + side]];
            let expected: Vec<Option<f64>> = (0..channels)
                .map(|c| mean(scene, &exposure.frame, block[0], block[1], c))
                .collect();
            let (Some(expected), false) = (expected[channel], expected.contains(&None)) else {
                assert!(!sample.is_finite(), "{what} {scale:?}: {at} should not count");
                continue;
            };
            let fraction = f64::from(sample / light.frame.saturation[0]);
            let off = (fraction - expected).abs();
            assert!(off < SAME_MEAN, "{what} {scale:?} {at}: {fraction} is not {expected}");
            compared += 1;
        }
    }
    assert!(compared > 100, "{what} {scale:?}: only {compared} compared");
}

fn recipes() -> Vec<(&'static str, Recipe)> {
    let all = Recipe { gain_maps: true, ambient: true, bent_response: true, ..Recipe::default() };
    vec![
        ("plain", Recipe::default()),
        ("everything", Recipe { exposures: 2, ..all }),
        ("colour", Recipe { layout: Layout::Rgb, ..all }),
        ("grey", Recipe { layout: Layout::Grey, ..all }),
        (
            "odd",
            Recipe {
                width: 67,
                height: 41,
                layout: Layout::Mosaic(Cfa::parse("GBRG").unwrap()),
                ..all
            },
        ),
    ]
}

#[test]
fn a_reduced_frame_is_the_mean_of_its_blocks() {
    for (what, recipe) in recipes() {
        let mut scene = scene(recipe);
        for scale in [Scale::Half, Scale::Quarter, Scale::Eighth] {
            check_means(what, &scene, scale);
        }
        scene.defects = Defects::new(vec![[3, 2], [20, 30]], vec![[21, 30], [50, 11]]);
        let data = (0..scene.width * scene.height).map(|k| k % scene.width > 13 && k % 11 != 3);
        scene.mask = Some(Image { width: scene.width, height: scene.height, data: data.collect() });
        for scale in [Scale::Quarter, Scale::Eighth] {
            check_means(what, &scene, scale);
        }
    }
}

#[test]
fn a_preview_is_the_solution_of_its_means_by_the_book() {
    for (what, recipe) in recipes() {
        for scale in [Scale::Half, Scale::Eighth] {
            let small = scene(Recipe { width: 131, height: 97, ..recipe }).reduced(scale);
            check_scene_against_reference(what, &small, Method::LeastSquares);
            check_scene_against_reference(what, &small, Method::Auto);
        }
    }
}

#[test]
fn reduced_pixels_look_where_their_blocks_do() {
    let scene = scene(Recipe::default());
    let camera = scene.camera.as_ref().unwrap();
    for scale in [Scale::Half, Scale::Quarter, Scale::Eighth] {
        let (small, side) =
            (crate::solve::scene::reduce::reduced_camera(camera, scale), scale as usize as f64);
        for [u, v] in [[0.0, 0.0], [3.0, 2.0], [7.0, 5.0]] {
            let middle = [u * side + (side - 1.0) / 2.0, v * side + (side - 1.0) / 2.0];
            let a = Projector::new(&small).on_plane([u, v], &scene.plane).unwrap();
            let b = Projector::new(camera).on_plane(middle, &scene.plane).unwrap();
            assert!((a - b).norm() < 1e-9, "{scale:?} ({u}, {v}): {a} is not {b}");
        }
    }
}

/// Pictures without colour filters leave no choice of weights: the sums of a running scan say the same.
#[test]
fn streamed_sums_show_the_same_as_means() {
    let scene = scene(Recipe {
        layout: Layout::Grey,
        mm_per_px: 0.3,
        ambient: true,
        width: 72,
        height: 48,
        ..Recipe::default()
    });
    for scale in [Scale::Half, Scale::Quarter, Scale::Eighth] {
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
        let like = &scene.lights[0].exposures[0].frame;
        let mut sums = Accumulator::new(calibration, scene.plane.clone(), like, scale);
        scene.ambient.iter().for_each(|ambient| sums.add_ambient(ambient.clone()).unwrap());
        for light in &scene.lights {
            sums.add(light.index, light.exposures[0].clone()).unwrap();
        }
        let streamed = sums.preview().unwrap().unwrap();
        let batch = solve(&scene.reduced(scale), Method::LeastSquares);
        for (a, b) in streamed.normal.data.iter().zip(&batch.normal.data) {
            let off = angle_deg(&Vector3::from(*a).cast(), &Vector3::from(*b).cast());
            assert!(off < SAME_PREVIEW_DEG, "{scale:?}: {off} degrees");
        }
    }
}
