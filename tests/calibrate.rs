//! Calibration from pictures of simulated targets, with effects that the fit does not know, and what it refuses.

#![cfg(feature = "opencv")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed and says so"
)]

use std::path::{Path, PathBuf};
use weavelight::calibrate::{
    self, CalibrateError, CameraOptions, CheckOptions, ColorOptions, LightsOptions, LightsReport,
};
use weavelight::instrument::Calibration;
use weavelight::simulate::{self, Flaws, Options, Part, Targets};
use weavelight_calibration::description::Light;

/// Small enough for two cores, large enough for the strip's corners.
const SIZE: [usize; 2] = [616, 408];

fn quiet(_: f64, _: &str) {}

/// A simulated rig whose rulers are 10 mm off per axis, vignetting 20 %, an uneven sheet.
fn rig(out: &Path, only: &[Part], change: impl Fn(&mut Options)) {
    let mut options = Options {
        out: out.to_owned(),
        size_px: Some(SIZE),
        seed: 3,
        only: only.to_vec(),
        flaws: Flaws { ruler_error_mm: 10.0, vignetting: 0.2, ..Flaws::default() },
        targets: Targets { unevenness: 0.02, ..Targets::default() },
        ..Options::default()
    };
    change(&mut options);
    simulate::run(&options, &quiet).unwrap();
}

fn lights(rig: &Path, sheets: &[&str], out: &Path) -> Result<LightsReport, CalibrateError> {
    let sessions = sheets.iter().map(|name| rig.join(name)).collect();
    calibrate::lights(
        &LightsOptions { rig: rig.join("rig.toml"), sessions, out: out.to_owned() },
        &quiet,
    )
}

/// A calibration folder with the true camera only.
fn with_true_camera(rig: &Path, out: &Path) {
    std::fs::create_dir_all(out).unwrap();
    std::fs::copy(rig.join("calibration/camera.toml"), out.join("camera.toml")).unwrap();
}

fn position_rms_mm(found: &Path, truth: &Path) -> f64 {
    let positions = |folder: &Path| -> Vec<_> {
        let lights = Calibration::load(folder).unwrap().lights;
        let near = |light: &Light| match light {
            Light::Point(light) => light.position_mm,
            Light::Directional(_) => panic!("a far light"),
        };
        lights.iter().map(|light| near(&light.light)).collect()
    };
    let (found, truth) = (positions(found), positions(truth));
    let square: f64 = found.iter().zip(&truth).map(|(a, b)| (a - b).norm_squared()).sum();
    (square / found.len() as f64).sqrt()
}

#[test]
fn the_whole_instrument_is_measured_from_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let (rig_folder, out) = (folder.path().join("rig"), folder.path().join("calibration"));
    let parts = [Part::Board, Part::Grey, Part::WhiteFlat, Part::WhiteRaised, Part::WhiteTilt];
    rig(&rig_folder, &parts, |_| ());
    let at = |name: &str| rig_folder.join(name);

    let options =
        CameraOptions { rig: at("rig.toml"), sessions: vec![at("board")], out: out.clone() };
    let camera = calibrate::camera(&options, &quiet).unwrap();
    assert!(camera.rms_reprojection_px <= 0.06, "{}", camera.rms_reprojection_px);
    let truth = Calibration::load(&at("calibration")).unwrap().camera.unwrap();
    assert!((camera.intrinsics_px[0] / truth.fx - 1.0).abs() < 1e-3, "{}", camera.intrinsics_px[0]);

    let options = ColorOptions { rig: at("rig.toml"), session: at("grey"), out: out.clone() };
    let color = calibrate::color(&options, &quiet).unwrap();
    assert!(
        color.black_level.iter().all(|black| (black - 600.0).abs() < 1.0),
        "{:?}",
        color.black_level
    );
    assert_eq!(color.response, [0.0, 1.0]);
    let worst = color.patches_de2000.iter().map(|[_, after]| *after).fold(0.0, f64::max);
    assert!(color.patches_de2000.len() == 24 && worst <= 1.0, "{worst}");

    let tilts = ["white-flat", "white-raised", "white-tilt-1", "white-tilt-2", "white-tilt-3"];
    let found = lights(&rig_folder, &tilts, &out).unwrap();
    assert!(found.lights.iter().all(|light| light.position_claimed));
    assert!(found.iterations <= 15);
    let error = position_rms_mm(&out, &at("calibration"));
    assert!(error < 1.0, "{error} mm");

    // The fourth tilt was not seen by the fit.
    let options = CheckOptions {
        calibration: out.clone(),
        sessions: vec![at("white-flat"), at("white-tilt-4")],
        threshold_deg: 0.1,
        out: Some(folder.path().join("maps")),
    };
    let check = calibrate::check(&options, &quiet).unwrap();
    assert!(check.passed, "{check:?}");
    assert!(
        check
            .sheets
            .iter()
            .all(|sheet| sheet.residual_map.as_ref().is_some_and(|map| map.exists()))
    );

    let status = calibrate::status(&out).unwrap();
    assert!(status.next.contains("check"), "{}", status.next);
}

