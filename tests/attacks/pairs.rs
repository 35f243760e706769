//! Two processes on every output at once: each does its work or says who is at it; what is there in the end is whole.

use crate::bench::{Bench, check_manners, check_whole, copy, leftovers, program, spawn, wait};
use crate::tries;
use std::process::Command;
use weavelight::session::Session;

/// Two calls, and where they write.
const PAIRS: [(&str, &str, &str); 9] = [
    (
        "solve rig/swatch --calibration rig/calibration --out out",
        "solve rig/swatch --calibration rig/calibration --out out --method robust",
        "out",
    ),
    (
        "solve rig/swatch --calibration rig/calibration --out maps --force",
        "solve rig/swatch --calibration rig/calibration --out maps --force",
        "maps",
    ),
    (
        "simulate --size 38x26 --only swatch --out out",
        "simulate --size 38x26 --only swatch --preset denim --out out",
        "out",
    ),
    ("demo --size 76x52 --out out", "demo --size 76x52 --out out", "out"),
    (
        "import --lights pictures/lights.lp --out out",
        "import --lights pictures/lights.lp --mask pictures/mask.png --out out",
        "out",
    ),
    (
        "calibrate color --rig rig/rig.toml rig/grey --out calib",
        "calibrate color --rig rig/rig.toml rig/grey --out calib",
        "calib",
    ),
    (
        "mask rig/swatch --calibration rig/calibration",
        "mask rig/swatch --calibration rig/calibration",
        "rig/swatch",
    ),
    (
        "scan --rig rig/rig.toml --out s --iso 6400 --exposure-s 0.02",
        "scan --rig rig/rig.toml --out s --iso 6400 --exposure-s 0.02",
        "s",
    ),
    (
        "scan --rig rig/rig.toml --out s --iso 6400 --exposure-s 0.02 --resume",
        "scan --rig rig/rig.toml --out s --iso 6400 --exposure-s 0.02 --resume",
        "s",
    ),
];

#[test]
fn two_processes_on_every_output() {
    let bench = Bench::new();
    let (mut done, mut failures) = (0, Vec::new());
    for round in 0..tries("WEAVELIGHT_PAIRS", 1) {
        for (first, second, out) in PAIRS {
            let home = tempfile::tempdir().unwrap();
            for folder in ["rig", "pictures", "maps"] {
                copy(&bench.path(folder), &home.path().join(folder));
            }
            let start = |call: &str| {
                let mut command = Command::new(program());
                command.args(call.split_whitespace());
                spawn(command, home.path())
            };
            let a = start(first);
            // At once, then a little later each round.
            std::thread::sleep(std::time::Duration::from_millis(7 * round as u64));
            let b = start(second);
            let ended = [wait(a, first), wait(b, second)];
            done += 1;
            let check = || -> Result<(), String> {
                for one in &ended {
                    check_manners(one)?;
                }
                if !ended.iter().any(|one| one.status.success()) {
                    return Err(format!(
                        "neither did its work: {}{}",
                        ended[0].said, ended[1].said
                    ));
                }
                let left = leftovers(home.path());
                if !left.is_empty() {
                    return Err(format!("left {left:?}"));
                }
                if out == "s" {
                    all_frames(&home.path().join(out))
                } else {
                    whole(&home.path().join(out))
                }
            };
            if let Err(why) = check() {
                failures.push(format!("{first} | {second}: {why}"));
            }
        }
    }
    println!("{done} pairs of processes, {} failed", failures.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// A scan that one process finished has every frame in its manifest, as it was recorded.
fn all_frames(folder: &std::path::Path) -> Result<(), String> {
    let session = Session::load(folder).map_err(|error| error.to_string())?;
    for frame in &session.frames {
        session.read_frame(frame).map_err(|error| error.to_string())?;
    }
    match session.frames.len() {
        12 => Ok(()),
        count => Err(format!("{count} frames instead of 12")),
    }
}

/// What was written as a whole folder is as its list says; other outputs at least read again.
fn whole(folder: &std::path::Path) -> Result<(), String> {
    if folder.join(".weavelight-files").exists() { check_whole(folder) } else { Ok(()) }
}
