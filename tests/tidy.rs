//! House rules as tests: which crate and which room may use which, and how long a file may be.

#![allow(clippy::unwrap_used, reason = "a test that cannot read its own tree has failed")]

#[path = "tidy/app.rs"]
mod app;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use weavelight::device::board::wire::REFUSALS;

/// A longer file must say why in a line that starts with `//! Long because`.
const LONGEST_FILE: usize = 600;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files_below(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for entry in entries.map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                open.push(entry);
            } else if entry.extension().is_some_and(|e| e == extension) {
                found.push(entry);
            }
        }
    }
    found.sort();
    found
}

/// Places in `folder` whose code (comments aside) contains one of `words`.
fn mentions(folder: &str, words: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for file in files_below(folder, "rs") {
        for (number, line) in fs::read_to_string(&file).unwrap().lines().enumerate() {
            let code = !line.trim_start().starts_with("//");
            if code && words.iter().any(|word| line.contains(word)) {
                found.push(format!("{}:{}: {}", file.display(), number + 1, line.trim()));
            }
        }
    }
    found
}

fn expect_none(rule: &str, found: &[String]) {
    assert!(found.is_empty(), "{rule}:\n{}", found.join("\n"));
}

#[test]
fn crates_depend_one_way() {
    let check = |manifest: &str, forbidden: &[&str]| {
        let text = fs::read_to_string(root().join(manifest)).unwrap();
        let table: toml::Table = toml::from_str(&text).unwrap();
        for section in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let Some(dependencies) = table.get(section).and_then(|s| s.as_table()) else {
                continue;
            };
            for name in forbidden {
                assert!(
                    !dependencies.contains_key(*name),
                    "{manifest}: {section} must not name {name}"
                );
            }
        }
    };
    let windows = ["egui", "eframe", "egui_extras", "egui_plot", "rfd"];
    let ours = ["weavelight-sim", "weavelight", "weavelight-app", "weavelight-tether"];
    check("calibration/Cargo.toml", &[&windows[..], &ours[..]].concat());
    check("sim/Cargo.toml", &[&windows[..], &ours[1..], &["opencv"]].concat());
    check("Cargo.toml", &[&windows[..], &ours[2..], &["opencv", "gphoto2"]].concat());
    check("tether/Cargo.toml", &[&windows[..], &ours[2..], &["opencv"]].concat());
}

#[test]
fn the_simulator_takes_descriptions_only() {
    let found: Vec<String> = mentions("sim/src", &["weavelight_calibration"])
        .into_iter()
        .filter(|place| !place.contains("weavelight_calibration::description"))
        .collect();
    expect_none("sim may use weavelight_calibration::description and nothing else of it", &found);
}

#[test]
fn opencv_stays_in_one_module() {
    let modules: BTreeSet<String> = ["calibration/src", "sim/src", "src"]
        .iter()
        .flat_map(|folder| mentions(folder, &["opencv::"]))
        // Our own modules named after its presence or absence are not the library.
        .filter(|place| !place.contains("_opencv::"))
        // A module is its file and the folder of the same name.
        .filter_map(|place| {
            let file = place.split(':').next()?.strip_suffix(".rs")?.to_owned();
            let below =
                file.split_once("/chessboard/").map(|(above, _)| format!("{above}/chessboard"));
            Some(below.unwrap_or(file))
        })
        .collect();
    assert!(modules.len() <= 1, "OpenCV is used in more than one module: {modules:?}");
}

#[test]
fn graphics_processors_stay_in_one_room() {
    let found: Vec<String> = mentions("src", &["wgpu::", "bytemuck::"])
        .into_iter()
        .filter(|place| !place.contains("src/gpu/"))
        .collect();
    expect_none("only src/gpu speaks to graphics processors", &found);
}

/// Every room of `src` from the ground up, and the rooms that it may use: rooms before it, and no others. A room that is not
/// here fails.
const ROOMS: &[(&str, &[&str])] = &[
    ("quantity", &[]),
    ("files", &["quantity"]),
    ("machine", &["files"]),
    ("raster", &["files", "machine"]),
    ("raw", &["raster"]),
    ("instrument", &["files", "quantity", "raster", "raw"]),
    ("session", &["files", "instrument", "quantity", "raster", "raw"]),
    ("photometry", &[]),
    ("linear", &["instrument", "photometry", "raw"]),
    ("solution", &["files", "instrument", "photometry", "quantity"]),
    ("albedo", &[]),
    ("gpu", &["files", "machine", "photometry"]),
    ("simulate", &["files", "instrument", "machine", "quantity", "raster", "session"]),
    ("swatch", &["photometry", "solution"]),
    (
        "solve",
        &[
            "albedo",
            "files",
            "gpu",
            "instrument",
            "linear",
            "machine",
            "photometry",
            "quantity",
            "raster",
            "raw",
            "session",
            "solution",
            "swatch",
        ],
    ),
    ("settings", &["files", "gpu", "machine", "photometry", "solution", "solve"]),
    ("live", &["instrument", "linear", "photometry", "raw", "solution", "solve"]),
    ("compare", &["files", "raster"]),
    ("calibrate", &["files", "instrument", "linear", "raw", "session"]),
    // The simulated camera photographs with the simulated rig's instrument.
    (
        "device",
        &["files", "instrument", "linear", "machine", "raster", "raw", "session", "simulate"],
    ),
    ("doctor", &["device", "files", "gpu"]),
    ("report", &["compare", "raster", "solution", "solve"]),
    ("demo", &["compare", "report", "simulate", "solution", "solve"]),
    (
        "bench",
        &[
            "albedo",
            "compare",
            "files",
            "gpu",
            "photometry",
            "raw",
            "simulate",
            "solution",
            "solve",
        ],
    ),
    (
        "cli",
        &[
            "bench",
            "calibrate",
            "compare",
            "demo",
            "device",
            "doctor",
            "files",
            "instrument",
            "machine",
            "photometry",
            "quantity",
            "report",
            "session",
            "settings",
            "simulate",
            "solution",
            "solve",
            "swatch",
        ],
    ),
];

