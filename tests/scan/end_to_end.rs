//! A whole scan with the real firmware, and what the solver makes of it.

use crate::laboratory::{Laboratory, Line, none};
use crate::simboard::SimBoard;
use std::path::Path;
use weavelight::compare::{self, Figures, Kind};
use weavelight::device::board::PortChoice;
use weavelight::device::scan::{Begin, Options};
use weavelight::session::Session;
use weavelight::solve;
use weavelight_sim::cloth::Preset;

/// RMS error of the normals that a capture session gives, degrees.
fn error_deg(laboratory: &Laboratory, session: &Path, name: &str) -> f64 {
    let out = laboratory.path(name);
    let calibration = laboratory.path("rig/calibration");
    solve::run(&solve::Options::new(session.to_owned(), calibration, &out), &|_| (), None).unwrap();
    let options = compare::Options {
        a: out.join("normal.exr"),
        b: laboratory.path("rig/truth/normal.exr"),
        mask: None,
        kind: Some(Kind::Normal),
    };
    match compare::run(&options).unwrap().figures {
        Figures::Normal(figures) => figures.rms_deg,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_scan_solves_to_the_right_fabric() {
    let Some(sim) = SimBoard::on_a_port(&[]) else { return };
    let laboratory = Laboratory::new([330, 218], |options| {
        options.material.preset = Preset::Facets;
        options.flaws.ruler_error_mm = 10.0;
    });
    let mut camera = laboratory.camera(Line::eyes(&sim), 0, none());
    let port = PortChoice::Path(sim.port());
    // As `simulate` exposes it.
    let own = Session::load(&laboratory.path("rig/swatch")).unwrap().frames[0].exposure_s;
    let options = Options { exposure_s: Some(own), iso: 100.0, ..laboratory.options(Begin::Anew) };
    let summary = laboratory.scan_with(port, &mut camera, &options).unwrap();
    assert_eq!((summary.frames, summary.retries, summary.warnings), (12, vec![], vec![]));
    assert_eq!(laboratory.check_frames(), 12);
    assert_eq!(Line::to(&sim).pins(), 0, "dark afterwards");
    let session = Session::load(&laboratory.path("session")).unwrap();
    assert!(
        session.frames.iter().all(|frame| frame.board_ms.is_some() && frame.attempts == Some(1))
    );
    let scanned = error_deg(&laboratory, &laboratory.path("session"), "scanned");
    let simulated = error_deg(&laboratory, &laboratory.path("rig/swatch"), "simulated");
    println!("normals: {scanned:.3} degrees from the scan, {simulated:.3} from `simulate`");
    assert!(scanned < 1.1 * simulated, "{scanned} degrees, but {simulated} from `simulate`");
}
