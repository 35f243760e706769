//! The README says what the program does, no more and no less.
#![allow(clippy::unwrap_used, reason = "a test that cannot read its own tree has failed")]

use assert_cmd::Command;
use std::collections::BTreeSet;
use std::path::Path;

fn readme() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap()
}

/// First words of the lines between "Commands:" and the next heading of `--help`.
fn commands() -> BTreeSet<String> {
    let output = Command::cargo_bin("weavelight").unwrap().arg("--help").output().unwrap();
    let help = String::from_utf8(output.stdout).unwrap();
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = lines.take_while(|line| line.starts_with("  ")).filter_map(|line| {
        line.strip_prefix("  ")
            .filter(|rest| !rest.starts_with(' '))
            .and_then(|rest| rest.split(' ').next())
    });
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

#[test]
fn the_table_of_commands_is_that_of_the_help() {
    let rows: BTreeSet<String> = readme()
        .lines()
        .filter_map(|line| line.strip_prefix("| `weavelight "))
        .filter_map(|rest| rest.split('`').next().map(str::to_owned))
        .collect();
    assert!(!rows.is_empty());
    assert_eq!(rows, commands());
}

#[test]
fn its_pictures_are_there() {
    let text = readme();
    let pictures: Vec<&str> = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .filter(|link| !link.contains("://"))
        .collect();
    assert!(!pictures.is_empty());
    for link in pictures {
        let file = link.split('#').next().unwrap();
        assert!(
            Path::new(env!("CARGO_MANIFEST_DIR")).join(file).exists(),
            "README.md links {file}, which is not there"
        );
    }
}

/// Help texts of every command and of the commands below it, in one.
fn all_help() -> String {
    let help = |command: &[&str]| {
        let mut program = Command::cargo_bin("weavelight").unwrap();
        let output = program.args(command).arg("--help").output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let below = ["camera", "color", "lights", "check", "status"];
    let mut all: String = commands().iter().map(|command| help(&[command.as_str()])).collect();
    below.iter().for_each(|part| all.push_str(&help(&["calibrate", part])));
    all
}

/// Options in a text, on lines that are not about other programs.
fn options(text: &str) -> BTreeSet<String> {
    let others = ["cargo ", "make ", "SEEDS=", "apt ", "ulimit", "--features"];
    let lines = text.lines().filter(|line| !others.iter().any(|other| line.contains(other)));
    let words = lines.flat_map(|line| line.split(|c: char| !c.is_ascii_alphanumeric() && c != '-'));
    let options = words.filter(|word| word.starts_with("--") && word.len() > 3);
    options.filter(|word| word.as_bytes()[2].is_ascii_lowercase()).map(str::to_owned).collect()
}

#[test]
fn every_option_that_the_documents_name_is_there() {
    let help = options(&all_help());
    for name in ["README.md", "docs/scanning.md", "docs/calibration.md", "docs/formats.md"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let named = options(&std::fs::read_to_string(path).unwrap());
        let unknown: Vec<&String> = named.difference(&help).collect();
        assert!(unknown.is_empty(), "{name}: {unknown:?}");
    }
}
