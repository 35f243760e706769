//! The wait for one picture.

use super::earlier::{Earlier, Relation, Seen, all_alike};
use super::listing::{Listing, Stamp, is_companion, list};
use super::{Waiting, WatchedCamera};
use crate::device::camera::{CameraError, Shutter};
use crate::raster::PictureError;
use crate::raw::{DecodeError, Hint, decode};
use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Listing a folder on a slow disk must not keep the disk busy: between two looks passes this many times what a look took.
const REST_BETWEEN_LOOKS: u32 = 3;

/// The picture of this light, whole.
pub(super) struct Picture {
    /// Its path below the watched folder.
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
}

/// A file that arrived.
struct Arrived {
    stamp: Stamp,
    /// Since when it has been so.
    since: Instant,
    verdict: Verdict,
}

enum Verdict {
    Unread,
    /// A RAW file of this light.
    Whole(Box<(Vec<u8>, Seen)>),
    /// A RAW file that shows what an earlier one shows.
    LikeAnother(Box<Seen>),
    /// A picture that is no RAW file; one may come with it.
    NotRaw,
    /// Not whole yet, or damaged; why.
    Incomplete(String),
    /// Of a kind that cannot be read; why, and what to do.
    Unsupported(String),
}

pub(super) struct Wait<'a> {
    folder: PathBuf,
    /// The capture session, where it lies below the watched folder.
    without: Option<PathBuf>,
    waiting: Waiting,
    exposure_s: f64,
    earlier: &'a mut Earlier,
    lit: Option<u32>,
    before: Listing,
    arrived: HashMap<PathBuf, Arrived>,
    /// Files that are not of this light.
    left_out: HashSet<(PathBuf, u64)>,
    /// A picture came sooner than it can have been exposed.
    early: bool,
    /// The last picture that was left out as another's copy.
    copy: Option<PathBuf>,
    start: Instant,
    look_took: Duration,
}

impl<'a> Wait<'a> {
    /// Begins before the shutter opens: what is in the folder now is of earlier lights.
    pub(super) fn begin(camera: &'a mut WatchedCamera, target: &Path) -> Result<Self, CameraError> {
        let folder = fs::canonicalize(&camera.folder).unwrap_or_else(|_| camera.folder.clone());
        let without = target.parent().and_then(|parent| fs::canonicalize(parent).ok());
        Ok(Self {
            before: list(&folder, without.as_deref())?,
            folder,
            without,
            waiting: camera.waiting,
            exposure_s: camera.exposure_s,
            earlier: &mut camera.earlier,
            lit: None,
            arrived: HashMap::new(),
            left_out: HashSet::new(),
            early: false,
            copy: None,
            start: Instant::now(),
            look_took: Duration::ZERO,
        })
    }

    /// Waits until the picture of this light is whole.
    pub(super) fn for_picture(mut self, shutter: &mut dyn Shutter) -> Result<Picture, CameraError> {
        self.start = Instant::now();
        self.lit = shutter.lit();
        shutter.waiting(&format!(
            "waiting for its RAW file in {}; release the shutter unless the light board does",
            self.folder.display()
        ));
        self.for_arrival(shutter)?;
        shutter.closed();
        loop {
            self.read_what_rests(shutter);
            if let Some(picture) = self.chosen()?.and_then(|path| self.take(path)) {
                return Ok(picture);
            }
            self.check_patience()?;
            self.look(shutter)?;
        }
    }

    fn for_arrival(&mut self, shutter: &mut dyn Shutter) -> Result<(), CameraError> {
        while self.arrived.is_empty() {
            self.check_arrival()?;
            self.look(shutter)?;
        }
        Ok(())
    }

    fn check_arrival(&self) -> Result<(), CameraError> {
        let after = self.start.elapsed();
        if after <= self.waiting.arrival + Duration::from_secs_f64(self.exposure_s) {
            return Ok(());
        }
        let folder = self.folder.clone();
        Err(match &self.copy {
            _ if self.early => CameraError::TooEarly { folder },
            Some(copy) => CameraError::SamePicture { file: folder.join(copy) },
            None => CameraError::NothingArrived { folder, after },
        })
    }

    /// Looks what is new, after a rest.
    fn look(&mut self, shutter: &mut dyn Shutter) -> Result<(), CameraError> {
        std::thread::sleep(self.waiting.look.max(self.look_took * REST_BETWEEN_LOOKS));
        let now = Instant::now();
        let mut listing = list(&self.folder, self.without.as_deref())?;
        self.look_took = now.elapsed();
        listing.retain(|path, stamp| self.is_new(path, *stamp));
        // A program that saves under another name first takes the first name away.
        self.arrived.retain(|path, _| listing.contains_key(path));
        let too_early = self.start.elapsed().as_secs_f64() < self.exposure_s;
        for (path, stamp) in listing {
            let known = self.arrived.get(&path).map(|arrived| arrived.stamp);
            if known.is_none() && too_early {
                self.early = true;
                shutter.waiting(&left_out(&path, "came before its exposure can have ended"));
                self.left_out.insert((path, stamp.identity));
            } else if known != Some(stamp) {
                if known.is_none() && is_companion(&path) {
                    shutter.waiting(&format!("{} came; waiting for its RAW file", name(&path)));
                }
                let verdict = Verdict::Unread;
                self.arrived.insert(path, Arrived { stamp, since: now, verdict });
            }
        }
        Ok(())
    }

