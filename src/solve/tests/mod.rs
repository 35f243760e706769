mod copies;
mod dark;
mod folders;
mod golden;
#[cfg(feature = "gpu")]
mod gpu;
mod idle;
mod inspections;
mod numbers;
mod previews;
mod reduced;
mod residuals;
mod scenes;

use super::*;
use crate::gpu::Device;
use crate::photometry::{Albedo, Maps, is_solved};
use crate::photometry::{Method, Outcome, Pixel, RowSolver};
use crate::raw::{Layout, Samples};
use crate::solve::bands::Run;
use crate::solve::bands::noise;
use crate::solve::bands::reference::solve_exactly;
use crate::solve::scene::checked::light_field;
use nalgebra::Vector3;
use scenes::{Recipe, albedo_at, normal_at, scene};
use weavelight_calibration::description::{Cfa, DirectionalLight, Image, Light};

/// What the project asks of the fast path against float64 evaluated at every pixel.
const SAME_NORMAL_DEG: f64 = 1e-3;
/// float32 keeps seven digits; the light field's grid is good to 1e-5.
const SAME_ALBEDO: f64 = 5e-5;

/// Maps and warnings of a scene.
fn with_warnings(scene: &Scene, method: Method) -> Result<(Maps, Vec<String>), SolveError> {
    let SolvedScene { maps, warnings, .. } = solved_on(scene, method, &Device::Cpu)?;
    Ok((maps, warnings))
}

fn solved_on(scene: &Scene, method: Method, device: &Device) -> Result<SolvedScene, SolveError> {
    scene.check()?.solve(method, device, None, &|_| {})
}

fn solve(scene: &Scene, method: Method) -> Maps {
    with_warnings(scene, method).expect("the scene can be solved").0
}

fn angle_deg(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}

fn own_albedo(maps: &Maps, x: usize, y: usize) -> Option<f64> {
    match &maps.albedo {
        Albedo::Mosaic(image, _) | Albedo::Grey(image) => Some(f64::from(*image.at(x, y))),
        Albedo::Rgb(_) => None,
    }
}

/// Every pixel of the fast run beside the exact one.
fn check_against_reference(recipe: Recipe, method: Method) {
    check_scene_against_reference(&format!("{recipe:?}"), &scene(recipe), method);
}

fn check_scene_against_reference(what: &str, scene: &Scene, method: Method) {
    let maps = solve(scene, method);
    let field = light_field(scene).unwrap();
    let run = Run::new(scene, &field, noise(scene, &field), method);
    let (mut fitted, mut undecided, mut worst) = (0, 0, 0.0_f64);
    for y in 0..scene.height {
        for x in 0..scene.width {
            let outcome = *maps.outcome.at(x, y);
            let Pixel::Fitted(fit) = solve_exactly(&run, x, y).unwrap() else {
                assert!(
                    !is_solved(outcome),
                    "{what} {method:?} ({x}, {y}): {outcome:?} without a reference"
                );
                continue;
            };
            if outcome != fit.outcome {
                // A residual right at the limit of the subset test.
                undecided += 1;
                continue;
            }
            let normal = Vector3::from(*maps.normal.at(x, y)).cast::<f64>();
            worst = worst.max(angle_deg(&normal, &fit.normal));
            if let Some(albedo) = own_albedo(&maps, x, y) {
                let off = (albedo - fit.albedo).abs() / fit.albedo;
                assert!(off < SAME_ALBEDO, "{what} {method:?} ({x}, {y}): albedo off by {off:e}");
            }
            let expected = fit.expected_error.to_degrees();
            let off = (f64::from(*maps.expected_error_deg.at(x, y)) - expected).abs() / expected;
            assert!(off < 1e-3, "{what} {method:?} ({x}, {y}): expected error off by {off:e}");
            fitted += 1;
        }
    }
    assert!(undecided * 200 <= fitted, "{what} {method:?}: {undecided} decided otherwise");
    assert!(worst <= SAME_NORMAL_DEG, "{what} {method:?}: {worst:e} degrees off");
    assert!(fitted > scene.width * scene.height / 2, "{what} {method:?}: only {fitted} fitted");
}

