//! The capture session that a scan writes: begun or continued, and each frame safe before the next light.

use super::ScanError;
use super::plan::{Plan, Step};
use super::subject::{Pose, Subject};
use crate::device::camera::Settings;
use crate::files::{
    FileError, Lock, Setting, UNFINISHED, WORK_FOLDER, clean_temporary, free_bytes, remove_noted,
};
use crate::session::{FrameEntry, Kind, MANIFEST, Session, SessionError, SessionWriter};
use std::fs;
use std::path::{Path, PathBuf};

/// Bytes of a frame beyond two for each photosite: previews, metadata.
const FRAME_EXTRA: u64 = 2 << 20;

/// What the capture session will say, beyond its frames.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Its name; the folder's where absent.
    pub name: Option<String>,
    /// How thick the swatch is, or how far a sheet is raised: its plane lies this far over the table.
    pub thickness_mm: Option<f64>,
}

/// Whether a capture session may be there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begin {
    /// No.
    Anew,
    /// It is continued, or begun where there is none.
    Resume,
}

/// The folder of a capture session that no other process writes to.
#[derive(Debug)]
pub(super) struct Place {
    folder: PathBuf,
    lock: Lock,
}

impl Place {
    /// The folder is made where it is absent.
    pub(super) fn take(folder: &Path) -> Result<Self, FileError> {
        fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
        let lock = Lock::acquire(folder, "scan")?;
        clean_temporary(folder);
        Ok(Self { folder: folder.to_owned(), lock })
    }
}

/// The capture session on disk.
#[derive(Debug)]
pub(super) struct Store {
    writer: SessionWriter,
    incoming: PathBuf,
    /// Per step: the file that is recorded for it.
    files: Vec<Option<PathBuf>>,
    /// Dropped last: until then, nothing else writes there.
    _lock: Lock,
}

/// A frame to be stored.
pub(super) struct Taken<'a> {
    pub(super) step: usize,
    /// Its file in the incoming folder, and what is in it.
    pub(super) path: &'a Path,
    pub(super) bytes: &'a [u8],
    /// What the manifest will say but for file name, hash and drift check.
    pub(super) entry: FrameEntry,
}

/// What was found of an earlier part of the scan.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// Steps whose frames are there, with their content.
    pub(super) finished: Vec<usize>,
    /// Exposure and sensitivity of the frames at the scan's own exposure.
    pub(super) settings: Option<Settings>,
    /// Sentences about frames that are not as they were recorded.
    pub(super) warnings: Vec<String>,
}

impl Store {
    /// Begins or continues the capture session in `place`.
    pub(super) fn open(
        Place { folder, lock }: Place,
        (about, subject): (&About, &Subject),
        begin: Begin,
        plan: &Plan,
    ) -> Result<(Self, Found), ScanError> {
        let folder = &*folder;
        let writer = match load_for(folder, (about, subject), begin, plan)? {
            Some(_) => SessionWriter::resume(folder)?,
            None => SessionWriter::create(new_session(folder, about, subject))?,
        };
        let (incoming, kept) = begin_work_folder(writer.session())?;
        let mut store = Self { writer, files: vec![None; plan.steps.len()], incoming, _lock: lock };
        let mut found = store.find(plan)?;
        found.warnings.extend(kept);
        Ok((store, found))
    }

    /// Which steps have their frame already; what is recorded but missing or altered leaves the record.
    fn find(&mut self, plan: &Plan) -> Result<Found, ScanError> {
        let mut found = Found::default();
        for (k, step) in plan.steps.iter().enumerate() {
            match state_of(self.writer.session(), step)? {
                State::Absent => {}
                State::Retaken(file) => self.files[k] = Some(file),
                State::Kept(entry) => {
                    if step.factor == 1.0 {
                        let (exposure_s, iso) = (entry.exposure_s, entry.iso);
                        found.settings = Some(Settings { exposure_s, iso });
                    }
                    self.files[k] = Some(entry.file);
                    found.finished.push(k);
                }
                State::Lost(file, why) => {
                    found.warnings.push(format!("{why}. It is taken again."));
                    self.writer.remove(&file)?;
                }
            }
        }
        Ok(found)
    }

    /// Where the camera saves.
    pub(super) fn incoming(&self) -> &Path {
        &self.incoming
    }

    /// The capture session so far.
    pub(super) fn session(&self) -> &Session {
        self.writer.session()
    }

    /// How many recorded frames have their file; `None` where the capture session is gone from its folder.
    pub(super) fn safe_frames(&self) -> Option<usize> {
        let session = self.session();
        let there = |entry: &&FrameEntry| session.frame_path(entry).is_file();
        session.manifest_path().is_file().then(|| session.frames.iter().filter(there).count())
    }

