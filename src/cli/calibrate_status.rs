//! `weavelight calibrate status` of a rig's folder: what the window's wizard has done there, and what it would do next.

use super::output::{Failure, Output};
use super::progress::Progress;
use crate::calibrate::wizard::{
    BOARD_SESSION, BOARDS, GREY_SESSION, Memory, Pose, RIG_FILE, RigFolder, State, Step, Task, read,
};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// The wizard's state, as `--json` prints it.
#[derive(Debug, Serialize)]
struct Wizard {
    /// Pictures in which the chessboard was found.
    boards: usize,
    /// As many are needed.
    boards_wanted: usize,
    /// Whether the chart is photographed.
    chart: bool,
    /// Capture sessions of white sheets that are complete, below `targets`.
    sheets: Vec<String>,
    /// Whether the check passed; absent before it.
    check_passed: Option<bool>,
    /// What to do next, in words.
    next: String,
    /// The command that does it; absent where nothing is left.
    command: Option<String>,
}

/// Whether the wizard's state belongs to this folder: it holds a rig.
pub(super) fn is_rig(folder: &Path) -> bool {
    folder.join(RIG_FILE).is_file()
}

/// The state of the calibration in a rig's folder. `describe` words the part that a calibration folder alone has, too.
pub(super) fn run(
    folder: &Path,
    describe: impl Fn(&crate::calibrate::Status) -> String,
) -> Result<Output, Failure> {
    let home = RigFolder::open(folder).map_err(Failure::work)?;
    let bar = Progress::new();
    let progress = |share: f64, what: &str| bar.set(share, what);
    let state = read(&home, &mut Memory::default(), &progress).map_err(Failure::work)?;
    let wizard = wizard(&state, folder);
    let mut json = serde_json::to_value(&state.status).unwrap_or_default();
    json["wizard"] = serde_json::to_value(&wizard).unwrap_or_default();
    let text = describe(&state.status) + &text(&state, &wizard);
    let mut warnings = Vec::new();
    if !state.sees_chessboards {
        warnings.push("this build cannot detect chessboards, so that none is counted".to_owned());
    }
    Ok(Output { text, json, warnings, status: 0 })
}

fn wizard(state: &State, folder: &Path) -> Wizard {
    let task = state.next();
    Wizard {
        boards: state.boards[1],
        boards_wanted: BOARDS,
        chart: state.chart,
        sheets: state.sheets.iter().map(|pose| pose.folder()).collect(),
        check_passed: state.verdict.as_ref().map(|verdict| verdict.passed),
        next: words(task),
        command: command(task, folder),
    }
}

fn text(state: &State, wizard: &Wizard) -> String {
    let mut text = String::new();
    let lost = state.boards[0] - state.boards[1];
    let _ = writeln!(
        text,
        "pictures: {} of {BOARDS} of the chessboard ({lost} without one), chart {}, {} of {} white sheets",
        wizard.boards,
        if wizard.chart { "done" } else { "missing" },
        Pose::FIT.iter().filter(|pose| state.sheets.contains(pose)).count(),
        Pose::FIT.len(),
    );
    let check = match wizard.check_passed {
        None => "not done",
        Some(true) => "passed",
        Some(false) => "failed",
    };
    let _ = writeln!(text, "check: {check}");
    let _ = writeln!(text, "wizard: {}", wizard.next);
    if let Some(command) = &wizard.command {
        let _ = writeln!(text, "  {command}");
    }
    text
}

/// What a task asks for.
fn words(task: Task) -> String {
    match task {
        Task::Table => "photograph the chessboard flat in the middle of the table".to_owned(),
        Task::Board => "photograph the chessboard tilted by 20 to 40 degrees".to_owned(),
        Task::Chart => "photograph the grey or colour chart".to_owned(),
        Task::Sheet(Pose::Flat) => "photograph the white sheet flat on the table".to_owned(),
        Task::Sheet(pose) => {
            let placement = pose.placement();
            match placement.tilt_deg > 0.0 {
                true => format!(
                    "photograph the white sheet tilted by {} degrees, facing {} degrees (0 is the picture's right, 90 its top)",
                    placement.tilt_deg, placement.faces_deg
                ),
                false => format!("photograph the white sheet raised by {} mm", placement.height_mm),
            }
        }
        Task::Fit(Step::Check) => "check the calibration".to_owned(),
        Task::Fit(step) => format!("calibrate {}", name(step)),
        Task::Done => "nothing is left to do".to_owned(),
    }
}

