use crate::files::FileError;
use crate::raw::ReadError;
use crate::session::SessionError;
use std::path::PathBuf;
use weavelight_calibration::board::BoardError;
use weavelight_calibration::lights;

/// Why a calibration could not be made; the old one then stands. Each message says what, where, and what to photograph
/// instead.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// A capture session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A frame.
    #[error(transparent)]
    Frame(#[from] ReadError),
    /// The boards.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The light fit.
    #[error(transparent)]
    Lights(#[from] lights::Error),
    /// A capture session of another kind.
    #[error("{}: this is no {expected} capture session; give one whose kind is \"{expected}\"", .session.display())]
    WrongKind {
        /// The manifest.
        session: PathBuf,
        /// What the command needs.
        expected: &'static str,
    },
    /// A frame whose size the rig does not have.
    #[error(
        "{}: this frame is {} x {}, {} says {} x {}; correct width_px and height_px, or take the frames of this camera",
        .frame.display(), .found[0], .found[1], .rig.display(), .expected[0], .expected[1]
    )]
    WrongSize {
        /// The frame.
        frame: PathBuf,
        /// Its width and height.
        found: [usize; 2],
        /// Where the other size stands.
        rig: PathBuf,
        /// That size.
        expected: [usize; 2],
    },
    /// Something about the targets as photographed or described.
    #[error("{}: {what}; {remedy}", .place.display())]
    Target {
        /// Session, frame or calibration.
        place: PathBuf,
        /// What is wrong.
        what: String,
        /// What to photograph or correct.
        remedy: String,
    },
    /// A build without OpenCV.
    #[error(
        "this build has no chessboard detection; build it with its `opencv` feature (needs libopencv-dev and clang)"
    )]
    NoChessboards,
}

impl CalibrateError {
    pub(super) fn target(
        place: impl Into<PathBuf>,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Target { place: place.into(), what: what.into(), remedy: remedy.into() }
    }
}