/// What a flawed set of sheets is refused with; the old calibration must stand.
fn check_refused(
    sheets: &[&str],
    change: impl Fn(&mut Options),
    spoil: impl Fn(&Path),
    words: &[&str],
) {
    let folder = tempfile::tempdir().unwrap();
    let (rig_folder, out) = (folder.path().join("rig"), folder.path().join("calibration"));
    rig(&rig_folder, &[Part::WhiteFlat], change);
    spoil(&rig_folder);
    with_true_camera(&rig_folder, &out);
    std::fs::copy(rig_folder.join("calibration/lights.toml"), out.join("lights.toml")).unwrap();
    for map in std::fs::read_dir(rig_folder.join("calibration")).unwrap().flatten() {
        if map.path().extension().is_some_and(|e| e == "exr") {
            std::fs::copy(map.path(), out.join(map.file_name())).unwrap();
        }
    }
    let before = std::fs::read(out.join("lights.toml")).unwrap();
    let message = lights(&rig_folder, sheets, &out).unwrap_err().to_string();
    for word in words {
        assert!(message.contains(word), "no {word:?} in {message:?}");
    }
    assert!(message.lines().count() <= 2, "{message}");
    assert_eq!(
        std::fs::read(out.join("lights.toml")).unwrap(),
        before,
        "the old calibration was touched"
    );
}

fn edit(path: impl AsRef<Path>, change: impl Fn(&str) -> String) {
    let text = std::fs::read_to_string(path.as_ref()).unwrap();
    std::fs::write(path, change(&text)).unwrap();
}

#[test]
fn flawed_sheets_are_refused_and_named() {
    let fine = |_: &mut Options| ();
    let as_is = |_: &Path| ();
    check_refused(
        &["white-flat"],
        |o| o.flaws.swapped = Some([2, 7]),
        as_is,
        &["light 2", "light 7", "wires"],
    );
    check_refused(&["white-flat"], |o| o.flaws.dead = Some(5), as_is, &["light 5", "dark"]);
    check_refused(
        &["white-flat"],
        |o| o.flaws.exposure_factor = 4.0,
        as_is,
        &["overexposes", "exposure"],
    );
    check_refused(&["white-flat", "white-flat"], fine, as_is, &["same pose", "tilted"]);
    let nine = |rig: &Path| {
        edit(rig.join("white-flat/session.toml"), |text| {
            text.replace("light = 9\n", "light = 8\n")
        });
    };
    check_refused(&["white-flat"], fine, nine, &["light [9]", "photograph"]);
    let wrong_strip = |rig: &Path| {
        edit(rig.join("white-flat/session.toml"), |text| text.replace("columns = ", "columns = 1"));
    };
    check_refused(&["white-flat"], fine, wrong_strip, &["strip", "not found"]);
}

