//! A folder into which another program saves: works with every tethering program, on any system.

use super::{Applied, Camera, CameraError, Description, Release, Settings, Shutter};
use crate::files::FileError;
use crate::raw::{DecodeError, Hint, decode};
use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// How long is waited, and how often looked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Waiting {
    /// For the first file after the light is on. Shorter than the board's longest on-time.
    pub arrival: Duration,
    /// For a file to become whole, since it last changed.
    pub completion: Duration,
    /// So long must a file stay as it is before it is read: programs write in pieces.
    pub rest: Duration,
    /// After a picture that is no RAW file: for the RAW file that may come with it.
    pub partner: Duration,
    /// Between looks.
    pub look: Duration,
}

impl Default for Waiting {
    fn default() -> Self {
        Self {
            arrival: Duration::from_secs(50),
            completion: Duration::from_secs(15),
            rest: Duration::from_millis(150),
            partner: Duration::from_secs(5),
            look: Duration::from_millis(25),
        }
    }
}

/// Endings of files that are not, or not yet, pictures.
const NOT_PICTURES: [&str; 16] = [
    "tmp",
    "temp",
    "part",
    "partial",
    "filepart",
    "crdownload",
    "download",
    "lock",
    "xmp",
    "txt",
    "ini",
    "db",
    "log",
    "cos",
    "json",
    "nksc",
];

/// A camera that another program runs. Its shutter is released outside; its settings are made by hand.
#[derive(Debug)]
pub struct WatchedCamera {
    folder: PathBuf,
    model: String,
    waiting: Waiting,
    /// Shorter than this after the light came on, no picture of it can be there.
    exposure_s: f64,
}

/// What tells one state of a file from another.
type Stamp = (u64, Option<SystemTime>);
/// The pictures in a folder.
type Listing = HashMap<OsString, Stamp>;

/// A file that is awaited.
#[derive(Clone, Copy, Debug)]
struct Seen {
    stamp: Stamp,
    /// Since when it has been so.
    since: Instant,
    verdict: Verdict,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Unread,
    Whole,
    NotRaw,
    Incomplete,
}

impl WatchedCamera {
    /// Watches `folder`; `model` is the camera's name, if known.
    pub fn new(folder: &Path, model: Option<&str>, waiting: Waiting) -> Self {
        let model = model.unwrap_or("camera of another program").to_owned();
        Self { folder: folder.to_owned(), model, waiting, exposure_s: 0.0 }
    }

    /// Whether the folder can be watched.
    ///
    /// # Errors
    /// Where it is missing, is no folder or may not be read.
    pub fn check(&self) -> Result<(), CameraError> {
        self.list().map(drop)
    }

    fn list(&self) -> Result<Listing, CameraError> {
        let failed = |error: io::Error| CameraError::Folder {
            folder: self.folder.clone(),
            what: match error.kind() {
                io::ErrorKind::NotFound => {
                    "is not there; make it, or correct [camera] folder in rig.toml".to_owned()
                }
                io::ErrorKind::NotADirectory => {
                    "is a file; name a folder as [camera] folder in rig.toml".to_owned()
                }
                io::ErrorKind::PermissionDenied => {
                    "may not be read; change its permissions".to_owned()
                }
                _ => format!("cannot be read ({error}); check the disk and the network"),
            },
        };
        let mut listing = Listing::new();
        for entry in fs::read_dir(&self.folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            // A file may vanish between being listed and looked at.
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_file() && metadata.len() > 0 && may_be_a_picture(&entry.file_name()) {
                listing.insert(entry.file_name(), (metadata.len(), metadata.modified().ok()));
            }
        }
        Ok(listing)
    }
}

fn may_be_a_picture(name: &OsStr) -> bool {
    let text = name.to_string_lossy();
    let ending = Path::new(name).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    !text.starts_with(['.', '~'])
        && !text.ends_with('~')
        && !ending.is_some_and(|ending| NOT_PICTURES.contains(&ending.as_str()))
}

impl Camera for WatchedCamera {
    fn describe(&self) -> Description {
        Description { model: self.model.clone(), release: Release::Outside }
    }

    fn configure(&mut self, wanted: Settings) -> Result<Applied, CameraError> {
        self.check()?;
        self.exposure_s = wanted.exposure_s;
        Ok(Applied::ByHand)
    }

    fn capture(
        &mut self,
        folder: &Path,
        shutter: &mut dyn Shutter,
    ) -> Result<PathBuf, CameraError> {
        let before = self.list()?;
        let mut wait = Wait { camera: self, before, seen: HashMap::new(), start: Instant::now() };
        shutter.open();
        wait.for_arrival()?;
        shutter.closed();
        let name = wait.for_one_whole()?;
        let target = folder.join(&name);
        fs::copy(self.folder.join(&name), &target)
            .map_err(|source| FileError::write(&target, source))?;
        Ok(target)
    }
}