    /// Whether a file may be of this light. A JPEG may come late for a RAW file that was there before: it is no news.
    fn is_new(&self, path: &Path, stamp: Stamp) -> bool {
        let raw_of_it = |other: &PathBuf| !is_companion(other) && same_stem(other, path);
        self.before.get(path) != Some(&stamp)
            && !self.left_out.contains(&(path.to_owned(), stamp.identity))
            && !(is_companion(path) && self.before.keys().any(raw_of_it))
    }

    fn read_what_rests(&mut self, shutter: &mut dyn Shutter) {
        let rest = self.waiting.rest;
        let mut copies = Vec::new();
        for (path, arrived) in &mut self.arrived {
            if !matches!(arrived.verdict, Verdict::Unread) || arrived.since.elapsed() < rest {
                continue;
            }
            arrived.verdict = judge(&self.folder.join(path), path);
            let Verdict::Whole(picture) = &arrived.verdict else { continue };
            match self.earlier.relation(&picture.1, self.lit) {
                Relation::New => {}
                Relation::Copy => copies.push((path.clone(), arrived.stamp.identity)),
                Relation::LikeAnother => {
                    shutter.waiting(&left_out(path, "shows the same as an earlier light's"));
                    let seen = picture.1.clone();
                    arrived.verdict = Verdict::LikeAnother(Box::new(seen));
                }
            }
        }
        for copy in copies {
            shutter.waiting(&left_out(&copy.0, "is a copy of an earlier picture"));
            self.arrived.remove(&copy.0);
            self.copy = Some(copy.0.clone());
            self.left_out.insert(copy);
        }
    }

    /// The RAW file of this light, once everything that arrived has been read.
    fn chosen(&self) -> Result<Option<PathBuf>, CameraError> {
        let unread = |arrived: &Arrived| matches!(arrived.verdict, Verdict::Unread);
        if self.arrived.values().any(unread) {
            return Ok(None);
        }
        let mut whole: Vec<(Instant, &PathBuf, &Seen)> = self
            .arrived
            .iter()
            .filter_map(|(path, arrived)| match &arrived.verdict {
                Verdict::Whole(picture) => Some((arrived.since, path, &picture.1)),
                _ => None,
            })
            .collect();
        whole.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)));
        let Some((_, first, _)) = whole.first() else { return Ok(None) };
        // Released twice, or saved twice: either shows this light.
        let seen: Vec<&Seen> = whole.iter().map(|(.., seen)| *seen).collect();
        if whole.iter().all(|(_, path, _)| same_stem(path, first)) || all_alike(&seen) {
            return Ok(Some((*first).clone()));
        }
        let (folder, count) = (self.folder.clone(), whole.len());
        Err(CameraError::SeveralArrived { folder, count })
    }

    /// Takes the chosen picture; the others of this light must not count for the next one.
    fn take(&mut self, path: PathBuf) -> Option<Picture> {
        let Verdict::Whole(picture) = self.arrived.remove(&path)?.verdict else { return None };
        let (bytes, seen) = *picture;
        for other in self.arrived.drain().map(|(_, arrived)| arrived.verdict) {
            if let Verdict::Whole(other) = other {
                self.earlier.take(other.1, self.lit);
            }
        }
        self.earlier.take(seen, self.lit);
        Some(Picture { path, bytes })
    }

    fn check_patience(&mut self) -> Result<(), CameraError> {
        let waiting = self.waiting;
        for (path, arrived) in &mut self.arrived {
            let waited = arrived.since.elapsed();
            let file = self.folder.join(path);
            match &mut arrived.verdict {
                Verdict::Incomplete(reason) if waited > waiting.completion => {
                    let (reason, after) = (reason.clone(), waiting.completion);
                    return Err(CameraError::Incomplete { file, after, reason });
                }
                Verdict::Unsupported(why) if waited > waiting.completion.min(UNSUPPORTED) => {
                    return Err(CameraError::Unsupported { file, why: why.clone() });
                }
                Verdict::NotRaw if waited > waiting.partner => {
                    let ending = path.extension().unwrap_or_default().to_string_lossy();
                    return Err(CameraError::NotRaw { found: ending.to_uppercase() });
                }
                Verdict::LikeAnother(seen) if waited > waiting.second => {
                    self.earlier.doubt((**seen).clone(), self.lit);
                    return Err(CameraError::SamePicture { file });
                }
                _ => {}
            }
        }
        // Everything was taken away, or left out.
        if self.arrived.is_empty() { self.check_arrival() } else { Ok(()) }
    }
}

/// A file of a kind that cannot be read is left alone for so long: what is half written may look like another kind.
const UNSUPPORTED: Duration = Duration::from_secs(3);

fn judge(file: &Path, path: &Path) -> Verdict {
    if is_companion(path) {
        return Verdict::NotRaw;
    }
    let bytes = match crate::files::read_input(file, crate::files::InputKind::Picture) {
        Ok(bytes) => bytes,
        Err(error) => return Verdict::Incomplete(error.to_string()),
    };
    match decode(&bytes, &Hint::default()) {
        Ok(frame) => {
            let seen = Seen::new(&bytes, &frame);
            Verdict::Whole(Box::new((bytes, seen)))
        }
        // 8-bit pictures do not say how they encode light.
        Err(DecodeError::EncodingUndeclared) => Verdict::NotRaw,
        Err(
            error @ DecodeError::Picture(
                PictureError::Unsupported { .. } | PictureError::NotAPicture { .. },
            ),
        ) => Verdict::Unsupported(error.to_string()),
        Err(error) => Verdict::Incomplete(error.to_string()),
    }
}

fn same_stem(a: &Path, b: &Path) -> bool {
    a.file_stem() == b.file_stem()
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn left_out(path: &Path, why: &str) -> String {
    format!("{} {why}, and is left out; waiting for this light's picture", name(path))
}