#[test]
fn boards_that_say_nothing_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let rig_folder = folder.path().join("rig");
    rig(&rig_folder, &[Part::Board], |o| o.targets.boards = 5);
    let camera = || {
        let options = CameraOptions {
            rig: rig_folder.join("rig.toml"),
            sessions: vec![rig_folder.join("board")],
            out: folder.path().join("calibration"),
        };
        calibrate::camera(&options, &quiet).unwrap_err().to_string()
    };
    let manifest = rig_folder.join("board/session.toml");
    let good = std::fs::read_to_string(&manifest).unwrap();
    edit(&manifest, |text| {
        text.replace("columns = 9", "columns = 8").replace("rows = 6", "rows = 7")
    });
    let message = camera();
    assert!(message.contains("8 x 7") && message.contains("correct"), "{message}");
    // One and the same picture, over and over: one angle.
    let first = good.find("[[frames]]").unwrap();
    let second = first + 3 + good[first + 3..].find("[[frames]]").unwrap();
    let mut manifest_text = good[..second].to_owned();
    for k in 0..4 {
        let copy = format!("again-{k}.dng");
        std::fs::copy(rig_folder.join("board/board-00.dng"), rig_folder.join("board").join(&copy))
            .unwrap();
        let frame = good[first..second].replace("pose = \"table\"\n", "");
        manifest_text += &frame.replace("board-00.dng", &copy);
    }
    std::fs::write(&manifest, manifest_text).unwrap();
    let message = camera();
    assert!(message.contains("one angle") || message.contains("cannot be fitted"), "{message}");
    assert!(!folder.path().join("calibration/camera.toml").exists());
}

/// The real pictures: `WEAVELIGHT_DATA`, else `../shared/data`.
fn real_pictures() -> Option<PathBuf> {
    let folder = std::env::var_os("WEAVELIGHT_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let chess = folder.join("chess-left");
    if chess.is_dir() {
        return Some(chess);
    }
    println!("not run: {} is not there", chess.display());
    None
}

#[test]
fn real_boards_fit_to_a_quarter_of_a_pixel() {
    let Some(pictures) = real_pictures() else { return };
    let folder = tempfile::tempdir().unwrap();
    let board = folder.path().join("board");
    std::fs::create_dir(&board).unwrap();
    let mut names: Vec<String> = std::fs::read_dir(&pictures)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".jpg"))
        .collect();
    names.sort();
    let mut manifest = "schema = 1\nkind = \"board\"\nname = \"chess\"\n[target]\n\
        board = { columns = 9, rows = 6, square_mm = 25.0 }\n"
        .to_owned();
    for name in &names {
        std::fs::copy(pictures.join(name), board.join(name)).unwrap();
        manifest += &format!(
            "[[frames]]\nfile = \"{name}\"\nexposure_s = 1.0\niso = 100\nencoding = \"srgb\"\n"
        );
    }
    std::fs::write(board.join("session.toml"), manifest).unwrap();
    let rig = "schema = 1\nname = \"boards\"\n[camera]\nkind = \"simulated\"\nwidth_px = 640\nheight_px = 480\n\
        [[lights]]\nposition_mm = [0.0, 300.0, 400.0]\n[[lights]]\nposition_mm = [300.0, 0.0, 400.0]\n\
        [[lights]]\nposition_mm = [-300.0, -100.0, 400.0]\n";
    std::fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let options = CameraOptions {
        rig: folder.path().join("rig.toml"),
        sessions: vec![board],
        out: folder.path().join("out"),
    };
    let report = calibrate::camera(&options, &quiet).unwrap();
    let kept = report.boards.iter().filter(|board| board.dropped.is_none()).count();
    assert!(
        kept >= 12 && report.rms_reprojection_px <= 0.24,
        "{kept} boards, {} px",
        report.rms_reprojection_px
    );
}
