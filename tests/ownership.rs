//! What belongs to the user survives: outputs written again, two processes at once, a kill at any moment, limits.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test that cannot set its scene up has failed; skipping is to be seen"
)]

mod support;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use support::{Home, names};

const SOLVE: &str = "solve s --calibration c --out maps";
const RULE: &str = "only an earlier";

fn weavelight(home: &Home, call: &str) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("weavelight"));
    command.args(call.split(' ')).current_dir(home.path(""));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn done(home: &Home, call: &str) {
    let said = home.run(call);
    assert_eq!(said.status, Some(0), "{call}: {}", said.stderr);
}

/// Everything below a folder.
fn all(folder: &Path) -> Vec<String> {
    let mut found = vec![];
    for entry in fs::read_dir(folder).unwrap().flatten() {
        found.push(entry.path().display().to_string());
        if entry.path().is_dir() {
            found.extend(all(&entry.path()));
        }
    }
    found
}

/// Calls that run side by side: exactly one does its work, and the others say who does.
fn one_of(home: &Home, calls: &[&str]) {
    let children: Vec<Child> =
        calls.iter().map(|call| weavelight(home, call).spawn().unwrap()).collect();
    let said: Vec<(bool, String)> = children
        .into_iter()
        .map(|child| child.wait_with_output().unwrap())
        .map(|out| (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned()))
        .collect();
    assert!(said.iter().any(|(done, _)| *done), "{said:?}");
    for (_, text) in said.iter().filter(|(done, _)| !done) {
        let refused = text.contains("in use by weavelight") && text.contains("process ");
        // The second may also begin when the first is done.
        let after = text.contains("holds") || text.contains("never replaced");
        assert!(refused || after, "{text}");
    }
}

#[test]
fn a_simulation_with_something_added_is_not_replaced() {
    let home = Home::new();
    let simulate = "simulate --out rig --size 96x64 --only swatch";
    done(&home, simulate);
    done(&home, simulate);
    let frame = fs::read(home.path("rig/swatch/light-00.dng")).unwrap();
    fs::create_dir(home.path("rig/swatch/another")).unwrap();
    home.run(simulate).expect_failure("a folder", 1, &["swatch/another", RULE]);
    fs::remove_dir(home.path("rig/swatch/another")).unwrap();
    home.write("rig/truth/notes.txt", "mine");
    home.run(simulate).expect_failure("a file", 1, &["truth/notes.txt", RULE]);
    fs::remove_file(home.path("rig/truth/notes.txt")).unwrap();
    home.write("rig/swatch/light-00.dng", "edited");
    home.run(simulate).expect_failure("a frame", 1, &["light-00.dng, changed since", RULE]);
    home.write("rig/swatch/light-00.dng", frame);
    done(&home, simulate);
}

#[test]
fn a_demo_leaves_notes_and_masks_alone() {
    let home = Home::new();
    let demo = "demo --out demo --size 64x48";
    done(&home, demo);
    done(&home, demo);
    home.write("demo/linen/rig/swatch/mask.png", "mine");
    home.run(demo).expect_failure("a mask", 1, &["linen/rig", "swatch/mask.png", RULE]);
    assert_eq!(home.read("demo/linen/rig/swatch/mask.png"), "mine");
}

#[test]
fn a_solution_with_notes_is_not_replaced_by_force() {
    let home = Home::new();
    done(&home, SOLVE);
    let force = format!("{SOLVE} --force");
    done(&home, &force);
    home.write("maps/residual-notes.txt", "mine");
    home.run(&force).expect_failure("notes", 1, &["residual-notes.txt", RULE]);
    assert_eq!(home.read("maps/residual-notes.txt"), "mine");
    fs::remove_file(home.path("maps/residual-notes.txt")).unwrap();
    home.write("maps/albedo.png", "mine");
    home.run(&force).expect_failure("a map", 1, &["albedo.png, changed since", RULE]);
    assert_eq!(home.read("maps/albedo.png"), "mine");
    let list = home.read("maps/.weavelight-files");
    assert!(list.contains("  normal.exr\n") && !list.contains("files\n"), "{list}");
}

