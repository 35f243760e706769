//! `weavelight gui`

use super::output::{Failure, Output};
use std::process::Command;

/// The desktop app's executable, beside this one.
const APP: &str = "weavelight-app";

/// Start the desktop app
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  weavelight gui")]
pub(super) struct Args {}

pub(super) fn run(_args: &Args) -> Result<Output, Failure> {
    let here = std::env::current_exe().map_err(Failure::work)?;
    let app = here.with_file_name(format!("{APP}{}", std::env::consts::EXE_SUFFIX));
    if !app.is_file() {
        let what = "the desktop app is not there; build it with `make build`, which puts it beside this program";
        return Err(Failure::work(format!("{}: {what}", app.display())));
    }
    let status = Command::new(&app).status().map_err(|error| {
        Failure::work(format!("{}: cannot be started ({error}); build it again", app.display()))
    })?;
    let status = status
        .code()
        .and_then(|code| u8::try_from(code).ok())
        .unwrap_or(super::output::WORK_FAILED);
    Ok(Output {
        status,
        json: serde_json::json!({ "app": app, "status": status }),
        ..Output::default()
    })
}
