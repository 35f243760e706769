use super::FileError;
use super::atomic::{parent_of, sync_folder};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What kind of folder is written: tells an earlier output, which may be replaced, from a folder that is somebody's.
#[derive(Clone, Copy, Debug)]
pub struct OutputKind {
    /// As in "solution", for messages.
    pub name: &'static str,
    /// A file that every finished output of this kind has. `None`: such a folder is never replaced.
    pub marker: Option<&'static str>,
    /// Every name that may stand in such a folder; a `*` at the end stands for any ending. A folder that holds anything
    /// else is not replaced, lest a user's own files go with it.
    pub members: &'static [&'static str],
}

impl OutputKind {
    fn owns(&self, name: &str) -> bool {
        self.members.iter().any(|member| match member.strip_suffix('*') {
            Some(start) => name.starts_with(start),
            None => name == *member,
        })
    }
}

/// An output folder under construction beside its final place. [`StagedFolder::commit`] moves it there; dropping it
/// removes it. A crash leaves at most `.NAME.partial-xxxx`, never anything under the final name.
#[derive(Debug)]
pub struct StagedFolder {
    partial: Option<tempfile::TempDir>,
    target: PathBuf,
    kind: OutputKind,
    /// Parents that did not exist before, outermost first; removed again if nothing comes of it.
    made_parents: Vec<PathBuf>,
}

impl StagedFolder {
    /// Starts an output that will stand at `target`.
    ///
    /// # Errors
    /// Where `target` is a file, or a folder that is neither empty nor an earlier output of this kind, or where nothing
    /// can be written beside it.
    pub fn create(target: &Path, kind: OutputKind) -> Result<Self, FileError> {
        let target = absolute(target)?;
        check_free(&target, kind)?;
        let parent = parent_of(&target).to_owned();
        check_one_disk(&target, &parent)?;
        let made_parents = make_parents(&parent)?;
        let prefix =
            format!(".{}.partial-", target.file_name().unwrap_or_default().to_string_lossy());
        let mut staged = Self { partial: None, target, kind, made_parents };
        let partial = folder_builder(&prefix).tempdir_in(&parent);
        staged.partial = Some(partial.map_err(|source| FileError::write(&staged.target, source))?);
        Ok(staged)
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

    /// Moves the whole folder to its final place. An earlier output stands untouched until this moment.
    ///
    /// # Errors
    /// Where the place was taken meanwhile, or the data cannot be flushed or renamed.
    pub fn commit(mut self) -> Result<(), FileError> {
        let failed = |source| FileError::write(&self.target, source);
        sync_tree(self.path()).map_err(failed)?;
        check_free(&self.target, self.kind)?;
        let old = self.set_old_aside()?;
        if let Err(source) = fs::rename(self.path(), &self.target) {
            if let Some(old) = &old {
                let _ = fs::rename(old, &self.target);
            }
            return Err(failed(source));
        }
        if let Some(partial) = self.partial.take() {
            let _ = partial.keep();
        }
        sync_folder(parent_of(&self.target));
        if let Some(old) = old {
            // The new output is in place; what cannot be removed is only litter.
            let _ = fs::remove_dir_all(old);
        }
        self.made_parents.clear();
        Ok(())
    }

    /// Renames what stands at the target, if anything, and says where to.
    fn set_old_aside(&self) -> Result<Option<PathBuf>, FileError> {
        if !self.target.exists() {
            return Ok(None);
        }
        let mut name = self.path().file_name().unwrap_or_default().to_owned();
        name.push(".old");
        let aside = self.target.with_file_name(name);
        fs::rename(&self.target, &aside)
            .map_err(|source| FileError::write(&self.target, source))?;
        Ok(Some(aside))
    }
}

impl Drop for StagedFolder {
    fn drop(&mut self) {
        drop(self.partial.take());
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

fn check_free(target: &Path, kind: OutputKind) -> Result<(), FileError> {
    let entries = match fs::read_dir(target) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotADirectory && target.is_file() => {
            return Err(occupied(target, "is a file".to_owned()));
        }
        Err(error) => return Err(FileError::write(target, error)),
    };
    let names: Vec<String> = entries
        .filter_map(Result::ok)
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    let finished = kind.marker.is_some_and(|marker| names.iter().any(|name| name == marker));
    let foreign = names.iter().filter(|name| !finished || !kind.owns(name)).min();
    match (foreign, kind.marker) {
        (None, _) => Ok(()),
        (Some(name), Some(_)) => {
            let what = format!(
                "holds {name}; only an earlier {} and nothing else would be replaced",
                kind.name
            );
            Err(occupied(target, what))
        }
        (Some(name), None) => {
            Err(occupied(target, format!("holds {name}; a {} is never replaced", kind.name)))
        }
    }
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
fn folder_builder(prefix: &str) -> tempfile::Builder<'_, 'static> {
    use std::os::unix::fs::PermissionsExt;
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix).permissions(fs::Permissions::from_mode(0o777));
    builder
}

#[cfg(not(unix))]
fn folder_builder(prefix: &str) -> tempfile::Builder<'_, 'static> {
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
mod tests {
    use super::*;

    const KIND: OutputKind = OutputKind {
        name: "solution",
        marker: Some("report.json"),
        members: &["report.json", "tilt-*", "a"],
    };

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// What happens to a target that holds `present` when `report.json` is staged and committed.
    fn check(present: &[&str], expected: &str) {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("out");
        if !present.is_empty() {
            fs::create_dir(&target).unwrap();
        }
        for name in present.iter().filter(|name| **name != "/") {
            fs::write(target.join(name), "old").unwrap();
        }
        let found = match StagedFolder::create(&target, KIND) {
            Ok(staged) => {
                fs::write(staged.join("report.json"), "new").unwrap();
                staged.commit().unwrap();
                names(&target).join(" ")
            }
            Err(error) => error.to_string(),
        };
        assert!(found.contains(expected), "{present:?}: {found}");
        assert_eq!(names(home.path()), ["out"], "{present:?}");
    }

    #[test]
    fn only_empty_folders_and_earlier_outputs_are_replaced() {
        check(&[], "report.json");
        check(&["/"], "report.json");
        check(&["report.json", "tilt-3", "a"], "report.json");
        check(
            &["report.json", "thesis.tex"],
            "holds thesis.tex; only an earlier solution and nothing else",
        );
        check(&["a"], "holds a; only an earlier solution");
    }

    #[test]
    fn dropping_leaves_the_old_output_and_no_new_parents() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("out");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("report.json"), "old").unwrap();
        let staged = StagedFolder::create(&target, KIND).unwrap();
        fs::write(staged.join("report.json"), "new").unwrap();
        drop(staged);
        assert_eq!(fs::read_to_string(target.join("report.json")).unwrap(), "old");
        drop(StagedFolder::create(&home.path().join("x/y/z"), KIND).unwrap());
        assert_eq!(names(home.path()), ["out"]);
    }

    #[test]
    fn a_file_in_the_way_is_named() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("out");
        fs::write(&target, "mine").unwrap();
        let error = StagedFolder::create(&target, KIND).unwrap_err().to_string();
        assert!(error.contains("out: is a file; choose"), "{error}");
        assert_eq!(fs::read_to_string(target).unwrap(), "mine");
    }
}
