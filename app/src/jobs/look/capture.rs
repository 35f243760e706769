//! Where the frames are that a solution was solved from.

use crate::model::project::Project;
use crate::texts::look as texts;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use weavelight::files::{Input, sha256_of_file};
use weavelight::instrument::LIGHTS_FILE;
use weavelight::photometry::Method;
use weavelight::raster::read_mask;
use weavelight::session::{MANIFEST, Session};
use weavelight::solution::{MASK_INPUT, Report};

use weavelight_calibration::description::Image;

/// Where a solution comes from.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The folders that it was made from.
    pub sources: Sources,
    /// Lights that have a frame, ascending.
    pub lights: Vec<usize>,
    /// What is inside, row by row, where a mask says so.
    pub mask: Option<Arc<Image<bool>>>,
    /// What strokes of its mask are kept under until they are saved.
    pub key: String,
    /// Whether capture session or calibration are not any more what the solution was made from.
    pub changed: bool,
}

/// What it takes to solve a photosite again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sources {
    /// The capture session's folder.
    pub session: PathBuf,
    /// The calibration's folder.
    pub calibration: PathBuf,
    /// How the solution was solved: what is solved again is to be the same.
    pub method: Method,
}

impl Sources {
    /// Whether both are of the same frames, however they were solved.
    pub(crate) fn same_frames(&self, other: &Self) -> bool {
        (&self.session, &self.calibration) == (&other.session, &other.calibration)
    }
}

/// A folder that may be the one, and whether it is.
struct Found<T> {
    folder: PathBuf,
    what: T,
    fits: bool,
}

/// The capture session of the solution in `folder`: where its report says, among the scans of the rig that is open, or of the
/// rig that the solution lies in. One whose manifest is what was solved goes before one that has changed since.
///
/// # Errors
/// A sentence that says why there is none that can be looked at, and the remedy.
pub(crate) fn capture_of(
    folder: &Path,
    project: Option<&Project>,
    report: &Report,
) -> Result<Capture, String> {
    if report.undistorted {
        return Err(texts::OTHER_GRID.to_owned());
    }
    if report.scale != 1 {
        return Err(texts::reduced(report.scale));
    }
    let method = report.solved_by().ok_or_else(|| texts::unknown_method(&report.method))?;
    let session = find_session(folder, project, report)?;
    let calibration = find_calibration(folder, project, report)
        .ok_or_else(|| texts::NO_CALIBRATION.to_owned())?;
    let read = session.what;
    let mut lights: Vec<usize> = read.frames.iter().filter_map(|frame| frame.light).collect();
    lights.sort_unstable();
    lights.dedup();
    Ok(Capture {
        mask: read.mask_path().and_then(|path| read_mask(&path).ok()).map(Arc::new),
        key: crate::jobs::look::drafts::key(&read),
        changed: !(session.fits && calibration.fits),
        sources: Sources { session: session.folder, calibration: calibration.folder, method },
        lights,
    })
}

fn find_session(
    folder: &Path,
    project: Option<&Project>,
    report: &Report,
) -> Result<Found<Session>, String> {
    let stated = report.folders.as_ref().map(|folders| PathBuf::from(&folders.session));
    let name = folder.file_name().unwrap_or_default();
    let of_place = project.map(|project| project.scans().join(name));
    let of_its_rig = rig_of(folder).map(|rig| rig.join("scans").join(name));
    let mut broken = None;
    let mut read = |folder: PathBuf| match Session::load(&folder) {
        Ok(what) => {
            let fits = is_input(&folder, MANIFEST, &report.inputs);
            Some(Found { folder, what, fits })
        }
        Err(error) if folder.join(MANIFEST).exists() => {
            broken.get_or_insert(error.to_string());
            None
        }
        Err(_) => None,
    };
    let found = best([stated.clone(), of_place, of_its_rig].into_iter().flatten(), &mut read);
    found.ok_or_else(|| match (broken, stated) {
        (Some(why), _) => why,
        (None, Some(stated)) => texts::frames_gone(&stated),
        (None, None) => texts::NO_FRAMES.to_owned(),
    })
}

fn find_calibration(
    folder: &Path,
    project: Option<&Project>,
    report: &Report,
) -> Option<Found<()>> {
    let stated = report.folders.as_ref().map(|folders| PathBuf::from(&folders.calibration));
    let of_its_rig = rig_of(folder).map(|rig| rig.join("calibration"));
    let folders =
        [stated, project.map(|project| project.calibration()), of_its_rig].into_iter().flatten();
    best(folders, &mut |folder: PathBuf| {
        let mut of_calibration = report
            .inputs
            .iter()
            .filter(|input| input.name != MANIFEST && !input.name.starts_with(MASK_INPUT));
        let fits = of_calibration.all(|input| is_input(&folder, &input.name, &report.inputs));
        folder.join(LIGHTS_FILE).exists().then_some(Found { folder, what: (), fits })
    })
}

/// The rig's folder, where a solution lies among those of a rig.
fn rig_of(folder: &Path) -> Option<&Path> {
    folder.parent()?.parent()
}

/// The first one that fits, else the first one that is there.
fn best<T>(
    folders: impl Iterator<Item = PathBuf>,
    read: &mut impl FnMut(PathBuf) -> Option<Found<T>>,
) -> Option<Found<T>> {
    let mut first = None;
    for found in folders.filter_map(read) {
        if found.fits {
            return Some(found);
        }
        first.get_or_insert(found);
    }
    first
}

/// Whether a file is the one that was solved with. Where the report does not say, it is given the benefit of the doubt.
fn is_input(folder: &Path, file: &str, inputs: &[Input]) -> bool {
    let hash = sha256_of_file(&folder.join(file)).ok();
    let solved_with = inputs.iter().find(|input| input.name == file);
    solved_with.is_none_or(|input| Some(&input.sha256) == hash.as_ref())
}
