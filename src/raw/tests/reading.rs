//! Frames from files.

use super::dng::{PLAIN, file};
use crate::raw::{Hint, ReadError, Source, read, read_all, read_source};
use sha2::{Digest, Sha256};
use std::path::Path;

fn write(folder: &Path, name: &str, bytes: &[u8]) -> Source {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    Source { path, hint: Hint::default(), sha256: None }
}

#[test]
fn many_files_come_back_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let good = file(PLAIN, vec![]);
    let mut sources: Vec<Source> =
        (0..9).map(|i| write(folder.path(), &format!("{i}.dng"), &good)).collect();
    std::fs::write(&sources[4].path, "notes").unwrap();
    sources[7].path = folder.path().join("absent.dng");
    let frames = read_all(&sources);
    let expected = read(&sources[0].path, &Hint::default()).unwrap();
    for (i, frame) in frames.iter().enumerate() {
        match i {
            4 => assert!(
                matches!(frame, Err(ReadError::Decode { path, .. }) if path.ends_with("4.dng"))
            ),
            7 => assert!(
                matches!(frame, Err(ReadError::Io { path, .. }) if path.ends_with("absent.dng"))
            ),
            _ => assert_eq!(frame.as_ref().unwrap(), &expected),
        }
    }
}

#[test]
fn the_hash_is_checked_on_reading() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = file(PLAIN, vec![]);
    let hash: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02X}")).collect();
    let mut source = write(folder.path(), "a.dng", &bytes);
    source.sha256 = Some(hash);
    assert!(read_source(&source).is_ok());
    let mut altered = bytes;
    altered[100] ^= 1;
    std::fs::write(&source.path, altered).unwrap();
    let error = read_source(&source).unwrap_err().to_string();
    assert!(
        error.contains("a.dng") && error.contains("altered") && error.lines().count() == 1,
        "{error}"
    );
}
