//! The command line: parse, call, print. One file per command; each calls one library function and says what came of it.
//!
//! Exit status: 0 done, 1 the work failed, 2 the call was wrong.

mod bench;
mod calibrate;
mod calibrate_status;
mod compare;
mod demo;
mod doctor;
mod gui;
mod import;
mod mask;
mod output;
mod progress;
mod scan;
mod simulate;
mod solve;
mod target;
#[cfg(test)]
mod tests;

use crate::{files, machine};
use clap::{Parser, Subcommand};
use output::{Failure, Output};
use std::process::ExitCode;

/// Fabric scanner: normal and albedo maps from photographs under one light at a time.
#[derive(Debug, Parser)]
#[command(name = "weavelight", version, propagate_version = true, arg_required_else_help = true)]
struct Cli {
    /// Print one JSON object on standard output instead of text
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Args),
    Simulate(Box<simulate::Args>),
    Scan(Box<scan::Args>),
    Mask(mask::Args),
    Solve(solve::Args),
    Import(import::Args),
    Calibrate(calibrate::Args),
    Compare(compare::Args),
    Bench(bench::Args),
    Doctor(doctor::Args),
    Gui(gui::Args),
}

impl Command {
    fn run(&self) -> Result<Output, Failure> {
        match self {
            Command::Demo(args) => demo::run(args),
            Command::Simulate(args) => simulate::run(args),
            Command::Scan(args) => scan::run(args),
            Command::Mask(args) => mask::run(args),
            Command::Solve(args) => solve::run(args),
            Command::Import(args) => import::run(args),
            Command::Calibrate(args) => calibrate::run(args),
            Command::Compare(args) => compare::run(args),
            Command::Bench(args) => bench::run(args),
            Command::Doctor(args) => doctor::run(args),
            Command::Gui(args) => gui::run(args),
        }
    }
}

/// Runs the command that the process was called with, prints what it says, and returns the exit status.
pub fn main() -> ExitCode {
    // The first thread's stack is as small as `ulimit -s` makes it.
    match machine::spawn("command", call) {
        Ok(thread) => thread.join().unwrap_or(ExitCode::from(PANICKED)),
        Err(_) => call(),
    }
}

/// As the standard library's own status of a program that panicked.
const PANICKED: u8 = 101;

fn call() -> ExitCode {
    files::name_settings(|name| format!("--{name}"));
    machine::start();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return output::refuse(&error),
    };
    output::finish(cli.command.run(), cli.json)
}
