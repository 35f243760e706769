use super::FileError;
use super::hidden::RANDOM;
use super::input::what_else;
use std::ffi::OsStr;
use std::fs::{File, Permissions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes a file so that it is there whole or not at all: beside its place first, flushed to the disk, then renamed.
///
/// # Errors
/// Where the folder cannot be written, or the disk is full; the old file, if any, is then as it was.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let path = &real_target(path)?;
    let failed = |source| FileError::write(path, source);
    let folder = parent_of(path);
    let mut file = builder(path).tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    sync_folder(folder);
    Ok(())
}

/// Where writing to `path` leads: renaming onto a link would replace the link, and onto a device the device.
fn real_target(path: &Path) -> Result<PathBuf, FileError> {
    let unwritable = |what| FileError::Unwritable { path: path.to_owned(), what };
    if let Some(what) = special(path) {
        return Err(unwritable(format!("it {what}; name a new file")));
    }
    match std::fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => {
            Err(unwritable("it is a folder; name a file in it".to_owned()))
        }
        Ok(found) if found.is_symlink() => {
            std::fs::canonicalize(path).map_err(|source| FileError::write(path, source))
        }
        _ => Ok(path.to_owned()),
    }
}

/// Sees that a folder to be written to later is not something else already: said before the work, not after it.
///
/// # Errors
/// Where it is a file, a named pipe, a device, or a link to nowhere.
pub fn check_output_folder(path: &Path) -> Result<(), FileError> {
    let what = special(path).or_else(|| path.is_file().then(|| "is a file".to_owned()));
    what.map_or(Ok(()), |what| Err(FileError::Occupied { path: path.to_owned(), what }))
}

/// What stands at `path`, if it is neither file nor folder, as in "is a named pipe"; links are followed.
pub(super) fn special(path: &Path) -> Option<String> {
    let itself = std::fs::symlink_metadata(path).ok()?;
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => None,
        Ok(found) => what_else(&found).map(|what| format!("is {what}")),
        Err(_) if itself.is_symlink() => {
            let to = std::fs::read_link(path).unwrap_or_default();
            Some(format!("is a link to {}, which is not there", to.display()))
        }
        Err(_) => None,
    }
}

/// The folder a path is in; "." for a bare name.
pub fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A rename is only as durable as its folder. Some file systems refuse to sync a folder; the data itself is then synced
/// already, so a refusal is no error.
pub(super) fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// How the names of temporary files begin.
const TEMPORARY: &str = ".weavelight-partial-";

/// Whether a file of this name is one that [`write_atomic`] had not finished.
pub(super) fn is_temporary(name: &OsStr) -> bool {
    let random = name.as_encoded_bytes().strip_prefix(TEMPORARY.as_bytes());
    random.is_some_and(|rest| rest.len() == RANDOM && rest.iter().all(u8::is_ascii_alphanumeric))
}

/// Takes away what writers that were killed left in `folder`. Only for whoever holds the folder's [`super::Lock`]: the file of a
/// process that still writes would go too.
pub fn clean_temporary(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && is_temporary(&entry.file_name()) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Temporary files are private by default; what is renamed into place gets the permissions any new file gets.
#[cfg(unix)]
fn builder(path: &Path) -> tempfile::Builder<'static, 'static> {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::metadata(path).map_or(0o666, |old| old.permissions().mode() & 0o777);
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY).permissions(Permissions::from_mode(mode));
    builder
}

#[cfg(not(unix))]
fn builder(_path: &Path) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY);
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_whole_and_leaves_nothing_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        write_atomic(&path, b"one").unwrap();
        write_atomic(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such/a.toml");
        let error = write_atomic(&path, b"one").unwrap_err().to_string();
        assert!(error.contains("a.toml"), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn links_stay_and_devices_and_pipes_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("file"), "old").unwrap();
        std::os::unix::fs::symlink(at("file"), at("link")).unwrap();
        write_atomic(&at("link"), b"new").unwrap();
        assert_eq!(std::fs::read(at("file")).unwrap(), b"new");
        assert!(std::fs::symlink_metadata(at("link")).unwrap().is_symlink());

        use rustix::fs::{CWD, FileType, Mode, mknodat};
        mknodat(CWD, at("pipe"), FileType::Fifo, Mode::RUSR, 0).unwrap();
        std::os::unix::fs::symlink("/no/such", at("nowhere")).unwrap();
        std::os::unix::fs::symlink("/dev/null", at("device")).unwrap();
        for (name, what) in [
            ("pipe", "cannot be written: it is a named pipe; name a new file"),
            ("nowhere", "it is a link to /no/such, which is not there"),
            ("device", "it is a device"),
            ("", "it is a folder"),
        ] {
            let error = write_atomic(&at(name), b"x").unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_what_was_written() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_atomic(&ours, b"x").unwrap();
        std::fs::write(&plain, b"x").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