#[test]
fn the_fast_run_agrees_with_float64_at_every_pixel() {
    let plain = Recipe::default();
    let all = Recipe { gain_maps: true, ambient: true, bent_response: true, ..plain };
    for method in [Method::LeastSquares, Method::Weighted, Method::Auto] {
        check_against_reference(plain, method);
        check_against_reference(Recipe { seed: 2, ..all }, method);
        check_against_reference(Recipe { seed: 3, exposures: 3, ..all }, method);
        check_against_reference(Recipe { seed: 4, layout: Layout::Rgb, ..all }, method);
        check_against_reference(Recipe { seed: 5, layout: Layout::Grey, ..all }, method);
        check_against_reference(Recipe { seed: 6, directional: true, ..plain }, method);
        check_against_reference(Recipe { seed: 7, lights: 3, ..plain }, method);
        check_against_reference(
            Recipe { seed: 8, lights: 64, width: 21, height: 9, ..plain },
            method,
        );
        check_against_reference(
            Recipe { seed: 8, lights: 256, width: 21, height: 9, ..plain },
            method,
        );
        check_against_reference(
            Recipe { seed: 9, mm_per_px: 0.08, width: 131, height: 70, ..plain },
            method,
        );
        check_against_reference(
            Recipe { seed: 10, layout: Layout::Mosaic(Cfa::parse("GBRG").unwrap()), ..plain },
            method,
        );
    }
}

#[test]
fn the_truth_comes_back() {
    let recipe =
        Recipe { gain_maps: true, ambient: true, bent_response: true, ..Recipe::default() };
    let scene = scene(recipe);
    let maps = solve(&scene, Method::Weighted);
    let Albedo::Mosaic(albedo, cfa) = &maps.albedo else { panic!("a mosaic gives a mosaic") };
    let mut errors = vec![];
    for y in 0..scene.height {
        for x in 0..scene.width {
            let normal = Vector3::from(*maps.normal.at(x, y)).cast::<f64>();
            errors.push(angle_deg(&normal, &normal_at(x, y)));
            let expected = albedo_at(x, y)[cfa.channel(x, y) as usize];
            let off = f64::from(*albedo.at(x, y)) / expected - 1.0;
            assert!(off.abs() < 0.01, "({x}, {y}): albedo off by {off}");
        }
    }
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    // Only rounding to 16 bits stands between the frames and the truth.
    assert!(median < 0.02, "median {median} degrees");
    assert!(*errors.last().unwrap() < 0.5, "worst {} degrees", errors.last().unwrap());
}

#[test]
fn one_pixel_is_a_picture() {
    let maps = solve(&scene(Recipe { width: 1, height: 1, ..Recipe::default() }), Method::Weighted);
    assert_eq!(maps.counts.solved(), 1);
    assert_eq!(maps.counts.of(Outcome::Fitted), 1);
}

#[test]
fn lights_that_contradict_the_others_are_named() {
    let check = |expected: &[&str], left_out: &[usize], change: &dyn Fn(&mut Scene)| {
        for seed in 20..24 {
            let mut scene = scene(Recipe { seed, ..Recipe::default() });
            change(&mut scene);
            let warnings = scene.leave_out_what_adds_nothing().unwrap().join("\n");
            let told = expected.iter().all(|part| warnings.contains(part));
            assert!(
                told && warnings.is_empty() == expected.is_empty(),
                "{expected:?}, got: {warnings}"
            );
            let left: Vec<usize> = scene.lights.iter().map(|light| light.index).collect();
            let right = (0..10).filter(|index| !left_out.contains(index));
            assert!(right.eq(left.iter().copied()) || scene.lights.len() < 9, "{left:?}");
        }
    };
    let dim = |scene: &mut Scene, light: usize, share: f64| {
        let Samples::U16(samples) = &mut scene.lights[light].exposures[0].frame.samples else {
            panic!()
        };
        samples.iter_mut().for_each(|v| *v = 600 + (f64::from(*v - 600) * share) as u16);
    };
    check(&[], &[], &|_| {});
    check(&["Light 4 shows no signal above noise", "left out"], &[4], &|scene| dim(scene, 4, 0.0));
    check(&["Light 4 gives 2.0 %", "left out"], &[4], &|scene| dim(scene, 4, 0.02));
    check(&["Light 7 gives 30 %"], &[], &|scene| dim(scene, 7, 0.3));
    // An exposure that the manifest states by a factor of two off, either way.
    check(&["Light 7 gives 50 %"], &[], &|scene| scene.lights[7].exposures[0].exposure_s *= 2.0);
    check(&["Light 2 gives 200 %"], &[], &|scene| scene.lights[2].exposures[0].iso /= 2.0);
    check(&["Lights 1 and 8 show no signal above noise"], &[1, 8], &|scene| {
        dim(scene, 1, 0.0);
        dim(scene, 8, 0.0);
    });
    for (a, b) in [(0, 1), (2, 9), (5, 6)] {
        check(&[&format!("Lights {a} and {b} seem to be swapped")], &[], &|scene| {
            let frame = std::mem::take(&mut scene.lights[a].exposures);
            let other = std::mem::replace(&mut scene.lights[b].exposures, frame);
            scene.lights[a].exposures = other;
        });
    }
    check(&["With three lights nothing can tell"], &[], &|scene| scene.lights.truncate(3));
}

