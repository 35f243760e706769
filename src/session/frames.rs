use super::{Encoding, FrameEntry, MANIFEST, Session, SessionError};
use crate::files::{FileError, InputKind, check_input, read_input, sha256_hex};
use crate::raw::{self, Frame, Hint, ReadError, decode};
use std::io;
use std::path::PathBuf;

impl FrameEntry {
    /// What the manifest says of the frame that its file may not say: encoding and mosaic.
    pub fn hint(&self) -> Hint {
        let encoding = self.encoding.map(|encoding| match encoding {
            Encoding::Linear => raw::Encoding::Linear,
            Encoding::Srgb => raw::Encoding::Srgb,
        });
        Hint { cfa: self.cfa, encoding }
    }
}

impl Session {
    /// The manifest's path.
    pub fn manifest_path(&self) -> PathBuf {
        self.folder.join(MANIFEST)
    }

    /// Where a frame is.
    pub fn frame_path(&self, frame: &FrameEntry) -> PathBuf {
        self.folder.join(&frame.file)
    }

    /// Where the mask is, if there is one.
    pub fn mask_path(&self) -> Option<PathBuf> {
        self.mask.as_ref().map(|mask| self.folder.join(mask))
    }

    /// A frame as it was taken: its file, checked against the recorded hash, decoded as the manifest says. The one way to a
    /// decoded frame of a capture session.
    ///
    /// # Errors
    /// Where the file is missing, unreadable, altered or no picture; with path and remedy.
    pub fn frame(&self, entry: &FrameEntry) -> Result<Frame, SessionError> {
        let bytes = self.read_frame(entry)?;
        decode(&bytes, &entry.hint())
            .map_err(|source| ReadError::Decode { path: self.frame_path(entry), source }.into())
    }

    /// The bytes of a frame's file, checked against the recorded hash: what is decoded is what was hashed.
    ///
    /// # Errors
    /// Where the file is missing, unreadable or altered.
    pub fn read_frame(&self, frame: &FrameEntry) -> Result<Vec<u8>, SessionError> {
        let path = self.frame_path(frame);
        let bytes =
            read_input(&path, InputKind::Picture).map_err(|source| match source.kind() {
                io::ErrorKind::NotFound => SessionError::FrameMissing { path: path.clone() },
                _ => FileError::read(&path, source).into(),
            })?;
        self.verify(frame, &bytes)?;
        Ok(bytes)
    }

    /// Compares the bytes of a frame with the recorded hash; fine where none is recorded.
    ///
    /// # Errors
    /// Where they differ.
    pub fn verify(&self, frame: &FrameEntry, bytes: &[u8]) -> Result<(), SessionError> {
        let Some(recorded) = &frame.sha256 else { return Ok(()) };
        let found = sha256_hex(bytes);
        if found == *recorded {
            return Ok(());
        }
        Err(SessionError::FrameAltered {
            path: self.frame_path(frame),
            found,
            recorded: recorded.clone(),
        })
    }

    /// Sees that every frame's file is there, before work begins.
    ///
    /// # Errors
    /// The first one, in the manifest's order, that is not.
    pub fn check_files(&self) -> Result<(), SessionError> {
        self.frames.iter().map(|frame| self.frame_path(frame)).try_for_each(|path| {
            check_input(&path).map_err(|source| match source.kind() {
                io::ErrorKind::NotFound => SessionError::FrameMissing { path: path.clone() },
                _ => FileError::read(&path, source).into(),
            })
        })
    }

    /// Sees that every frame is of a light below `count`.
    ///
    /// # Errors
    /// The first frame of another light.
    pub fn check_lights(&self, count: usize) -> Result<(), SessionError> {
        let unknown = self
            .frames
            .iter()
            .find_map(|frame| frame.light.filter(|l| *l >= count).map(|l| (frame, l)));
        let Some((frame, light)) = unknown else { return Ok(()) };
        Err(SessionError::UnknownLight {
            session: self.manifest_path(),
            file: frame.file.display().to_string(),
            light,
            last: count.saturating_sub(1),
        })
    }
}
