//! Capture sessions that cannot serve: empty, dark, of another kind, copied, with impossible exposures. Each is refused by name
//! before anything is written.

use super::bench::{BLACK, Bench, Picture, edit};
use super::refusals::refused;
use std::path::{Path, PathBuf};
use weavelight::calibrate::{
    self, CalibrateError, CameraOptions, CheckOptions, ColorOptions, LightsOptions,
};
use weavelight::session::Session;
use weavelight::simulate::Part;

const RIG: &str = "schema = 1\nname = \"small\"\n[camera]\nkind = \"simulated\"\nwidth_px = 640\nheight_px = 480\n\
    [[lights]]\nposition_mm = [0.0, 300.0, 400.0]\n[[lights]]\nposition_mm = [300.0, 0.0, 400.0]\n\
    [[lights]]\nposition_mm = [-300.0, -100.0, 400.0]\n";

fn quiet(_: f64, _: &str) {}

/// Folders with a manifest each, below a temporary one; nothing was photographed.
fn folders(manifests: &[(&str, &str)]) -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("rig.toml"), RIG).unwrap();
    for (name, rest) in manifests {
        std::fs::create_dir(home.path().join(name)).unwrap();
        let text = format!("schema = 1\nname = \"{name}\"\n{rest}");
        std::fs::write(home.path().join(name).join("session.toml"), text).unwrap();
    }
    home
}

fn camera(home: &Path, names: &[&str]) -> String {
    let sessions = names.iter().map(|name| home.join(name)).collect();
    let (rig, out) = (home.join("rig.toml"), home.join("out"));
    calibrate::camera(&CameraOptions { rig, sessions, out }, &quiet).unwrap_err().to_string()
}

fn color(home: &Path, name: &str) -> String {
    let (rig, out) = (home.join("rig.toml"), home.join("out"));
    let options = ColorOptions { rig, session: home.join(name), out };
    calibrate::color(&options, &quiet).unwrap_err().to_string()
}

const BOARD: &str =
    "kind = \"board\"\n[target]\nboard = { columns = 9, rows = 6, square_mm = 25.0 }\n";

#[test]
fn sessions_without_pictures() {
    let home = folders(&[("b", BOARD), ("g", "kind = \"grey\"\n"), ("w", "kind = \"white\"\n")]);
    let at = |name: &str| home.path().join(name).join("session.toml").display().to_string();
    let expected =
        format!("{}: no picture of a board; photograph one: a scan with kind board", at("b"));
    assert_eq!(camera(home.path(), &["b"]), expected);
    let expected =
        format!("{}: no picture of a chart; photograph one: a scan with kind grey", at("g"));
    assert_eq!(color(home.path(), "g"), expected);
    // Of another kind is told first.
    assert!(camera(home.path(), &["w"]).contains("this is no board capture session"));
    assert!(color(home.path(), "b").contains("this is no grey capture session"));
    assert!(!home.path().join("out").exists(), "a refusal made a folder");
}

#[test]
fn sessions_that_name_what_is_not_there() {
    let frame = "[[frames]]\nfile = \"gone.dng\"\n";
    let missing = BOARD.to_owned() + frame;
    let no_board = format!("kind = \"board\"\n{frame}");
    let home = folders(&[("m", &missing), ("n", &no_board)]);
    assert!(camera(home.path(), &["m"]).contains("gone.dng: this frame is missing"));
    std::fs::write(home.path().join("n/gone.dng"), "x").unwrap();
    assert!(camera(home.path(), &["n"]).contains("names no board"));
    let twice = camera(home.path(), &["m/../n", "n"]);
    assert!(twice.contains("is given twice; list every capture session once"), "{twice}");
    let none = camera(home.path(), &[]);
    assert!(none.contains("no capture session was given"), "{none}");
    std::fs::write(home.path().join("out"), "mine").unwrap();
    let file = camera(home.path(), &["n"]);
    assert!(file.contains("out: is a file; ") && file.ends_with(" new output folder"), "{file}");
}

fn black(picture: &mut Picture) {
    picture.samples.fill(BLACK);
}

fn white(picture: &mut Picture) {
    picture.samples.fill(16_383);
}

fn check_chart(spoil: impl Fn(&Bench), words: &[&str]) {
    let bench = Bench::new(&[Part::Grey], |_| ());
    spoil(&bench);
    refused(&bench, Bench::color, words);
}

#[test]
fn charts_that_show_nothing() {
    check_chart(
        |b| {
            b.spoil("grey", "", black);
        },
        &["all pictures are dark", "lens cap"],
    );
    // Without any black either: a sensor that gives only zeros.
    let zeros = |picture: &mut Picture| picture.samples.fill(0);
    check_chart(
        |b| {
            b.spoil("grey", "", zeros);
        },
        &["all pictures are dark"],
    );
    check_chart(
        |b| {
            b.spoil("grey", "", white);
        },
        &["overexposed under light 0", "shorten"],
    );
    let one = |b: &Bench| {
        b.spoil("grey", "light-04", white);
    };
    check_chart(one, &["overexposed under light 4"]);
}

#[test]
fn charts_whose_exposures_are_not_true() {
    let alike = |bench: &Bench| {
        let mut session = Session::load(&bench.rig("grey")).unwrap();
        let mut longer = 1.0;
        for entry in &mut session.frames {
            // Backwards: what was exposed long is stated short.
            if entry.file.to_string_lossy().contains("exposure") {
                entry.exposure_s = 0.2 / entry.exposure_s * longer;
                longer *= 1.01;
            }
        }
        session.save().unwrap();
    };
    check_chart(alike, &["do not follow the exposures", "correct exposure_s and iso"]);
}

