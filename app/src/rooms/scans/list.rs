//! What lies in the folder of scans.

use crate::place::Place;
use std::path::{Path, PathBuf};
use weavelight::instrument::Rig;
use weavelight::session::{Kind, Session};

/// A capture session of a swatch.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its folder.
    pub folder: PathBuf,
    /// The swatch's name.
    pub name: String,
    /// When it was taken.
    pub captured: Option<jiff::Timestamp>,
    /// Frames that are there, and that there ought to be.
    pub frames: [usize; 2],
    /// Its solution's folder, if there is one.
    pub solution: Option<PathBuf>,
}

impl Entry {
    /// Every light has been photographed.
    pub fn is_complete(&self) -> bool {
        self.frames[0] >= self.frames[1]
    }
}

/// The scans of a rig, newest first.
pub(super) fn list(place: &Place) -> Vec<Entry> {
    let folders = std::fs::read_dir(place.scans()).into_iter().flatten().flatten();
    let mut entries: Vec<Entry> =
        folders.filter_map(|folder| entry(&folder.path(), place)).collect();
    entries.sort_by(|a, b| (b.captured, &a.name).cmp(&(a.captured, &b.name)));
    entries
}

fn entry(folder: &Path, place: &Place) -> Option<Entry> {
    let session = Session::load(folder).ok().filter(|session| session.kind == Kind::Swatch)?;
    let solution = place.solution(folder);
    Some(Entry {
        frames: [session.frames.len(), frames_of_a_scan(&session, &place.rig)],
        name: session.name,
        captured: session.captured,
        solution: solution.join(weavelight::solution::REPORT_JSON).exists().then_some(solution),
        folder: folder.to_owned(),
    })
}

/// Every light, one frame without light, and the first light again; further exposures come on top.
fn frames_of_a_scan(session: &Session, rig: &Rig) -> usize {
    let further =
        session.frames.iter().filter(|frame| frame.file.to_string_lossy().contains("-exposure-"));
    rig.lights.len() + 2 + further.count()
}

/// Name and frames of a scan that was stopped before its end.
pub fn incomplete(folder: &Path, rig: &Rig) -> Option<(String, usize)> {
    let session = Session::load(folder).ok().filter(|session| session.kind == Kind::Swatch)?;
    let frames = session.frames.len();
    (frames < frames_of_a_scan(&session, rig)).then_some((session.name, frames))
}
