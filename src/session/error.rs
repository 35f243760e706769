use crate::files::FileError;
use crate::raw::ReadError;
use std::path::PathBuf;

/// What goes wrong with a capture session. Each message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// `session.toml` or the folder.
    #[error(transparent)]
    File(#[from] FileError),
    /// A frame's file that is no usable picture.
    #[error(transparent)]
    Frame(#[from] ReadError),
    /// A frame that the manifest names is not there.
    #[error("{}: this frame is missing; put it back under the name in session.toml, or remove its [[frames]] entry", .path.display())]
    FrameMissing {
        /// The frame's path.
        path: PathBuf,
    },
    /// A frame's content is not what was recorded.
    #[error("{}: this frame was altered (sha256 {found:.12}..., recorded {recorded:.12}...); restore the original file", .path.display())]
    FrameAltered {
        /// The frame's path.
        path: PathBuf,
        /// Its hash now.
        found: String,
        /// Its hash when it was taken.
        recorded: String,
    },
    /// A frame of a light beyond the calibration.
    #[error("{}: {file} is of light {light}, but there are lights 0 to {last} only; use the calibration of this rig", .session.display())]
    UnknownLight {
        /// The manifest.
        session: PathBuf,
        /// The frame.
        file: String,
        /// Its light.
        light: usize,
        /// Index of the last light.
        last: usize,
    },
}
