use super::{FrameEntry, MANIFEST, Session, SessionError};
use crate::files::{FileError, sha256_hex, write_atomic};
use std::path::Path;

/// A capture session that grows frame by frame. After every call the folder is a valid capture session: a crash loses at
/// most the frame that was being written, and the next run resumes from the manifest.
#[derive(Debug)]
pub struct SessionWriter {
    session: Session,
}

impl SessionWriter {
    /// Begins a capture session in a new or empty folder.
    ///
    /// # Errors
    /// Where the folder holds a capture session already, or cannot be written.
    pub fn create(session: Session) -> Result<Self, SessionError> {
        let folder = &session.folder;
        std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
        if folder.join(MANIFEST).exists() {
            let what = "holds a capture session already".to_owned();
            return Err(FileError::Occupied { path: folder.clone(), what }.into());
        }
        session.save()?;
        Ok(Self { session })
    }

    /// Continues a capture session.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn resume(folder: &Path) -> Result<Self, SessionError> {
        Ok(Self { session: Session::load(folder)? })
    }

    /// The capture session so far.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Writes a frame's file and then its entry with the file's hash. An entry of the same file name is replaced.
    ///
    /// # Errors
    /// Where file or manifest cannot be written, or the entry is impossible; the manifest is then as it was.
    pub fn add(&mut self, mut entry: FrameEntry, bytes: &[u8]) -> Result<(), SessionError> {
        entry.sha256 = Some(sha256_hex(bytes));
        let mut grown = self.session.clone();
        grown.frames.retain(|frame| frame.file != entry.file);
        let path = grown.frame_path(&entry);
        grown.frames.push(entry);
        grown.check()?;
        write_atomic(&path, bytes)?;
        grown.save()?;
        self.session = grown;
        Ok(())
    }
}
