use super::FileError;
use super::atomic::{parent_of, special, sync_folder};
use super::exchange::exchange;
use super::file_list::{FileList, LIST_FILE};
use super::hidden::{PARTIAL, hidden_name};
use super::leftovers::{self, UNFINISHED};
use super::lock::Lock;
use super::survey::Survey;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What kind of folder is written: tells an earlier output, which may be replaced, from another kind.
#[derive(Clone, Copy, Debug)]
pub struct OutputKind {
    /// As in "solution", for messages.
    pub name: &'static str,
    /// A file that every finished output of this kind has. `None`: such a folder is never replaced.
    pub marker: Option<&'static str>,
}

/// An output folder under construction beside its final place. [`StagedFolder::commit`] moves it there; dropping it
/// removes it. A crash leaves at most `.NAME.partial-xxxxxx`, which the next run beside it takes away, and never anything
/// unfinished under the final name.
///
/// A finished output holds [`LIST_FILE`] with the name and hash of every file, those in its folders included. An earlier output
/// is replaced only if every file in it is listed and has its hash. A file, folder or link that was added, and a file that was
/// changed, is named in an error, before the work and again at its end. An output inside another one (a solution in a
/// simulation's folder) is something added: the outer one is not replaced as long as it stands there. A folder without a list
/// was written by an earlier version or by somebody else, and is not replaced.
///
/// The place is locked from [`StagedFolder::create`] on, so that two processes cannot write one output.
#[derive(Debug)]
pub struct StagedFolder {
    partial: Option<tempfile::TempDir>,
    target: PathBuf,
    kind: OutputKind,
    /// What stood at the target at first.
    before: Option<Survey>,
    /// Parents that did not exist before, outermost first; removed again if nothing comes of it.
    made_parents: Vec<PathBuf>,
    lock: Option<Lock>,
}

impl StagedFolder {
    /// Starts an output that will stand at `target`.
    ///
    /// # Errors
    /// Where `target` is a file, or a folder that is neither empty nor an earlier output of this kind as it was written, or
    /// another process writes it, or nothing can be written beside it.
    pub fn create(target: &Path, kind: OutputKind) -> Result<Self, FileError> {
        let target = absolute(target)?;
        // Before anything is made or read: what stands in the way by its name alone.
        check_no_file(&target)?;
        let parent = parent_of(&target).to_owned();
        check_one_disk(&target, &parent)?;
        let made_parents = make_parents(&parent)?;
        let (partial, before, lock) = (None, None, None);
        let mut staged = Self { partial, target, kind, before, made_parents, lock };
        staged.lock = Some(Lock::beside(&staged.target, kind.name)?);
        leftovers::clean(&staged.target);
        staged.before = check_free(&staged.target, kind, None)?;
        staged.partial = Some(staged.begin(&parent)?);
        Ok(staged)
    }

    fn begin(&self, parent: &Path) -> Result<tempfile::TempDir, FileError> {
        let failed = |source| FileError::write(&self.target, source);
        let name = self.target.file_name().unwrap_or_default();
        let prefix = hidden_name(name, PARTIAL);
        let partial = folder_builder(&prefix).tempdir_in(parent).map_err(failed)?;
        fs::write(partial.path().join(UNFINISHED), name.as_encoded_bytes()).map_err(failed)?;
        Ok(partial)
    }

    /// Where to write meanwhile.
    pub fn path(&self) -> &Path {
        self.partial.as_ref().map_or(&self.target, tempfile::TempDir::path)
    }

    /// The final place.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// A path inside the folder under construction.
    pub fn join(&self, name: impl AsRef<Path>) -> PathBuf {
        self.path().join(name)
    }

    /// Moves the whole folder to its final place, with the list of its files. An earlier output stands untouched until this
    /// moment.
    ///
    /// # Errors
    /// Where the place was taken meanwhile, or the data cannot be flushed or renamed.
    pub fn commit(mut self) -> Result<(), FileError> {
        let failed = |source| FileError::write(&self.target, source);
        // Hashing needs the processor and flushing the disk.
        let (flushed, list) = rayon::join(
            || sync_tree(self.path()),
            || FileList::of(self.path(), &[LIST_FILE, UNFINISHED]),
        );
        flushed.map_err(failed)?;
        list?.write(self.path())?;
        fs::remove_file(self.join(UNFINISHED)).map_err(failed)?;
        sync_folder(self.path());
        let before = check_free(&self.target, self.kind, self.before.as_ref())?;
        match before {
            None => fs::rename(self.path(), &self.target).map_err(failed)?,
            Some(before) => self.replace(&before)?,
        }
        if let Some(partial) = self.partial.take() {
            let _ = partial.keep();
        }
        sync_folder(parent_of(&self.target));
        self.made_parents.clear();
        Ok(())
    }

