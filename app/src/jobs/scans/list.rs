//! What lies in the folder of scans.

use crate::model::project::Project;
use crate::model::scan_entry::{ScanEntry, UnfinishedScan};
use std::path::{Path, PathBuf};
use weavelight::device::scan::Plan;
use weavelight::instrument::Rig;
use weavelight::session::{Kind, Session};

/// The scans of a rig, newest first.
pub(crate) fn list(place: &Project) -> Vec<ScanEntry> {
    let folders = std::fs::read_dir(place.scans()).into_iter().flatten().flatten();
    let mut entries: Vec<ScanEntry> =
        folders.filter_map(|folder| entry(&folder.path(), place)).collect();
    entries.sort_by(|a, b| (b.captured, &a.name).cmp(&(a.captured, &b.name)));
    entries
}

fn entry(folder: &Path, place: &Project) -> Option<ScanEntry> {
    let session = Session::load(folder).ok().filter(|session| session.kind == Kind::Swatch)?;
    let solution = place.solution(folder);
    Some(ScanEntry {
        frames: frames(&session, &place.rig),
        name: session.name,
        captured: session.captured,
        solution: solution.join(weavelight::solution::REPORT_JSON).exists().then_some(solution),
        folder: folder.to_owned(),
    })
}

/// Frames whose files are there, and those that there ought to be: what is recorded, and what the scan's plan has beyond that.
fn frames(session: &Session, rig: &Rig) -> [usize; 2] {
    let is_there =
        |file: PathBuf| file.metadata().is_ok_and(|file| file.is_file() && file.len() > 0);
    let there = session.frames.iter().filter(|frame| is_there(session.frame_path(frame))).count();
    let missing = Plan::missing(rig, &session.frames).ok().flatten().map_or(0, |steps| steps.len());
    [there, session.frames.len() + missing]
}

/// A scan that was stopped before its end, or has lost frames since; `None` where nothing is missing.
pub fn incomplete(folder: &Path, rig: &Rig) -> Option<UnfinishedScan> {
    let session = Session::load(folder).ok().filter(|session| session.kind == Kind::Swatch)?;
    let [there, wanted] = frames(&session, rig);
    (there < wanted).then(|| UnfinishedScan {
        folder: folder.to_owned(),
        name: session.name,
        frames: there,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight::session::FrameEntry;
    use weavelight::simulate;

    #[test]
    fn frames_are_counted_by_the_plan_and_by_what_is_on_the_disk() {
        let home = tempfile::tempdir().unwrap();
        let options = simulate::Options {
            out: home.path().join("rig"),
            size_px: Some([32, 32]),
            ..simulate::Options::default()
        };
        simulate::write_rig(&options).unwrap();
        let rig = Project::open(&options.out).unwrap().rig.clone();
        let folder = home.path().join("scan");
        std::fs::create_dir(&folder).unwrap();
        let check = |stems: &[&str], lost: usize, expected: [usize; 2]| {
            let mut session = Session::new(&folder, Kind::Swatch, "x");
            for (k, stem) in stems.iter().enumerate() {
                let light = stem.strip_prefix("light-").map(|light| light[..2].parse().unwrap());
                let exposure_s = if stem.contains("exposure") { 0.025 } else { 0.1 };
                let entry = FrameEntry::new(format!("{stem}.dng"), light, exposure_s, 100.0);
                let path = session.frame_path(&entry);
                std::fs::write(&path, if k < lost { "" } else { "frame" }).unwrap();
                session.frames.push(entry);
            }
            assert_eq!(frames(&session, &rig), expected, "{stems:?}");
        };
        check(&[], 0, [0, 12]);
        check(&["ambient", "light-00", "light-01"], 0, [3, 12]);
        check(&["ambient", "light-00", "light-01"], 2, [1, 12]);
        // One further exposure each of ten lights.
        check(&["ambient", "light-00", "light-00-exposure-1"], 0, [3, 22]);
        // Imported under names of their own: nothing says that more is to come.
        check(&["DSC_0001", "long-exposure-2"], 0, [2, 2]);
    }
}
