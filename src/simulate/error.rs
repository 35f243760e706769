use crate::files::{FileError, Setting};
use crate::session::SessionError;
use std::path::PathBuf;

/// What goes wrong with a simulation.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// A capture session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// More memory than there is.
    #[error(transparent)]
    Memory(#[from] crate::machine::NoMemory),
    /// An option that makes no sense.
    #[error("{option} is {value}; {remedy}")]
    Option {
        /// Which.
        option: Setting,
        /// What was given.
        value: String,
        /// What it may be.
        remedy: String,
    },
    /// The rig does not say what a simulation needs.
    #[error("{}: {what}", .path.display())]
    Rig {
        /// The rig's file.
        path: PathBuf,
        /// What is wrong and what to do.
        what: String,
    },
    /// No light reaches the camera.
    #[error(
        "{part}: no light reaches the camera; the rig's lights must stand above the table and shine on it"
    )]
    Dark {
        /// Which capture session.
        part: String,
    },
    /// A target cannot be seen whole.
    #[error(
        "{part}: no chessboard can be seen whole; the camera's field of view is too small or its pixels too few"
    )]
    NoBoard {
        /// Which capture session.
        part: String,
    },
}
