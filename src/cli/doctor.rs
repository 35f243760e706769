//! `weavelight doctor`

use super::output::{Failure, Output};
use crate::doctor::{Examination, SerialPort, examine};
use std::path::PathBuf;

/// Say what of the machine and the instrument is there and usable
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  weavelight doctor")]
pub(super) struct Args {
    /// Folder that outputs would go to
    #[arg(long, value_name = "DIR", default_value = ".")]
    folder: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let examination = examine(&args.folder);
    Ok(Output {
        text: text(&examination),
        json: serde_json::to_value(&examination).map_err(Failure::work)?,
        ..Output::default()
    })
}

fn text(found: &Examination) -> String {
    let mut lines = vec![
        format!("program    {}", found.program),
        format!("boards     {}", chessboards(found)),
        format!("machine    {} cores, {}", found.cores, memory(found)),
        format!("folder     {}", folder(found)),
    ];
    if found.serial_ports.is_empty() {
        lines.push(
            "serial     no port; plug in the light controller, and see that its cable carries data"
                .to_owned(),
        );
    }
    lines.extend(found.serial_ports.iter().map(|port| format!("serial     {}", serial(port))));
    lines.push("camera     tethered cameras are not part of this version; copy frames into a capture session".to_owned());
    lines.join("\n")
}

fn chessboards(found: &Examination) -> &'static str {
    if found.opencv {
        "chessboard detection built in"
    } else {
        "no chessboard detection; build with --features opencv"
    }
}

fn memory(found: &Examination) -> String {
    match found.available_memory_mb {
        Some(free) => format!("{free} MB of memory free (a full-size solve takes about 1200)"),
        None => "free memory unknown".to_owned(),
    }
}

fn folder(found: &Examination) -> String {
    let path = found.folder.display();
    let space = found
        .free_space_mb
        .map_or_else(|| "free space unknown".to_owned(), |free| format!("{free} MB free"));
    match &found.write_error {
        None => format!("{path} can be written, {space}"),
        Some(error) => {
            format!("{path} cannot be written ({error}); choose another or change its permissions")
        }
    }
}

fn serial(port: &SerialPort) -> String {
    let path = port.path.display();
    if port.usable {
        format!("{path} may be opened")
    } else {
        format!("{path} may not be opened; run `sudo usermod -aG dialout $USER` and log in again")
    }
}
