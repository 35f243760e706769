//! Real pictures, through the whole program: import, solve, compare. They are not part of this repository; WEAVELIGHT_DATA
//! says where they are, else ../shared/data.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    clippy::print_stdout,
    reason = "a test that cannot set its scene up has failed; figures are to be seen"
)]

#[allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "test programs share it")]
#[path = "support/skip.rs"]
mod skip;
mod support;

use std::path::{Path, PathBuf};
use support::Home;
use weavelight::compare::{angle_deg, percentile};
use weavelight::raster::{Values, decode_picture, read_exr, write_exr_rgb};
use weavelight_calibration::description::Image;

/// How near to the expected figures, degrees.
const TOLERANCE_DEG: f64 = 0.1;

fn data(folder: &str) -> Option<PathBuf> {
    skip::real_pictures(env!("CARGO_MANIFEST_DIR"), folder)
}

fn expect(case: &str, found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= TOLERANCE_DEG,
        "{case}: {found:.3} deg, expected {expected:.2}"
    );
}

/// Mean and median error of plain least squares on a DiLiGenT set whose pictures `prepare` copied to `set`.
fn diligent(home: &Home, folder: &Path, import: &str) -> (f64, f64) {
    let folder = folder.display();
    home.run(&format!("{import} --mask {folder}/mask.png --out s1 --json")).json();
    home.run("solve s1 --calibration s1/calibration --out m1 --method least-squares --json").json();
    let found = home
        .run(&format!(
            "compare m1/normal.exr {folder}/normal_gt.exr --mask {folder}/mask.png --json"
        ))
        .json();
    assert!(found["pixels"].as_u64().unwrap() > 40_000, "{found}");
    (found["mean_deg"].as_f64().unwrap(), found["median_deg"].as_f64().unwrap())
}

/// Least squares in float64 on all sixteen bits, by an independent program: mean and median of the ten-light sets.
#[test]
fn diligent_sixteen_bits() {
    for (name, mean, median) in [("bear", 8.731, 5.788), ("cat", 8.761, 6.618)] {
        let Some(folder) = data(&format!("diligent/{name}")) else { return };
        let home = Home::new();
        let import = format!("import --lights {}/light_directions.txt", folder.display());
        let found = diligent(&home, &folder, &import);
        assert!(
            (found.0 - mean).abs() < 0.002 && (found.1 - median).abs() < 0.002,
            "{name}: {found:?}"
        );
    }
}

/// The figures that go with the sets were made from the upper eight bits of each sample.
#[test]
fn diligent_upper_eight_bits() {
    for (name, mean, median) in [("bear", 9.01, 6.18), ("cat", 9.28, 7.19)] {
        let Some(folder) = data(&format!("diligent/{name}")) else { return };
        let home = Home::new();
        std::fs::create_dir(home.path("set")).unwrap();
        for list in ["filenames.txt", "light_directions.txt", "light_intensities.txt"] {
            std::fs::copy(folder.join(list), home.path("set").join(list)).unwrap();
        }
        for name in
            std::fs::read_to_string(folder.join("filenames.txt")).unwrap().split_whitespace()
        {
            upper_eight_bits(&folder.join(name), &home.path("set").join(name));
        }
        let found =
            diligent(&home, &folder, "import --lights set/light_directions.txt --encoding linear");
        expect(&format!("{name}, mean"), found.0, mean);
        expect(&format!("{name}, median"), found.1, median);
    }
}

fn upper_eight_bits(from: &Path, to: &Path) {
    let picture = decode_picture(&std::fs::read(from).unwrap()).unwrap();
    let Values::U16(values) = picture.values else { panic!("{} has not 16 bits", from.display()) };
    let upper: Vec<u8> = values.iter().map(|value| (value >> 8) as u8).collect();
    let (width, height) = (picture.width as u32, picture.height as u32);
    image::save_buffer(to, &upper, width, height, image::ColorType::Rgb8).unwrap();
}

/// Within six pixels of the sphere's rim the mask is a mixture and most lights are in shadow; there figures depend on where
/// exactly the rim is drawn, so it is left out.
const RIM_PX: f64 = 6.0;

