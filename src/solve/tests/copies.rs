//! One picture under several names is noticed in whatever container it comes, and never suspected of two exposures.

use super::scenes::{Recipe, scene};
use super::{add_noise, solve};
use crate::linear::Exposure;
use crate::photometry::Method;
use crate::raw::Samples;
use crate::solve::*;

fn noisy(recipe: Recipe) -> Scene {
    let mut scene = scene(recipe);
    add_noise(&mut scene, 40_000.0 / 64_400.0);
    scene
}

fn numbers(exposure: &Exposure) -> Vec<u16> {
    let Samples::U16(samples) = &exposure.frame.samples else { panic!("made of integers") };
    samples.clone()
}

/// Puts the picture of light `from` in the place of that of light `to`, each number changed by `resave`.
fn copy(scene: &mut Scene, from: usize, to: usize, resave: &dyn Fn(f64) -> f64) {
    let samples = numbers(&scene.lights[from].exposures[0]);
    let resaved = samples.iter().map(|&v| resave(f64::from(v)).round().clamp(0.0, 65_535.0) as u16);
    scene.lights[to].exposures[0].frame.samples = Samples::U16(resaved.collect());
}

fn without(mut scene: Scene, lights: &[usize]) -> Scene {
    scene.lights.retain(|light| !lights.contains(&light.index));
    scene
}

#[test]
fn a_picture_under_two_lights_is_left_out_in_whatever_container() {
    let untouched = noisy(Recipe::default());
    let known = solve(&without(untouched.clone(), &[3, 5]), Method::Auto);
    let same = |v: f64| v;
    let resaved: [(&str, &dyn Fn(f64) -> f64); 6] = [
        ("as it is", &same),
        ("black taken off", &|v| v - 600.0),
        ("14 bits", &|v| v / 4.0),
        ("10 bits", &|v| v / 64.0),
        ("full range", &|v| (v - 600.0) * 65_535.0 / 64_400.0),
        ("brightened", &|v| 300.0 + 0.83 * v),
    ];
    for (what, resave) in resaved {
        let mut copied = untouched.clone();
        copy(&mut copied, 3, 5, resave);
        let warnings = copied.leave_out_what_adds_nothing().unwrap().join("\n");
        assert!(warnings.contains("Lights 3 and 5 have the same picture"), "{what}: {warnings}");
        assert!(warnings.contains("copies of one frame"), "{what}: {warnings}");
        assert!(solve(&copied, Method::Auto) == known, "{what}");
    }
    let mut floating = untouched.clone();
    let samples = numbers(&floating.lights[3].exposures[0]);
    let samples = samples.iter().map(|&v| f32::from(v) / 65_535.0).collect();
    floating.lights[5].exposures[0].frame.samples = Samples::F32(samples);
    let warnings = floating.leave_out_what_adds_nothing().unwrap().join("\n");
    assert!(warnings.contains("Lights 3 and 5 have the same picture"), "{warnings}");
}

#[test]
fn with_fewer_than_three_pictures_of_their_own_there_is_an_error() {
    for copies in [10, 8] {
        let mut scene = noisy(Recipe::default());
        (1..copies).for_each(|light| copy(&mut scene, 0, light, &|v| v));
        let error = scene.leave_out_what_adds_nothing().unwrap_err().to_string();
        for part in ["have the same picture", "a solve needs three", "Lights 0, 1, 2"] {
            assert!(error.contains(part), "{copies}: {error}");
        }
        assert!(error.lines().count() <= 2, "{error}");
    }
    // Far lights over whatever surface.
    let mut scene = noisy(Recipe { directional: true, ..Recipe::default() });
    (1..10).for_each(|light| copy(&mut scene, 0, light, &|v| v));
    assert!(scene.leave_out_what_adds_nothing().is_err());
}

#[test]
fn a_picture_at_two_exposures_of_a_light_is_not_used() {
    let mut scene = noisy(Recipe::default());
    let known = solve(&without(scene.clone(), &[3]), Method::Auto);
    let mut again = scene.lights[3].exposures[0].clone();
    again.exposure_s *= 2.0;
    again.path = "again.dng".into();
    scene.lights[3].exposures.push(again);
    let warnings = scene.leave_out_what_adds_nothing().unwrap().join("\n");
    assert!(warnings.contains("again.dng of light 3 are copies of one picture"), "{warnings}");
    assert!(solve(&scene, Method::Auto) == known);
}

#[test]
fn a_light_with_the_picture_of_the_ambient_light_is_left_out() {
    let mut scene = noisy(Recipe { ambient: true, ..Recipe::default() });
    let known = solve(&without(scene.clone(), &[3]), Method::Auto);
    scene.lights[3].exposures[0].frame = scene.ambient[0].frame.clone();
    let warnings = scene.leave_out_what_adds_nothing().unwrap().join("\n");
    assert!(warnings.contains("Light 3 and ambient light have the same picture"), "{warnings}");
    assert!(solve(&scene, Method::Auto) == known);
}

#[test]
fn an_ambient_frame_with_the_picture_of_a_light_is_refused() {
    let mut scene = noisy(Recipe { ambient: true, ..Recipe::default() });
    scene.ambient[0].frame = scene.lights[3].exposures[0].frame.clone();
    scene.ambient[0].exposure_s = scene.lights[3].exposures[0].exposure_s;
    let error = scene.leave_out_what_adds_nothing().unwrap_err().to_string();
    assert!(error.contains("ambient.png is brighter than"), "{error}");
    assert!(error.contains("is it the frame of a light"), "{error}");
}

/// Two exposures of one light, or of two outputs wired to one LED, differ by their noise alone. They are no copies.
#[test]
fn two_exposures_are_no_copies() {
    let mut scene = scene(Recipe::default());
    let same = scene.lights[3].exposures[0].frame.clone();
    scene.lights[5].exposures[0].frame = same.clone();
    let mut again = scene.lights[7].exposures[0].clone();
    again.path = "again.png".into();
    scene.lights[7].exposures.push(again);
    add_noise(&mut scene, 40_000.0 / 64_400.0);
    let warnings = scene.leave_out_what_adds_nothing().unwrap().join("\n");
    assert!(!warnings.contains("copies") && !warnings.contains("same picture"), "{warnings}");
    assert_eq!((scene.lights.len(), scene.lights[7].exposures.len()), (10, 2));
}
