//! The pictures below a watched folder.

use crate::device::camera::CameraError;
use std::collections::HashMap;
use std::ffi::OsStr;
use std::fs::{self, DirEntry, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Endings of files that are not, or not yet, pictures.
const NOT_PICTURES: [&str; 18] = [
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
    "thm",
    "wav",
];
/// Endings of pictures that cameras save beside the RAW file.
const COMPANIONS: [&str; 8] = ["jpg", "jpeg", "jpe", "heic", "heif", "hif", "png", "avif"];
/// Folders below the watched one that are looked into: tethering programs file pictures by job and by date.
const DEEPEST: usize = 4;

/// What tells one state of a file from another: its length, its time, and which file it is under this name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
    /// The inode: a file of the same length and time may have replaced another.
    pub(super) identity: u64,
}

/// The pictures, by their path below the watched folder.
pub(super) type Listing = HashMap<PathBuf, Stamp>;

/// Lists the pictures below `folder`, but not below `without`.
///
/// # Errors
/// Where the folder is missing, is no folder or may not be read. What vanishes or is locked below it is passed over.
pub(super) fn list(folder: &Path, without: Option<&Path>) -> Result<Listing, CameraError> {
    let mut listing = Listing::new();
    let mut open = vec![(PathBuf::new(), 0)];
    while let Some((below, depth)) = open.pop() {
        let entries = match fs::read_dir(folder.join(&below)) {
            Ok(entries) => entries,
            Err(error) if depth == 0 => return Err(unreadable(folder, &error)),
            Err(_) => continue,
        };
        for entry in entries {
            let entry = match entry {
                Ok(entry) => entry,
                Err(error) if depth == 0 => return Err(unreadable(folder, &error)),
                Err(_) => break,
            };
            let path = below.join(entry.file_name());
            match kind(&entry) {
                Some(Kind::Folder) if depth < DEEPEST && without != Some(&folder.join(&path)) => {
                    open.push((path, depth + 1));
                }
                Some(Kind::Picture(stamp)) => drop(listing.insert(path, stamp)),
                _ => {}
            }
        }
    }
    Ok(listing)
}

enum Kind {
    Folder,
    Picture(Stamp),
}

/// `None`: nothing of interest, or it vanished since it was listed. Links are not followed: they may lead in circles.
fn kind(entry: &DirEntry) -> Option<Kind> {
    let name = entry.file_name();
    if name.to_string_lossy().starts_with(['.', '~']) {
        return None;
    }
    let metadata = entry.metadata().ok()?;
    if metadata.is_dir() {
        return Some(Kind::Folder);
    }
    let picture = metadata.is_file() && metadata.len() > 0 && may_be_a_picture(&name);
    picture.then(|| Kind::Picture(stamp(&metadata)))
}

fn stamp(metadata: &Metadata) -> Stamp {
    Stamp {
        length: metadata.len(),
        modified: metadata.modified().ok(),
        identity: identity(metadata),
    }
}

#[cfg(unix)]
fn identity(metadata: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(metadata)
}

#[cfg(not(unix))]
fn identity(_metadata: &Metadata) -> u64 {
    0
}

fn may_be_a_picture(name: &OsStr) -> bool {
    !name.to_string_lossy().ends_with('~')
        && !ending(Path::new(name)).is_some_and(|e| NOT_PICTURES.contains(&e.as_str()))
}

fn ending(path: &Path) -> Option<String> {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase())
}

/// Whether this is a picture that a camera saves beside its RAW file, by its name.
pub(super) fn is_companion(path: &Path) -> bool {
    ending(path).is_some_and(|ending| COMPANIONS.contains(&ending.as_str()))
}

fn unreadable(folder: &Path, error: &io::Error) -> CameraError {
    let what = match error.kind() {
        io::ErrorKind::NotFound => {
            "is not there; make it, or correct [camera] folder in rig.toml".to_owned()
        }
        io::ErrorKind::NotADirectory => {
            "is a file; name a folder as [camera] folder in rig.toml".to_owned()
        }
        io::ErrorKind::PermissionDenied => "may not be read; change its permissions".to_owned(),
        _ => format!("cannot be read ({error}); check the disk and the network"),
    };
    CameraError::Folder { folder: folder.to_owned(), what }
}
