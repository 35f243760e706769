use super::{FrameEntry, MANIFEST, Session, SessionError};
use crate::files::{
    FileError, note_files, open_input, parent_of, sha256_hex, sha256_of_file, write_atomic,
};
use std::path::Path;

/// A capture session that grows frame by frame. After every call the folder is a valid capture session: a crash loses at
/// most the frame that was being written, and the next run resumes from the manifest. The caller holds the folder's
/// [`crate::files::Lock`].
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

    /// Takes over a frame's file, which is on the capture session's disk and holds `bytes`: flushed to the disk, renamed, then
    /// recorded with its hash. The frame in the file `replaced` leaves the record in the same moment, and its file after that.
    /// Both files are noted beside `source` before anything moves, so that after a kill the next run knows which one nobody asks
    /// for ([`crate::files::remove_noted`]).
    ///
    /// # Errors
    /// Where file or manifest cannot be written, or the entry is impossible; the manifest is then as it was.
    pub fn adopt(
        &mut self,
        mut entry: FrameEntry,
        source: &Path,
        bytes: &[u8],
        replaced: Option<&Path>,
    ) -> Result<(), SessionError> {
        let flush = || open_input(source).and_then(|file| file.sync_all());
        let (flushed, hash) = rayon::join(flush, || sha256_hex(bytes));
        flushed.map_err(|error| FileError::write(source, error))?;
        entry.sha256 = Some(hash);
        let mut grown = self.session.clone();
        grown.frames.retain(|frame| frame.file != entry.file && Some(&*frame.file) != replaced);
        let path = grown.frame_path(&entry);
        grown.frames.push(entry);
        grown.check()?;
        self.note(source, grown.frames.last(), replaced)?;
        // Saving the manifest flushes the folder, and so this.
        std::fs::rename(source, &path).map_err(|error| FileError::write(&path, error))?;
        grown.save()?;
        let before = std::mem::replace(&mut self.session, grown);
        if let Some(replaced) = replaced {
            delete(&before, replaced);
        }
        Ok(())
    }

    fn note<'a>(
        &'a self,
        source: &Path,
        new: Option<&'a FrameEntry>,
        replaced: Option<&Path>,
    ) -> Result<(), FileError> {
        let old = self.session.frames.iter().find(|frame| Some(&*frame.file) == replaced);
        let hashed = |frame: &'a FrameEntry| Some((&*frame.file, frame.sha256.as_deref()?));
        let files: Vec<(&Path, &str)> = new.into_iter().chain(old).filter_map(hashed).collect();
        note_files(parent_of(source), &files)
    }

    /// Takes the frame in `file` out of the record, and then its file away, if that still is what was recorded.
    ///
    /// # Errors
    /// Where the manifest cannot be written; it is then as it was.
    pub fn remove(&mut self, file: &Path) -> Result<(), SessionError> {
        let mut rest = self.session.clone();
        rest.frames.retain(|frame| frame.file != file);
        rest.save()?;
        let before = std::mem::replace(&mut self.session, rest);
        delete(&before, file);
        Ok(())
    }
}

/// Deletes a frame's file. One that is not what was recorded may be somebody's work, and stays; what cannot be deleted is
/// litter.
fn delete(session: &Session, file: &Path) {
    let path = session.folder.join(file);
    let recorded = session.frames.iter().find(|frame| frame.file == file);
    let recorded = recorded.and_then(|frame| frame.sha256.as_deref());
    if recorded.is_some() && sha256_of_file(&path).ok().as_deref() == recorded {
        let _ = std::fs::remove_file(path);
    }
}