    /// Takes the place of the earlier output and deletes that.
    fn replace(&self, before: &Survey) -> Result<(), FileError> {
        let failed = |source| FileError::write(&self.target, source);
        exchange(self.path(), &self.target).map_err(failed)?;
        sync_folder(parent_of(&self.target));
        // Nothing is added under this name any more: what came since the last look is found now.
        let now = Survey::of(self.path(), Some(before));
        let found = match &now {
            Ok(now) => now.as_ref().and_then(Survey::in_the_way),
            Err(_) => Some("something that cannot be read".to_owned()),
        };
        if let Some(what) = found {
            exchange(self.path(), &self.target).map_err(failed)?;
            return Err(holds(&self.target, &what, self.kind));
        }
        if let Ok(Some(now)) = now {
            // The new output is in place; what cannot be removed is litter, and tried again by the next run.
            now.delete(self.path());
        }
        Ok(())
    }
}

impl Drop for StagedFolder {
    fn drop(&mut self) {
        drop(self.partial.take());
        drop(self.lock.take());
        for parent in self.made_parents.iter().rev() {
            // Fails where something else stands in it by now: then it stays.
            let _ = fs::remove_dir(parent);
        }
    }
}

fn absolute(target: &Path) -> Result<PathBuf, FileError> {
    let failed = |source| FileError::write(target, source);
    // `.` and `x/..` have no name of their own to rename to; an existing folder is known by its real path.
    if target.exists() {
        fs::canonicalize(target).map_err(failed)
    } else {
        std::path::absolute(target).map_err(failed)
    }
}

fn check_no_file(target: &Path) -> Result<(), FileError> {
    if let Some(what) = special(target) {
        return Err(occupied(target, what));
    }
    match fs::symlink_metadata(target) {
        Ok(found) if !found.is_dir() => Err(occupied(target, "is a file".to_owned())),
        Err(error) if error.kind() == io::ErrorKind::NotADirectory => {
            Err(FileError::write(target, error))
        }
        _ => Ok(()),
    }
}

/// What stands at the target, if anything: all of it may be deleted.
fn check_free(
    target: &Path,
    kind: OutputKind,
    before: Option<&Survey>,
) -> Result<Option<Survey>, FileError> {
    check_no_file(target)?;
    let Some(survey) = Survey::of(target, before)? else { return Ok(None) };
    if survey.is_empty() {
        return Ok(Some(survey));
    }
    let Some(marker) = kind.marker else {
        let first = survey.any_name().unwrap_or_default();
        return Err(occupied(target, format!("holds {first}; a {} is never replaced", kind.name)));
    };
    if !survey.is_listed {
        let first = survey.any_name().unwrap_or_default();
        let what = format!(
            "holds {first}, and no {LIST_FILE} says that weavelight wrote it; only an earlier {} and nothing else would be replaced",
            kind.name
        );
        return Err(occupied(target, what));
    }
    if let Some(what) = survey.in_the_way() {
        return Err(holds(target, &what, kind));
    }
    if !survey.has(marker) {
        let rule = format!("only an earlier {} and nothing else would be replaced", kind.name);
        return Err(occupied(
            target,
            format!("is not a {} (no {marker} in it); {rule}", kind.name),
        ));
    }
    Ok(Some(survey))
}

fn holds(target: &Path, what: &str, kind: OutputKind) -> FileError {
    let rule = format!("only an earlier {} and nothing else would be replaced", kind.name);
    occupied(target, format!("holds {what}; {rule}"))
}

/// A folder cannot be renamed onto the root of another disk; said before the work, not after it.
#[cfg(unix)]
fn check_one_disk(target: &Path, parent: &Path) -> Result<(), FileError> {
    use std::os::unix::fs::MetadataExt;
    let disk = |path: &Path| fs::metadata(path).map(|metadata| metadata.dev()).ok();
    match (disk(target), disk(parent)) {
        (Some(a), Some(b)) if a != b => Err(occupied(target, "is the root of a disk".to_owned())),
        _ => Ok(()),
    }
}

#[cfg(not(unix))]
fn check_one_disk(_target: &Path, _parent: &Path) -> Result<(), FileError> {
    Ok(())
}

fn occupied(target: &Path, what: String) -> FileError {
    FileError::Occupied { path: target.to_owned(), what }
}

fn make_parents(parent: &Path) -> Result<Vec<PathBuf>, FileError> {
    let missing: Vec<PathBuf> =
        parent.ancestors().take_while(|path| !path.exists()).map(Path::to_owned).collect();
    fs::create_dir_all(parent).map_err(|source| FileError::write(parent, source))?;
    Ok(missing.into_iter().rev().collect())
}

/// Temporary folders are private by default; what is renamed into place gets the permissions any new folder gets.
#[cfg(unix)]
fn folder_builder(prefix: &std::ffi::OsStr) -> tempfile::Builder<'_, 'static> {
    use std::os::unix::fs::PermissionsExt;
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix).permissions(fs::Permissions::from_mode(0o777));
    builder
}

#[cfg(not(unix))]
fn folder_builder(prefix: &std::ffi::OsStr) -> tempfile::Builder<'_, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
    builder
}

/// Flushes every file below `folder`: a full disk may show only now.
fn sync_tree(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_tree(&entry.path())?;
        } else {
            fs::File::open(entry.path())?.sync_all()?;
        }
    }
    sync_folder(folder);
    Ok(())
}

#[cfg(test)]
#[path = "staged_tests.rs"]
mod tests;
