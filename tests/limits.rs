//! What the world can do to the whole program: names that are no text, things that are no files, limits of memory, stack
//! and threads, absurd numbers. It does its work, or ends soon with an error and a remedy; it never hangs, panics or aborts.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]

mod support;

use assert_cmd::Command;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::time::Duration;
use support::{Home, Said, names};

/// Longer than anything here takes on a busy machine; a hang takes for ever.
const SOON: Duration = Duration::from_secs(120);

/// Runs a program in a folder; it must end soon.
fn run(folder: &Path, program: &str, arguments: &[&OsStr], variables: &[(&str, &str)]) -> Said {
    let mut command = Command::new(program);
    command.current_dir(folder).args(arguments).env("XDG_RUNTIME_DIR", folder);
    let output = command.envs(variables.iter().copied()).timeout(SOON).output().unwrap();
    Said {
        status: output.status.code(),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

fn weavelight() -> &'static str {
    env!("CARGO_BIN_EXE_weavelight")
}

/// Runs the program below limits of the shell, as in "ulimit -s 256".
fn limited(folder: &Path, limit: &str, call: &str, variables: &[(&str, &str)]) -> Said {
    let line = format!("{limit}; exec {} {call}", weavelight());
    run(folder, "sh", &["-c".as_ref(), line.as_ref()], variables)
}

/// Runs the program; arguments with this in them have it replaced by a byte that is not UTF-8.
fn no_text(folder: &Path, call: &str) -> Said {
    let arguments: Vec<Vec<u8>> = call
        .split_whitespace()
        .map(|part| part.bytes().map(|byte| if byte == b'?' { 0xff } else { byte }).collect())
        .collect();
    let arguments: Vec<&OsStr> = arguments.iter().map(|part| OsStr::from_bytes(part)).collect();
    run(folder, weavelight(), &arguments, &[])
}

fn pipe(path: &Path) {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
}

#[test]
fn names_that_are_no_text_are_as_good_as_others() {
    let home = Home::new();
    let folder = home.path("");
    let simulated = no_text(&folder, "simulate --out rig? --size 48x32 --only swatch --json");
    assert!(simulated.json()["out"].as_str().unwrap().contains("rig\u{fffd}"));
    for call in [
        "scan --rig rig?/rig.toml --out scan? --iso 6400 --json",
        "scan --rig rig?/rig.toml --out scan? --resume --iso 6400",
        "mask scan? --calibration rig?/calibration --json",
        "solve scan? --calibration rig?/calibration --out maps? --json",
        "solve scan? --calibration rig?/calibration --out maps? --json",
        "compare maps?/normal.exr maps?/normal.exr --mask maps?/mask.png --json",
        "demo --out demo? --size 48x32 --json",
        "doctor --folder demo? --json",
    ] {
        let said = no_text(&folder, call);
        assert_eq!(said.status, Some(0), "{call}: {}", said.stderr);
        if call.ends_with("--json") {
            said.json();
        }
    }
    fs::write(home.path("lights.txt"), "0.5 0 0.8\n-0.5 0.1 0.8\n0 0.5 0.8\n0.1 -0.5 0.8\n")
        .unwrap();
    for k in 0..4 {
        let name = [b"light-".as_slice(), &[b'0' + k, 0xff], b".png"].concat();
        fs::copy(home.path(&format!("s/light-{k}.png")), folder.join(OsStr::from_bytes(&name)))
            .unwrap();
    }
    let call = "import --lights lights.txt light-0?.png light-1?.png light-2?.png light-3?.png --out set? --json";
    let said = no_text(&folder, call).json();
    assert_eq!(said["frames"], 4);
    no_text(&folder, "solve set? --calibration set?/calibration --out set-maps? --json").json();
}

#[test]
fn pipes_devices_and_folders_are_no_inputs() {
    let home = Home::new();
    pipe(&home.path("pipe"));
    fs::create_dir(home.path("folder")).unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(home.path("socket")).unwrap();
    std::os::unix::fs::symlink("pipe", home.path("link")).unwrap();
    fs::write(home.path("lights.txt"), "0.5 0 0.8\n-0.5 0.1 0.8\n0 0.5 0.8\n").unwrap();
    let before = home.names();
    for (thing, what) in [
        ("pipe", "is a named pipe, not a file;"),
        ("link", "is a named pipe, not a file;"),
        ("socket", "is a socket, not a file;"),
        ("folder", "is a folder where a file is expected;"),
        ("/dev/zero", "is a device, not a file;"),
    ] {
        for call in [
            "scan --rig @ --out out",
            "scan --rig @ --preview",
            "simulate --rig @ --out out",
            "calibrate camera --rig @ s --out out",
            "solve s --calibration c --out out --mask @",
            "solve s --calibration c --out out --settings @",
            "import --lights @ s/light-0.png --out out",
            "import --lights lights.txt @ s/light-0.png s/light-1.png --out out",
            "import --lights lights.txt s/light-0.png s/light-1.png s/light-2.png --mask @ --out out",
            "compare @ s/light-0.png",
            "doctor --rig @",
        ] {
            let said = home.run(&call.replace('@', thing));
            said.expect_failure(&format!("{call} ({thing})"), 1, &[what]);
            assert_eq!(home.names(), before, "{call} ({thing})");
        }
    }
}

#[test]
fn pipes_in_the_place_of_a_folders_files_are_refused() {
    for name in
        ["s/session.toml", "s/light-1.png", "c/lights.toml", "c/color.toml", "c/camera.toml"]
    {
        let home = Home::new();
        let _ = fs::remove_file(home.path(name));
        pipe(&home.path(name));
        let said = home.run("solve s --calibration c --out maps");
        said.expect_failure(name, 1, &[name, "is a named pipe, not a file;"]);
    }
}

#[test]
fn outputs_do_not_replace_pipes_devices_or_links() {
    let home = Home::new();
    pipe(&home.path("pipe"));
    std::os::unix::fs::symlink("/no/such/place", home.path("nowhere")).unwrap();
    let before = home.names();
    for (thing, what) in [
        ("pipe", "is a named pipe"),
        ("nowhere", "is a link to /no/such/place, which is not there"),
        ("/dev/null", "is a device"),
    ] {
        for call in [
            "solve s --calibration c --out @",
            "mask s --calibration c --force --out @",
            "simulate --out @ --size 48x32 --only swatch",
            "calibrate camera --rig none.toml s --out @",
            "calibrate color --rig none.toml s --out @",
            "calibrate lights --rig none.toml s --out @",
            "calibrate check none s --out @",
        ] {
            let said = home.run(&call.replace('@', thing));
            said.expect_failure(&format!("{call} ({thing})"), 1, &[what]);
        }
    }
    assert_eq!(home.names(), before);
}

#[test]
fn a_small_stack_is_enough() {
    let home = Home::new();
    for kilobytes in [128, 256, 1024] {
        let call = format!("solve s --calibration c --out maps-{kilobytes} --json");
        let variables = [("RUST_MIN_STACK", "1000")];
        limited(&home.path(""), &format!("ulimit -s {kilobytes}"), &call, &variables).json();
    }
}

#[test]
fn little_memory_is_enough_or_refused() {
    let home = Home::new();
    let folder = home.path("");
    no_text(&folder, "simulate --out rig --size 400x300 --only swatch --json").json();
    for megabytes in [120, 160, 200, 240, 300, 400, 600, 1000] {
        let call = "solve rig/swatch --calibration rig/calibration --force --out maps";
        let said = limited(&folder, &format!("ulimit -v {}", megabytes * 1024), call, &[]);
        // Where there is too little it says so; it never dies of it.
        if said.status != Some(0) || said.stderr.contains("memory") {
            said.expect_failure("solve", 1, &["MB of memory, but", "ulimit -v", "--preview"]);
            assert!(megabytes < 500, "{megabytes} MB are enough: {}", said.stderr);
        }
    }
    let said = limited(
        &folder,
        "ulimit -v 500000",
        "simulate --out big --size 6000x4000 --only swatch",
        &[],
    );
    said.expect_failure("simulate", 1, &["needs about 2.", "GB of memory", "ulimit -v", "--size"]);
    // A sparse file that is as large as a picture may be, and one that claims to be.
    let sparse = fs::File::create(home.path("large.png")).unwrap();
    sparse.set_len(1 << 30).unwrap();
    let said = limited(&folder, "ulimit -v 500000", "compare large.png large.png", &[]);
    said.expect_failure("a large file", 1, &["large.png: needs 1.1 GB of memory"]);
}

#[test]
fn any_number_of_threads_gives_the_same_soon() {
    let home = Home::new();
    let solve = |out: &str, variables: &[(&str, &str)]| {
        let call = format!("solve s --calibration c --out {out}");
        limited(&home.path(""), ":", &format!("{call} --json"), variables).json();
        ["normal.exr", "albedo.exr"].map(|map| fs::read(home.path(out).join(map)).unwrap())
    };
    let expected = solve("plain", &[]);
    for (k, count) in
        ["1", "0", "-1", "many", "", "1000", "99999999999999999999"].iter().enumerate()
    {
        let found = solve(&format!("maps-{k}"), &[("RAYON_NUM_THREADS", count)]);
        assert!(found == expected, "{count}");
    }
    home.run("solve s --calibration c --out maps-t --threads 1024 --json").json();
}

#[test]
fn names_and_values_do_not_control_a_terminal() {
    let home = Home::new();
    let folder = home.path("");
    let evil = "evil\u{1b}[2J\u{202e}\u{9b}31m\n.toml";
    let run_with = |arguments: &[&str]| {
        let arguments: Vec<&OsStr> = arguments.iter().map(OsStr::new).collect();
        run(&folder, weavelight(), &arguments, &[])
    };
    let check = |said: &Said| {
        for text in [&said.stdout, &said.stderr] {
            let bad = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
            assert!(!text.contains(bad), "{text:?}");
            assert!(text.len() < 4000, "{} bytes", text.len());
        }
    };
    let missing = run_with(&["scan", "--rig", evil, "--out", "out"]);
    missing.expect_failure(
        "missing",
        1,
        &["evil\\u{1b}[2J\\u{202e}\\u{9b}31m\\n.toml: not found;"],
    );
    check(&missing);
    fs::write(home.path(evil), format!("schema = 1\nname = 5\n{} = 1\n", "k".repeat(100_000)))
        .unwrap();
    for arguments in [
        &["scan", "--rig", evil, "--out", "out"][..],
        &["scan", "--rig", evil, evil],
        &["solve", "s", "--method", evil],
        &["--color\u{1b}[2J"],
        &["import", "--lights", evil, "--out", "out"],
        &["compare", evil, evil],
        &["solve", "s", "--calibration", "c", "--out", evil],
        &["solve", "s", "--calibration", "c", "--out", evil, "--json"],
        &["doctor", "--folder", evil],
        &["doctor", "--folder", evil, "--json"],
    ] {
        check(&run_with(arguments));
    }
    home.replace("s/session.toml", "name = \"small\"", "name = \"\\u001b[2J\\u202e\"\nkin = 1");
    check(&home.run("solve s --calibration c --out maps"));
}

#[test]
fn absurd_rigs_are_refused_and_odd_ones_simulated() {
    let home = Home::new();
    let rig = |camera: &str, third: &str| {
        format!(
            "schema = 1\n[camera]\nkind = \"simulated\"\nwidth_px = 38\nheight_px = 26\n{camera}\n\
             [[lights]]\nposition_mm = [400, 0, 400]\n[[lights]]\nposition_mm = [-300, 300, 400]\n\
             [[lights]]\nposition_mm = {third}\n"
        )
    };
    const PLACE: &str = "[0, -400, 400]";
    const CALL: &str = "simulate --rig rig.toml --size 38x26 --only swatch --out sim";
    for (camera, third, expected) in [
        (
            "pixel_pitch_um = 0.00478",
            PLACE,
            "`camera.pixel_pitch_um` is 0.00478; pixels are 0.4 to 5000 micrometres: is this in millimetres?",
        ),
        ("pixel_pitch_um = 1e-9", PLACE, "`camera.pixel_pitch_um` is 1e-9"),
        ("pixel_pitch_um = 1e9", PLACE, "`camera.pixel_pitch_um` is 1e9"),
        (
            "focal_length_mm = 1e30",
            PLACE,
            "`camera.focal_length_mm` is 1e30; focal lengths are 0.5 to 10000 millimetres",
        ),
        ("focal_length_mm = 1e-300", PLACE, "`camera.focal_length_mm` is 1e-300"),
        (
            "focal_length_mm = 10000\npixel_pitch_um = 0.5\nheight_mm = 5",
            PLACE,
            "does not fit the rest",
        ),
        (
            "focal_length_mm = 0.5\npixel_pitch_um = 5000\nheight_mm = 20000",
            PLACE,
            "does not fit the rest",
        ),
        (
            "height_mm = 0.61",
            PLACE,
            "`camera.height_mm` is 0.61; cameras over the table are 5 to 20000 millimetres: is this in metres?",
        ),
        ("height_mm = 1e300", PLACE, "`camera.height_mm` is 1e300"),
        ("", "[0, -0.4, 0.4]", "`lights[2].position_mm` is a place whose distance is 0.56"),
        (
            "",
            "[0, -400, -400]",
            "`lights[2].position_mm` is a place whose z is -400; lights above the table (z = 0) are 0.1 to 20000 millimetres",
        ),
        ("", "[1e200, 0, 1e200]", "`lights[2].position_mm` is a place whose distance is "),
    ] {
        home.write("rig.toml", rig(camera, third));
        home.run(CALL).expect_failure(camera, 1, &["rig.toml:", expected]);
        home.run("scan --rig rig.toml --out s2").expect_failure(
            camera,
            1,
            &["rig.toml:", expected],
        );
    }
    for (k, camera) in [
        "focal_length_mm = 1000\npixel_pitch_um = 10\nheight_mm = 300",
        "focal_length_mm = 1.5\npixel_pitch_um = 1.0\nheight_mm = 20",
        "focal_length_mm = 100\npixel_pitch_um = 3000\nheight_mm = 10000",
    ]
    .iter()
    .enumerate()
    {
        home.write("rig.toml", rig(camera, PLACE));
        let said = run(
            &home.path(""),
            weavelight(),
            &format!("{CALL}-{k}").split_whitespace().map(OsStr::new).collect::<Vec<_>>(),
            &[],
        );
        assert_eq!(said.status, Some(0), "{camera}: {}", said.stderr);
    }
}

#[test]
fn a_light_behind_the_surface_is_named() {
    let home = Home::new();
    home.replace("c/lights.toml", "direction = [0.5, 0.0, 0.8]", "direction = [0.5, 0.0, -0.8]");
    let said = home.run("solve s --calibration c --out maps --json");
    assert!(
        said.json()["warnings"].to_string().contains("Light 0 is behind the surface"),
        "{}",
        said.stdout
    );
}

#[test]
fn maps_hold_no_nan_whatever_legal_numbers_say() {
    let finite = |home: &Home| {
        for name in names(&home.path("maps")).iter().filter(|name| name.ends_with(".exr")) {
            let exr = weavelight::raster::read_exr(&home.path("maps").join(name)).unwrap();
            for channel in ["R", "G", "B", "Y"] {
                let bad = exr.channel(channel).map(|values| values.iter().any(|v| !v.is_finite()));
                assert_ne!(bad, Some(true), "{name} {channel}");
            }
        }
    };
    let color = "schema = 1\nresponse = [0, 1]\n";
    for (file, from, to) in [
        ("s/session.toml", "exposure_s = 1.0", "exposure_s = 1e-6"),
        ("s/session.toml", "exposure_s = 1.0", "exposure_s = 86400.0"),
        ("s/session.toml", "iso = 100", "iso = 1"),
        ("s/session.toml", "iso = 100", "iso = 10000000"),
        ("c/lights.toml", "intensity = [1.0, 1.0, 1.0]", "intensity = [1e-9, 1e-9, 1e-9]"),
        ("c/lights.toml", "intensity = [1.0, 1.0, 1.0]", "intensity = [1e9, 1e-9, 1e9]"),
        (
            "c/color.toml",
            color,
            "schema = 1\nblack_level = [-1e6, 0, 0, 0]\nsaturation_level = 4.3e9\n",
        ),
        (
            "c/color.toml",
            color,
            "schema = 1\nblack_level = [0, 0, 0, 0]\nsaturation_level = 0.001\n",
        ),
        ("c/color.toml", color, "schema = 1\nresponse = [0, 100, 100, 100]\n"),
        (
            "c/color.toml",
            color,
            "schema = 1\ncamera_to_linear_srgb = [[50, -49, 0], [-50, 50, 1], [0, -49, 50]]\n",
        ),
        (
            "c/color.toml",
            color,
            "schema = 1\n[noise]\nelectrons_per_dn = 1e-6\nread_noise_e = 1e6\nkappa = 1\n",
        ),
        ("c/color.toml", color, "schema = 1\n[noise]\nelectrons_per_dn = 1e9\nread_noise_e = 0\n"),
    ] {
        for method in ["auto", "least-squares", "robust"] {
            let home = Home::new();
            let text = home.read(file);
            assert!(text.contains(from), "{from}");
            // Of one light, then of all.
            for text in [text.replacen(from, to, 1), text.replace(from, to)] {
                home.write(file, text);
                let call = "solve s --calibration c --force --residuals --out maps --method";
                let said = home.run(&format!("{call} {method}"));
                assert!(
                    said.status == Some(0) || said.stderr.starts_with("error: "),
                    "{}",
                    said.stderr
                );
                assert!(!said.stderr.contains("panicked"), "{to}: {}", said.stderr);
                if said.status == Some(0) {
                    finite(&home);
                }
            }
        }
    }
}
