//! Files that the program adds to a folder which others add to as well: each is replaced or deleted only while it is what the
//! program wrote, by the folder's list.

use super::atomic::parent_of;
use super::file_list::FileList;
use super::{
    FileError, Lock, clean_temporary, sha256_hex, sha256_of_file, toml_bytes, write_atomic,
};
use serde::Serialize;
use std::fs;
use std::io;
use std::path::Path;

/// What is known of a file that is to be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owned {
    /// There is none.
    Absent,
    /// It is what the program wrote.
    Ours,
    /// It is not on the list, or differs from it.
    NotOurs,
}

/// Takes a folder's lock for the time of some work, cleans up after killed runs, and sees that the `files` that the work will
/// write there may be replaced: before the work, not after it. The folder need not be there yet.
///
/// # Errors
/// Where another process works on the folder, or one of the files is not the program's.
pub fn begin_owned(folder: &Path, purpose: &str, files: &[&str]) -> Result<Lock, FileError> {
    let lock = Lock::acquire(folder, purpose)?;
    clean_temporary(folder);
    files.iter().try_for_each(|file| check_owned(&folder.join(file)).map(drop))?;
    Ok(lock)
}

/// Sees that a file is absent, or is what the program wrote there.
///
/// # Errors
/// [`FileError::NotOurs`] where it is neither.
pub fn check_owned(path: &Path) -> Result<Owned, FileError> {
    match owned(path, &FileList::read(parent_of(path)))? {
        Owned::NotOurs => Err(FileError::NotOurs { path: path.to_owned() }),
        found => Ok(found),
    }
}

fn owned(path: &Path, list: &FileList) -> Result<Owned, FileError> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Owned::Absent),
        Err(error) => return Err(FileError::read(path, error)),
        Ok(found) if !found.is_file() => return Ok(Owned::NotOurs),
        Ok(_) => {}
    }
    let hashes = list.hashes(name(path));
    if hashes.is_empty() || !hashes.contains(&&*sha256_of_file(path)?) {
        return Ok(Owned::NotOurs);
    }
    Ok(Owned::Ours)
}

fn name(path: &Path) -> &Path {
    path.file_name().map_or(path, Path::new)
}

/// As [`write_atomic`], and notes name and hash in the list of the file's folder. A crash at any moment leaves a list that knows
/// the file, old or new.
///
/// # Errors
/// Where a file stands there that is not the program's and has another content, or something cannot be written.
pub fn write_owned(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let mut list = FileList::read(parent_of(path));
    let hash = sha256_hex(bytes);
    if owned(path, &list)? == Owned::NotOurs && !is_same(path, &hash) {
        return Err(FileError::NotOurs { path: path.to_owned() });
    }
    replace(path, bytes, &hash, &mut list)
}

/// Somebody else's file of the same content may stay, and is then as good as ours.
fn is_same(path: &Path, hash: &str) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_file())
        && sha256_of_file(path).is_ok_and(|found| found == hash)
}

fn replace(path: &Path, bytes: &[u8], hash: &str, list: &mut FileList) -> Result<(), FileError> {
    let (folder, name) = (parent_of(path), name(path));
    list.insert(name, hash);
    list.write(folder)?;
    write_atomic(path, bytes)?;
    list.remove(name);
    list.insert(name, hash);
    list.write(folder)
}

/// [`write_owned`] of a value as TOML.
///
/// # Errors
/// As [`write_owned`], or a number that is not finite.
pub fn write_owned_toml<T: Serialize>(path: &Path, value: &T) -> Result<(), FileError> {
    write_owned(path, &toml_bytes(path, value)?)
}

/// As [`write_owned_toml`], for a value that carries on what the file said. One that was edited since stays as it is, with
/// its comments, and so does another program's: the answer says whose it is.
///
/// # Errors
/// Where it cannot be written.
pub fn update_owned_toml<T: Serialize>(path: &Path, value: &T) -> Result<Owned, FileError> {
    let bytes = toml_bytes(path, value)?;
    let mut list = FileList::read(parent_of(path));
    let found = owned(path, &list)?;
    if found != Owned::NotOurs {
        replace(path, &bytes, &sha256_hex(&bytes), &mut list)?;
    }
    Ok(found)
}