/// The step as the command line calls it.
fn name(step: Step) -> &'static str {
    match step {
        Step::Camera => "camera",
        Step::Color => "color",
        Step::Lights => "lights",
        Step::Check => "check",
    }
}

/// The command that does a task; what only the user knows stands in capitals.
fn command(task: Task, folder: &Path) -> Option<String> {
    let at = |path: &str| quoted(&folder.join(path));
    let rig = at(RIG_FILE);
    let targets = |name: &str| at(&format!("targets/{name}"));
    let scan = |rest: &str| Some(format!("weavelight scan --rig {rig} {rest}"));
    match task {
        Task::Table | Task::Board => {
            let pose = if task == Task::Table { "table" } else { "free" };
            let out = targets(BOARD_SESSION);
            scan(&format!("--kind board --board CxRxMM --pose {pose} --out {out}"))
        }
        Task::Chart => {
            scan(&format!("--kind grey --target CHART.toml --out {}", targets(GREY_SESSION)))
        }
        Task::Sheet(Pose::Flat) => {
            scan(&format!("--kind white --out {}", targets(&Pose::Flat.folder())))
        }
        Task::Sheet(Pose::Raised) => {
            let height_mm = Pose::Raised.placement().height_mm;
            let out = targets(&Pose::Raised.folder());
            scan(&format!("--kind white --thickness-mm {height_mm} --out {out}"))
        }
        Task::Sheet(pose) => {
            scan(&format!("--kind white --board CxRxMM --out {}", targets(&pose.folder())))
        }
        Task::Fit(Step::Check) => Some(format!(
            "weavelight calibrate check {} {}",
            at("calibration"),
            targets(&Pose::Check.folder())
        )),
        Task::Fit(step) => {
            let sessions: Vec<String> = step.folders().iter().map(|name| targets(name)).collect();
            let (step, sessions) = (name(step), sessions.join(" "));
            let out = at("calibration");
            Some(format!("weavelight calibrate {step} --rig {rig} {sessions} --out {out}"))
        }
        Task::Done => None,
    }
}

/// A path as a shell reads it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-~".contains(c);
    match text.chars().all(plain) {
        true => text,
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_has_its_command() {
        let check = |task: Task, expected: &str| {
            assert_eq!(command(task, Path::new("my rig")).unwrap_or_default(), expected);
        };
        check(
            Task::Table,
            "weavelight scan --rig 'my rig/rig.toml' --kind board --board CxRxMM --pose table --out 'my rig/targets/board'",
        );
        check(
            Task::Sheet(Pose::Flat),
            "weavelight scan --rig 'my rig/rig.toml' --kind white --out 'my rig/targets/white-flat'",
        );
        check(
            Task::Fit(Step::Color),
            "weavelight calibrate color --rig 'my rig/rig.toml' 'my rig/targets/grey' --out 'my rig/calibration'",
        );
        check(
            Task::Fit(Step::Check),
            "weavelight calibrate check 'my rig/calibration' 'my rig/targets/check-tilt'",
        );
        check(Task::Done, "");
    }

    #[test]
    fn a_new_rig_begins_with_the_board_on_the_table() {
        let home = tempfile::tempdir().unwrap();
        let options = crate::simulate::Options {
            out: home.path().join("rig"),
            size_px: Some([32, 32]),
            ..crate::simulate::Options::default()
        };
        crate::simulate::write_rig(&options).unwrap();
        assert!(is_rig(&options.out) && !is_rig(home.path()));
        let output = run(&options.out, |_| String::new()).unwrap();
        assert!(output.text.contains("wizard: photograph the chessboard flat"), "{}", output.text);
        assert_eq!(output.json["wizard"]["boards"], 0);
        assert_eq!(output.json["steps"][0]["state"], "missing");
    }
}
