//! `weavelight bench`, as a user runs it.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]

mod support;

use serde_json::Value;
use support::{HEIGHT, Home, WIDTH};
use weavelight::raster::write_exr_rgb;
use weavelight_calibration::description::Image;

const METHODS: [&str; 11] = [
    "svd-x4",
    "normal-equations",
    "least-squares",
    "weighted",
    "auto",
    "robust",
    "gpu",
    "l1",
    "cauchy",
    "shadow-test-cauchy",
    "sparse-bayesian",
];

/// A graphics processor takes part where the program has that part; `make test` sees to it that there is one in software.
fn methods() -> impl Iterator<Item = &'static str> {
    METHODS.into_iter().filter(|name| *name != "gpu" || cfg!(feature = "gpu"))
}

fn figure(set: &Value, method: &str, key: &str) -> f64 {
    let methods = set["methods"].as_array().unwrap();
    let method = methods.iter().find(|m| m["name"] == method).unwrap();
    method[key].as_f64().unwrap_or_else(|| panic!("{key}: {method}"))
}

fn check_set(set: &Value) {
    let names: Vec<&str> =
        set["methods"].as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
    assert_eq!(names, methods().collect::<Vec<_>>(), "{}", set["name"]);
    assert!(set["touch"]["milliseconds"].as_f64().unwrap() > 0.0);
    assert!(set["compared"].as_u64().unwrap() > 100);
    for method in methods() {
        assert!(figure(set, method, "times_touch") > 0.0, "{method}");
        assert!((0.0..90.0).contains(&figure(set, method, "mean_deg")), "{method}");
        assert!(figure(set, method, "unsolved_share") < 0.05, "{method}");
    }
    if cfg!(feature = "gpu") {
        for (key, off) in [("mean_deg", 1e-4), ("robust_share", 1e-4)] {
            assert!(
                (figure(set, "gpu", key) - figure(set, "auto", key)).abs() <= off,
                "{key}: {set}"
            );
        }
    }
    // Three ways to the same minimum.
    for (key, off) in [("mean_deg", 2e-3), ("p95_deg", 1e-2)] {
        let plain = figure(set, "least-squares", key);
        for method in ["svd-x4", "normal-equations"] {
            let found = figure(set, method, key);
            assert!((found - plain).abs() < off, "{}: {method} {found}, {plain}", set["name"]);
        }
    }
    let on_front = |m: &&Value| m["on_front"] == true;
    let front: Vec<&Value> = set["methods"].as_array().unwrap().iter().filter(on_front).collect();
    let best = methods().map(|m| figure(set, m, "mean_deg")).fold(f64::INFINITY, f64::min);
    assert!(front.iter().any(|m| m["mean_deg"].as_f64() == Some(best)), "{set}");
}

/// The simulated fabrics, small; and the output folder, which another run replaces.
#[test]
fn fabrics_are_measured_and_drawn() {
    let home = Home::new();
    for call in ["bench --quick --curves --out b --json", "bench --quick --out b --json"] {
        let said = home.run(call).json();
        let sets = said["sets"].as_array().unwrap();
        let names: Vec<&str> = sets.iter().map(|set| set["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["smooth", "linen", "satin"]);
        sets.iter().for_each(check_set);
        for shadowed in &sets[1..] {
            let [auto, plain] =
                ["auto", "least-squares"].map(|method| figure(shadowed, method, "mean_deg"));
            assert!(auto < plain, "{}: {auto}, {plain}", shadowed["name"]);
        }
        // Nothing to drop: next to nothing is dropped.
        assert!(figure(&sets[0], "auto", "robust_share") < 0.005);
        let written: Value = serde_json::from_str(&home.read("b/bench.json")).unwrap();
        assert_eq!(written, said);
        let picture = home.read("b/bench.svg");
        assert!(methods().all(|name| picture.contains(&format!(">{name}</text>"))));
        assert_eq!(picture.contains("over lights"), call.contains("curves"));
        let curves = said["curves"].as_array().map_or(0, Vec::len);
        assert_eq!(curves, if call.contains("curves") { 8 } else { 0 });
    }
}

/// The true normals of the small capture session's frames.
fn write_truth(home: &Home, width: u32, value: impl Fn(u32, u32) -> [f64; 3]) {
    let places = (0..HEIGHT).flat_map(|y| (0..width).map(move |x| (x, y)));
    let data = places.map(|(x, y)| value(x, y).map(|c| c as f32)).collect();
    let image = Image { width: width as usize, height: HEIGHT as usize, data };
    write_exr_rgb(&home.path("truth.exr"), &image).unwrap();
}

fn normal(x: u32, y: u32) -> [f64; 3] {
    let [a, b] = [-0.2 * f64::from(x).sin(), -0.2 * f64::from(y).cos()];
    [a, b, 1.0].map(|c| c / (a * a + b * b + 1.0).sqrt())
}

const CALL: &str = "bench --no-fabrics --quick --set small=s,c,truth.exr --out b";

#[test]
fn a_set_from_outside_is_measured() {
    let home = Home::new();
    write_truth(&home, WIDTH, normal);
    let said = home.run(&format!("{CALL} --json")).json();
    let set = &said["sets"][0];
    check_set(set);
    assert_eq!(set["name"], "small");
    assert_eq!(set["compared"], u64::from(WIDTH * HEIGHT));
    for method in methods() {
        let found = figure(set, method, "mean_deg");
        assert!(found < 0.01, "{method}: {found} degrees on exact frames");
    }
    let table = home.run(CALL);
    assert_eq!(table.status, Some(0), "{}", table.stderr);
    let starts = |line: &str| methods().any(|m| line[2..].starts_with(&format!("{m} ")));
    let lines = table.stdout.lines().filter(|line| line.len() > 2 && starts(line));
    assert_eq!(lines.count(), methods().count(), "{}", table.stdout);
}

#[test]
fn calls_and_truths_that_make_no_sense_are_refused() {
    let home = Home::new();
    home.run("bench --no-fabrics").expect_failure("nothing", 2, &["--no-fabrics"]);
    write_truth(&home, WIDTH + 1, normal);
    home.run(CALL).expect_failure("size", 1, &["truth.exr", "25 x 18", "24 x 18"]);
    write_truth(&home, WIDTH, |_, _| [0.0; 3]);
    home.run(CALL).expect_failure("empty", 1, &["small"]);
    home.run("bench --no-fabrics --set a=s,c,nowhere.exr --out b").expect_failure(
        "no truth",
        1,
        &["nowhere.exr"],
    );
    assert_eq!(home.names(), ["c", "s", "truth.exr"]);
}

/// One row a cloth, as a Markdown table and in JSON.
#[test]
fn colours_are_measured_and_tabled() {
    let home = Home::new();
    let said = home
        .run(
            "bench --colors --out b --sizes 616x408 --middle 160x144 --psf-px 0,0.7 --seeds 2 --cloths facets;velvet --json",
        )
        .json();
    let rows = said["colors"].as_array().unwrap();
    let names: Vec<&str> = rows.iter().map(|row| row["cloth"].as_str().unwrap()).collect();
    assert_eq!(names, ["facets", "facets", "velvet", "velvet"]);
    for row in rows {
        assert!(row["figures"]["mean_de2000"].as_f64().unwrap() < 3.0, "{row}");
        assert_eq!(row["demosaicers"].as_array().unwrap().len(), 3, "{row}");
    }
    let table = home.read("b/colors.md");
    assert_eq!(table.lines().count(), 6, "{table}");
}