/// Deletes those files of `folder` that `is_meant`, and that are still what the program wrote; the others stay. What cannot be
/// deleted is litter.
///
/// # Errors
/// Where the list cannot be written.
pub fn remove_owned(folder: &Path, is_meant: impl Fn(&str) -> bool) -> Result<(), FileError> {
    let mut list = FileList::read(folder);
    let meant: Vec<_> = list
        .iter()
        .map(|(file, _)| file.to_owned())
        .filter(|file| file.to_str().is_some_and(&is_meant))
        .collect();
    if meant.is_empty() {
        return Ok(());
    }
    for file in &meant {
        if owned(&folder.join(file), &list)? == Owned::Ours {
            let _ = fs::remove_file(folder.join(file));
        }
    }
    meant.iter().for_each(|file| list.remove(file));
    list.write(folder)
}

/// Notes in `folder` what is about to be put elsewhere, each file with its hash; replaces what was noted before. Not flushed to
/// the disk: it is for the case that the process is killed.
///
/// # Errors
/// Where it cannot be written.
pub fn note_files(folder: &Path, files: &[(&Path, &str)]) -> Result<(), FileError> {
    let mut list = FileList::default();
    files.iter().for_each(|(file, hash)| list.insert(file, hash));
    list.write_fast(folder)
}

/// Deletes from `root` what was noted in `notes` ([`note_files`]), still has its hash and is not to be kept.
pub fn remove_noted(notes: &Path, root: &Path, is_kept: impl Fn(&Path) -> bool) {
    for (file, hash) in FileList::read(notes).iter().filter(|(file, _)| !is_kept(file)) {
        let path = root.join(file);
        if is_same(&path, hash) {
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::LIST_FILE;

    #[test]
    fn only_what_was_written_is_replaced_and_removed() {
        let home = tempfile::tempdir().unwrap();
        let at = |name: &str| home.path().join(name);
        for (name, content) in [("gain-00.exr", "a"), ("gain-01.exr", "b"), ("camera.toml", "c")] {
            write_owned(&at(name), content.as_bytes()).unwrap();
        }
        write_owned(&at("camera.toml"), b"d").unwrap();
        fs::write(at("gain-99.exr"), "mine").unwrap();
        fs::write(at("gain-01.exr"), "edited").unwrap();
        remove_owned(home.path(), |name| name.starts_with("gain-")).unwrap();
        assert!(!at("gain-00.exr").exists());
        assert_eq!(fs::read_to_string(at("gain-99.exr")).unwrap(), "mine");
        assert_eq!(fs::read_to_string(at("gain-01.exr")).unwrap(), "edited");
        fs::write(at("camera.toml"), "mine").unwrap();
        let error = write_owned(&at("camera.toml"), b"e").unwrap_err().to_string();
        assert!(error.contains("camera.toml: "), "{error}");
        assert_eq!(fs::read_to_string(at("camera.toml")).unwrap(), "mine");
        // The same content does no harm.
        write_owned(&at("camera.toml"), b"mine").unwrap();
        assert_eq!(check_owned(&at("camera.toml")).unwrap(), Owned::Ours);
        fs::remove_file(at(LIST_FILE)).unwrap();
        assert!(check_owned(&at("camera.toml")).is_err());
        let update = || update_owned_toml(&at("camera.toml"), &toml::Table::new()).unwrap();
        assert_eq!(update(), Owned::NotOurs);
        assert_eq!(fs::read_to_string(at("camera.toml")).unwrap(), "mine");
        assert!(check_owned(&at("camera.toml")).is_err());
        fs::remove_file(at("camera.toml")).unwrap();
        assert_eq!(update(), Owned::Absent);
        assert_eq!(update(), Owned::Ours);
    }

    /// Killed before, between and after the two writes of the list, the file can be replaced again.
    #[test]
    fn a_crash_between_list_and_file_does_not_lock_anybody_out() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("lights.toml");
        write_owned(&path, b"old").unwrap();
        let mut list = FileList::read(home.path());
        list.insert(Path::new("lights.toml"), &sha256_hex(b"new"));
        list.write(home.path()).unwrap();
        assert_eq!(check_owned(&path).unwrap(), Owned::Ours);
        fs::write(&path, "new").unwrap();
        assert_eq!(check_owned(&path).unwrap(), Owned::Ours);
        write_owned(&path, b"newer").unwrap();
        assert_eq!(FileList::read(home.path()).hashes(Path::new("lights.toml")).len(), 1);
    }
}
