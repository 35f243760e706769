//! The file of a [`super::Lock`]: opened where it can be, recognised when it was replaced, removed at the end.

use super::holder::Holder;
use super::sha256_hex;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// An open lock file, locked or not.
#[derive(Debug)]
pub(super) struct Opened {
    pub(super) file: File,
    pub(super) path: PathBuf,
}

/// Opens the lock file, made where absent; in the folder for temporary files where its own place cannot be written. `None` where
/// neither can.
pub(super) fn open(path: &Path) -> Option<Opened> {
    let make = |path: &Path| {
        let file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        Ok(Opened { file, path: path.to_owned() })
    };
    match make(path) {
        Ok(opened) => Some(opened),
        Err(error) if is_refusal(&error) => {
            // Left by, or held by, another user: locking needs no right to write.
            if let Ok(file) = File::open(path) {
                return Some(Opened { file, path: path.to_owned() });
            }
            let elsewhere = elsewhere(path);
            let made: io::Result<Opened> = make(&elsewhere);
            made.or_else(|_| File::open(&elsewhere).map(|file| Opened { file, path: elsewhere }))
                .ok()
        }
        Err(_) => None,
    }
}

/// Who holds the lock of this file, without taking it.
pub(super) fn held_by(path: &Path) -> Option<Holder> {
    [path.to_owned(), elsewhere(path)].into_iter().find_map(|path| {
        let file = File::open(&path).ok()?;
        let held = match file.try_lock_shared() {
            Ok(()) => false,
            Err(TryLockError::WouldBlock) => true,
            Err(TryLockError::Error(_)) => Holder::read(&path)?.may_live(),
        };
        // A holder that has not written its record yet is asked again: it takes a moment.
        held.then(|| Holder::read(&path).unwrap_or_else(Holder::unknown))
    })
}

fn is_refusal(error: &io::Error) -> bool {
    use io::ErrorKind::{NotFound, PermissionDenied, ReadOnlyFilesystem};
    // A folder that is not there yet: what will be in it is locked all the same.
    matches!(error.kind(), NotFound | PermissionDenied | ReadOnlyFilesystem)
}

fn elsewhere(path: &Path) -> PathBuf {
    let hash = sha256_hex(path.as_os_str().as_encoded_bytes());
    std::env::temp_dir().join(format!(".{}.weavelight-lock", &hash[..32]))
}

impl Opened {
    /// Whether the file is still the one that its path leads to.
    pub(super) fn is_at_its_path(&self) -> bool {
        match (self.file.metadata(), fs::metadata(&self.path)) {
            (Ok(ours), Ok(there)) => same_file(&ours, &there),
            _ => false,
        }
    }

    /// Who holds it, by the file that was opened: it may not be at its path any more.
    pub(super) fn holder(&self) -> Option<Holder> {
        let (mut file, mut text) = (&self.file, String::new());
        file.rewind().and_then(|()| file.read_to_string(&mut text)).ok()?;
        Holder::parse(&text)
    }

    /// Says who holds it. What cannot be written is missed in messages only.
    pub(super) fn record(&self, holder: &Holder) {
        let text = toml::to_string(holder).unwrap_or_default();
        let mut file = &self.file;
        let _ = file
            .set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(text.as_bytes()));
    }

    /// Takes the file away, and then lets go of the lock: whoever opened the file before that finds that it is no longer there.
    pub(super) fn remove(self) {
        if self.is_at_its_path() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(unix)]
fn same_file(a: &fs::Metadata, b: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// A file that is open is not removed there.
#[cfg(not(unix))]
fn same_file(_a: &fs::Metadata, _b: &fs::Metadata) -> bool {
    true
}