/// Code without comments and without what is compiled for tests only.
fn product(text: &str) -> String {
    let mut code = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.trim_start().starts_with("#[cfg(test)]")
            || line.trim_start().starts_with("#[cfg(all(test")
        {
            match lines.next() {
                // A file of its own, which is passed over by its name.
                Some(module) if module.trim_end().ends_with(';') => continue,
                _ => break,
            }
        }
        code.push_str(line.split("//").next().unwrap());
        code.push('\n');
    }
    code
}

fn is_of_tests(path: &Path) -> bool {
    let stem = path.file_stem().unwrap().to_string_lossy();
    path.components().any(|part| part.as_os_str() == "tests")
        || stem.ends_with("tests")
        || stem == "round_trip"
}

/// The first names after `crate::`, braces and all.
fn names_below_crate(code: &str) -> BTreeSet<String> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let first =
        |text: &str| text.trim_start().chars().take_while(|c| is_name(*c)).collect::<String>();
    let mut found = BTreeSet::new();
    for rest in code.split("crate::").skip(1) {
        let Some(list) = rest.strip_prefix('{') else {
            found.insert(first(rest));
            continue;
        };
        let (mut depth, mut begin) = (1, 0);
        for (at, c) in list.char_indices() {
            depth += i32::from(c == '{') - i32::from(c == '}');
            if depth == 0 || (depth == 1 && c == ',') {
                found.insert(first(&list[begin..at]));
                begin = at + 1;
            }
            if depth == 0 {
                break;
            }
        }
    }
    found
}

#[test]
fn rooms_use_only_the_rooms_that_they_may() {
    let position = |room: &str| ROOMS.iter().position(|(name, _)| *name == room);
    let mut found = Vec::new();
    for (at, (room, allowed)) in ROOMS.iter().enumerate() {
        assert!(root().join("src").join(room).is_dir(), "no room {room}");
        for other in *allowed {
            assert!(
                position(other).is_some_and(|below| below < at),
                "{room} stands before {other}"
            );
        }
    }
    for file in files_below("src", "rs") {
        let path = file.strip_prefix(root().join("src")).unwrap();
        if is_of_tests(path) || path.components().count() < 2 {
            continue;
        }
        let room = path.components().next().unwrap().as_os_str().to_string_lossy();
        let Some(at) = position(&room) else { panic!("src/{room} is not in the table of rooms") };
        for name in names_below_crate(&product(&fs::read_to_string(&file).unwrap())) {
            let known = position(&name).is_some() && name != room;
            if known && !ROOMS[at].1.contains(&name.as_str()) {
                found.push(format!("{} uses {name}", path.display()));
            }
        }
    }
    expect_none("rooms that use others than their row allows", &found);
}

#[test]
fn names_are_read_through_braces() {
    let code = "use crate::files::{self, x};\nuse crate::{raw::{self, a}, solve, machine::spawn};\nlet _ = crate::gpu::open();";
    let names: Vec<String> = names_below_crate(code).into_iter().collect();
    assert_eq!(names, ["files", "gpu", "machine", "raw", "solve"]);
    assert_eq!(
        product("a // b\n#[cfg(test)]\nmod tests;\nc\n#[cfg(test)]\nmod tests {\nd"),
        "a \nc\n"
    );
}

