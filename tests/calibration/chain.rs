//! From pictures to a calibration that holds on sheets the fit has not seen.

use super::bench::{Bench, SIX_SHEETS, WHITE, quiet};
use super::skip;
use std::path::{Path, PathBuf};
use weavelight::calibrate::{self, CameraOptions, StepState};
use weavelight::instrument::Calibration;
use weavelight::simulate::Part;

#[test]
fn the_whole_instrument_is_measured_from_pictures() {
    let parts = [&[Part::Board, Part::Grey], &WHITE[..]].concat();
    let bench = Bench::new(&parts, |_| ());
    let camera = bench.camera().unwrap();
    assert!(camera.rms_reprojection_px <= 0.06, "{}", camera.rms_reprojection_px);
    let truth = Calibration::load(&bench.truth()).unwrap().camera.unwrap();
    assert!((camera.intrinsics_px[0] / truth.fx - 1.0).abs() < 1e-3, "{}", camera.intrinsics_px[0]);
    assert_eq!(camera.coverage.len(), 48);
    assert!(camera.sigma.iter().chain(&camera.pose_sigma).all(|sigma| *sigma > 0.0), "{camera:?}");

    let color = bench.color().unwrap();
    let exact = color.black_level.iter().all(|black| (black - 600.0).abs() < 1.0);
    assert!(exact, "{:?}", color.black_level);
    assert_eq!(color.response, [0.0, 1.0]);
    let worst = color.patches_de2000.iter().map(|[_, after]| *after).fold(0.0, f64::max);
    assert!(color.patches_de2000.len() == 24 && worst <= 1.0, "{worst}");
    assert_eq!((color.hot, color.dead), (0, 0));

    // The fourth tilt is not seen by the fit.
    let found = bench.lights(&SIX_SHEETS[..5]).unwrap();
    assert!(found.lights.iter().all(|light| light.position_claimed));
    assert!(found.iterations <= 15);
    let error = bench.position_rms_mm();
    assert!(error < 1.0, "{error} mm");
    assert!(found.sheets.iter().all(|sheet| (0.5..0.9).contains(&sheet.brightest)), "{found:?}");

    let check = bench.check(&["white-flat", "white-tilt-4"]).unwrap();
    assert!(check.passed, "{check:?}");
    let drawn = |map: &Option<PathBuf>| map.as_ref().is_some_and(|map| map.exists());
    assert!(check.sheets.iter().all(|sheet| drawn(&sheet.residual_map)));

    let status = calibrate::status(&bench.found()).unwrap();
    assert!(status.next.contains("check"), "{}", status.next);
    assert!(status.exposure.is_empty(), "{:?}", status.exposure);
    states_its_making(&bench.found());
}

/// Date, inputs and quality, in every file.
fn states_its_making(folder: &Path) {
    let provenance = Calibration::load(folder).unwrap().provenance;
    for made in [provenance.camera, provenance.color, provenance.lights] {
        let made = made.unwrap();
        assert!(made.program.starts_with("weavelight") && made.created.is_some(), "{made:?}");
        assert!(made.inputs.iter().any(|input| input.name.ends_with("rig.toml")), "{made:?}");
        assert!(made.inputs.len() >= 2 && made.quality.len() >= 3, "{made:?}");
        assert!(made.inputs.iter().all(|input| input.sha256.len() == 64), "{made:?}");
    }
    let defects = std::fs::read_to_string(folder.join("defects.toml")).unwrap();
    assert!(defects.contains("created") && defects.contains("inputs"), "{defects}");
}

/// The board on the table lies along the pixels' rows; this one's corners are the worst of its set, and good all the same.
#[test]
fn the_board_on_the_table_is_kept() {
    let bench = Bench::new(&[Part::Board], |o| (o.seed, o.size_px) = (2, Some([1232, 816])));
    let report = bench.camera().unwrap();
    assert!(report.boards.iter().all(|board| board.dropped.is_none()), "{:?}", report.boards);
    let truth = Calibration::load(&bench.truth()).unwrap().camera.unwrap();
    assert!((report.intrinsics_px[0] / truth.fx - 1.0).abs() < 5e-4, "{:?}", report.intrinsics_px);
}

#[test]
fn the_wizard_asks_for_one_thing_at_a_time() {
    let bench = Bench::new(&[Part::WhiteFlat], |o| o.flaws.exposure_factor = 0.4);
    let ask = || calibrate::status(&bench.found()).unwrap();
    assert!(ask().next.contains("chessboard"));
    bench.know(&["camera.toml"]);
    assert!(ask().next.contains("chart"), "{}", ask().next);
    bench.know(&["color.toml"]);
    assert!(ask().next.contains("white sheet flat"), "{}", ask().next);
    // One flat sheet is too little, and this one is too dark.
    bench.lights(&["white-flat"]).unwrap();
    let status = ask();
    assert_eq!(status.steps[2].state, StepState::Improvable);
    assert!(status.next.contains("tilted towards light"), "{}", status.next);
    let now = status.position_sigma_mm.unwrap();
    assert!(status.next_sigma_mm.is_some_and(|then| then < now), "{status:?}");
    assert!(status.exposure.iter().any(|advice| advice.contains("times longer")), "{status:?}");
}

/// Pictures of a real board.
fn real_pictures() -> Option<PathBuf> {
    skip::real_pictures(env!("CARGO_MANIFEST_DIR"), "chess-left")
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
