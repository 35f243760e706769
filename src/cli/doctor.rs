//! `weavelight doctor`

use super::output::{Failure, Output};
use crate::device::board::PortChoice;
use crate::device::scan::{CameraFinding, diagnose_camera};
use crate::doctor::{Examination, Graphics, LightBoard, SerialPort, examine, examine_boards};
use crate::instrument::Rig;
use serde_json::json;
use std::path::PathBuf;

/// Say what of the machine and the instrument is there and usable
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  weavelight doctor\n  weavelight doctor --rig rig.toml")]
pub(super) struct Args {
    /// Folder that outputs would go to
    #[arg(long, value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Look for the light board and the camera that this rig describes, instead of any
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let rig = args.rig.as_deref().map(Rig::load).transpose().map_err(Failure::work)?;
    let examination = examine(&args.folder);
    let choice = rig.as_ref().map_or(PortChoice::Find, PortChoice::of_rig);
    let boards = examine_boards(&choice, rig.as_ref().map(|rig| rig.lights.len()));
    let mut json = serde_json::to_value(&examination).map_err(Failure::work)?;
    json["light_boards"] = serde_json::to_value(&boards).map_err(Failure::work)?;
    let cameras = diagnose_camera(rig.as_ref().zip(args.rig.as_deref()));
    let camera = |camera: &CameraFinding| json!({ "name": camera.what, "problem": camera.problem });
    json["cameras"] = cameras.iter().map(camera).collect();
    Ok(Output { text: text(&examination, &boards, &cameras), json, ..Output::default() })
}

fn text(found: &Examination, boards: &[LightBoard], cameras: &[CameraFinding]) -> String {
    let mut lines = vec![
        format!("program    {}", found.program),
        format!("boards     {}", chessboards(found)),
        format!("machine    {} cores, {}", found.cores, memory(found)),
        format!("graphics   {}", graphics(&found.graphics)),
        format!("folder     {}", folder(found)),
    ];
    if found.serial_ports.is_empty() {
        lines.push(
            "serial     no port; plug in the light controller, and see that its cable carries data"
                .to_owned(),
        );
    }
    lines.extend(found.serial_ports.iter().map(|port| format!("serial     {}", serial(port))));
    lines.extend(boards.iter().map(|board| format!("lights     {}", light_board(board))));
    lines.extend(cameras.iter().map(|camera| {
        let problem = camera.problem.as_deref().unwrap_or("is there");
        format!("camera     {}: {problem}", camera.what)
    }));
    lines.join("\n")
}

fn chessboards(found: &Examination) -> &'static str {
    if found.opencv {
        "chessboard detection built in"
    } else {
        "no chessboard detection; build with --features opencv"
    }
}

fn graphics(found: &Graphics) -> String {
    match (&found.adapter, &found.problem) {
        (Some(adapter), _) if adapter.software => {
            format!(
                "{} ({}), in software: `solve` uses it only where it measures faster",
                adapter.name, adapter.driver
            )
        }
        (Some(adapter), _) => format!("{} ({})", adapter.name, adapter.driver),
        (None, problem) => problem.clone().unwrap_or_default(),
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

fn light_board(board: &LightBoard) -> String {
    if let Some(problem) = &board.problem {
        return problem.clone();
    }
    let extras = [(board.back_light, ", back light"), (board.trigger, ", camera trigger")];
    let extras: String = extras.iter().filter(|extra| extra.0).map(|extra| extra.1).collect();
    let firmware = board.firmware.as_deref().unwrap_or("unknown");
    let lights = board.lights.unwrap_or_default();
    format!(
        "{}: light board with firmware {firmware}, {lights} lights{extras}",
        board.port.display()
    )
}
