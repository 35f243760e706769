//! Whatever the inputs, no map holds NaN or infinity, and odd sizes are pictures too.

use super::scenes::{Recipe, scene};
use super::with_warnings;
use crate::linear::PhotographedLight;
use crate::photometry::Method;
use crate::raw::{Layout, Samples};
use crate::solution::{AlbedoKind, Outputs};
use crate::solve::output::finish::{finish, leave_out_what_is_not_finite};
use crate::solve::*;
use nalgebra::Matrix3;
use weavelight_calibration::description::{Image, Light};

const METHODS: [Method; 4] = [Method::LeastSquares, Method::Weighted, Method::Auto, Method::Robust];

/// Solves in every way and looks at every number. Photosites solved.
fn check(what: &str, scene: &Scene) -> usize {
    let mut solved = 0;
    for method in METHODS {
        let Ok((maps, _)) = with_warnings(scene, method) else { continue };
        assert!(maps.counts.residual_rms().is_finite(), "{what} {method:?}: residual");
        let mut maps = finish(maps, &scene.color, Outputs::ALL, AlbedoKind::Reflectance);
        leave_out_what_is_not_finite(&mut maps);
        let vectors = maps.normal.data.iter().zip(&maps.albedo.data).zip(&maps.confidence.data);
        for (at, ((normal, albedo), error)) in vectors.enumerate() {
            let all = normal.iter().chain(albedo).chain([error]);
            assert!(
                all.clone().all(|v| v.is_finite()),
                "{what} {method:?} {at}: {normal:?} {albedo:?} {error}"
            );
            let unsolved = maps.mask.data[at] == 0;
            assert!(!unsolved || all.clone().all(|v| *v == 0.0), "{what} {method:?} {at}");
            let length: f32 = normal.iter().map(|c| c * c).sum();
            assert!(unsolved || (length - 1.0).abs() < 1e-4, "{what} {method:?} {at}: {normal:?}");
            solved += usize::from(!unsolved);
        }
    }
    solved
}

#[test]
fn absurd_numbers_make_no_absurd_maps() {
    let small = Recipe { width: 24, height: 16, ambient: true, ..Recipe::default() };
    for layout in [small.layout, Layout::Rgb, Layout::Grey] {
        let made = scene(Recipe { layout, ..small });
        let change = |what: &str, change: &dyn Fn(&mut Scene)| {
            let mut scene = made.clone();
            change(&mut scene);
            check(&format!("{layout:?}, {what}"), &scene);
        };
        for huge in [1e300, 1e39, 1e38, 1e30, f64::MAX] {
            change("matrix", &|scene| {
                scene.color.camera_to_linear_srgb = Some(Matrix3::from_element(huge));
            });
        }
        for factor in [1e-300, 1e-45, 1e-38, 1e-30, 1e-9, 1e9, 1e30, 1e38, 1e300] {
            let scale = |light: &mut PhotographedLight| match &mut light.calibrated.light {
                Light::Point(light) => light.intensity = light.intensity.map(|i| i * factor),
                Light::Directional(light) => light.intensity = light.intensity.map(|i| i * factor),
            };
            change("intensities", &|scene| scene.lights.iter_mut().for_each(scale));
            change("one intensity", &|scene| scale(&mut scene.lights[3]));
            change("exposures", &|scene| {
                scene.lights.iter_mut().for_each(|light| light.exposures[0].exposure_s *= factor);
            });
            change("an exposure", &|scene| scene.lights[3].exposures[0].exposure_s *= factor);
            change("ambient", &|scene| scene.ambient[0].exposure_s *= factor);
            change("response", &|scene| scene.color.response = vec![0.0, factor]);
        }
    }
}

#[test]
fn every_size_is_a_picture() {
    for (width, height) in [(1, 1), (2, 2), (1, 9), (9, 1), (2, 9), (3, 2), (5, 5), (6, 1), (17, 3)]
    {
        for layout in [Recipe::default().layout, Layout::Rgb, Layout::Grey] {
            for known_noise in [true, false] {
                let mut scene = scene(Recipe { width, height, layout, ..Recipe::default() });
                if !known_noise {
                    scene.color.noise = None;
                }
                let what = format!("{width} x {height} {layout:?}");
                scene.leave_out_what_adds_nothing().unwrap();
                assert_eq!(check(&what, &scene), METHODS.len() * width * height, "{what}");
            }
        }
    }
}

#[test]
fn masks_and_clipping_leave_nothing_odd() {
    let small = Recipe { width: 24, height: 16, ..Recipe::default() };
    let mut masked = scene(small);
    masked.mask = Some(Image::filled(24, 16, false));
    assert_eq!(check("all masked", &masked), 0);
    masked.mask.as_mut().unwrap().data[100] = true;
    assert_eq!(check("one photosite", &masked), METHODS.len());
    masked.leave_out_what_adds_nothing().unwrap();
    let mut clipped = scene(small);
    for light in &mut clipped.lights {
        light.exposures[0].frame.samples = Samples::U16(vec![u16::MAX; 24 * 16]);
    }
    assert_eq!(check("all clipped", &clipped), 0);
    // Of two exposures of each light the long one clips everywhere.
    let mut long = scene(Recipe { exposures: 2, ..small });
    let known = with_warnings(&scene(small), Method::Auto).unwrap().0;
    for light in &mut long.lights {
        light.exposures[1].frame.samples = Samples::U16(vec![u16::MAX; 24 * 16]);
    }
    check("long ones clipped", &long);
    long.leave_out_what_adds_nothing().unwrap();
    assert!(with_warnings(&long, Method::Auto).unwrap().0 == known);
}

/// A light that sinks below the plane across the frame, and one that stands under the table.
#[test]
fn lights_at_and_below_the_plane_are_named() {
    let lower = |scene: &mut Scene, light: usize, z: f64| {
        if let Light::Point(light) = &mut scene.lights[light].calibrated.light {
            light.position_mm.z = z;
        }
    };
    let warnings = |scene: &Scene| with_warnings(scene, Method::Auto).unwrap().1.join("\n");
    let mut made = scene(Recipe::default());
    assert_eq!(warnings(&made), "");
    lower(&mut made, 4, -300.0);
    let told = warnings(&made);
    assert!(told.contains("Light 4 is behind the surface everywhere"), "{told}");
    check("under the table", &made);
    // In the plane itself, and among the photosites.
    let on_plane = |scene: &mut Scene, light: usize, x: f64| {
        let (point, normal) = (scene.plane.point_mm, scene.plane.normal);
        if let Light::Point(light) = &mut scene.lights[light].calibrated.light {
            light.position_mm.x = x;
            light.position_mm.y = 0.0;
            light.position_mm.z = point.z - normal.x * x / normal.z;
        }
    };
    for x in [0.0, 40.0, 500.0] {
        let mut flat = scene(Recipe::default());
        on_plane(&mut flat, 6, x);
        check("in the plane", &flat);
    }
    let mut low = scene(Recipe::default());
    (0..8).for_each(|light| lower(&mut low, light, -300.0));
    let error = with_warnings(&low, Method::Auto).unwrap_err().to_string();
    assert!(error.contains("stand at or below the plane of the swatch"), "{error}");
}
