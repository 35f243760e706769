//! `weavelight scan` as a user calls it, on a rig without hardware.

use crate::laboratory::{Laboratory, SMALL};
use assert_cmd::Command;
use std::path::Path;
use weavelight::session::Session;
use weavelight::simulate::{self, Lying, Part};

struct Said {
    status: Option<i32>,
    out: String,
    err: String,
}

fn weavelight(folder: &Path, call: &str) -> Said {
    let output = Command::cargo_bin("weavelight")
        .unwrap()
        .current_dir(folder)
        .args(call.split_whitespace())
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Said { status: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
}

fn json(folder: &Path, call: &str) -> serde_json::Value {
    let said = weavelight(folder, call);
    assert_eq!(said.status, Some(0), "{call}: {}", said.err);
    serde_json::from_str(&said.out).unwrap()
}

#[test]
fn a_simulated_rig_scans_out_of_the_box() {
    let laboratory = Laboratory::new(SMALL, |_| ());
    let home = laboratory.home.path();
    let plan = json(home, "scan --rig rig/rig.toml --dry-run --exposure-s 0.5 --json");
    assert_eq!(plan["frames"].as_array().unwrap().len(), 12);
    assert_eq!(plan["frames"][3]["light"], 2);
    assert_eq!(plan["frames"][3]["exposure_s"], 0.5);
    let seen = json(home, "scan --rig rig/rig.toml --preview --iso 6400 --light 3 --json");
    assert_eq!(seen["channels"].as_array().unwrap().len(), 3);
    let shares = seen["channels"][1]["histogram"].as_array().unwrap();
    assert!((shares.iter().filter_map(|s| s.as_f64()).sum::<f64>() - 1.0).abs() < 1e-6);
    assert!(seen["focus"].as_f64().unwrap() > 0.0);

    let done = json(home, "scan --rig rig/rig.toml --out s --iso 6400 --thickness-mm 0.5 --json");
    assert_eq!((&done["frames"], &done["resumed"]), (&12.into(), &0.into()));
    let again = weavelight(home, "scan --rig rig/rig.toml --out s");
    assert_eq!(again.status, Some(1));
    assert!(
        again.err.contains(
            "s: holds a capture session already (s, 12 frames); continue it with --resume"
        ),
        "{}",
        again.err
    );
    let resumed = json(home, "scan --rig rig/rig.toml --out s --resume --iso 6400 --json");
    assert_eq!((&resumed["frames"], &resumed["resumed"]), (&12.into(), &12.into()));
    let solved = json(home, "solve s --calibration rig/calibration --out maps --json");
    assert_eq!(solved["plane"]["point_mm"][2], 0.5, "{solved}");
}

#[test]
fn a_bracket_is_merged_by_the_solve() {
    let laboratory = Laboratory::new(SMALL, |_| ());
    let home = laboratory.home.path();
    let call = "scan --rig rig/rig.toml --out s --exposure-s 0.08 --iso 800 --bracket 0.25 --json";
    assert_eq!(json(home, call)["frames"], 22);
    let solved = json(home, "solve s --calibration rig/calibration --out maps --json");
    assert_eq!(solved["lights_used"].as_array().unwrap().len(), 10);
}

#[test]
fn targets_are_photographed_and_calibrate() {
    let laboratory = Laboratory::new([156, 104], |options| {
        options.only = vec![Part::Grey];
    });
    let home = laboratory.home.path();
    let rig = home.join("rig/rig.toml");
    simulate::lay(&rig, Lying::Board { pose: 0 }).unwrap();
    let call = "scan --rig rig/rig.toml --kind board --board 9x6x25 --light 3 --out b --json";
    assert_eq!(json(home, call)["frames"], 1);
    simulate::lay(&rig, Lying::Board { pose: 1 }).unwrap();
    assert_eq!(json(home, call)["frames"], 2);
    let board = std::fs::read_to_string(home.join("b/session.toml")).unwrap();
    assert!(board.contains("kind = \"board\"") && board.contains("pose = \"table\""), "{board}");

    simulate::lay(&rig, Lying::Grey).unwrap();
    let call = "scan --rig rig/rig.toml --kind grey --target rig/grey/session.toml --out g --json";
    let done = json(home, call);
    assert_eq!((&done["frames"], &done["warnings"]), (&18.into(), &serde_json::json!([])));
    let measured = json(home, "calibrate color --rig rig/rig.toml g --out own --json");
    assert!(measured["nonlinearity"].as_f64().unwrap() < 0.01, "{measured}");
    assert!(measured["camera_to_linear_srgb"].is_array(), "{measured}");

    simulate::lay(&rig, Lying::White { height_mm: 100.0, tilt_deg: 0.0, towards_deg: 0.0 })
        .unwrap();
    let call =
        "scan --rig rig/rig.toml --kind white --thickness-mm 100 --reflectance 0.98 --out w --json";
    let done = json(home, call);
    assert_eq!((&done["frames"], &done["warnings"]), (&12.into(), &serde_json::json!([])));
    let sheet = Session::load(&home.join("w")).unwrap();
    assert_eq!(sheet.plane.unwrap().point_mm.z, 100.0);
    assert_eq!(sheet.target.unwrap().reflectance, Some(0.98));
}

#[test]
fn what_is_wrong_with_a_call_is_told() {
    let laboratory = Laboratory::new(SMALL, |_| ());
    let home = laboratory.home.path();
    let rig = std::fs::read_to_string(home.join("rig/rig.toml")).unwrap();
    let write = |name: &str, from: &str, to: &str| {
        assert!(rig.contains(from), "{rig}");
        std::fs::write(home.join("rig").join(name), rig.replacen(from, to, 1)).unwrap();
    };
    let simulated_camera = "kind = \"simulated\"";
    write("watched.toml", simulated_camera, "kind = \"watched\"\nfolder = \"none\"");
    write(
        "mixed.toml",
        "[controller]\nkind = \"simulated\"",
        "[controller]\nkind = \"serial\"\nport = \"/dev/none\"",
    );
    write("channel.toml", "channel = 4", "channel = 40");
    let check = |call: &str, status: i32, expected: &str| {
        let said = weavelight(home, call);
        assert_eq!(said.status, Some(status), "{call}: {}", said.err);
        assert!(said.err.contains(expected), "{call}: {}", said.err);
        assert!(said.err.lines().count() <= 2 && said.err.contains("; "), "{call}: {}", said.err);
        assert!(!home.join("s").exists(), "{call} left something");
    };
    check("scan --rig none.toml --out s", 1, "none.toml: not found");
    check("scan --rig rig/watched.toml --out s", 1, "the watched folder is not there; make it");
    check("scan --rig rig/mixed.toml --out s", 1, "sees simulated lights only; set [controller]");
    check("scan --rig rig/channel.toml --out s", 1, "light 4 is on channel 40; a light board has");
    check("scan --rig rig/rig.toml --out s --bracket 1", 2, "--bracket: 1 makes no sense; give");
    let rig = |rest: &str| format!("scan --rig rig/rig.toml --out s {rest}");
    check(&rig("--kind board"), 2, "the board is not described; give --board 9x6x25");
    check(&rig("--kind board --board 9by6"), 2, "as in 9x6x25");
    check(&rig("--kind board --board 9x6x25 --light 12"), 2, "--light is 12; the rig has lights");
    check(&rig("--kind grey"), 2, "the patches are not described; name them with --target");
    check(&rig("--kind grey --target rig/rig.toml"), 1, "`target` is missing; describe");
    check(&rig("--light 2"), 2, "--light goes with --preview or --kind board; leave");
    check(&rig("--plane-point 0,0,60"), 2, "--plane-point goes with --kind white; leave it out");
    check(&rig("--kind white --plane-normal 0,0,-1"), 2, "does not point to the camera; its z");
    check("scan --rig rig/rig.toml --out s --exposure-s 900", 2, "--exposure-s is 900; give");
    check(
        "scan --rig rig/rig.toml --preview --light 10",
        2,
        "--light is 10; the rig has lights 0 to 9",
    );
}