/// Imports the sphere as `s1`; its true normals, 0 outside and along the rim: those of the sphere whose disc has the mask's
/// area.
fn import_sphere(home: &Home, folder: &Path) -> Image<[f32; 3]> {
    let images: Vec<String> =
        (0..12).rev().map(|k| folder.join(format!("gray.{k}.png")).display().to_string()).collect();
    let folder = folder.display();
    let mask = format!("{folder}/gray.mask.png");
    let call = format!(
        "import --lights {folder}/lights.txt {} --encoding linear --mask {mask} --out s1 --json",
        images.join(" ")
    );
    home.run(&call).json();
    let picture = decode_picture(&std::fs::read(&mask).unwrap()).unwrap();
    let (width, height) = (picture.width, picture.height);
    let inside = whole_pixels(&mask);
    let (sphere_u, sphere_v, radius) = disc(&inside, width);
    let normal = |k: usize| {
        let (x, y) = ((k % width) as f64 - sphere_u, sphere_v - (k / width) as f64);
        if !inside[k] || x.hypot(y) > radius - RIM_PX {
            return [0.0; 3];
        }
        [x, y, (radius * radius - x * x - y * y).sqrt()].map(|c| (c / radius) as f32)
    };
    Image { width, height, data: (0..width * height).map(normal).collect() }
}

#[test]
fn gray_sphere() {
    let Some(folder) = data("gray-sphere") else { return };
    let home = Home::new();
    let truth = import_sphere(&home, &folder);
    home.run("solve s1 --calibration s1/calibration --out m1 --method least-squares --json").json();

    let exr = read_exr(&home.path("m1/normal.exr")).unwrap();
    let [nx, ny, nz] = ["R", "G", "B"].map(|name| exr.channel(name).unwrap());
    let known = (0..truth.data.len()).filter(|&k| nz[k] != 0.0 && truth.data[k] != [0.0; 3]);
    let angle =
        |k: usize| angle_deg([nx[k], ny[k], nz[k]].map(f64::from), truth.data[k].map(f64::from));
    let mut angles: Vec<f64> = known.map(angle).collect();
    assert!(angles.len() > 30_000, "{}", angles.len());
    angles.sort_by(f64::total_cmp);
    expect("mean", angles.iter().sum::<f64>() / angles.len() as f64, 5.15);
    expect("median", percentile(&angles, 0.5).unwrap(), 4.50);
}

/// One set of defaults for all: the automatic method beside least squares and what the literature has. The sphere's eight
/// bits, and a sphere that is only fitted to its outline, leave it ahead of least squares only.
#[test]
fn the_automatic_method_is_ahead_of_the_literature() {
    let Some(folder) = data("gray-sphere") else { return };
    let home = Home::new();
    let truth = import_sphere(&home, &folder);
    write_exr_rgb(&home.path("sphere.exr"), &truth).unwrap();
    let mut sets = "--set gray-sphere=s1,s1/calibration,sphere.exr".to_owned();
    for name in ["bear", "cat"] {
        let Some(folder) = data(&format!("diligent/{name}")) else { return };
        let folder = folder.display();
        home.run(&format!(
            "import --lights {folder}/light_directions.txt --mask {folder}/mask.png --out {name} --json"
        ))
        .json();
        sets.push_str(&format!(" --set {name}={name},{name}/calibration,{folder}/normal_gt.exr"));
    }
    let said = home.run(&format!("bench --quick --no-fabrics --out b --json {sets}")).json();
    for set in said["sets"].as_array().unwrap() {
        let mean = |name: &str| {
            let methods = set["methods"].as_array().unwrap();
            let method = methods.iter().find(|method| method["name"] == name).unwrap();
            method["mean_deg"].as_f64().unwrap()
        };
        let literature = ["l1", "cauchy", "shadow-test-cauchy", "sparse-bayesian"];
        let others = if set["name"] == "gray-sphere" { &[] } else { &literature[..] };
        for other in others.iter().chain(&["least-squares"]) {
            let [auto, other_deg] = [mean("auto"), mean(other)];
            assert!(auto < other_deg, "{}: auto {auto}, {other} {other_deg}", set["name"]);
        }
    }
}

/// Pixels that are wholly inside an antialiased mask.
fn whole_pixels(mask: &str) -> Vec<bool> {
    let picture = decode_picture(&std::fs::read(mask).unwrap()).unwrap();
    let Values::U8(values) = &picture.values else { panic!("{mask} has not 8 bits") };
    values
        .chunks_exact(picture.channels)
        .map(|pixel| pixel.iter().all(|value| *value == 255))
        .collect()
}

/// Centre and radius of the disc with the mask's area.
fn disc(inside: &[bool], width: usize) -> (f64, f64, f64) {
    let places: Vec<(f64, f64)> = (0..inside.len())
        .filter(|k| inside[*k])
        .map(|k| ((k % width) as f64, (k / width) as f64))
        .collect();
    let count = places.len() as f64;
    let sum = places.iter().fold((0.0, 0.0), |sum, place| (sum.0 + place.0, sum.1 + place.1));
    (sum.0 / count, sum.1 / count, (count / std::f64::consts::PI).sqrt())
}
