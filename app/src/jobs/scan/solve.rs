//! Solves a scan.

use crate::jobs::outbox::Outbox;
use crate::jobs::tools::Tools;
use crate::model::settings::SolveSettings;
use crate::texts::scan as texts;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use weavelight::report::{expected_error, page_of_solve};
use weavelight::solution::Report;
use weavelight::solution::Reuse;
use weavelight::solve::{Shown, Solved, run};

/// A solution of a scan.
pub struct SolvedScan {
    /// Its folder.
    pub solution: PathBuf,
    /// What it says of itself.
    pub report: Box<Report>,
    /// Expected error of a normal, median, degrees; `None` where the maps were there already.
    pub expected_deg: Option<f64>,
    /// Whether they were.
    pub up_to_date: bool,
}

/// Solves a scan with the same call and settings as the command line. `None` where that failed; the error is reported.
/// Warnings are in the report, which the room shows.
pub fn solve(
    scan: &Path,
    (settings, reuse): (SolveSettings, Reuse),
    tools: &mut Tools,
    out: &Outbox,
) -> Option<SolvedScan> {
    let name = scan.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let title = texts::solving(&name);
    let Some(project) = &tools.project else {
        out.fail(&title, &crate::texts::rig::NONE_OPEN);
        return None;
    };
    let solution = project.solution(scan);
    // The page is made only if the maps are not up to date.
    let expected = OnceLock::new();
    let solved = out.job(&title, || -> Result<Solved, Box<dyn std::error::Error>> {
        std::fs::create_dir_all(solution.parent().unwrap_or(Path::new(".")))?;
        let mut options = settings.options(scan, &project.calibration(), &solution);
        options.reuse = reuse;
        let page = |shown: &Shown| {
            let _ = expected.set(expected_error(shown).map(|spread| spread.median));
            page_of_solve(shown, None)
        };
        let send = |state: weavelight::solve::Progress| out.tick(state.share(), state.stage.what());
        Ok(run(&options, &send, Some(&page))?)
    });
    let Solved { report, up_to_date } = solved.ok()?;
    let (report, expected_deg) = (Box::new(report), expected.into_inner().flatten());
    Some(SolvedScan { solution, report, expected_deg, up_to_date })
}
