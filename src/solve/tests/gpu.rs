//! The whole run with a graphics processor against the same without: flags, masks, counts and maps.

use super::scenes::{Recipe, scene};
use super::{solved_on, with_warnings};
use crate::gpu::Device;
use crate::gpu::{Gpu, GpuError};
use crate::photometry::Method;
use crate::photometry::{Albedo, Maps};
use crate::raw::{Layout, Samples};
use crate::solve::bands::noise;
use crate::solve::scene::checked::light_field;
use crate::solve::{Scene, SolvedScene};
use nalgebra::Vector3;
use std::sync::{Arc, OnceLock};
use weavelight_calibration::description::{Cfa, Image};

/// What the project asks.
const SAME_NORMAL_DEG: f64 = 1e-3;
/// float32 keeps seven digits, sums of 64 terms lose one.
const SAME_ALBEDO: f32 = 1e-5;
const SAME_ERROR: f32 = 1e-3;

fn gpu() -> Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    let open = || match Gpu::open() {
        Ok(gpu) => Arc::new(gpu),
        Err(error) => panic!("the GPU part was not tested: {error}"),
    };
    GPU.get_or_init(open).clone()
}

fn albedo_values(maps: &Maps) -> Vec<f32> {
    match &maps.albedo {
        Albedo::Mosaic(image, _) | Albedo::Grey(image) => image.data.clone(),
        Albedo::Rgb(image) => image.data.as_flattened().to_vec(),
    }
}

fn check_same(name: &str, scene: &Scene, method: Method) {
    let name = format!("{name}, {method:?}");
    let solved = solved_on(scene, method, &Device::Opened(gpu()));
    let SolvedScene { maps: there, device, warnings } = solved.expect("a scene that can be solved");
    let (here, _) = with_warnings(scene, method).expect("a scene that can be solved");
    assert_eq!((device.kind.as_str(), warnings.len()), ("gpu", 0), "{name}: {warnings:?}");
    assert!(device.sent_mb > Some(0.0) && device.received_mb > Some(0.0), "{name}: {device:?}");
    assert_eq!(there.outcome, here.outcome, "{name}");
    assert_eq!(there.counts.outcomes, here.counts.outcomes, "{name}");
    assert_eq!(there.counts.saturated, here.counts.saturated, "{name}");
    let close = |a: f32, b: f32, tolerance: f32| (a - b).abs() <= tolerance * b.abs();
    for (at, (a, b)) in there.normal.data.iter().zip(&here.normal.data).enumerate() {
        let [a, b] = [a, b].map(|n| Vector3::from(*n).cast::<f64>());
        let off = a.cross(&b).norm().atan2(a.dot(&b)).to_degrees();
        let same = (a == b) || off <= SAME_NORMAL_DEG;
        assert!(same, "{name}, photosite {at}: normal off by {off:e} degrees");
        let [a, b] = [&there, &here].map(|maps| maps.expected_error_deg.data[at]);
        assert!(close(a, b, SAME_ERROR), "{name}, photosite {at}: expected error {a} not {b}");
    }
    for (at, (a, b)) in albedo_values(&there).into_iter().zip(albedo_values(&here)).enumerate() {
        assert!(close(a, b, SAME_ALBEDO), "{name}, value {at}: albedo {a} not {b}");
    }
}

/// Some samples in shadow, some clipped.
fn spoil(scene: &mut Scene) {
    for (light, photographed) in scene.lights.iter_mut().enumerate() {
        for exposure in &mut photographed.exposures {
            let Samples::U16(samples) = &mut exposure.frame.samples else { continue };
            for sample in samples.iter_mut().skip(light).step_by(37) {
                *sample = 600 + (*sample - 600.min(*sample)) / 6;
            }
            samples.iter_mut().skip(5 * light).step_by(101).for_each(|sample| *sample = 65_535);
        }
    }
}