/// The wait for one picture.
struct Wait<'a> {
    camera: &'a WatchedCamera,
    before: Listing,
    seen: HashMap<OsString, Seen>,
    start: Instant,
}

impl Wait<'_> {
    fn for_arrival(&mut self) -> Result<(), CameraError> {
        let WatchedCamera { folder, waiting, exposure_s, .. } = self.camera;
        while self.seen.is_empty() {
            if self.start.elapsed() > waiting.arrival + Duration::from_secs_f64(*exposure_s) {
                let (folder, after) = (folder.clone(), self.start.elapsed());
                return Err(CameraError::NothingArrived { folder, after });
            }
            std::thread::sleep(waiting.look);
            self.look()?;
        }
        // What arrives sooner was exposed before this light was on.
        if self.start.elapsed().as_secs_f64() < *exposure_s {
            return Err(CameraError::TooEarly { folder: folder.clone() });
        }
        Ok(())
    }

    /// The name of the one RAW file, when everything that arrived has been read.
    fn for_one_whole(&mut self) -> Result<OsString, CameraError> {
        loop {
            self.read_what_rests();
            let with = |verdict| self.seen.iter().filter(move |(_, s)| s.verdict == verdict);
            let (whole, settled) =
                (with(Verdict::Whole).count(), with(Verdict::Unread).count() == 0);
            match with(Verdict::Whole).next() {
                Some((name, _)) if whole == 1 && settled => return Ok(name.clone()),
                Some(_) if settled => {
                    let folder = self.camera.folder.clone();
                    return Err(CameraError::SeveralArrived { folder, count: whole });
                }
                _ => {}
            }
            self.check_patience()?;
            std::thread::sleep(self.camera.waiting.look);
            self.look()?;
        }
    }

    fn look(&mut self) -> Result<(), CameraError> {
        let now = Instant::now();
        let mut listing = self.camera.list()?;
        listing.retain(|name, stamp| self.is_new(name, *stamp));
        // A program that saves under another name first takes the first name away.
        self.seen.retain(|name, _| listing.contains_key(name));
        for (name, stamp) in listing {
            let fresh = Seen { stamp, since: now, verdict: Verdict::Unread };
            let seen = self.seen.entry(name).or_insert(fresh);
            if seen.stamp != stamp {
                *seen = fresh;
            }
        }
        Ok(())
    }

    /// A JPEG may come late for a RAW file that was there before: it is no news.
    fn is_new(&self, name: &OsStr, stamp: Stamp) -> bool {
        let partner = |other: &OsString| {
            Path::new(other).file_stem() == Path::new(name).file_stem() && other != name
        };
        self.before.get(name) != Some(&stamp) && !self.before.keys().any(partner)
    }

    fn read_what_rests(&mut self) {
        let waiting = self.camera.waiting;
        for (name, seen) in &mut self.seen {
            if seen.verdict == Verdict::Unread && seen.since.elapsed() >= waiting.rest {
                seen.verdict = judge(&self.camera.folder.join(name));
            }
        }
    }

    fn check_patience(&self) -> Result<(), CameraError> {
        let waiting = self.camera.waiting;
        let overdue = |verdict: Verdict, patience: Duration| {
            let mut these = self.seen.iter().filter(move |(_, s)| s.verdict == verdict);
            these.find(|(_, seen)| seen.since.elapsed() > patience).map(|(name, _)| name)
        };
        if let Some(name) = overdue(Verdict::Incomplete, waiting.completion) {
            let file = self.camera.folder.join(name);
            return Err(CameraError::Incomplete {
                reason: reason(&file),
                file,
                after: waiting.completion,
            });
        }
        if let Some(name) = overdue(Verdict::NotRaw, waiting.partner) {
            let ending = Path::new(name).extension().unwrap_or_default().to_string_lossy();
            return Err(CameraError::NotRaw { found: ending.to_uppercase() });
        }
        // It was there, and was taken away without another name.
        if self.seen.is_empty() && self.start.elapsed() > waiting.arrival + waiting.completion {
            let (folder, after) = (self.camera.folder.clone(), self.start.elapsed());
            return Err(CameraError::NothingArrived { folder, after });
        }
        Ok(())
    }
}

fn judge(path: &Path) -> Verdict {
    let Ok(bytes) = fs::read(path) else { return Verdict::Incomplete };
    match decode(&bytes, &Hint::default()) {
        Ok(_) => Verdict::Whole,
        // 8-bit pictures, JPEG among them, do not say how they encode light.
        Err(DecodeError::EncodingUndeclared) => Verdict::NotRaw,
        Err(_) => Verdict::Incomplete,
    }
}

fn reason(path: &Path) -> String {
    match fs::read(path) {
        Err(error) => error.to_string(),
        Ok(bytes) => decode(&bytes, &Hint::default())
            .err()
            .map_or_else(|| "it changed".to_owned(), |error| error.to_string()),
    }
}

#[cfg(test)]
mod tests;
