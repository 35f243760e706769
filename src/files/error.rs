use super::document::readable;
use super::input::Refused;
use super::{LockError, Setting, shown};
use crate::quantity::Problem;
use std::io;
use std::path::{Path, PathBuf};

/// What goes wrong with files. Each message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file or folder could not be read.
    #[error("{}: {}", shown(.path).display(), read_advice(.source))]
    Read {
        /// What was to be read.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The file or folder could not be written.
    #[error("{}: {}", shown(.path).display(), write_advice(.source))]
    Write {
        /// What was to be written.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The text is not what the format allows.
    #[error("{}:{line}: {what}", shown(.path).display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong and what to do.
        what: String,
    },
    /// The content is not what the file's name promises.
    #[error("{}: {what}", shown(.path).display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        what: String,
    },
    /// The file is of another version of the format.
    #[error("{}:{line}: schema {found}, but this version reads schema {supported}; use the weavelight that wrote it", shown(.path).display())]
    Schema {
        /// The file.
        path: PathBuf,
        /// Line of the number.
        line: usize,
        /// The number found.
        found: i64,
        /// The number read.
        supported: i64,
    },
    /// A number about to be written is NaN or infinite.
    #[error("{}: `{key}` is not a finite number and was not written; this is a fault of the computation before it", shown(.path).display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The key.
        key: String,
    },
    /// Something about to be written does not fit the format.
    #[error("{}: cannot be written: {what}", shown(.path).display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        what: String,
    },
    /// The output folder holds something that is not ours to replace.
    #[error("{}: {what}; move that elsewhere, or choose an empty or new {}", shown(.path).display(), Setting("out"))]
    Occupied {
        /// The folder.
        path: PathBuf,
        /// What is in the way, and why it stays.
        what: String,
    },
    /// A file that would be replaced is not what the program wrote there.
    #[error("{}: is not as weavelight wrote it, and would be lost; move it elsewhere, or choose another {}", shown(.path).display(), Setting("out"))]
    NotOurs {
        /// The file.
        path: PathBuf,
    },
    /// Another process writes there.
    #[error(transparent)]
    InUse(#[from] LockError),
}

impl FileError {
    /// An error from reading `path`.
    pub fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_owned(), source }
    }

    /// What a check found in something about to be written: the reader would refuse it.
    pub fn unwritable(path: &Path, problem: &Problem) -> Self {
        let what = format!("`{}` {}", readable(&problem.key), problem.what);
        Self::Unwritable { path: path.to_owned(), what }
    }

    /// An error from writing `path`.
    pub fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.to_owned(), source }
    }
}

/// Why a file was not read and what to do, to follow its name.
fn read_advice(source: &io::Error) -> String {
    if let Some(refused) = source.get_ref().and_then(|inner| inner.downcast_ref::<Refused>()) {
        return refused.to_string();
    }
    match source.kind() {
        io::ErrorKind::NotFound => "not found; check the path".to_owned(),
        io::ErrorKind::PermissionDenied => "may not be read; check its permissions".to_owned(),
        io::ErrorKind::InvalidData => {
            "is not UTF-8 text; check that this is the right file".to_owned()
        }
        io::ErrorKind::IsADirectory => {
            "is a folder where a file is expected; name the file".to_owned()
        }
        io::ErrorKind::NotADirectory => {
            "a part of this path is a file, not a folder; check the path".to_owned()
        }
        _ => format!("cannot be read ({source}); check the disk and the path"),
    }
}

fn write_advice(source: &io::Error) -> String {
    let out = Setting("out");
    let what = match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "no space left on this disk; free some or choose"
        }
        io::ErrorKind::FileTooLarge => {
            "the file would be larger than its disk or a limit allows (see ulimit -f); raise the limit or choose"
        }
        io::ErrorKind::ReadOnlyFilesystem => "the disk is read-only; choose",
        io::ErrorKind::PermissionDenied => "may not be written; check its permissions or choose",
        io::ErrorKind::NotADirectory => "a part of this path is a file, not a folder; choose",
        io::ErrorKind::AlreadyExists => "something that is no folder has this name; choose",
        _ => {
            return format!("cannot be written ({source}); check the disk or choose another {out}");
        }
    };
    format!("{what} another {out}")
}