#[test]
fn two_processes_on_every_output() {
    let home = Home::new();
    done(&home, "simulate --out rig --size 96x64 --only swatch");
    let force = format!("{SOLVE} --force");
    done(&home, SOLVE);
    for _ in 0..4 {
        one_of(&home, &[&force, &force, &force]);
        assert!(home.run(&format!("{SOLVE} --json")).json()["solved"].as_u64().unwrap() > 0);
    }
    one_of(&home, &["simulate --out sim --size 64x48"; 3]);
    one_of(&home, &["mask s --calibration c"; 2]);
    let rig = "--rig rig/rig.toml --iso 6400";
    let one = format!("scan {rig} --out scan --resume");
    for _ in 0..3 {
        one_of(&home, &[&one, &one, &one]);
        let manifest = home.read("scan/session.toml");
        assert_eq!(manifest.matches("[[frames]]").count(), 12, "{manifest}");
    }
    let other = format!("scan {rig} --out scan-2 --resume");
    one_of(&home, &[&one, &other, &format!("scan {rig} --preview")]);
    // Nothing of locks or work is left.
    let mut left = all(&home.path("s/.."));
    left.retain(|name| {
        name.contains("partial") || name.contains("-lock") || name.contains("incoming")
    });
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn the_output_stands_under_its_name_whenever_the_program_is_killed() {
    let home = Home::new();
    done(&home, SOLVE);
    let force = format!("{SOLVE} --force");
    for k in 0..25 {
        let mut child = weavelight(&home, &force).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(4 * k));
        let _ = child.kill();
        let _ = child.wait();
        assert!(home.path("maps/report.json").is_file(), "{k}: the solution is gone");
    }
    done(&home, &force);
    let hidden: Vec<String> =
        names(&home.path("")).into_iter().filter(|name| name.starts_with('.')).collect();
    assert!(hidden.is_empty(), "{hidden:?}");
}

/// A limit on file sizes, as `ulimit -f` sets it, in blocks of 512 or 1024 bytes.
fn limited(home: &Home, blocks: u32, call: &str) -> (Option<i32>, String) {
    let program = assert_cmd::cargo::cargo_bin("weavelight");
    let script = format!("ulimit -f {blocks}; exec {} {call}", program.display());
    let out = Command::new("sh").args(["-c", &script]).current_dir(home.path("")).output().unwrap();
    (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
}

#[test]
fn a_limit_on_file_sizes_is_an_error_that_names_the_final_place() {
    let home = Home::new();
    let before = home.names();
    let (code, said) = limited(&home, 1, "simulate --out rig --size 256x192 --only swatch");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("rig/") && said.contains("larger than"), "{said}");
    assert!(!said.contains("partial"), "{said}");
    assert_eq!(home.names(), before);
}

#[test]
fn a_calibration_keeps_what_is_not_its_own() {
    let home = Home::new();
    done(&home, "simulate --out rig --size 160x120");
    let lights = "calibrate lights --rig rig/rig.toml rig/white-flat --out rig/calibration";
    home.write("rig/calibration/gain-light-99-mine.exr", "mine");
    let first = weavelight(&home, lights).output().unwrap();
    if !first.status.success() {
        eprintln!("skipped: {}", String::from_utf8_lossy(&first.stderr));
        return;
    }
    assert_eq!(home.read("rig/calibration/gain-light-99-mine.exr"), "mine");
    let edited = format!("{}\n# my remark\n", home.read("rig/calibration/lights.toml"));
    home.write("rig/calibration/lights.toml", &edited);
    home.run(lights).expect_failure("edited", 1, &["lights.toml: is not as weavelight wrote it"]);
    assert_eq!(home.read("rig/calibration/lights.toml"), edited);
}

/// With `strace`, at chosen system calls: killed when it exchanges, renames and deletes.
#[test]
#[ignore = "needs strace and the right to trace"]
fn killed_at_chosen_system_calls() {
    let home = Home::new();
    done(&home, SOLVE);
    let program = assert_cmd::cargo::cargo_bin("weavelight");
    for call in ["renameat2", "rename", "unlink", "unlinkat", "rmdir", "fsync", "mkdir"] {
        for when in 1..12 {
            let inject = format!("inject={call}:signal=SIGKILL:when={when}");
            let status = Command::new("strace")
                .args([
                    "-f",
                    "-qq",
                    "-o",
                    "/dev/null",
                    "-e",
                    &format!("trace={call}"),
                    "-e",
                    &inject,
                ])
                .arg(&program)
                .args(format!("{SOLVE} --force").split(' '))
                .current_dir(home.path(""))
                .stderr(Stdio::null())
                .stdout(Stdio::null())
                .status()
                .unwrap();
            assert!(home.path("maps/report.json").is_file(), "{call} {when}: {status:?}");
            whole(&home.path("maps"));
        }
    }
    done(&home, &format!("{SOLVE} --force"));
    let hidden: Vec<String> =
        names(&home.path("")).into_iter().filter(|name| name.starts_with('.')).collect();
    assert!(hidden.is_empty(), "{hidden:?}");
}

fn whole(solution: &Path) {
    let check = Command::new("sha256sum")
        .args(["--check", "--quiet", ".weavelight-files"])
        .current_dir(solution)
        .output()
        .unwrap();
    assert!(check.status.success(), "{check:?}");
}
