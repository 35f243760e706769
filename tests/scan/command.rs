//! `weavelight scan` as a user calls it, on a rig without hardware.

use crate::laboratory::{Laboratory, SMALL};
use assert_cmd::Command;
use std::path::Path;

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
    check("scan --rig rig/rig.toml --out s --exposure-s 900", 2, "--exposure-s is 900; give");
    check(
        "scan --rig rig/rig.toml --preview --light 10",
        2,
        "--light is 10; the rig has lights 0 to 9",
    );
}
