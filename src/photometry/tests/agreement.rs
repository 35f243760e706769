//! The fast path against the float64 reference.

use nalgebra::Vector3;

use super::scene::{Random, Scene, Solved, angle_deg, many_lights, reference_lights, tilted};
use crate::photometry::{Method, Outcome};

/// What the fast path may differ from the reference, degrees, at albedo 0.01 and above.
const SAME_ANSWER_DEG: f64 = 0.001;

fn check_same(name: &str, fast: &Solved, reference: &Solved) {
    let mut worst = 0.0_f64;
    for column in 0..fast.outcome.len() {
        let place = format!("{name}, column {column}");
        assert_eq!(fast.outcome[column], reference.outcome[column], "{place}");
        assert_eq!(fast.support[column], reference.support[column], "{place}: samples kept");
        if reference.albedo[column] < 0.01 {
            continue;
        }
        worst = worst.max(angle_deg(&fast.normal(column), &reference.normal(column)));
        for (what, a, b, tolerance) in [
            ("albedo", fast.albedo[column], reference.albedo[column], 1e-5),
            (
                "expected error",
                fast.expected_error_deg[column],
                reference.expected_error_deg[column],
                1e-2,
            ),
            ("residual", fast.residual[column], reference.residual[column], 1e-3),
        ] {
            let scale =
                b.abs().max(if what == "residual" { 1e-3 * reference.albedo[column] } else { 0.0 });
            assert!((a - b).abs() <= tolerance * scale, "{place}: {what} {a} against {b}");
        }
    }
    println!("{name}: {worst:.2e} deg");
    assert!(worst <= SAME_ANSWER_DEG, "{name}: off by {worst} deg");
}

fn facets(
    width: usize,
    step: usize,
    lights: &[Vector3<f64>],
    most_tilt_deg: f64,
    seed: u64,
) -> Scene {
    let mut random = Random::new(seed);
    let mut scene = Scene::new(lights, width, step, |_| {
        let tilt = random.between(0.0, most_tilt_deg);
        let albedo = 10_f64.powf(random.between(-2.0, 0.1));
        (tilted(&mut random, tilt), albedo)
    });
    scene.add_noise(&mut random);
    scene
}

#[test]
fn fast_least_squares_is_the_reference() {
    let lights = reference_lights();
    for (width, step) in
        [(700, 64), (700, 32), (97, 96), (65, 7), (1, 64), (2, 1), (33, 33), (700, 700)]
    {
        let scene = facets(width, step, &lights, 80.0, 1);
        let method = Method::LeastSquares;
        check_same(&format!("{width} by {step}"), &scene.fast(method), &scene.reference(method));
    }
}

#[test]
fn fast_weighted_is_the_reference() {
    let lights = reference_lights();
    for (width, step) in [(700, 64), (97, 96), (65, 7), (1, 64), (700, 700)] {
        let scene = facets(width, step, &lights, 75.0, 2);
        let method = Method::Weighted;
        check_same(&format!("{width} by {step}"), &scene.fast(method), &scene.reference(method));
    }
}

#[test]
fn fast_subset_test_is_the_reference() {
    for (lights, name) in [
        (reference_lights(), "ten"),
        (many_lights(20), "twenty"),
        (many_lights(5), "five"),
        (many_lights(96), "ninety-six"),
        (many_lights(256), "most"),
    ] {
        let mut random = Random::new(6);
        let mut scene = Scene::new(&lights, 300, 64, |_| {
            let tilt = random.between(0.0, 60.0);
            (tilted(&mut random, tilt), random.between(0.02, 1.0))
        });
        scene.spoil(3, &mut random);
        scene.add_noise(&mut random);
        for column in (0..scene.width).step_by(3) {
            scene.signal[random.below(scene.lights)][column] = f32::NAN;
        }
        for method in [Method::Robust, Method::Auto] {
            check_same(
                &format!("{name} {method:?}"),
                &scene.fast(method),
                &scene.reference(method),
            );
        }
    }
}

#[test]
fn missing_samples_leave_both_with_the_same_others() {
    let mut scene = facets(900, 64, &reference_lights(), 60.0, 3);
    let mut random = Random::new(4);
    for column in 0..scene.width {
        for _ in 0..random.below(10) {
            let light = random.below(scene.lights);
            scene.signal[light][column] = f32::NAN;
        }
    }
    for method in [Method::LeastSquares, Method::Weighted] {
        check_same(&format!("{method:?}"), &scene.fast(method), &scene.reference(method));
    }
    let solved = scene.fast(Method::LeastSquares);
    for outcome in [Outcome::Fitted, Outcome::TooFewLights] {
        assert!(solved.outcome.contains(&outcome), "the scene is to show {outcome:?}");
    }
}

#[test]
fn badly_conditioned_lights_stay_in_tolerance() {
    for elevation_deg in [70.0_f64, 80.0, 85.0, 89.0, 89.9] {
        let ring: Vec<_> = reference_lights()
            .iter()
            .map(|p| {
                let flat =
                    Vector3::new(p.x, p.y, 0.0).normalize() * elevation_deg.to_radians().cos();
                560.0 * (flat + Vector3::z() * elevation_deg.to_radians().sin())
            })
            .collect();
        let scene = facets(200, 64, &ring, 30.0, 5);
        for method in [Method::LeastSquares, Method::Weighted] {
            check_same(
                &format!("{elevation_deg} {method:?}"),
                &scene.fast(method),
                &scene.reference(method),
            );
        }
    }
}