fn copy_over(bench: &Bench, session: &str, from: usize, to: impl Iterator<Item = usize>) {
    let mut session = Session::load(&bench.rig(session)).unwrap();
    let file = |session: &Session, light: usize| {
        let entry = session.frames.iter().position(|f| f.light == Some(light) && !f.drift_check);
        (entry.unwrap(), session.frame_path(&session.frames[entry.unwrap()]))
    };
    let (_, source) = file(&session, from);
    for light in to {
        let (k, path) = file(&session, light);
        std::fs::copy(&source, path).unwrap();
        session.frames[k].sha256 = None;
    }
    session.save().unwrap();
}

#[test]
fn copies_of_one_picture() {
    check_chart(
        |bench| copy_over(bench, "grey", 2, [5].into_iter()),
        &["hold the same picture, for light 2 and light 5", "photograph every light by itself"],
    );
    let bench = Bench::new(&[Part::WhiteFlat, Part::WhiteRaised], |_| ());
    copy_over(&bench, "white-flat", 0, 1..10);
    let flat = |bench: &Bench| bench.lights(&["white-flat"]);
    refused(&bench, flat, &["white-flat", "same picture, for light 0 and light 1"]);

    // A whole capture session, copied under another name.
    let (from, to) = (bench.rig("white-raised"), bench.rig("white-again"));
    std::fs::create_dir(&to).unwrap();
    for entry in std::fs::read_dir(&from).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
    }
    let both = |bench: &Bench| bench.lights(&["white-raised", "white-again"]);
    refused(&bench, both, &["white-again", "is the same picture as in", "white-raised"]);
}

fn check_sheet(spoil: impl Fn(&Bench), words: &[&str]) {
    let bench = Bench::new(&[Part::WhiteFlat], |_| ());
    spoil(&bench);
    refused(&bench, |bench| bench.lights(&["white-flat"]), words);
}

#[test]
fn sheets_that_show_nothing() {
    check_sheet(
        |b| {
            b.spoil("white-flat", "", black);
        },
        &["all pictures are dark", "lens cap"],
    );
    check_sheet(
        |b| {
            b.spoil("white-flat", "", white);
        },
        &["light 0 overexposes 100 %"],
    );
    check_sheet(
        |b| {
            b.spoil("white-flat", "light-03", black);
        },
        &["light 3 is dark"],
    );
    let room = |bench: &Bench| {
        bench.spoil("white-flat", "", |picture| picture.samples.fill(4_000));
    };
    // Every picture shows the room and nothing else.
    check_sheet(room, &["the ambient frame reaches", "lights switch on"]);
}

#[test]
fn sheets_whose_exposures_are_not_true() {
    let again = |bench: &Bench| {
        let mut session = Session::load(&bench.rig("white-flat")).unwrap();
        let mut entry = session.frames.iter().find(|f| f.light == Some(0)).unwrap().clone();
        let path = session.frame_path(&entry);
        entry.file = PathBuf::from("light-00-again.dng");
        std::fs::copy(path, session.frame_path(&entry)).unwrap();
        (entry.exposure_s, entry.sha256, entry.drift_check) = (4.0 * entry.exposure_s, None, false);
        session.frames.push(entry);
        session.save().unwrap();
    };
    check_sheet(
        again,
        &[
            "light-00-again.dng is stated to be exposed 4.000 times as long",
            "correct exposure_s and iso",
        ],
    );
}

#[test]
fn an_exposure_that_the_file_does_not_have_is_told() {
    let bench = Bench::new(&[Part::WhiteFlat], |_| ());
    bench.know(&["camera.toml"]);
    let mut session = Session::load(&bench.rig("white-flat")).unwrap();
    session.frames.iter_mut().for_each(|entry| entry.exposure_s *= 3.0);
    session.save().unwrap();
    let report = bench.lights(&["white-flat"]).unwrap();
    let told = |w: &String| w.contains("session.toml says that") && w.contains("the file says");
    assert_eq!(report.warnings.iter().filter(|w| told(w)).count(), 1, "{:?}", report.warnings);
}

#[test]
fn frames_of_two_sizes() {
    let other = Bench::new(&[Part::WhiteFlat], |o| o.size_px = Some([308, 204]));
    let small = other.rig("white-flat/light-03.dng");
    let swap = |bench: &Bench| {
        std::fs::copy(&small, bench.rig("white-flat/light-03.dng")).unwrap();
        edit(bench.rig("white-flat/session.toml"), |text| {
            let lines = text.lines().filter(|line| !line.starts_with("sha256"));
            lines.collect::<Vec<_>>().join("\n") + "\n"
        });
    };
    check_sheet(swap, &["light-03.dng", "308 x 204"]);
}

#[test]
fn a_check_of_nothing() {
    let bench = Bench::new(&[Part::WhiteFlat, Part::Board], |_| ());
    bench.know_all();
    let check = |sessions: Vec<PathBuf>| -> CalibrateError {
        let (calibration, out) = (bench.found(), None);
        let options = CheckOptions { calibration, sessions, threshold_deg: 0.1, out };
        calibrate::check(&options, &quiet).unwrap_err()
    };
    assert!(check(Vec::new()).to_string().contains("no capture session was given"));
    let wrong = check(vec![bench.rig("board")]).to_string();
    assert!(wrong.contains("this is no white capture session"), "{wrong}");
    let twice = check(vec![bench.rig("white-flat"); 2]).to_string();
    assert!(twice.contains("is given twice"), "{twice}");
    let options = LightsOptions {
        rig: bench.rig("rig.toml"),
        sessions: vec![bench.rig("board")],
        out: bench.found(),
    };
    let wrong = calibrate::lights(&options, &quiet).unwrap_err().to_string();
    assert!(wrong.contains("this is no white capture session"), "{wrong}");
}