#[test]
fn every_kind_of_scene_comes_out_the_same() {
    let plain = Recipe::default();
    let all = Recipe { gain_maps: true, ambient: true, bent_response: true, ..plain };
    let gbrg = Layout::Mosaic(Cfa::parse("GBRG").expect("a mosaic"));
    let recipes = [
        ("plain", plain),
        ("all", Recipe { seed: 2, ..all }),
        ("exposures", Recipe { seed: 3, exposures: 3, ..all }),
        ("colour", Recipe { seed: 4, layout: Layout::Rgb, ..all }),
        ("grey", Recipe { seed: 5, layout: Layout::Grey, ..all }),
        ("far", Recipe { seed: 6, directional: true, layout: gbrg, ..plain }),
        ("three lights", Recipe { seed: 7, lights: 3, ..plain }),
        ("64 lights", Recipe { seed: 8, lights: 64, width: 21, height: 9, ..plain }),
        ("256 lights", Recipe { seed: 12, lights: 256, width: 21, height: 9, ..plain }),
        ("wide", Recipe { seed: 9, mm_per_px: 0.08, width: 131, height: 140, ..plain }),
        ("one row", Recipe { seed: 10, height: 1, ..plain }),
        ("one pixel", Recipe { seed: 11, width: 1, height: 1, ..plain }),
    ];
    for (name, recipe) in recipes {
        let mut made = scene(recipe);
        for method in [Method::LeastSquares, Method::Weighted, Method::Auto] {
            check_same(name, &made, method);
        }
        if recipe.width > 1 {
            spoil(&mut made);
            let places = 0..made.width * made.height;
            // Rows outside altogether, and rows that begin in the middle.
            let inside = |place: usize| (place / 70) % 5 != 1 && (place * 7 + place / 90) % 11 > 1;
            let data = places.map(inside).collect();
            made.mask = Some(Image { width: made.width, height: made.height, data });
            check_same(&format!("{name}, spoilt"), &made, Method::Auto);
        }
    }
}

/// The processor takes over, from the tile under way on.
#[test]
fn a_driver_that_fails_costs_no_photosite() {
    let made = scene(Recipe { height: 300, ..Recipe::default() });
    let spoilt = Gpu::open().expect("a device");
    spoilt.spoil();
    let device = Device::Opened(Arc::new(spoilt));
    let solved = solved_on(&made, Method::Auto, &device).expect("a scene");
    let (here, _) = with_warnings(&made, Method::Auto).expect("a scene");
    assert_eq!((solved.maps.normal, solved.maps.outcome), (here.normal, here.outcome));
    let [warning] = solved.warnings.as_slice() else { panic!("{:?}", solved.warnings) };
    assert!(warning.contains("failed (spoilt by a test); the processor solved"), "{warning}");
}

#[test]
fn what_is_measured_decides() {
    let made = scene(Recipe { width: 200, height: 150, ..Recipe::default() });
    let field = light_field(&made).expect("a field");
    let run = crate::solve::bands::Run::new(&made, &field, noise(&made, &field), Method::Auto);
    let folder = tempfile::tempdir().expect("a folder");
    let memory = folder.path().join("device.json");
    let first = crate::solve::bands::faster(&run, Some(&memory));
    assert!(first.why.starts_with("measured: "), "{}", first.why);
    let second = crate::solve::bands::faster(&run, Some(&memory));
    assert!(second.why.starts_with("remembered: "), "{}", second.why);
    assert_eq!(first.gpu.is_some(), second.gpu.is_some());
    assert_eq!(first.why.split(": ").nth(1), second.why.split(": ").nth(1));
}

#[test]
fn who_solves_where_nothing_is_to_be_gained() {
    let made = scene(Recipe::default());
    let check = |device: Device, method: Method, why: &str| {
        let solved = solved_on(&made, method, &device).expect("a scene");
        assert_eq!(solved.device.kind, "cpu", "{device:?}");
        assert!(solved.device.why.contains(why), "{device:?}: {}", solved.device.why);
        solved.warnings.len()
    };
    assert_eq!(check(Device::Cpu, Method::Auto, "asked for"), 0);
    assert_eq!(check(Device::Auto { memory: None }, Method::Auto, "too small"), 0);
    assert_eq!(check(Device::Gpu, Method::Robust, "subset test"), 1);
    let text = GpuError::NoAdapter.to_string();
    assert!(text.contains("mesa-vulkan-drivers") && text.lines().count() == 1);
}
