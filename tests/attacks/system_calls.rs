//! Kills and failures at chosen system calls: what stood before is there whole, or what is new is; the next run works and leaves
//! nothing behind. Needs `strace`.

use crate::bench::{
    Bench, check_manners, check_whole, content, copy, leftovers, program, run_in, spawn, wait,
};
use crate::tries;
use std::path::Path;
use std::process::{Command, Stdio};

/// A command that writes `out`, and what it reads.
struct Writer {
    call: &'static str,
    reads: &'static [&'static str],
    /// What stands at `out` before.
    before: Option<&'static str>,
}

const WRITERS: [Writer; 4] = [
    Writer {
        call: "solve rig/swatch --calibration rig/calibration --out out --force",
        reads: &["rig"],
        before: Some(
            "solve rig/swatch --calibration rig/calibration --out out --method least-squares",
        ),
    },
    Writer {
        call: "solve rig/swatch --calibration rig/calibration --out out",
        reads: &["rig"],
        before: None,
    },
    Writer {
        call: "import --lights pictures/lights.lp --mask pictures/mask.png --out out",
        reads: &["pictures"],
        before: None,
    },
    Writer {
        call: "simulate --size 38x26 --only swatch --preset denim --out out",
        reads: &[],
        before: Some("simulate --size 38x26 --only swatch --out out"),
    },
];
/// System calls by which files and folders change.
const CHANGES: [&str; 9] =
    ["openat", "write", "renameat2", "rename", "fsync", "unlink", "unlinkat", "mkdir", "rmdir"];
/// Failures that a system gives.
const ERRORS: [(&str, &str); 8] = [
    ("write", "ENOSPC"),
    ("write", "EIO"),
    ("openat", "EMFILE"),
    ("openat", "EACCES"),
    ("fsync", "EIO"),
    ("renameat2", "EACCES"),
    ("rename", "EXDEV"),
    ("mkdir", "ENOSPC"),
];

/// The writes with which a run ends are its words, on standard output and standard error.
const LAST_WORDS: usize = 3;

/// Whether to go on: not where a variable says to leave these tests out.
///
/// # Panics
/// Where strace is missing or may not trace.
fn can_trace() -> bool {
    if std::env::var_os("WEAVELIGHT_SKIP_STRACE").is_some() {
        return false;
    }
    let traced = Command::new("strace")
        .args(["-qq", "-o", "/dev/null", "true"])
        .stdout(Stdio::null())
        .status();
    assert!(
        traced.is_ok_and(|status| status.success()),
        "strace is missing or may not trace here (a container needs --cap-add=SYS_PTRACE); WEAVELIGHT_SKIP_STRACE=1 leaves these tests out"
    );
    true
}

/// The program under strace; `inject` as strace's option reads it.
fn under_strace(folder: &Path, call: &str, inject: &str) -> crate::bench::Ended {
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-o", "/dev/null", "-e", "signal=none", "-e", inject]);
    command.arg(program()).args(call.split_whitespace());
    wait(spawn(command, folder), call)
}

/// How often each system call occurs in a run.
fn occurrences(folder: &Path, call: &str) -> Vec<(String, usize)> {
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-o", "calls", "-e"]).arg(format!("trace={}", CHANGES.join(",")));
    command.arg(program()).args(call.split_whitespace());
    assert!(wait(spawn(command, folder), call).status.success(), "{call}");
    let calls = std::fs::read_to_string(folder.join("calls")).unwrap();
    std::fs::remove_file(folder.join("calls")).unwrap();
    let count = |name: &str| calls.matches(&format!(" {name}(")).count();
    CHANGES.iter().map(|name| ((*name).to_owned(), count(name))).filter(|(_, n)| *n > 0).collect()
}

/// A home for one try.
fn prepare(bench: &Bench, writer: &Writer) -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    for folder in writer.reads {
        copy(&bench.path(folder), &home.path().join(folder));
    }
    if let Some(call) = writer.before {
        let ended = run_in(home.path(), call);
        assert!(ended.status.success(), "{call}: {}", ended.said);
    }
    home
}

/// What must hold after a run that was cut short: the output is the old one, the new one, or none where there was none; and the
/// same call then works and leaves nothing beside it.
fn check_after(home: &Path, writer: &Writer) -> Result<(), String> {
    let out = home.join("out");
    if out.exists() {
        check_whole(&out)?;
    } else if writer.before.is_some() {
        return Err("the earlier output is gone".to_owned());
    }
    let ended = run_in(home, writer.call);
    // A finished import is not replaced.
    let there = ended.said.contains("holds") && writer.before.is_none();
    if !ended.status.success() && !there {
        return Err(format!("the next run failed: {}", ended.said));
    }
    check_whole(&out)?;
    let left = leftovers(home);
    if left.is_empty() { Ok(()) } else { Err(format!("left {left:?}")) }
}

fn report(kind: &str, count: usize, failures: &[String]) {
    println!("{count} {kind}, {} failed", failures.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn kills_at_system_calls() {
    if !can_trace() {
        return;
    }
    let bench = Bench::new();
    let (mut done, mut failures) = (0, Vec::new());
    let each = tries("WEAVELIGHT_KILLS_PER_CALL", 1);
    for writer in &WRITERS {
        let home = prepare(&bench, writer);
        for (name, count) in occurrences(home.path(), writer.call) {
            for k in 0..each.min(count) {
                // Spread over the run, the last ones first: there the output takes its place.
                let when = count - k * count / each.min(count);
                let home = prepare(&bench, writer);
                under_strace(
                    home.path(),
                    writer.call,
                    &format!("inject={name}:signal=KILL:when={when}"),
                );
                done += 1;
                if let Err(why) = check_after(home.path(), writer) {
                    failures.push(format!("{}: killed at {name} {when}: {why}", writer.call));
                }
            }
        }
    }
    report("kills", done, &failures);
}

#[test]
fn failing_system_calls() {
    if !can_trace() {
        return;
    }
    let bench = Bench::new();
    let (mut done, mut failures) = (0, Vec::new());
    let each = tries("WEAVELIGHT_ERRORS_PER_CALL", 1);
    for writer in &WRITERS {
        let home = prepare(&bench, writer);
        let counts = occurrences(home.path(), writer.call);
        for (name, error) in ERRORS {
            let Some((_, count)) = counts.iter().find(|(call, _)| call == name) else { continue };
            for k in 0..each.min(*count) {
                let when = count - k * count / each.min(*count);
                // Once, or for good: a full disk stays full.
                let more = if k % 2 == 0 { "" } else { "+" };
                let home = prepare(&bench, writer);
                let before = content(&home.path().join("out"));
                let inject = format!("inject={name}:error={error}:when={when}{more}");
                let ended = under_strace(home.path(), writer.call, &inject);
                // The program was not even loaded.
                if ended.said.contains("error while loading shared libraries") {
                    continue;
                }
                done += 1;
                // Where no write succeeds, the result and the error cannot be printed either.
                let is_mute = name == "write" && (!more.is_empty() || when + LAST_WORDS > *count);
                let kept = is_mute || content(&home.path().join("out")) == before;
                let manners = match ended.status.success() || kept || before.is_empty() {
                    true if is_mute && ended.said.is_empty() => Ok(()),
                    true => check_manners(&ended),
                    false => Err("a failed run changed the earlier output".to_owned()),
                };
                if let Err(why) = manners.and_then(|()| check_after(home.path(), writer)) {
                    failures.push(format!("{}: {inject}: {why}", writer.call));
                }
            }
        }
    }
    report("injected errors", done, &failures);
}
