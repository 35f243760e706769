//! A scan that is taken again: the earlier one and its solution go to the bin together, and come back with *Undo*; then the
//! later one is in the bin.

use crate::jobs::bin::{BinError, BinnedFolders};
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::scan::live_preview::LivePreview;
use crate::jobs::scan::live_preview::look_at_what_is_there;
use crate::jobs::scan::unfinished::look_for_unfinished;
use crate::jobs::scan::{Event, RestoredScan};
use crate::jobs::scans;
use crate::jobs::scans::Deleted;
use crate::jobs::tools::Tools;
use crate::model::project::Project;
use crate::texts::scan as texts;
use std::path::Path;
use weavelight::session::Session;
use weavelight::solution::{REPORT_JSON, Report};

/// The scan in `folder` and its solution into the bin. `None` where there is none any more.
pub(crate) fn put_aside(
    name: &str,
    folder: &Path,
    project: &Project,
    out: &Outbox,
) -> Result<Option<Deleted>, BinError> {
    let binned = BinnedFolders::put([folder.to_owned(), project.solution(folder)])?;
    if binned.folders.is_empty() {
        return Ok(None);
    }
    let deleted = Deleted { name: name.to_owned(), folder: folder.to_owned(), binned };
    out.send(Update::Scans(scans::Event::Deleted(deleted.clone())));
    out.send(Update::Scan(Event::Replaced(Some(deleted.clone()))));
    Ok(Some(deleted))
}

/// Brings the earlier scan back; the later one goes to the bin.
pub(crate) fn undo(replaced: Deleted, tools: &mut Tools, out: &Outbox) {
    let Some(project) = tools.project.clone() else { return };
    match swap(replaced, &project, out) {
        Ok(restored) => show(restored, &project, out),
        Err(error) => out.fail(texts::BRINGING_BACK, &error),
    }
    look_for_unfinished(tools, out);
}

/// Where not a single frame of the new scan was taken, there is nothing to choose.
pub(crate) fn put_back_if_nothing_came(
    folder: &Path,
    replaced: Deleted,
    tools: &mut Tools,
    out: &Outbox,
) {
    if Session::load(folder).map_or(true, |session| session.frames.is_empty()) {
        undo(replaced, tools, out);
        out.send(Update::Scan(Event::Replaced(None)));
    }
}

fn swap(earlier: Deleted, project: &Project, out: &Outbox) -> Result<RestoredScan, BinError> {
    let folder = earlier.folder.clone();
    let later = BinnedFolders::put([folder.clone(), project.solution(&folder)])?;
    if let Err(error) = earlier.binned.bring_back() {
        // As it was before.
        let _ = later.bring_back();
        return Err(error);
    }
    let solution = project.solution(&folder);
    let report = Report::read(&solution.join(REPORT_JSON)).ok().map(Box::new);
    let replaced =
        (!later.folders.is_empty()).then(|| Deleted { binned: later, ..earlier.clone() });
    out.send(Update::Scans(scans::Event::BroughtBack(earlier)));
    if let Some(replaced) = &replaced {
        out.send(Update::Scans(scans::Event::Deleted(replaced.clone())));
    }
    Ok(RestoredScan { folder, solution: report.map(|report| (solution, report)), replaced })
}

/// What takes the place of the scan that the room shows, after an undo.
pub(crate) fn show(restored: RestoredScan, project: &Project, out: &Outbox) {
    let folder = restored.folder.clone();
    out.send(Update::Scan(Event::Restored(restored)));
    look_at_what_is_there(&folder, &LivePreview::open(project, &folder, out));
}
