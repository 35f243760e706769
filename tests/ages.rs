//! Files of earlier versions are read for ever: one folder of each age in `tests/ages`.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use support::Home;
use weavelight::instrument::{Calibration, Rig};
use weavelight::session::Session;
use weavelight::simulate::Scene;
use weavelight::solution::Solution;

fn age(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ages").join(name)
}

/// A folder of that age as `old` in a place where commands may write.
fn home_with(name: &str) -> Home {
    fn copy(from: &Path, to: &Path) {
        fs::create_dir(to).unwrap();
        for entry in fs::read_dir(from).unwrap().map(|entry| entry.unwrap()) {
            let (from, to) = (entry.path(), to.join(entry.file_name()));
            if from.is_dir() {
                copy(&from, &to);
            } else {
                fs::copy(from, to).unwrap();
            }
        }
    }
    let home = Home::new();
    copy(&age(name), &home.path("old"));
    home
}

#[test]
fn every_solution_opens_as_what_it_is() {
    for (name, method) in [("first", ""), ("2026-11", "auto")] {
        let solution = Solution::load(&age(name).join("maps")).unwrap();
        assert_eq!(solution.report.method, method, "{name}");
        assert_eq!(solution.report.albedo, None, "{name}: an albedo as it appears");
        assert_eq!((solution.report.solved, solution.report.scale), (384, 1), "{name}");
        let home = home_with(name);
        let again =
            "compare old/maps/normal.exr old/maps/normal.exr --mask old/maps/mask.png --json";
        let figures = home.run(again).json();
        assert_eq!(figures["pixels"], 384, "{name}");
        assert_eq!(figures["max_deg"].as_f64().unwrap(), 0.0, "{name}");
    }
}

#[test]
fn a_rig_a_calibration_and_a_capture_session_are_read_whole() {
    let folder = age("2026-11");
    let rig = Rig::load(&folder.join("rig.toml")).unwrap();
    assert_eq!((rig.lights.len(), rig.camera.width_px), (10, 24));
    Scene::beside(&folder.join("rig.toml")).unwrap();
    let calibration = Calibration::load(&folder.join("calibration")).unwrap();
    assert_eq!(calibration.lights.len(), 10);
    assert!(calibration.camera.is_some());
    let session = Session::load(&folder.join("swatch")).unwrap();
    assert_eq!(session.frames.len(), 12);
    for frame in &session.frames {
        session.read_frame(frame).unwrap();
    }
}

#[test]
fn an_old_scan_is_solved_and_an_old_rig_scans() {
    let home = home_with("2026-11");
    home.run("solve old/swatch --calibration old/calibration --out new --json").json();
    // A solution of an earlier revision is made again.
    let said = home.run("solve old/swatch --calibration old/calibration --out old/maps --force");
    assert_eq!(said.status, Some(1), "without a list of files nothing proves whose they are");
    let figures = home.run("compare old/maps/normal.exr new/normal.exr --json").json();
    // Gain maps were left out of the stored calibration.
    assert!(figures["mean_deg"].as_f64().unwrap() < 12.0, "{figures}");
    home.run("scan --rig old/rig.toml --out scan --json").json();
    assert_eq!(Session::load(&home.path("scan")).unwrap().frames.len(), 12);
}
