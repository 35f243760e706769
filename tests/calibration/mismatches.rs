//! A calibration and pictures that do not belong together: `solve` says so.

use super::bench::{Bench, edit};
use std::path::Path;
use weavelight::simulate::{Options, Part};
use weavelight::solve;
use weavelight_sim::cloth::Preset;

fn swatch(change: impl Fn(&mut Options)) -> Bench {
    let bench = Bench::new(&[Part::Swatch], |o| {
        o.size_px = Some([308, 204]);
        o.material.preset = Preset::Facets;
        change(o);
    });
    bench.know_all();
    bench
}

/// The warnings of a solve must hold all these words in one sentence; without any, there must be none.
fn check(spoil: impl Fn(&Bench), words: &[&str]) {
    let bench = swatch(|_| ());
    spoil(&bench);
    let warnings = bench.solve("swatch", &bench.found(), "out").warnings;
    let told = warnings.iter().any(|w| words.iter().all(|word| w.contains(word)));
    assert!(if words.is_empty() { warnings.is_empty() } else { told }, "{words:?}: {warnings:?}");
}

#[test]
fn another_camera_lens_or_zoom_is_told() {
    let camera_toml = |from: &'static str, to: &'static str| {
        move |bench: &Bench| {
            edit(bench.found().join("camera.toml"), |text| {
                assert!(text.contains(from), "no {from} in {text}");
                text.replace(from, to)
            });
        }
    };
    check(|_| (), &[]);
    let camera = camera_toml("\"Weavelight Simulator\"", "\"Nikon D5100\"");
    check(camera, &["light-00.dng", "Weavelight Simulator", "calibrated was \"Nikon D5100\""]);
    let lens = camera_toml("\"Simulated 35 mm\"", "\"Micro 40mm\"");
    check(lens, &["lens is \"Simulated 35 mm\"", "calibrated was \"Micro 40mm\"", "calibrate"]);
    let zoom = camera_toml("focal_length_mm = 35.0", "focal_length_mm = 40.0");
    check(zoom, &["35 mm", "calibrated was 40 mm"]);
}

#[test]
fn another_lens_at_the_bench_is_told() {
    let with_lens = |focal_length: &str| {
        let plain = swatch(|_| ());
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("rig.toml");
        std::fs::copy(plain.rig("rig.toml"), &path).unwrap();
        edit(&path, |text| {
            assert!(text.contains("focal_length_mm = 35.0"), "{text}");
            text.replace("35.0", focal_length)
        });
        Bench::new(&[Part::Grey, Part::Swatch], |o| {
            o.rig = Some(path.clone());
            o.size_px = None;
            o.material.preset = Preset::Facets;
        })
    };
    let [before, now] = ["35.0", "50.0"].map(with_lens);
    let told = |warnings: &[String]| {
        let zoom = |w: &String| w.contains("stands at 50 mm, calibrated was 35 mm");
        assert!(warnings.iter().any(zoom), "{warnings:?}");
    };
    told(&now.solve("swatch", &before.truth(), "out").warnings);
    // Every step of the calibration compares too.
    now.know_all();
    std::fs::copy(before.truth().join("camera.toml"), now.found().join("camera.toml")).unwrap();
    told(&now.color().unwrap().warnings);
}

#[test]
fn lights_from_before_the_camera_are_told() {
    let bench = Bench::new(&[Part::WhiteFlat, Part::Swatch], |o| {
        o.material.preset = Preset::Facets;
    });
    bench.know(&["camera.toml", "color.toml"]);
    bench.lights(&["white-flat"]).unwrap();
    let warned = || {
        let report = bench.solve("swatch", &bench.found(), "out");
        report.warnings.iter().any(|w| w.contains("camera.toml") && w.contains("calibrate lights"))
    };
    assert!(!warned());
    edit(bench.found().join("camera.toml"), |text| format!("{text}\n# measured again\n"));
    assert!(warned());
    let status = weavelight::calibrate::status(&bench.found()).unwrap();
    assert!(status.next.contains("calibrate lights"), "{}", status.next);
}

fn solve_fails(bench: &Bench, calibration: &Path, words: &[&str]) {
    let options = solve::Options::new(bench.rig("swatch"), calibration, bench.beside("out"));
    let message = solve::run(&options, &|_| {}, None).unwrap_err().to_string();
    assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
    assert!(!bench.beside("out").exists());
}

#[test]
fn another_size_or_too_few_calibrated_lights_are_refused() {
    let bench = swatch(|_| ());
    let other = swatch(|o| o.size_px = Some([330, 218]));
    solve_fails(&bench, &other.found(), &["308 x 204", "330 x 218"]);
    edit(bench.found().join("lights.toml"), |text| {
        let last = text.rfind("[[lights]]").unwrap();
        text[..last].to_owned()
    });
    solve_fails(&bench, &bench.found(), &["light 9"]);
}