    /// The file that is recorded for a step.
    pub(super) fn file(&self, step: usize) -> Option<PathBuf> {
        self.files[step].as_ref().map(|file| self.session().folder.join(file))
    }

    /// Makes a frame safe: on disk, hashed, recorded. An earlier frame of the step stays until the new one is.
    pub(super) fn keep(&mut self, plan: &Plan, taken: Taken<'_>) -> Result<(), ScanError> {
        let step = &plan.steps[taken.step];
        let old = self.files[taken.step].clone();
        let ending = taken.path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let name = |tag: &str| PathBuf::from(format!("{}{tag}.{ending}", step.stem));
        let names = std::iter::once(name("")).chain((2..).map(|k| name(&format!("-take-{k}"))));
        // A file that nobody recorded is not ours to replace.
        let folder = &self.session().folder;
        let is_free = |name: &PathBuf| {
            old.as_ref() != Some(name) && fs::symlink_metadata(folder.join(name)).is_err()
        };
        let file = names.into_iter().find(is_free).unwrap_or(name(""));
        let pose = step.board.filter(|pose| *pose == Pose::Table).map(|_| "table".to_owned());
        let drift_check = step.drift_check;
        let entry = FrameEntry { file: file.clone(), drift_check, pose, ..taken.entry };
        self.writer.adopt(entry, taken.path, taken.bytes, old.as_deref())?;
        self.files[taken.step] = Some(file);
        Ok(())
    }

    /// Takes a step's frame out of the record.
    pub(super) fn drop_frame(&mut self, step: usize) -> Result<(), ScanError> {
        if let Some(file) = self.files[step].take() {
            self.writer.remove(&file)?;
        }
        Ok(())
    }

