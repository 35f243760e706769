//! What a command says, and where.

use crate::files::{harmless, harmless_json, one_line};
use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

/// Characters of one message: names of files and what is in them may be any length.
const LONGEST: usize = 1500;

/// Exit status of work that failed.
pub(super) const WORK_FAILED: u8 = 1;
/// Exit status of a call that was wrong.
pub(super) const CALL_WRONG: u8 = 2;

/// What a command that did its work has to say.
#[derive(Debug, Default)]
pub(super) struct Output {
    /// For people, on standard output.
    pub(super) text: String,
    /// For programs: one object, on standard output with `--json`.
    pub(super) json: serde_json::Value,
    /// Sentences, on standard error either way.
    pub(super) warnings: Vec<String>,
    /// Exit status; 0 but for commands that pass on another program's.
    pub(super) status: u8,
}

/// Why a command did not do its work.
#[derive(Debug)]
pub(super) struct Failure {
    message: String,
    status: u8,
}

impl Failure {
    /// The call was right, but the work failed.
    pub(super) fn work(error: impl Display) -> Self {
        Self { message: error.to_string(), status: WORK_FAILED }
    }

    /// The call was wrong.
    pub(super) fn call(error: impl Display) -> Self {
        Self { message: error.to_string(), status: CALL_WRONG }
    }
}

/// Prints and returns the exit status.
pub(super) fn finish(result: Result<Output, Failure>, json: bool) -> ExitCode {
    match result {
        Ok(output) => {
            for warning in &output.warnings {
                to_stderr(&format!("warning: {}", one_line(warning, LONGEST)));
            }
            let printed = if json {
                to_stdout(&harmless_json(&output.json.to_string()))
            } else {
                to_stdout(&harmless(&output.text))
            };
            let Err(error) = printed else { return ExitCode::from(output.status) };
            to_stderr(&format!("error: the work is done, but its result was not printed: {error}"));
            ExitCode::from(WORK_FAILED)
        }
        Err(failure) => {
            to_stderr(&format!("error: {}", one_line(&failure.message, LONGEST)));
            ExitCode::from(failure.status)
        }
    }
}

/// Says what is wrong with a call, in two lines, or gives the help that was asked for.
pub(super) fn refuse(error: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind;
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let printed = to_stdout(&error.render().to_string());
            ExitCode::from(if printed.is_ok() { 0 } else { WORK_FAILED })
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            to_stderr(&error.render().to_string());
            ExitCode::from(CALL_WRONG)
        }
        // The values that were given are in it.
        _ => {
            to_stderr(&in_two_lines(&harmless(&error.render().to_string())));
            ExitCode::from(CALL_WRONG)
        }
    }
}

/// The first paragraph of a message, which says what is wrong, and its usage.
fn in_two_lines(message: &str) -> String {
    let paragraph: Vec<&str> =
        message.lines().take_while(|line| !line.is_empty()).map(str::trim).collect();
    let usage = message
        .lines()
        .find(|line| line.starts_with("Usage:"))
        .unwrap_or("Try `weavelight --help`");
    format!("{}\n{usage}; see --help", one_line(&paragraph.join(" "), LONGEST))
}

/// A reader that stopped listening (`weavelight ... | head`) is no failure.
fn to_stdout(text: &str) -> io::Result<()> {
    let text = text.trim_end();
    if text.is_empty() {
        return Ok(());
    }
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

fn to_stderr(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", text.trim_end());
}