/// A named pipe makes a plain read wait for ever, `/dev/zero` makes it fill the memory.
#[test]
fn inputs_are_opened_in_one_place() {
    let words = ["fs::read(", "fs::read_to_string(", "File::open(", "fs::copy(", "OpenOptions::"];
    let mut found = Vec::new();
    for file in
        ["src", "app/src", "tether/src", "sim/src"].iter().flat_map(|f| files_below(f, "rs"))
    {
        let path = file.strip_prefix(root()).unwrap().to_owned();
        let test = path.components().any(|part| part.as_os_str() == "tests")
            || path.file_stem().is_some_and(|name| name.to_string_lossy().ends_with("tests"));
        if test || path.starts_with("src/files") {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let code = code.split("#[cfg(all(test").next().unwrap();
        for (number, line) in code.lines().enumerate() {
            if words.iter().any(|word| line.contains(word)) && !line.trim_start().starts_with("//")
            {
                found.push(format!("{}:{}: {}", path.display(), number + 1, line.trim()));
            }
        }
    }
    expect_none(
        "read through files::{read_input, read_input_text, open_input, copy_input}",
        &found,
    );
}

#[test]
fn the_kernels_do_no_input_or_output() {
    let words = ["std::fs", "std::io", "std::thread", "std::time", "rayon", "tracing::"];
    // Their tests may read pictures.
    let kernels = |folder: &str| -> Vec<String> {
        mentions(folder, &words)
            .into_iter()
            .filter(|place| !place.contains("/tests/") && !place.contains("tests.rs:"))
            .collect()
    };
    expect_none("src/photometry: data in, data out", &kernels("src/photometry"));
    expect_none("calibration: data in, data out", &kernels("calibration/src"));
}

#[test]
fn nobody_asks_whether_the_instrument_is_simulated() {
    for folder in ["calibration/src", "src"] {
        expect_none(
            "an implementation behind a trait is not asked what it is",
            &mentions(folder, &["fn is_simulated"]),
        );
    }
}

#[test]
fn no_file_is_longer_than_agreed_without_a_reason() {
    let mut long = Vec::new();
    for folder in ["calibration/src", "sim/src", "src", "app", "tether", "tests"] {
        for file in files_below(folder, "rs") {
            let text = fs::read_to_string(&file).unwrap();
            let lines = text.lines().count();
            if lines > LONGEST_FILE && !text.contains("//! Long because") {
                long.push(format!("{}: {lines} lines", file.display()));
            }
        }
    }
    expect_none("files over 600 lines", &long);
}

#[test]
fn error_numbers_agree_in_protocol_firmware_and_host() {
    let protocol = include_str!("../firmware/PROTOCOL.md");
    let firmware = include_str!("../firmware/weavelight/protocol.h");
    let section = protocol.split("## Errors").nth(1).unwrap().split("##").next().unwrap();
    for (refusal, name) in REFUSALS {
        let number = refusal as u8;
        assert!(
            section.contains(&format!("| {number} | {name} |")),
            "PROTOCOL.md: {number} {name}"
        );
        assert!(
            firmware.contains(&format!("ERROR_{name} = {number},")),
            "protocol.h: {number} {name}"
        );
    }
    assert_eq!(
        section.lines().filter(|line| line.starts_with("| ")).count(),
        REFUSALS.len() + 2,
        "PROTOCOL.md"
    );
    assert_eq!(firmware.matches("    ERROR_").count(), REFUSALS.len() + 1, "protocol.h");
}

/// docs/attacks.md names tests and places; what it names must be there.
#[test]
fn the_table_of_attacks_names_what_is_there() {
    let text = fs::read_to_string(root().join("docs/attacks.md")).unwrap();
    let code: String = ["src", "tests", "app", "calibration", "sim", "tether"]
        .iter()
        .flat_map(|folder| files_below(folder, "rs"))
        .map(|file| fs::read_to_string(file).unwrap())
        .collect();
    let rows =
        text.lines().filter(|line| line.starts_with("| ") && line.matches(" | ").count() == 3);
    let mut count = 0;
    for row in rows.filter(|row| row.contains('`')) {
        let [.., places, tests] = row.split(" | ").collect::<Vec<_>>()[..] else { continue };
        for name in tests.split('`').skip(1).step_by(2) {
            assert!(code.contains(&format!("fn {name}(")), "no test {name}: {row}");
        }
        for place in places.split('`').skip(1).step_by(2).filter(|place| !place.contains('{')) {
            let parts = place.split('/').count();
            let there = parts == 1 || root().join(place).exists();
            assert!(there, "no {place}: {row}");
        }
        count += 1;
    }
    assert!(count > 60, "{count} rows");
}

/// The window shows the library's messages too. What a user can set is a `files::Setting`, which every interface words itself.
#[test]
fn only_the_command_line_names_its_options() {
    let mut found = Vec::new();
    for folder in ["src", "calibration/src", "sim/src", "app/src"] {
        for file in files_below(folder, "rs") {
            let path = file.strip_prefix(root()).unwrap();
            if path.starts_with("src/cli") || is_of_tests(path) {
                continue;
            }
            let code = product(&fs::read_to_string(&file).unwrap());
            for line in code.lines().filter(|line| line.contains("\"--") || line.contains(" --")) {
                let names = |rest: &str| rest.starts_with(|c: char| c.is_ascii_lowercase());
                if line.split("--").skip(1).any(names) {
                    found.push(format!("{}: {}", path.display(), line.trim()));
                }
            }
        }
    }
    expect_none("messages that name options of the command line", &found);
}
