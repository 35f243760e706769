//! One writer at a time for a capture session, a rig or an output folder. The lock is the operating system's (`flock`), so it
//! is free by itself when its holder dies; the file only says who holds it.

use super::atomic::parent_of;
use super::hidden::hidden_name;
use super::holder::{self, Holder};
use super::lock_file::{self, Opened};
use std::ffi::OsStr;
use std::fs::{self, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The lock's file inside a folder; beside a file or a folder to be written, `.NAME.weavelight-lock`.
const LOCK_FILE: &str = ".weavelight-lock";
/// A look by [`Lock::holder`] holds a lock for a moment; that must not look like an owner.
const TRIES: usize = 5;
const MOST_TRIES: usize = 50;
const BETWEEN_TRIES: Duration = Duration::from_millis(20);

/// The right to write to one place, held until dropped or until the process ends, however it ends.
///
/// Already locked by what works there, for as long as it works: a capture session by [`crate::device::scan::scan`] and
/// [`crate::solve::make_mask`], a rig by [`crate::device::scan::Instruments`], an output by [`super::StagedFolder`], a calibration
/// folder by `calibrate`. Do not take the same lock around these: a second lock of one process on one place is refused as
/// that of any other process.
///
/// A window calls [`Lock::holder`] when it opens a capture session or a calibration: if there is one, it shows the content
/// read-only with the holder's sentence, and looks again from time to time. Before it changes anything (a mask, a name) it
/// calls `Lock::acquire(folder, "edit")`, shows the [`LockError`] if that fails, and drops the lock after the change.
///
/// Where the place is read-only, the lock file is in the system's folder for temporary files, so that it works between
/// processes of one computer. Where the file system has no locks, the recorded process is looked for instead. Where neither
/// works, the lock is granted: it must not keep anybody from working.
#[derive(Debug)]
pub struct Lock {
    /// `None` where no lock file could be made.
    held: Option<Opened>,
}

/// The place is in use by another program, or by another part of this one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: in use by {}; wait until that is done, or stop it{}", .path.display(), who(.holder.as_deref()), remedy(.holder.as_deref(), .lock_file))]
pub struct LockError {
    /// What was to be locked.
    pub path: PathBuf,
    /// Who holds it; `None` where its file does not say.
    pub holder: Option<Box<Holder>>,
    /// The file that records the holder.
    pub lock_file: PathBuf,
}

fn who(holder: Option<&Holder>) -> String {
    holder.map_or_else(|| "another program".to_owned(), Holder::to_string)
}

/// The lock of a process that cannot be seen from here may outlive it.
fn remedy(holder: Option<&Holder>, lock_file: &Path) -> String {
    match holder {
        Some(holder) if holder.host != holder::host() => {
            format!(" (if it is no longer running, delete {})", lock_file.display())
        }
        _ => String::new(),
    }
}

impl Lock {
    /// Locks `path` for this process: a folder that exists by a file in it, anything else by a file beside it. `purpose` is one
    /// word for messages, as in "scan".
    ///
    /// # Errors
    /// Where another process, or another part of this one, holds it.
    pub fn acquire(path: &Path, purpose: &str) -> Result<Self, LockError> {
        if path.is_dir() {
            let folder = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
            check_free(path, &file_beside(path))?;
            Self::take(path, &folder.join(LOCK_FILE), purpose)
        } else {
            Self::beside(path, purpose)
        }
    }

    /// As [`Lock::acquire`], with the lock file beside `path` also where that is a folder: for a folder that is replaced.
    ///
    /// # Errors
    /// As [`Lock::acquire`].
    pub fn beside(path: &Path, purpose: &str) -> Result<Self, LockError> {
        Self::take(path, &file_beside(path), purpose)
    }

    /// Who holds the lock of `path` at the moment, without taking it: for what opens read-only then. `None` where it is free.
    pub fn holder(path: &Path) -> Option<Holder> {
        let inside = path.is_dir().then(|| path.join(LOCK_FILE));
        inside.into_iter().chain([file_beside(path)]).find_map(|file| lock_file::held_by(&file))
    }

    fn take(path: &Path, lock_file: &Path, purpose: &str) -> Result<Self, LockError> {
        let mut tries = 0;
        loop {
            let Some(opened) = lock_file::open(lock_file) else { return Ok(Self { held: None }) };
            match lock(&opened) {
                Ok(()) if !opened.is_at_its_path() => {} // its holder removed it between our opening and locking it
                Ok(()) => {
                    opened.record(&Holder::this_process(purpose));
                    return Ok(Self { held: Some(opened) });
                }
                Err(()) => {
                    tries += 1;
                    let holder = opened.holder();
                    // One that has just begun has not said who it is, and one that ends has taken its file away.
                    let passing = holder.is_none() || !opened.is_at_its_path();
                    if tries > MOST_TRIES || (tries > TRIES && !passing) {
                        let (path, lock_file) = (path.to_owned(), opened.path.clone());
                        let holder = holder.map(Box::new);
                        return Err(LockError { path, holder, lock_file });
                    }
                    std::thread::sleep(BETWEEN_TRIES);
                }
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if let Some(opened) = self.held.take() {
            opened.remove();
        }
    }
}

/// `Err` where somebody else holds it.
fn lock(opened: &Opened) -> Result<(), ()> {
    match opened.file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(()),
        // A file system without locks: the record is all there is.
        Err(TryLockError::Error(_)) => match opened.holder() {
            Some(holder) if holder.may_live() => Err(()),
            _ => Ok(()),
        },
    }
}

/// That nobody holds the lock of this file, which is about `path`.
pub(super) fn check_free(path: &Path, lock_file: &Path) -> Result<(), LockError> {
    match lock_file::held_by(lock_file) {
        None => Ok(()),
        holder => {
            let (holder, lock_file) = (holder.map(Box::new), lock_file.to_owned());
            Err(LockError { path: path.to_owned(), holder, lock_file })
        }
    }
}

/// Whether a file of this name is a lock's. Such a file is nobody's content.
pub(super) fn is_lock(name: &OsStr) -> bool {
    let name = name.as_encoded_bytes();
    name.starts_with(b".") && name.ends_with(LOCK_FILE.as_bytes())
}

fn file_beside(path: &Path) -> PathBuf {
    let path = fs::canonicalize(path)
        .or_else(|_| std::path::absolute(path))
        .unwrap_or_else(|_| path.to_owned());
    let name = hidden_name(path.file_name().unwrap_or_default(), LOCK_FILE);
    parent_of(&path).join(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn the_second_hears_who_holds_it_and_nothing_stays() {
        let home = tempfile::tempdir().unwrap();
        let (folder, rig) = (home.path().join("linen"), home.path().join("rig.toml"));
        fs::create_dir(&folder).unwrap();
        fs::write(&rig, "").unwrap();
        for path in [&folder, &rig] {
            assert_eq!(Lock::holder(path), None);
            let lock = Lock::acquire(path, "scan").unwrap();
            let error = Lock::acquire(path, "mask").unwrap_err();
            let holder = Lock::holder(path).unwrap();
            assert_eq!(error.holder.as_deref(), Some(&holder));
            assert_eq!((holder.pid, &*holder.purpose), (std::process::id(), "scan"));
            let said = error.to_string();
            let who = format!(
                "{}: in use by {} (this program: scan, process ",
                path.display(),
                holder.program
            );
            assert!(said.starts_with(&who), "{said}");
            assert!(said.ends_with("; wait until that is done, or stop it"), "{said}");
            drop(lock);
            assert_eq!(Lock::holder(path), None);
            drop(Lock::acquire(path, "mask").unwrap());
        }
        assert!(names(&folder).is_empty());
        assert_eq!(names(home.path()).len(), 2);
    }

    #[test]
    fn the_lock_of_a_process_that_ended_is_free() {
        let home = tempfile::tempdir().unwrap();
        let left = home.path().join(LOCK_FILE);
        fs::write(&left, "program = \"weavelight\"\npid = 1\nhost = \"here\"\n").unwrap();
        assert_eq!(Lock::holder(home.path()), None);
        drop(Lock::acquire(home.path(), "scan").unwrap());
        assert!(!left.exists());
    }

    #[test]
    fn one_of_many_threads_has_it_at_a_time() {
        let home = tempfile::tempdir().unwrap();
        let inside = std::sync::atomic::AtomicUsize::new(0);
        let had = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        let Ok(lock) = Lock::acquire(home.path(), "test") else { continue };
                        assert_eq!(inside.fetch_add(1, std::sync::atomic::Ordering::SeqCst), 0);
                        had.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
                        inside.fetch_sub(1, std::sync::atomic::Ordering::SeqCst);
                        drop(lock);
                    }
                });
            }
        });
        assert!(had.into_inner() > 0);
        assert!(names(home.path()).is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn a_read_only_folder_is_locked_all_the_same() {
        use std::os::unix::fs::PermissionsExt;
        let home = tempfile::tempdir().unwrap();
        fs::set_permissions(home.path(), fs::Permissions::from_mode(0o555)).unwrap();
        let lock = Lock::acquire(home.path(), "scan").unwrap();
        assert!(Lock::acquire(home.path(), "scan").is_err());
        assert!(Lock::holder(home.path()).is_some());
        drop(lock);
        fs::set_permissions(home.path(), fs::Permissions::from_mode(0o755)).unwrap();
    }
}
