//! What stands in a folder that is to be replaced: proven to be the program's, or in the way.

use super::atomic::is_temporary;
use super::file_list::{FileList, LIST_FILE};
use super::lock::{self, is_lock};
use super::{FileError, sha256_of_file};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// How many names an error gives.
const MOST_NAMES: usize = 3;

/// A folder looked through, with everything below it.
#[derive(Debug, Default)]
pub(super) struct Survey {
    /// Files that have the hash of the list, and what they looked like then.
    proven: BTreeMap<PathBuf, Stamp>,
    /// Left by a process that ended: lock files, temporary files.
    litter: Vec<PathBuf>,
    /// The deepest last.
    folders: Vec<PathBuf>,
    /// What the program may not delete.
    pub(super) foreign: BTreeMap<PathBuf, Why>,
    /// Whether the folder has a list at all.
    pub(super) is_listed: bool,
    list: FileList,
}

/// Why something may not be deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// The program did not write it.
    Added,
    /// It is no longer what the program wrote.
    Changed,
}

/// As long as this stays the same, so does the content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    bytes: u64,
    modified: Option<SystemTime>,
    inode: [i64; 4],
}

impl Stamp {
    #[cfg(unix)]
    fn of(file: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        // The time of the last change of the inode cannot be set back by ordinary means.
        let inode = [file.dev() as i64, file.ino() as i64, file.ctime(), file.ctime_nsec()];
        Self { bytes: file.len(), modified: file.modified().ok(), inode }
    }

    #[cfg(not(unix))]
    fn of(file: &Metadata) -> Self {
        Self { bytes: file.len(), modified: file.modified().ok(), inode: [0; 4] }
    }
}

impl Survey {
    /// Looks through `folder`; `None` where there is none. Files that look as they did in `before` are not read again.
    pub(super) fn of(folder: &Path, before: Option<&Self>) -> Result<Option<Self>, FileError> {
        match fs::symlink_metadata(folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(FileError::read(folder, error)),
            Ok(_) => {}
        }
        let list = FileList::read(folder);
        let mut survey = Self { is_listed: !list.is_empty(), list, ..Self::default() };
        let mut found = BTreeMap::new();
        survey.look(folder, Path::new(""), &mut found)?;
        // Whatever is in the way is in the way; the rest need not be read then.
        if survey.foreign.is_empty() {
            survey.prove(folder, found, before)?;
        }
        Ok(Some(survey))
    }

    fn look(
        &mut self,
        root: &Path,
        below: &Path,
        found: &mut BTreeMap<PathBuf, Stamp>,
    ) -> Result<(), FileError> {
        let folder = root.join(below);
        let failed = |error| FileError::read(&folder, error);
        for entry in fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let (path, metadata) =
                (below.join(entry.file_name()), entry.metadata().map_err(failed)?);
            if metadata.is_dir() {
                if self.list.reaches_into(&path) {
                    self.folders.push(path.clone());
                    self.look(root, &path, found)?;
                } else {
                    self.foreign.insert(path, Why::Added);
                }
            } else if !metadata.is_file() {
                self.foreign.insert(path, Why::Added);
            } else if path == Path::new(LIST_FILE) {
                self.litter.push(path);
            } else if is_lock(&entry.file_name()) {
                lock::check_free(&folder, &entry.path())?;
                self.litter.push(path);
            } else if is_temporary(&entry.file_name()) {
                self.litter.push(path);
            } else if self.list.hashes(&path).is_empty() {
                self.foreign.insert(path, Why::Added);
            } else {
                found.insert(path, Stamp::of(&metadata));
            }
        }
        Ok(())
    }

    fn prove(
        &mut self,
        root: &Path,
        found: BTreeMap<PathBuf, Stamp>,
        before: Option<&Self>,
    ) -> Result<(), FileError> {
        let known = |path: &PathBuf, stamp: &Stamp| {
            before.is_some_and(|before| before.proven.get(path) == Some(stamp))
        };
        let (same, unread): (BTreeMap<_, _>, BTreeMap<_, _>) =
            found.into_iter().partition(|(path, stamp)| known(path, stamp));
        self.proven.extend(same);
        let read: Result<Vec<(PathBuf, Stamp, String)>, FileError> = unread
            .into_par_iter()
            .map(|(path, stamp)| Ok((path.clone(), stamp, sha256_of_file(&root.join(&path))?)))
            .collect();
        for (path, stamp, hash) in read? {
            if self.list.hashes(&path).contains(&&*hash) {
                self.proven.insert(path, stamp);
            } else {
                self.foreign.insert(path, Why::Changed);
            }
        }
        Ok(())
    }

    /// Whether nothing at all is in it.
    pub(super) fn is_empty(&self) -> bool {
        self.proven.is_empty() && self.foreign.is_empty() && !self.is_listed
    }

    /// Whether a file of this name is the program's.
    pub(super) fn has(&self, name: &str) -> bool {
        self.proven.contains_key(Path::new(name))
    }

    /// A name in it, the first.
    pub(super) fn any_name(&self) -> Option<String> {
        let names = self.foreign.keys().chain(self.proven.keys()).chain(&self.litter);
        names.min().map(|path| path.display().to_string())
    }

    /// What is in the way, for an error: `notes.txt, which weavelight did not write`.
    pub(super) fn in_the_way(&self) -> Option<String> {
        let (first, why) = self.foreign.first_key_value()?;
        let alike: Vec<String> = self
            .foreign
            .iter()
            .filter(|(_, other)| *other == why)
            .map(|(path, _)| path.display().to_string())
            .collect();
        let names = match alike.len() {
            0..=MOST_NAMES => alike.join(", "),
            count => format!("{} and {} more", first.display(), count - 1),
        };
        Some(match why {
            Why::Added => format!("{names}, which weavelight did not write"),
            Why::Changed => format!("{names}, changed since weavelight wrote it"),
        })
    }

    /// Deletes from `folder` what is proven and still looks as it did, and the folder itself if nothing is left in it.
    pub(super) fn delete(&self, folder: &Path) {
        let same = |path: &Path, stamp: &Stamp| {
            fs::symlink_metadata(path).is_ok_and(|now| now.is_file() && Stamp::of(&now) == *stamp)
        };
        for (path, stamp) in &self.proven {
            let path = folder.join(path);
            if same(&path, stamp) {
                let _ = fs::remove_file(path);
            }
        }
        // The list goes last but for the folders: until then, what is left can be proven.
        let (list, litter): (Vec<_>, Vec<_>) =
            self.litter.iter().partition(|path| **path == Path::new(LIST_FILE));
        for path in litter.into_iter().chain(list) {
            let _ = fs::remove_file(folder.join(path));
        }
        for path in self.folders.iter().rev() {
            // Fails where something else stands in it by now: then it stays.
            let _ = fs::remove_dir(folder.join(path));
        }
        let _ = fs::remove_dir(folder);
    }
}
