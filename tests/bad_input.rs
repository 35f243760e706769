//! Bad input to the whole program: exit status 1 or 2, one or two lines that name the file and the remedy, no backtrace,
//! nothing half-written.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    clippy::print_stdout,
    reason = "a test that cannot set its scene up has failed; figures are to be seen"
)]

#[allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "test programs share it")]
#[path = "support/skip.rs"]
mod skip;
mod support;

use std::fs;
use std::path::Path;
use support::{HEIGHT, Home, LIGHTS, WIDTH, lights_toml, names, write_frame};

const SOLVE: &str = "solve s --calibration c --out maps";

/// A case: its name, what is done to the faultless session, the parts of the message.
type Case = (&'static str, fn(&Home), &'static [&'static str]);

fn check(call: &str, status: i32, cases: &[Case]) {
    for (case, damage, expected) in cases {
        let home = Home::new();
        damage(&home);
        let before = home.names();
        home.run(call).expect_failure(case, status, expected);
        assert_eq!(home.names(), before, "{case}: something was left behind");
    }
}

#[test]
fn the_faultless_session_is_solved() {
    let home = Home::new();
    let report = home.run(&format!("{SOLVE} --json")).json();
    assert_eq!(report["solved"], u64::from(WIDTH * HEIGHT), "{report}");
    assert_eq!(report["lights_used"], serde_json::json!([0, 1, 2, 3]));
    for name in [
        "normal.exr",
        "albedo.exr",
        "shade.exr",
        "confidence.exr",
        "normal.png",
        "albedo.png",
        "mask.png",
        "report.json",
    ] {
        assert!(home.path("maps").join(name).is_file(), "{name}");
    }
}

#[test]
fn frames() {
    check(
        SOLVE,
        1,
        &[
            (
                "missing",
                |h| fs::remove_file(h.path("s/light-2.png")).unwrap(),
                &["light-2.png", "missing"],
            ),
            (
                "renamed",
                |h| fs::rename(h.path("s/light-2.png"), h.path("s/light-9.png")).unwrap(),
                &["light-2.png", "missing"],
            ),
            ("a folder in its place", a_folder_for_a_frame, &["light-2.png"]),
            ("altered", altered, &["light-1.png", "altered"]),
            ("swapped", swapped, &["light-0.png", "altered"]),
            ("truncated", truncated, &["light-1.png", "altered"]),
            (
                "truncated, no hash",
                |h| {
                    truncated(h);
                    h.forget_hashes();
                },
                &["light-1.png"],
            ),
            ("empty, no hash", |h| replaced(h, b""), &["light-1.png", "empty"]),
            ("text, no hash", |h| replaced(h, b"no picture\n"), &["light-1.png", "text"]),
            ("text named .nef", text_named_nef, &["light-1.nef", "text"]),
            ("noise, no hash", |h| replaced(h, &noise()), &["light-1.png"]),
            ("another size", another_size, &["light-1.png", "24 x 18", "25 x 18"]),
            ("another mosaic", another_mosaic, &["light-", "RGGB", "BGGR"]),
            (
                "a light that the rig lacks",
                |h| h.replace("s/session.toml", "light = 3", "light = 4"),
                &["session.toml", "light-3.png", "light 4", "0 to 3"],
            ),
        ],
    );
}

fn a_folder_for_a_frame(home: &Home) {
    fs::remove_file(home.path("s/light-2.png")).unwrap();
    fs::create_dir(home.path("s/light-2.png")).unwrap();
}

fn altered(home: &Home) {
    let mut bytes = fs::read(home.path("s/light-1.png")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    home.write("s/light-1.png", bytes);
}

fn swapped(home: &Home) {
    let (a, b) = (
        fs::read(home.path("s/light-0.png")).unwrap(),
        fs::read(home.path("s/light-1.png")).unwrap(),
    );
    home.write("s/light-0.png", b);
    home.write("s/light-1.png", a);
}

fn truncated(home: &Home) {
    let bytes = fs::read(home.path("s/light-1.png")).unwrap();
    home.write("s/light-1.png", &bytes[..bytes.len() / 2]);
}

fn replaced(home: &Home, content: &[u8]) {
    home.write("s/light-1.png", content);
    home.forget_hashes();
}

fn text_named_nef(home: &Home) {
    home.write("s/light-1.nef", "Notes of the day\n".repeat(100));
    home.forget_hashes();
    home.replace("s/session.toml", "light-1.png", "light-1.nef");
}

fn noise() -> Vec<u8> {
    (0u32..4096).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

fn another_size(home: &Home) {
    write_frame(&home.path("s/light-1.png"), LIGHTS[1], WIDTH + 1, HEIGHT);
    home.forget_hashes();
}

fn another_mosaic(home: &Home) {
    home.replace("s/session.toml", "cfa = \"RGGB\"", "cfa = \"BGGR\"");
}

#[test]
fn lights() {
    check(
        SOLVE,
        1,
        &[
            ("two lights in the calibration", two_lights, &["lights.toml", "are 2"]),
            ("frames of two lights", frames_of_two_lights, &["session.toml", "2 lights"]),
            ("coplanar", lights_in_a_plane, &["light"]),
            (
                "all the same",
                |h| h.write("c/lights.toml", lights_toml(&[[0.0, 0.0, 1.0]; 4])),
                &["light"],
            ),
            (
                "two different ones",
                |h| {
                    h.write(
                        "c/lights.toml",
                        lights_toml(&[LIGHTS[0], LIGHTS[1], LIGHTS[0], LIGHTS[1]]),
                    );
                },
                &["light"],
            ),
            (
                "no lights.toml",
                |h| fs::remove_file(h.path("c/lights.toml")).unwrap(),
                &["lights.toml"],
            ),
        ],
    );
}

fn two_lights(home: &Home) {
    home.write("c/lights.toml", lights_toml(&LIGHTS[..2]));
}

fn frames_of_two_lights(home: &Home) {
    let text = home.read("s/session.toml");
    let parts: Vec<&str> = text.split("\n[[frames]]").collect();
    home.write("s/session.toml", parts[..3].join("\n[[frames]]"));
}

fn lights_in_a_plane(home: &Home) {
    let fan = [[-0.6, 0.0, 0.8], [-0.2, 0.0, 0.9], [0.3, 0.0, 0.9], [0.7, 0.0, 0.7]];
    home.write("c/lights.toml", lights_toml(&fan));
}

#[test]
fn a_level_ring_of_lamps_is_fine() {
    let ring: Vec<[f64; 3]> = (0..6)
        .map(|k| f64::from(k).to_radians() * 60.0)
        .map(|a| [0.6 * a.cos(), 0.6 * a.sin(), 0.8])
        .collect();
    let home = Home::with_lights(&ring);
    assert_eq!(home.run(&format!("{SOLVE} --json")).json()["solved"], u64::from(WIDTH * HEIGHT));
}

#[test]
fn manifests_and_calibrations() {
    check(
        SOLVE,
        1,
        &[
            (
                "no session",
                |h| fs::remove_dir_all(h.path("s")).unwrap(),
                &["session.toml", "not found"],
            ),
            ("no calibration", |h| fs::remove_dir_all(h.path("c")).unwrap(), &["c/", "not found"]),
            (
                "NaN",
                |h| h.replace("s/session.toml", "exposure_s = 1.0", "exposure_s = nan"),
                &["session.toml:8", "exposure_s", "nan"],
            ),
            (
                "infinite",
                |h| h.replace("c/lights.toml", "[1.0, 1.0, 1.0]", "[1.0, inf, 1.0]"),
                &["lights.toml:6", "intensity", "inf"],
            ),
            (
                "too large",
                |h| h.write("c/color.toml", "schema = 1\nresponse = [0, 1e400]\n"),
                &["color.toml:2", "response"],
            ),
            (
                "schema",
                |h| h.replace("s/session.toml", "schema = 1", "schema = 99"),
                &["session.toml:1", "99", "schema 1"],
            ),
            (
                "schema",
                |h| h.replace("c/lights.toml", "schema = 1", "schema = 2"),
                &["lights.toml:1", "schema 2", "schema 1"],
            ),
            (
                "no schema",
                |h| h.replace("c/color.toml", "schema = 1", ""),
                &["color.toml:1", "schema"],
            ),
            (
                "a typo",
                |h| h.replace("s/session.toml", "iso = 100", "isoo = 100"),
                &["session.toml:9", "isoo"],
            ),
            ("no TOML", |h| h.write("s/session.toml", [0u8, 159, 146, 150]), &["session.toml"]),
            (
                "a frame elsewhere",
                |h| h.replace("s/session.toml", "light-0.png", "../light-0.png"),
                &["session.toml:6", "../light-0.png"],
            ),
            ("a mask of another size", mask_of_another_size, &["mask.png", "3 x 3", "24 x 18"]),
            ("a mask that is text", mask_that_is_text, &["mask.png", "text"]),
        ],
    );
}

fn mask_of_another_size(home: &Home) {
    image::GrayImage::from_pixel(3, 3, image::Luma([255])).save(home.path("s/mask.png")).unwrap();
    home.replace("s/session.toml", "name = \"small\"", "name = \"small\"\nmask = \"mask.png\"");
}

fn mask_that_is_text(home: &Home) {
    mask_of_another_size(home);
    home.write("s/mask.png", "white everywhere");
}

#[test]
fn outputs_of_others_are_not_touched() {
    check(
        SOLVE,
        1,
        &[
            (
                "a folder with other things",
                |h| {
                    fs::create_dir(h.path("maps")).unwrap();
                    h.write("maps/thesis.tex", "years of work");
                },
                &["maps", "thesis.tex"],
            ),
            ("a file", |h| h.write("maps", "mine"), &["maps", "is a file"]),
        ],
    );
}

#[test]
fn a_failed_run_leaves_the_old_solution() {
    let home = Home::new();
    home.run(SOLVE);
    let old = fs::read(home.path("maps/normal.exr")).unwrap();
    altered(&home);
    home.run(SOLVE).expect_failure("altered", 1, &["light-1.png"]);
    assert_eq!(fs::read(home.path("maps/normal.exr")).unwrap(), old);
    assert_eq!(home.names(), ["c", "maps", "s"]);
}

#[test]
fn targets_that_cannot_be_written() {
    let home = Home::new();
    home.write("file", "in the way");
    for out in ["file/maps", "/proc/maps-of-weavelight"] {
        home.run(&format!("solve s --calibration c --out {out}")).expect_failure(
            out,
            1,
            &["--out"],
        );
    }
    assert_eq!(home.names(), ["c", "file", "s"]);
}

/// Mounts a small disk for `test`; says so where this system does not let it.
fn on_a_disk(options: &str, test: impl FnOnce(&Home, &Path)) {
    let home = Home::new();
    let disk = home.path("disk");
    fs::create_dir(&disk).unwrap();
    let mount = std::process::Command::new("mount")
        .args(["-t", "tmpfs", "-o", options, "tmpfs"])
        .arg(&disk)
        .output();
    let mounted = mount.is_ok_and(|output| output.status.success());
    let right = mounted.then_some(()).ok_or_else(|| "no right to mount a disk".to_owned());
    if skip::need("mount", right).is_none() {
        return;
    }
    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| test(&home, &disk)));
    let unmounted = std::process::Command::new("umount").arg(&disk).status();
    assert!(unmounted.is_ok_and(|status| status.success()));
    if let Err(panic) = result {
        std::panic::resume_unwind(panic);
    }
}

#[test]
fn a_full_disk() {
    on_a_disk("size=8k", |home, disk| {
        home.run("solve s --calibration c --out disk/maps").expect_failure(
            "full",
            1,
            &["disk", "o space left"],
        );
        assert_eq!(names(disk), Vec::<String>::new());
    });
}

#[test]
fn the_root_of_a_disk() {
    on_a_disk("size=1m", |home, _| {
        home.run("solve s --calibration c --out disk").expect_failure(
            "root",
            1,
            &["disk", "root of a disk"],
        );
    });
}

#[test]
fn a_read_only_disk() {
    on_a_disk("ro", |home, disk| {
        home.run("solve s --calibration c --out disk/maps").expect_failure(
            "read-only",
            1,
            &["disk", "read-only"],
        );
        assert_eq!(names(disk), Vec::<String>::new());
    });
}

#[test]
fn comparisons() {
    let home = Home::new();
    home.run(SOLVE);
    home.write("text.exr", "no picture");
    image::GrayImage::from_pixel(3, 3, image::Luma([255])).save(home.path("small.png")).unwrap();
    image::GrayImage::from_pixel(WIDTH, HEIGHT, image::Luma([0]))
        .save(home.path("black.png"))
        .unwrap();
    let check = |call: &str, expected: &[&str]| home.run(call).expect_failure(call, 1, expected);
    check("compare maps/normal.exr nowhere.exr", &["nowhere.exr"]);
    check("compare maps/normal.exr text.exr", &["text.exr"]);
    check(
        "compare maps/normal.exr maps/normal.exr --mask small.png",
        &["small.png", "3 x 3", "24 x 18"],
    );
    check(
        "compare maps/normal.exr maps/normal.exr --mask black.png",
        &["black.png", "black everywhere"],
    );
    let equal = home.run("compare maps/normal.exr maps/normal.exr --json").json();
    assert_eq!(
        (&equal["max_deg"], &equal["pixels"]),
        (&0.0.into(), &(WIDTH * HEIGHT).into()),
        "{equal}"
    );
    let equal = home.run("compare maps/albedo.exr maps/albedo.exr --json").json();
    assert_eq!(
        (&equal["mean_de2000"], &equal["psnr_db"]),
        (&0.0.into(), &serde_json::Value::Null),
        "{equal}"
    );
}

#[test]
fn imports() {
    let home = Home::new();
    home.write("l.txt", "0.5 0 0.8\n-0.5 0.1 0.8\n0 0.5 0.8\n0.1 -0.5 0.8\n");
    home.write("short.txt", "0.5 0 0.8\n-0.5 0.1 0.8\n0 0.5 0.8\n");
    home.write("broken.txt", "0.5 0 0.8\n-0.5 nan 0.8\n0 0.5 0.8\n");
    image::GrayImage::from_pixel(WIDTH, HEIGHT, image::Luma([9])).save(home.path("8.png")).unwrap();
    let before = home.names();
    let frames = "s/light-0.png s/light-1.png s/light-2.png";
    let check = |call: &str, status: i32, expected: &[&str]| {
        home.run(call).expect_failure(call, status, expected);
        assert_eq!(home.names(), before, "{call}");
    };
    check(
        &format!("import --lights l.txt {frames} --out i"),
        1,
        &["l.txt", "4 directions", "3 pictures"],
    );
    check(&format!("import --lights broken.txt {frames} --out i"), 1, &["broken.txt:2"]);
    check(&format!("import --lights none.txt {frames} --out i"), 1, &["none.txt", "not found"]);
    check(
        "import --lights short.txt s/light-0.png s/light-1.png 8.png --out i",
        2,
        &["8.png", "--encoding"],
    );
    check(
        "import --lights short.txt s/light-0.png s/light-1.png l.txt --out i",
        1,
        &["l.txt", "text"],
    );
    check(&format!("import --lights short.txt {frames} --out s"), 1, &["s", "never replaced"]);
}

#[test]
fn wrong_calls() {
    let home = Home::new();
    for call in [
        "",
        "fly",
        "solve s",
        "solve s --calibration c",
        "compare a.exr",
        "solve s --calibration c --out m --method best",
    ] {
        let said = home.run(call);
        assert_eq!(said.status, Some(2), "{call}: {}", said.stderr);
        assert_eq!(said.stdout, "", "{call}");
        assert!(
            said.stderr.contains("Usage:") || said.stderr.contains("--help"),
            "{call}: {}",
            said.stderr
        );
        assert!(call.is_empty() || said.stderr.lines().count() == 2, "{call}: {}", said.stderr);
    }
}

#[test]
fn help_has_an_example() {
    let home = Home::new();
    for command in ["demo", "simulate", "solve", "import", "compare", "doctor", "gui"] {
        let said = home.run(&format!("{command} --help"));
        assert_eq!((said.status, said.stderr.as_str()), (Some(0), ""), "{command}");
        assert!(
            said.stdout.contains(&format!("weavelight {command}")),
            "{command}: {}",
            said.stdout
        );
    }
}
