//! Frames from files: hashes checked, several at once.

use super::{Frame, Hint, ReadError, decode};
use crate::files::{InputKind, read_input};
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// A frame's file and what the capture session says of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// What the file may not say.
    pub hint: Hint,
    /// SHA-256 that the file must have, hexadecimal; not checked where absent.
    pub sha256: Option<String>,
}

/// Reads and decodes one file.
///
/// # Errors
/// [`ReadError`] with the path.
pub fn read(path: &Path, hint: &Hint) -> Result<Frame, ReadError> {
    read_source(&Source { path: path.to_owned(), hint: *hint, sha256: None })
}

/// Reads one file, checks its hash and decodes it.
///
/// # Errors
/// [`ReadError`] with the path.
pub fn read_source(source: &Source) -> Result<Frame, ReadError> {
    let path = || source.path.clone();
    let bytes = read_input(&source.path, InputKind::Picture)
        .map_err(|error| ReadError::Io { path: path(), source: error })?;
    if let Some(expected) = &source.sha256 {
        let found = hex(&Sha256::digest(&bytes));
        if !found.eq_ignore_ascii_case(expected.trim()) {
            let short = |hash: &str| hash.chars().take(8).collect();
            return Err(ReadError::Altered {
                path: path(),
                expected: short(expected),
                found: short(&found),
            });
        }
    }
    decode(&bytes, &source.hint).map_err(|error| ReadError::Decode { path: path(), source: error })
}

/// Reads and decodes many files in parallel; the results are in the order of the sources. Beside the results, memory holds at
/// most one file per thread of the current rayon pool.
pub fn read_all(sources: &[Source]) -> Vec<Result<Frame, ReadError>> {
    sources.par_iter().with_max_len(1).map(read_source).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
