//! What the fit leaves over of each light.

use super::scenes::{Recipe, normal_at, scene};
use super::with_warnings;
use crate::gpu::Device;
use crate::photometry::{Maps, is_solved};
use crate::photometry::{Method, Outcome};
use crate::raw::{Layout, Samples};
use crate::solve::bands::Run;
use crate::solve::bands::noise;
use crate::solve::bands::reference::signal;
use crate::solve::scene::checked::light_field;
use crate::solve::*;
use nalgebra::Vector3;
use std::sync::Mutex;
use weavelight_calibration::description::Image;

fn with_residuals(scene: &Scene, method: Method) -> (Maps, Vec<Image<f32>>) {
    let blank = || Image::filled(scene.width, scene.height, f32::NAN);
    let images: Mutex<Vec<Image<f32>>> = Mutex::new(scene.lights.iter().map(|_| blank()).collect());
    let take = |light: usize, y: usize, values: &[f32]| {
        images.lock().unwrap()[light].data[y * scene.width..][..scene.width]
            .copy_from_slice(values);
    };
    let solved = scene.check().unwrap().solve(method, &Device::Cpu, Some(&take), &|_| {}).unwrap();
    (solved.maps, images.into_inner().unwrap())
}

/// Every residual beside its definition in float64: exact signal, exact light vector, the maps' surface.
fn check_definition(recipe: Recipe, change: impl Fn(&mut Scene)) {
    let mut scene = scene(recipe);
    change(&mut scene);
    let (maps, residuals) = with_residuals(&scene, Method::Auto);
    assert_eq!(maps, with_warnings(&scene, Method::Auto).unwrap().0, "{recipe:?}");
    let field = light_field(&scene).unwrap();
    let run = Run::new(&scene, &field, noise(&scene, &field), Method::Auto);
    let mut compared = 0;
    for (x, y) in (0..scene.height).flat_map(|y| (0..scene.width).map(move |x| (x, y))) {
        let vectors = field.exact([x as f64, y as f64]).unwrap();
        let normal = Vector3::from(*maps.normal.at(x, y)).cast::<f64>();
        for (light, residual) in residuals.iter().enumerate() {
            let found = f64::from(*residual.at(x, y));
            let sample = signal(&run, light, x, y, (y & 1) * 2 + (x & 1)).0;
            if !is_solved(*maps.outcome.at(x, y)) || sample.is_nan() {
                assert!(found.is_nan(), "{recipe:?} light {light} ({x}, {y}): {found}");
                continue;
            }
            let Some(albedo) = super::own_albedo(&maps, x, y) else { continue };
            let predicted = albedo * normal.dot(&vectors[light]).max(0.0);
            let expected = (sample - predicted) / vectors[light].norm();
            assert!(
                (found - expected).abs() < 2e-5,
                "{recipe:?} light {light} ({x}, {y}): {found}, {expected}"
            );
            compared += 1;
        }
    }
    let of_colour = recipe.layout == Layout::Rgb;
    assert_eq!(compared > scene.width * scene.height, !of_colour, "{recipe:?}: {compared}");
}

#[test]
fn residuals_are_what_the_samples_exceed_the_fit_by() {
    let plain = Recipe::default();
    let all = Recipe { seed: 2, gain_maps: true, ambient: true, bent_response: true, ..plain };
    check_definition(plain, |_| {});
    check_definition(all, |_| {});
    check_definition(Recipe { exposures: 3, ..all }, |_| {});
    check_definition(Recipe { layout: Layout::Grey, lights: 3, ..all }, |_| {});
    check_definition(Recipe { layout: Layout::Rgb, ..all }, |_| {});
    check_definition(plain, |scene| {
        let mut mask = Image::filled(scene.width, scene.height, false);
        (12..25).for_each(|y| mask.data[y * scene.width + 9..][..30].fill(true));
        scene.mask = Some(mask);
    });
    check_definition(plain, |scene| spoil(scene, 2, |_| u16::MAX));
}

/// Alters one light's samples in a patch of 20 x 10.
fn spoil(scene: &mut Scene, light: usize, change: impl Fn(u16) -> u16) {
    let width = scene.width;
    let Samples::U16(samples) = &mut scene.lights[light].exposures[0].frame.samples else {
        panic!("made of integers")
    };
    for (x, y) in (20..30).flat_map(|y| (20..40).map(move |x| (x, y))) {
        samples[y * width + x] = change(samples[y * width + x]);
    }
}

#[test]
fn what_the_robust_path_drops_is_in_the_residual() {
    let mut scene = scene(Recipe { lights: 12, ..Recipe::default() });
    // 4000 of 64400 raw numbers more for light 3; light 7 wholly in shadow, at black.
    spoil(&mut scene, 3, |raw| raw + 4000);
    spoil(&mut scene, 7, |_| 600);
    let (maps, residuals) = with_residuals(&scene, Method::Auto);
    let field = light_field(&scene).unwrap();
    let mut dropped = 0;
    for (x, y) in (20..30).flat_map(|y| (20..40).map(move |x| (x, y))) {
        let found = |light: usize| f64::from(*residuals[light].at(x, y));
        let vectors = field.exact([x as f64, y as f64]).unwrap();
        let cosine = |light: usize| normal_at(x, y).dot(&vectors[light]) / vectors[light].norm();
        if cosine(7) < 0.3 || *maps.outcome.at(x, y) == Outcome::Fitted {
            continue;
        }
        dropped += 1;
        assert!(found(3) > 0.01, "({x}, {y}): highlight {}", found(3));
        let albedo = super::own_albedo(&maps, x, y).unwrap();
        let shadow = found(7) + albedo * cosine(7);
        assert!(shadow.abs() < 0.01 * albedo, "({x}, {y}): shadow {}", found(7));
        for light in (0..12).filter(|light| ![3, 7].contains(light)) {
            assert!(found(light).abs() < 2e-3, "({x}, {y}): light {light} {}", found(light));
        }
    }
    assert!(dropped > 100, "{dropped} of 200");
}

/// A residual of exactly 0 is a residual: resampling does not take it for a gap, nor a gap for 0.
#[test]
fn zeros_are_resampled_and_gaps_are_not() {
    let (width, height) = (40, 30);
    let camera = scene(Recipe { width, height, ..Recipe::default() }).camera.unwrap();
    let straight = crate::solve::output::finish::pinhole(&camera);
    let mut values = Image::filled(width, height, 0.0_f32);
    values.data[12 * width + 20] = 1.0;
    values.data[5 * width + 7] = f32::NAN;
    // Without distortion every pixel stays where it is.
    let same = crate::solve::output::finish::undistort_values(&values, &straight);
    for (at, (found, expected)) in same.data.iter().zip(&values.data).enumerate() {
        let equal = (found - expected).abs() < 1e-6 || found.is_nan() && expected.is_nan();
        assert!(equal, "{at}: {found}, not {expected}");
    }
    // With distortion the bright pixel keeps its weight among zeros: taken for gaps, they would let it spread at full height.
    let bent = crate::solve::output::finish::undistort_values(&values, &camera);
    let sum: f32 = bent.data.iter().filter(|value| value.is_finite()).sum();
    assert!((0.7..1.3).contains(&sum), "{sum}");
}