    /// Empties the incoming folder: what is in there was not kept.
    pub(super) fn clear_incoming(&self) {
        for entry in fs::read_dir(&self.incoming).into_iter().flatten().flatten() {
            if entry.file_name() == UNFINISHED {
                continue;
            }
            // What cannot be removed is only litter.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// What a capture session has of one step.
enum State {
    Absent,
    /// Its frame is there, as it was recorded.
    Kept(FrameEntry),
    /// A board that lies better now is photographed again; the earlier picture stays until then.
    Retaken(PathBuf),
    /// It is recorded, but its file is missing or altered; a sentence without its full stop.
    Lost(PathBuf, String),
}

fn state_of(session: &Session, step: &Step) -> Result<State, ScanError> {
    let Some(entry) = session.frames.iter().find(|entry| is_of(entry, step)) else {
        return Ok(State::Absent);
    };
    if step.board.is_some() {
        return Ok(State::Retaken(entry.file.clone()));
    }
    match session.read_frame(entry) {
        Ok(_) => Ok(State::Kept(entry.clone())),
        Err(error @ SessionError::FrameMissing { .. }) => {
            Ok(State::Lost(entry.file.clone(), error.to_string()))
        }
        Err(error @ SessionError::FrameAltered { .. }) => {
            Ok(State::Lost(entry.file.clone(), format!("{error}; the altered file stays")))
        }
        Err(error) => Err(error.into()),
    }
}

/// The capture session in `folder`, if there is one and the scan may go on with it.
fn load_for(
    folder: &Path,
    (about, subject): (&About, &Subject),
    begin: Begin,
    plan: &Plan,
) -> Result<Option<Session>, ScanError> {
    let there = folder.join(MANIFEST).exists().then(|| Session::load(folder)).transpose()?;
    match (there, begin) {
        (Some(session), Begin::Anew) => {
            let (name, frames) = (session.name, session.frames.len());
            Err(ScanError::Taken { folder: folder.to_owned(), name, frames })
        }
        (Some(session), Begin::Resume) => {
            check_same(&session, (about, subject), plan)?;
            Ok(Some(session))
        }
        (None, _) => Ok(None),
    }
}

/// What a scan into `folder` would find there, per step of the plan: whether its frame need not be taken again. Writes nothing.
/// Also gives sentences about frames that are not as they were recorded.
///
/// # Errors
/// As the scan itself before its first frame: another capture session, or one that is not to be continued.
pub fn survey(
    folder: &Path,
    whose: (&About, &Subject),
    begin: Begin,
    plan: &Plan,
) -> Result<(Vec<bool>, Vec<String>), ScanError> {
    let Some(session) = load_for(folder, whose, begin, plan)? else {
        return Ok((vec![false; plan.steps.len()], Vec::new()));
    };
    let mut warnings = Vec::new();
    let mut kept = |step: &Step| match state_of(&session, step)? {
        State::Kept(_) => Ok(true),
        State::Lost(_, why) => {
            warnings.push(format!("{why}. It will be taken again."));
            Ok(false)
        }
        State::Absent | State::Retaken(_) => Ok(false),
    };
    let there = plan.steps.iter().map(&mut kept).collect::<Result<_, ScanError>>()?;
    Ok((there, warnings))
}

impl Drop for Store {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.incoming);
    }
}

/// Makes the folder that the camera saves into, which is gone when the scan is over. One that a killed scan left holds no finished
/// frame, but says which files of the capture session nobody recorded any more; one that the program did not make is moved out
/// of the way. With a sentence about that.
fn begin_work_folder(session: &Session) -> Result<(PathBuf, Option<String>), FileError> {
    let (folder, work) = (&session.folder, session.folder.join(WORK_FOLDER));
    let failed = |source| FileError::write(&work, source);
    let mut said = None;
    if fs::symlink_metadata(work.join(UNFINISHED)).is_ok() {
        let is_recorded = |file: &Path| session.frames.iter().any(|frame| frame.file == file);
        remove_noted(&work, folder, is_recorded);
        fs::remove_dir_all(&work).map_err(failed)?;
    } else if fs::remove_dir(&work).is_err() && fs::symlink_metadata(&work).is_ok() {
        let names = (1..).map(|k| folder.join(format!("incoming-{k}")));
        let free = names.into_iter().find(|path| fs::symlink_metadata(path).is_err());
        let free = free.unwrap_or_else(|| folder.join("incoming"));
        fs::rename(&work, &free).map_err(failed)?;
        said = Some(format!(
            "{}: was in the way of the scan and is now {}",
            folder.join(WORK_FOLDER).display(),
            free.display()
        ));
    }
    fs::create_dir(&work).map_err(failed)?;
    fs::write(work.join(UNFINISHED), "").map_err(failed)?;
    Ok((work, said))
}

fn new_session(folder: &Path, about: &About, subject: &Subject) -> Session {
    let named = || folder.file_name().map(|name| name.to_string_lossy().into_owned());
    let name = about.name.clone().or_else(named).unwrap_or_else(|| "unnamed".to_owned());
    Session {
        captured: Some(jiff::Timestamp::now()),
        plane: subject.plane(about.thickness_mm),
        target: subject.target(),
        ..Session::new(folder, subject.kind(), name)
    }
}

fn check_same(
    session: &Session,
    (about, subject): (&About, &Subject),
    plan: &Plan,
) -> Result<(), ScanError> {
    let another = |what| Err(ScanError::Another { folder: session.folder.clone(), what });
    if session.kind != subject.kind() {
        return another(format!("it is no scan of {}", name_of(subject.kind())));
    }
    if session.target != subject.target() {
        return another("its [target] is another one".to_owned());
    }
    if let Some(name) = about.name.as_ref().filter(|name| **name != session.name) {
        return another(format!("it is named {:?}, not {name:?}", session.name));
    }
    let wanted = subject.plane(about.thickness_mm);
    if wanted.is_some() && wanted != session.plane {
        return another(format!(
            "its plane is not at the given {} or {}",
            Setting("thickness-mm"),
            Setting("plane-point")
        ));
    }
    if session.kind == Kind::Board {
        return Ok(()); // all pictures of one board go together
    }
    let strange =
        session.frames.iter().find(|entry| !plan.steps.iter().any(|step| is_of(entry, step)));
    match strange {
        Some(entry) => another(format!(
            "{} is no frame of this scan (other lights or bracket)",
            entry.file.display()
        )),
        None => Ok(()),
    }
}

fn name_of(kind: Kind) -> &'static str {
    match kind {
        Kind::Swatch => "a swatch",
        Kind::White => "a white sheet",
        Kind::Grey => "a grey chart",
        Kind::Board => "a chessboard",
    }
}

pub(super) fn is_of(entry: &FrameEntry, step: &Step) -> bool {
    let stem = entry.file.file_stem().unwrap_or_default().to_string_lossy();
    let stem = stem.split_once("-take-").map_or(&*stem, |(stem, _)| stem);
    stem == step.stem
        && entry.light == step.recorded_light()
        && entry.drift_check == step.drift_check
}

/// Sees that the frames will fit on the disk, before anything is begun: those that are there already need no more room.
pub(super) fn check_room(
    folder: &Path,
    size_px: [usize; 2],
    frames: usize,
) -> Result<(), ScanError> {
    let there = Session::load(folder).map_or(0, |session| session.frames.len());
    let frames = frames.saturating_sub(there);
    let each = 2 * (size_px[0] * size_px[1]) as u64 + FRAME_EXTRA;
    let needed = each * frames as u64;
    // The folder may not be there yet.
    let existing = folder.ancestors().find(|f| f.exists()).unwrap_or(Path::new("."));
    match free_bytes(existing) {
        Some(free) if free < needed => Err(ScanError::NoRoom {
            folder: folder.to_owned(),
            free_mb: free >> 20,
            needed_mb: needed.div_ceil(1 << 20),
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
#[path = "store_tests.rs"]
mod tests;