/// A ring of lights at elevation e has the condition number sqrt(2) tan(e): 41 at 88 degrees, 54 at 88.5.
#[test]
fn poorly_spread_lights_are_warned_about() {
    let check = |elevation_deg: f64, expected: &str| {
        let mut scene =
            scene(Recipe { directional: true, width: 12, height: 8, ..Recipe::default() });
        let elevation = elevation_deg.to_radians();
        for (k, light) in scene.lights.iter_mut().enumerate() {
            let azimuth = k as f64 * 0.628;
            let level = elevation.cos();
            let to_light =
                Vector3::new(level * azimuth.cos(), level * azimuth.sin(), elevation.sin());
            light.calibrated.light = Light::Directional(DirectionalLight {
                direction: nalgebra::UnitVector3::new_normalize(to_light),
                intensity: [1.0; 3],
            });
        }
        let warnings = with_warnings(&scene, Method::LeastSquares).unwrap().1.join("\n");
        assert!(warnings.contains(expected), "{elevation_deg}: {warnings:?}");
        assert_eq!(warnings.is_empty(), expected.is_empty(), "{elevation_deg}: {warnings}");
    };
    check(45.0, "");
    check(88.0, "");
    check(88.5, "condition number 54");
    check(89.0, "condition number 81");
}

/// Adds the noise of a sensor to every frame: shot and read noise of `electrons_per_dn`, 4 electrons.
fn add_noise(scene: &mut Scene, electrons_per_dn: f64) {
    let mut dice = scenes::Dice(77);
    // Twelve uniform numbers have variance one.
    let mut gaussian = || (0..12).map(|_| dice.between(-0.5, 0.5)).sum::<f64>();
    for light in &mut scene.lights {
        let Samples::U16(samples) = &mut light.exposures[0].frame.samples else {
            panic!("made of integers")
        };
        for sample in samples {
            let electrons = (f64::from(*sample) - 600.0) * electrons_per_dn;
            let noisy = electrons + (electrons.max(0.0) + 16.0).sqrt() * gaussian();
            *sample = (600.0 + noisy / electrons_per_dn).round().clamp(0.0, 65_535.0) as u16;
        }
    }
}

#[test]
fn noise_is_found_in_the_pictures_where_the_calibration_is_silent() {
    let mut made = scene(Recipe { width: 200, height: 120, mm_per_px: 0.4, ..Recipe::default() });
    let electrons_per_dn = 40_000.0 / 64_400.0;
    add_noise(&mut made, electrons_per_dn);
    made.color.noise = None;
    let field = light_field(&made).unwrap();
    let found = noise(&made, &field);
    // What matters is the variance at the signals that were there; the floor alone is beyond these pictures.
    for signal in [0.1, 0.2, 0.4] {
        let (variance, truth) = (found.shot * signal + found.floor, signal / 40_000.0 + 1e-8);
        assert!(
            (variance / truth - 1.0).abs() < 0.2,
            "at {signal}: {found:?}, {variance:e} not {truth:e}"
        );
    }
    assert!(found.kappa < 0.004, "{found:?}");
}

/// What estimators from elsewhere are handed is what the run solves: its own kernel finds the same there.
#[test]
fn rows_hold_what_the_run_solves() {
    let plain = Recipe::default();
    let all = Recipe { gain_maps: true, ambient: true, bent_response: true, ..plain };
    for recipe in
        [all, Recipe { layout: Layout::Rgb, ..all }, Recipe { directional: true, ..plain }]
    {
        let mut scene = scene(recipe);
        let data = (0..scene.width * scene.height).map(|place| place % 7 > 1).collect();
        scene.mask = Some(Image { width: scene.width, height: scene.height, data });
        let maps = solve(&scene, Method::Weighted);
        let by_rows = |step: usize| {
            Rows::with(&scene, |rows| {
                rows.solve(step, &|input, output| {
                    RowSolver::new().solve(input, output, Method::Weighted).unwrap();
                })
            })
            .unwrap()
        };
        for (step, found) in [(1, by_rows(1)), (3, by_rows(3))] {
            for place in 0..scene.width * scene.height {
                let (normal, expected) = (found.data[place], maps.normal.data[place]);
                let left_out = !(place / scene.width).is_multiple_of(step) || expected == [0.0; 3];
                let [normal, expected] = [normal, expected].map(|n| Vector3::from(n).cast::<f64>());
                assert_eq!(normal == Vector3::zeros(), left_out, "{recipe:?}, {step}, {place}");
                // With a mask the run's rows begin elsewhere, and float32 rounds otherwise.
                let same = left_out || angle_deg(&normal, &expected) < SAME_NORMAL_DEG;
                assert!(same, "{recipe:?}, one row in {step}, photosite {place}");
            }
        }
    }
}
