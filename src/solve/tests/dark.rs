//! Frames without light are named, or refused; nothing is solved from noise.

use super::scenes::{Dice, Recipe, scene};
use super::{add_noise, solve};
use crate::linear::{Exposure, PhotographedLight};
use crate::photometry::Method;
use crate::raw::{Layout, Samples};
use crate::solve::*;
use weavelight_calibration::description::Cfa;

const WIDTH: usize = 96;

fn plain() -> Recipe {
    Recipe { width: WIDTH, height: 64, ambient: true, ..Recipe::default() }
}

fn noisy(recipe: Recipe) -> Scene {
    let mut scene = scene(recipe);
    add_noise(&mut scene, 40_000.0 / 64_400.0);
    scene
}

/// Every sample of a frame anew: its place to a level, with read noise of `noise` raw numbers.
fn fill(exposure: &mut Exposure, seed: u64, noise: f64, level: &dyn Fn(usize) -> f64) {
    let Samples::U16(samples) = &mut exposure.frame.samples else { panic!("made of integers") };
    let mut dice = Dice(seed);
    for (at, sample) in samples.iter_mut().enumerate() {
        let gauss: f64 = (0..12).map(|_| dice.between(-0.5, 0.5)).sum();
        *sample = (level(at) + noise * gauss).round().clamp(0.0, 65_535.0) as u16;
    }
}

/// The ambient light at a photosite, as the recipe has it under each filter, in raw numbers.
fn room_light(at: usize) -> f64 {
    let channel = Cfa::RGGB.channel(at % WIDTH, at / WIDTH) as usize;
    600.0 + [0.02, 0.015, 0.01][channel] * 0.5 * 64_400.0
}

fn error_of(mut scene: Scene) -> String {
    let error = scene.leave_out_what_adds_nothing().unwrap_err().to_string();
    assert!(error.lines().count() <= 2, "{error}");
    error
}

#[test]
fn without_light_there_is_an_error() {
    // A lens cap: black level and read noise; or nothing at all.
    for (noise, black) in [(6.0, 600.0), (0.0, 600.0), (6.0, 601.0), (0.0, 0.0)] {
        for ambient in [true, false] {
            let mut scene = noisy(Recipe { ambient, ..plain() });
            for (k, light) in scene.lights.iter_mut().enumerate() {
                fill(&mut light.exposures[0], k as u64, noise, &|_| black);
            }
            for exposure in &mut scene.ambient {
                fill(exposure, 99, noise, &|_| black);
            }
            let error = error_of(scene);
            assert!(error.contains("no light shows a signal above noise"), "{noise}: {error}");
            assert!(error.contains("lens cap"), "{error}");
        }
    }
}

/// Lamps off in a lit room, and no ambient frame: every picture is the same but for its noise.
#[test]
fn lamps_that_change_nothing_are_an_error() {
    let mut scene = noisy(Recipe { ambient: false, ..plain() });
    for (k, light) in scene.lights.iter_mut().enumerate() {
        let level = |at: usize| 9000.0 + 2000.0 * ((at % 7) as f64) + 3.0 * (at / WIDTH) as f64;
        fill(&mut light.exposures[0], k as u64, 40.0, &level);
    }
    let error = error_of(scene);
    assert!(error.contains("no light changes the picture"), "{error}");
}

#[test]
fn half_of_the_lights_dark_leaves_the_maps_of_the_others() {
    let mut scene = noisy(plain());
    let mut without = scene.clone();
    without.lights.retain(|light| light.index % 2 == 0);
    let known = solve(&without, Method::Auto);
    for light in scene.lights.iter_mut().filter(|light| light.index % 2 == 1) {
        let seed = light.index as u64;
        fill(&mut light.exposures[0], seed, 6.0, &room_light);
    }
    let warnings = scene.leave_out_what_adds_nothing().unwrap().join("\n");
    assert!(
        warnings.contains("Lights 1, 3, 5, 7 and 9 show no signal above noise and were left out"),
        "{warnings}"
    );
    assert!(solve(&scene, Method::Auto) == known);
}

#[test]
fn with_fewer_than_three_lit_lights_there_is_an_error() {
    let mut scene = noisy(plain());
    for light in scene.lights.iter_mut().skip(2) {
        let seed = light.index as u64;
        fill(&mut light.exposures[0], seed, 6.0, &room_light);
    }
    let error = error_of(scene);
    for part in ["lights 2, 3, 4, 5, 6, 7, 8 and 9 show no signal above noise", "2 of the three"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn an_ambient_frame_that_is_none_is_refused() {
    let check = |what: &str, change: &dyn Fn(&mut Exposure)| {
        let mut scene = noisy(plain());
        change(&mut scene.ambient[0]);
        let error = error_of(scene);
        assert!(error.contains("ambient.png is brighter than every frame"), "{what}: {error}");
    };
    check("bright", &|ambient| fill(ambient, 5, 30.0, &|_| 64_000.0));
    check("white", &|ambient| fill(ambient, 5, 0.0, &|_| 65_535.0));
    // 5 s that the manifest calls 1/100 s.
    check("exposure", &|ambient| ambient.exposure_s = 0.01);
    // Longer exposures of the same dim light are none of that.
    let mut scene = noisy(plain());
    scene.ambient[0].exposure_s *= 3.0;
    let level = |at: usize| {
        let channel = Cfa::RGGB.channel(at % WIDTH, at / WIDTH) as usize;
        600.0 + [0.02, 0.015, 0.01][channel] * 6.0 * 64_400.0
    };
    fill(&mut scene.ambient[0], 5, 30.0, &level);
    assert_eq!(scene.leave_out_what_adds_nothing().unwrap(), [""; 0]);
}

#[test]
fn a_dead_channel_is_named() {
    for layout in [Layout::Mosaic(Cfa::RGGB), Layout::Rgb] {
        let kill = |light: &mut PhotographedLight| {
            let Samples::U16(samples) = &mut light.exposures[0].frame.samples else { panic!() };
            for (at, sample) in samples.iter_mut().enumerate() {
                let channel = match layout {
                    Layout::Mosaic(cfa) => cfa.channel(at % WIDTH, at / WIDTH) as usize,
                    _ => at % 3,
                };
                if channel == 2 {
                    *sample = 600;
                }
            }
        };
        let mut all = noisy(Recipe { ambient: false, layout, ..plain() });
        let mut one = all.clone();
        all.lights.iter_mut().for_each(kill);
        kill(&mut one.lights[6]);
        let warnings = all.leave_out_what_adds_nothing().unwrap().join("\n");
        assert!(warnings.contains("No frame shows any blue light above noise"), "{warnings}");
        let warnings = one.leave_out_what_adds_nothing().unwrap().join("\n");
        assert!(warnings.contains("light 6 show no blue light above noise"), "{warnings}");
    }
}
