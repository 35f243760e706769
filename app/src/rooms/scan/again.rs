//! A scan that is taken again: the earlier one and its solution go to the bin together, and come back with *Undo*; then the
//! later one is in the bin.

use super::Told;
use super::work::{look_for_unfinished, show};
use crate::place::Place;
use crate::rooms::scans::{self, Deleted};
use crate::texts::scan as texts;
use crate::worker::bin::{BinError, Binned};
use crate::worker::{Outbox, Tools, Update};
use std::path::{Path, PathBuf};
use weavelight::session::Session;
use weavelight::solution::{REPORT_JSON, Report};

/// A scan that has come back.
#[derive(Debug)]
pub struct Swapped {
    /// Its folder.
    pub folder: PathBuf,
    /// Its solution, and what that says of itself; `None` where it was not solved.
    pub solution: Option<(PathBuf, Box<Report>)>,
    /// What it took the place of.
    pub replaced: Option<Deleted>,
}

/// The scan in `folder` and its solution into the bin. `None` where there is none any more.
pub(super) fn put_aside(
    name: &str,
    folder: &Path,
    place: &Place,
    out: &Outbox,
) -> Result<Option<Deleted>, BinError> {
    let binned = Binned::put([folder.to_owned(), place.solution(folder)])?;
    if binned.folders.is_empty() {
        return Ok(None);
    }
    let deleted = Deleted { name: name.to_owned(), folder: folder.to_owned(), binned };
    out.tell(Update::Scans(scans::Told::Deleted(deleted.clone())));
    out.tell(Update::Scan(Told::Replaced(Some(deleted.clone()))));
    Ok(Some(deleted))
}

/// Brings the earlier scan back; the later one goes to the bin.
pub(super) fn undo(replaced: Deleted, tools: &mut Tools, out: &Outbox) {
    let Some(place) = tools.place.clone() else { return };
    match swap(replaced, &place, out) {
        Ok(swapped) => show(swapped, &place, out),
        Err(error) => out.fail(texts::BRINGING_BACK, &error),
    }
    look_for_unfinished(tools, out);
}

/// Where not a single frame of the new scan was taken, there is nothing to choose.
pub(super) fn put_back_if_nothing_came(
    folder: &Path,
    replaced: Deleted,
    tools: &mut Tools,
    out: &Outbox,
) {
    if Session::load(folder).map_or(true, |session| session.frames.is_empty()) {
        undo(replaced, tools, out);
        out.tell(Update::Scan(Told::Replaced(None)));
    }
}

fn swap(earlier: Deleted, place: &Place, out: &Outbox) -> Result<Swapped, BinError> {
    let folder = earlier.folder.clone();
    let later = Binned::put([folder.clone(), place.solution(&folder)])?;
    if let Err(error) = earlier.binned.bring_back() {
        // As it was before.
        let _ = later.bring_back();
        return Err(error);
    }
    let solution = place.solution(&folder);
    let report = Report::read(&solution.join(REPORT_JSON)).ok().map(Box::new);
    let replaced =
        (!later.folders.is_empty()).then(|| Deleted { binned: later, ..earlier.clone() });
    out.tell(Update::Scans(scans::Told::BroughtBack(earlier)));
    if let Some(replaced) = &replaced {
        out.tell(Update::Scans(scans::Told::Deleted(replaced.clone())));
    }
    Ok(Swapped { folder, solution: report.map(|report| (solution, report)), replaced })
}
