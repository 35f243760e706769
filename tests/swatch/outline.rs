//! The table around a swatch: found without losing cloth, and kept wherever it cannot be told.

use crate::photograph::{Field, Scan};
use crate::thorough;
use weavelight::linear::Exposure;
use weavelight::raster::read_exr;
use weavelight::raw::Samples;
use weavelight::simulate::Material;
use weavelight::solve::Scene;
use weavelight::swatch::Swatch;
use weavelight_calibration::description::Image;
use weavelight_sim::cloth::{Preset, Structure};

const SIZE: [usize; 2] = [384, 256];
/// Black level of the simulated sensor.
const BLACK: f64 = 600.0;

fn material(preset: Preset) -> Material {
    Material { preset, ..Material::default() }
}

fn find(scene: &Scene) -> Swatch {
    scene.find_swatch(&|_| {}).unwrap()
}

/// Share of the frame that is table, and share of it that the mask keeps, after seeing that no photosite of cloth is lost.
fn check_nothing_lost(what: &str, found: &Swatch, cloth: &Image<bool>) -> [f64; 2] {
    let lost = cloth.data.iter().zip(&found.mask.data).filter(|(cloth, kept)| **cloth && !**kept);
    assert_eq!(lost.count(), 0, "{what}: cloth is lost; {}", found.said);
    let table = cloth.data.iter().filter(|cloth| !**cloth).count() as f64 / cloth.data.len() as f64;
    println!("{what}: table {table:.2}, left out {:.2}; {}", found.table_share, found.said);
    [table, found.table_share]
}

/// Where the simulator says that cloth is: the table is grey, 0.04, and nothing else is.
fn truth(scan: &Scan, scene: &Scene) -> Image<bool> {
    let albedo = read_exr(&scan.path("truth/albedo.exr")).unwrap();
    let channels = ["R", "G", "B"].map(|name| albedo.channel(name).unwrap());
    let data = (0..scene.width * scene.height)
        .map(|at| channels.iter().any(|channel| (channel[at] - 0.04).abs() > 1e-5));
    Image { width: scene.width, height: scene.height, data: data.collect() }
}

#[test]
fn a_swatch_on_the_dark_table_is_found_on_every_cloth() {
    for preset in Preset::ALL {
        let material =
            Material { extent_mm: Some([18.0, 12.0]), thickness_mm: 0.6, ..material(preset) };
        let scan = Scan::new(Field::Close, SIZE, material, |_| {});
        let (scene, _) = scan.load();
        let [table, left_out] =
            check_nothing_lost(preset.name(), &find(&scene), &truth(&scan, &scene));
        assert!(left_out > 0.5 * table, "{}: only {left_out} of {table}", preset.name());
    }
}

#[test]
fn a_swatch_that_fills_the_frame_is_kept_whole() {
    for (turn, preset) in Preset::ALL.into_iter().enumerate() {
        // Printed and wrinkled where yarns can be seen, plain where they cannot.
        let looks = [(Field::Close, false), (Field::Close, true), (Field::Whole, true)];
        let looks = looks.into_iter().enumerate();
        for (_, (field, print)) in looks.filter(|(k, _)| thorough::runs(*k, 3, turn)) {
            let wrinkles_mm = if print { 1.0 } else { 0.0 };
            let material = Material { print, wrinkles_mm, ..material(preset) };
            let (scene, _) = Scan::new(field, [208, 144], material, |_| {}).load();
            let found = find(&scene);
            let what = format!("{} {field:?} print {print}: {}", preset.name(), found.said);
            assert_eq!(found.table_share, 0.0, "{what}");
            assert!(!found.mask.data.contains(&false));
            println!("{what}");
        }
    }
}

/// Cloth of one scan on the table of another, photosite by photosite; albedos of the table times `factor`.
fn compose(
    cloth: &Scene,
    table: &Scene,
    factor: f64,
    is_cloth: &dyn Fn(usize, usize) -> bool,
) -> (Scene, Image<bool>) {
    let mut scene = cloth.clone();
    let (width, height) = (scene.width, scene.height);
    for (light, other) in scene.lights.iter_mut().zip(&table.lights) {
        let (own, other) = (&mut light.exposures[0], &other.exposures[0]);
        let scale = factor * own.exposure_s / other.exposure_s;
        let others = integers(other).to_vec();
        let Samples::U16(samples) = &mut own.frame.samples else { panic!("made of integers") };
        for (at, (sample, other)) in samples.iter_mut().zip(others).enumerate() {
            if !is_cloth(at % width, at / width) {
                *sample =
                    ((f64::from(other) - BLACK) * scale + BLACK).round().clamp(0.0, 16383.0) as u16;
            }
        }
    }
    let data = (0..width * height).map(|at| is_cloth(at % width, at / width)).collect();
    (scene, Image { width, height, data })
}

/// Share of the samples that are clipped.
fn clipped_share(scene: &Scene) -> f64 {
    let samples = scene.lights.iter().flat_map(|light| integers(&light.exposures[0]));
    let all = (scene.width * scene.height * scene.lights.len()) as f64;
    samples.filter(|&&sample| sample == 16383).count() as f64 / all
}

fn integers(exposure: &Exposure) -> &[u16] {
    let Samples::U16(samples) = &exposure.frame.samples else { panic!("made of integers") };
    samples
}

/// A smooth table of albedo 0.5, or of tables that differ, as a scene.
fn smooth_table() -> Scene {
    let flat = Material { structure: Some(Structure::Flat), ..material(Preset::Facets) };
    Scan::new(Field::Close, SIZE, flat, |options| options.seed = 5).load().0
}

type Shape = (&'static str, fn(f64, f64) -> bool);

/// Shapes over the frame, u and v from -1 to 1.
const SHAPES: [Shape; 5] = [
    ("at an angle", |u, v| (0.8 * u + 0.5 * v).abs() < 0.6 && (0.8 * v - 0.5 * u).abs() < 0.5),
    ("round", |u, v| u.hypot(v) < 0.7),
    ("two swatches", |u, v| ((u.abs() - 0.45).abs() < 0.3) && v.abs() < 0.6),
    ("over the right side", |u, v| u > 0.0 && v.abs() < 0.7),
    ("lace", |u, v| u.abs() < 0.7 && v.abs() < 0.7 && (u * 8.0).sin() * (v * 6.0).cos() > -0.6),
];

#[test]
fn swatches_of_any_shape_are_found_on_any_smooth_table() {
    let table = smooth_table();
    for (turn, preset) in Preset::ALL.into_iter().enumerate() {
        let (cloth, _) = Scan::new(Field::Close, SIZE, material(preset), |_| {}).load();
        for (at, (name, shape)) in SHAPES.into_iter().enumerate() {
            let tables = [0.03, 0.5, 1.6].into_iter().enumerate();
            for (_, factor) in tables.filter(|(k, _)| thorough::runs(*k, 3, turn + at)) {
                let [width, height] = SIZE.map(|size| size as f64);
                let is_cloth = |x: usize, y: usize| {
                    shape(2.0 * x as f64 / width - 1.0, 2.0 * y as f64 / height - 1.0)
                };
                let (scene, cloth) = compose(&cloth, &table, factor, &is_cloth);
                let what = format!("{} {name}, table {:.2}", preset.name(), 0.5 * factor);
                let clipped = clipped_share(&scene);
                let [table, left_out] = check_nothing_lost(&what, &find(&scene), &cloth);
                // Where a light clips on the table in many frames, the table has no normals to be known by.
                assert!(left_out > 0.5 * table || clipped > 0.1, "{what}: {left_out} of {table}");
            }
        }
    }
}
