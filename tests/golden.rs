//! What scripts and people rely on, as stored text: `--help` of every command, `--json` of those that a small capture session
//! goes through, and `report.json`. After an intended change `SNAPSHOTS=overwrite cargo test --test golden` stores the new one; read the diff.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]

mod support;

use assert_cmd::Command;
use serde_json::Value;
use snapbox::data::DataFormat;
use snapbox::{Data, assert_data_eq};
use std::path::Path;
use support::Home;

fn stored(name: &str) -> Data {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name);
    Data::read_from(&path, Some(DataFormat::Text))
}

fn help(command: &str) -> String {
    let mut program = Command::cargo_bin("weavelight").unwrap();
    let output = program.args(command.split_whitespace()).arg("--help").output().unwrap();
    assert!(output.status.success(), "{command}");
    String::from_utf8(output.stdout).unwrap()
}

/// Names below "Commands:" in a help text.
fn commands(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = lines.take_while(|line| line.starts_with("  ")).filter_map(|line| {
        let rest = line.strip_prefix("  ").filter(|rest| !rest.starts_with(' '))?;
        rest.split(' ').next()
    });
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

#[test]
fn help_texts() {
    let top = help_of("");
    for command in commands(&top) {
        let text = help_of(&command);
        for below in commands(&text) {
            help_of(&format!("{command} {below}"));
        }
    }
}

/// The text, after comparing it with the stored one.
fn help_of(command: &str) -> String {
    let name = format!("help/weavelight {command}").trim_end().replace(' ', "-") + ".txt";
    let text = help(command);
    assert_data_eq!(text.clone(), stored(&name));
    text
}

/// Digits that do not depend on the processor's instruction set.
const DIGITS: i32 = 3;

/// What is smaller is rounding.
const LEAST: f64 = 1e-4;

/// A report without what differs from run to run: seconds, hashes, folders; numbers to three digits.
fn without_chance(value: &mut Value, key: &str) {
    match value {
        // A busy machine may take a frame again.
        Value::Array(_) if key == "retries" => *value = "[retries]".into(),
        Value::Object(map) => {
            for (name, value) in map {
                without_chance(value, if key == "seconds" { key } else { name });
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|value| without_chance(value, key)),
        Value::String(text) if key == "key" || key == "sha256" => *text = "[hash]".to_owned(),
        Value::String(text) if text.starts_with('/') => *text = "[path]".to_owned(),
        Value::Number(_) if key == "seconds" => *value = "[seconds]".into(),
        Value::Number(number) if number.is_f64() => {
            let rounded = round(number.as_f64().unwrap());
            *value = serde_json::json!(rounded);
        }
        _ => {}
    }
}

fn round(number: f64) -> f64 {
    if number.abs() < LEAST {
        return 0.0;
    }
    let places = (DIGITS - 1 - number.abs().log10().floor() as i32).max(0) as usize;
    format!("{number:.places$}").parse().unwrap()
}

fn check_json(mut value: Value, name: &str) {
    without_chance(&mut value, "");
    let text = serde_json::to_string_pretty(&value).unwrap() + "\n";
    assert_data_eq!(text, stored(&format!("json/{name}.json")));
}

#[test]
fn json() {
    let home = Home::new();
    let check = |name: &str, call: &str| check_json(home.run(call).json(), name);
    check("solve", "solve s --calibration c --out maps --json");
    check("solve-again", "solve s --calibration c --out maps --json");
    check("mask", "mask s --calibration c --json");
    check("compare-normal", "compare maps/normal.exr maps/normal.exr --json");
    check("compare-color", "compare maps/albedo.exr maps/albedo.exr --kind color --json");
    check("simulate", "simulate --out rig --preset facets --size 24x16 --only swatch --json");
    check("scan", "scan --rig rig/rig.toml --out scan --json");
    let report = serde_json::from_str(&home.read("maps/report.json")).unwrap();
    check_json(report, "report");
}
