//! What adds nothing is left out, is named, and changes nothing.

use super::scenes::{Recipe, scene};
use super::{SAME_NORMAL_DEG, angle_deg, solve};
use crate::linear::Exposure;
use crate::photometry::Maps;
use crate::photometry::Method;
use crate::raw::Samples;
use crate::solve::*;
use nalgebra::Vector3;
use weavelight_calibration::description::Image;

fn samples(exposure: &mut Exposure) -> &mut Vec<u16> {
    let Samples::U16(samples) = &mut exposure.frame.samples else { panic!("made of integers") };
    samples
}

/// The same exposure of a light once more, every sample changed.
fn expose_again(scene: &mut Scene, light: usize, name: &str, change: impl Fn(u16) -> u16) {
    let mut again = scene.lights[light].exposures[0].clone();
    again.path = name.into();
    samples(&mut again).iter_mut().for_each(|sample| *sample = change(*sample));
    scene.lights[light].exposures.push(again);
}

fn assert_same(what: &str, a: &Maps, b: &Maps) {
    for (place, (a, b)) in a.normal.data.iter().zip(&b.normal.data).enumerate() {
        assert_eq!(*a == [0.0; 3], *b == [0.0; 3], "{what}: {place}");
        let off = angle_deg(&Vector3::from(*a).cast(), &Vector3::from(*b).cast());
        assert!(off < SAME_NORMAL_DEG, "{what}: {place} is {off} degrees off");
    }
}

/// `spoil` adds what adds nothing to a scene: it is left out with `expected` among the warnings, and what remains is exactly
/// the scene as it was.
fn check(expected: &str, spoil: impl Fn(&mut Scene)) -> (Maps, Scene) {
    let untouched = scene(Recipe::default());
    let mut spoilt = untouched.clone();
    spoil(&mut spoilt);
    let as_spoilt = spoilt.clone();
    let warnings = spoilt.leave_out_what_adds_nothing().unwrap().join("\n");
    assert!(warnings.contains(expected), "expected {expected:?}, got: {warnings}");
    let (found, known) = (solve(&spoilt, Method::Auto), solve(&untouched, Method::Auto));
    assert!(found == known, "{expected}: the maps are not those without it");
    (found, as_spoilt)
}

#[test]
fn frames_that_add_nothing_change_nothing() {
    check("Light 3: copy.dng is a copy of light-03-0.png and was left out", |scene| {
        expose_again(scene, 3, "copy.dng", |sample| sample);
    });
    let (found, spoilt) = check("Light 5: white.dng is clipped everywhere", |scene| {
        expose_again(scene, 5, "white.dng", |_| u16::MAX);
    });
    // Nor would it have changed the normals had it stayed.
    assert_same("clipped frame", &found, &solve(&spoilt, Method::Auto));
}

/// A second picture of a light is no copy: its noise is another.
#[test]
fn a_second_picture_counts() {
    let mut scene = scene(Recipe::default());
    expose_again(&mut scene, 3, "again.dng", |sample| sample + sample % 2);
    assert_eq!(scene.leave_out_what_adds_nothing().unwrap(), [""; 0]);
    assert_eq!(scene.lights[3].exposures.len(), 2);
}

fn clip(scene: &mut Scene, light: usize, places: impl Fn(usize) -> bool) {
    for (place, sample) in samples(&mut scene.lights[light].exposures[0]).iter_mut().enumerate() {
        if places(place) {
            *sample = u16::MAX;
        }
    }
}

#[test]
fn a_light_that_clips_everywhere_is_left_out() {
    let mut clipped = scene(Recipe::default());
    let mut without = clipped.clone();
    clip(&mut clipped, 6, |_| true);
    without.lights.remove(6);
    let as_clipped = solve(&clipped, Method::Weighted);
    let warnings = clipped.leave_out_what_adds_nothing().unwrap();
    assert_eq!(warnings, ["Light 6 is clipped everywhere and was left out."]);
    let (left, known) = (solve(&clipped, Method::Weighted), solve(&without, Method::Weighted));
    assert!(left == known, "not the maps of the other lights");
    assert_same("clipped light", &left, &as_clipped);
}

#[test]
fn only_the_swatch_says_whether_a_light_clips() {
    let inside = |place: usize| place % 70 > 20;
    let make = |places: &dyn Fn(usize) -> bool| {
        let mut scene = scene(Recipe::default());
        let data = (0..70 * 50).map(inside).collect();
        scene.mask = Some(Image { width: 70, height: 50, data });
        clip(&mut scene, 2, places);
        scene.leave_out_what_adds_nothing().unwrap();
        scene.lights.len()
    };
    assert_eq!(make(&inside), 9, "clipped wherever the swatch is");
    assert_eq!(make(&|place| !inside(place)), 10, "clipped on the table");
    assert_eq!(make(&|place| place != 70 * 25 + 40), 10, "one sample is left");
}

/// Nothing can be solved then, and nothing is written.
#[test]
fn with_fewer_than_three_lights_that_do_not_clip_there_is_an_error() {
    let check = |lights: usize, clipped: &[usize], expected: &str| {
        let mut scene = scene(Recipe { lights, ..Recipe::default() });
        clipped.iter().for_each(|&light| clip(&mut scene, light, |_| true));
        let error = scene.leave_out_what_adds_nothing().unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("take shorter exposures"), "{error}");
    };
    check(3, &[1], "light 1 is clipped everywhere");
    check(5, &[0, 2, 4], "lights 0, 2 and 4 are clipped everywhere");
    check(4, &[0, 1, 2, 3], "lights 0, 1, 2 and 3 are clipped everywhere");
}
