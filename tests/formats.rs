//! The examples of docs/formats.md are read by the program.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use weavelight::instrument::{Calibration, Rig, RigLightPlace};
use weavelight::session::{Kind, Session, Target};
use weavelight::simulate::Scene;
use weavelight::solution::Report;

/// The fenced blocks that name a file, by name.
fn examples() -> BTreeMap<String, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/formats.md");
    let text = fs::read_to_string(path).unwrap();
    let mut found = BTreeMap::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some(language) = line.strip_prefix("```").filter(|rest| !rest.is_empty()) else {
            continue;
        };
        let body: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with("```")).collect();
        let (_, name) = language.split_once(' ').expect("every block names its file");
        assert!(found.insert(name.to_owned(), body.join("\n")).is_none(), "{name} twice");
    }
    found
}

/// All of them in a folder.
fn written() -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    for (name, text) in examples() {
        let path = home.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    home
}

#[test]
fn a_rig() {
    let home = written();
    let rig = Rig::load(&home.path().join("rig.toml")).unwrap();
    assert_eq!(rig.lights.len(), 3);
    assert_eq!(rig.channel(2), 2);
    assert!(matches!(rig.lights[2].place, RigLightPlace::Directional { .. }));
}

#[test]
fn a_scene() {
    let home = written();
    let scene = Scene::beside(&home.path().join("rig.toml")).unwrap();
    assert_eq!((scene.places.len(), scene.flaws.psf_px, scene.material.wear), (3, 0.7, Some(0.2)));
}

#[test]
fn capture_sessions() {
    let home = written();
    let load = |name: &str| Session::load(&home.path().join(name)).unwrap();
    let swatch = load("swatch");
    assert_eq!(
        (swatch.kind, swatch.name.as_str(), swatch.frames.len()),
        (Kind::Swatch, "linen 4021", 4)
    );
    assert_eq!(swatch.plane.as_ref().map(|plane| plane.point_mm.z), Some(0.8));
    let patches = |target: Option<Target>| target.unwrap().patches.len();
    assert_eq!(patches(load("grey").target), 2);
    assert!(load("board").target.unwrap().board.is_some());
    assert_eq!(load("white").plane.unwrap().normal.z, 1.0);
    assert!(Target::load(&home.path().join("white/session.toml")).unwrap().board.is_some());
}

#[test]
fn a_calibration() {
    let home = written();
    let found = Calibration::load(&home.path().join("calibration")).unwrap();
    assert_eq!(found.lights.len(), 3);
    assert!(found.camera.is_some());
    assert!(found.color.camera_to_linear_srgb.is_some());
}

#[test]
fn a_report() {
    let home = written();
    let report = Report::read(&home.path().join("solution/report.json")).unwrap();
    assert_eq!((report.size_px, report.lights_used.len()), ([4928, 3264], 3));
}
