use crate::files::{FileError, Setting};
use crate::gpu::GpuError;
use crate::machine::NoMemory;
use crate::raw::ReadError;
use crate::session::SessionError;
use std::path::PathBuf;

/// Why a solve gives nothing. Each message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The capture session or one of its frames' files.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A calibration file, or the output folder.
    #[error(transparent)]
    File(#[from] FileError),
    /// A frame that does not decode, or a mask.
    #[error(transparent)]
    Frame(#[from] ReadError),
    /// A graphics processor that was asked for.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A capture session of boards.
    #[error("{}: its frames are pictures of a chessboard, there is nothing to solve; use it with `weavelight calibrate camera`", .session.display())]
    Board {
        /// The manifest.
        session: PathBuf,
    },
    /// The calibration has no lights.
    #[error("{}: there is no lights.toml; run `weavelight calibrate lights`", .calibration.display())]
    NoLights {
        /// The folder.
        calibration: PathBuf,
    },
    /// Near lights, but no camera to say where pixels look.
    #[error("{}: there is no camera.toml, and near lights need it; run `weavelight calibrate camera`", .calibration.display())]
    NoCamera {
        /// The folder.
        calibration: PathBuf,
    },
    /// `--undistort` without a camera.
    #[error("{}: there is no camera.toml, so there is no distortion to undo; leave out {}", .calibration.display(), Setting("undistort"))]
    NothingToUndistort {
        /// The folder.
        calibration: PathBuf,
    },
    /// A reading that no spectrophotometer gives, or one that the solve has no use for.
    #[error("{} {what}", Setting("reference-lab"))]
    Reference {
        /// What is wrong with it and what to do; follows its name.
        what: String,
    },
    /// Fewer than three lights were photographed.
    #[error("{}: frames of {found} light{} only; photograph at least three lights, not all in one plane with the swatch", .session.display(), if *.found == 1 { "" } else { "s" })]
    TooFewLights {
        /// The manifest.
        session: PathBuf,
        /// Lights with a frame.
        found: usize,
    },
    /// Frames that are copies of one another.
    #[error("{}: {what} {left} light{} with a picture of {} own {} left, and a solve needs three", .session.display(), if *.left == 1 { "" } else { "s" }, if *.left == 1 { "its" } else { "their" }, if *.left == 1 { "is" } else { "are" })]
    Copies {
        /// The manifest.
        session: PathBuf,
        /// Which, as a sentence.
        what: String,
        /// Lights that remain.
        left: usize,
    },
    /// Frames that nothing can be solved from.
    #[error("{}: {what}; is every LED on, the lens cap off, exposure_s long enough and the black level in color.toml right? Photograph the swatch again", .session.display())]
    NoSignal {
        /// The manifest.
        session: PathBuf,
        /// What the frames show instead.
        what: String,
    },
    /// An ambient frame that is none.
    #[error("{} is brighter than {what}: is it the frame of a light, or is its exposure_s wrong? Take it again with every LED off, correct it, or remove its [[frames]] entry", .path.display())]
    BrightAmbient {
        /// The frame.
        path: PathBuf,
        /// "every frame", or which.
        what: String,
    },
    /// Lights whose frames clip wherever the swatch is.
    #[error("{}: {what} clipped everywhere, and fewer than three lights are left; take shorter exposures", .session.display())]
    Clipped {
        /// The manifest.
        session: PathBuf,
        /// As in "lights 0 and 1 are".
        what: String,
    },
    /// An input that changed between its hash and its reading.
    #[error("{}: it changed while it was being read; run it again when nothing writes there", .path.display())]
    Changing {
        /// The file.
        path: PathBuf,
    },
    /// The light vectors span no volume.
    #[error("{}: {what}, so the third direction of the normals cannot be found; add a light that stands apart, or check lights.toml", .calibration.display())]
    DependentLights {
        /// The folder.
        calibration: PathBuf,
        /// Which lights, as in "lights 0, 1 and 2 lie in one plane through the swatch".
        what: String,
    },
    /// Two frames that cannot belong together.
    #[error("{} is {a_is}, but {} is {b_is}; all frames of a capture session must come from one camera at one setting", .a.display(), .b.display())]
    DifferentFrames {
        /// The first frame.
        a: PathBuf,
        /// Its size and layout.
        a_is: String,
        /// The other.
        b: PathBuf,
        /// Its size and layout.
        b_is: String,
    },
    /// A frame and the camera's calibration disagree.
    #[error("{} is {frame}, but {} is for {camera}; use the calibration of this camera at this setting", .path.display(), .calibration.display())]
    OtherCamera {
        /// The frame.
        path: PathBuf,
        /// Its size.
        frame: String,
        /// `camera.toml`.
        calibration: PathBuf,
        /// The size it is for.
        camera: String,
    },
    /// The mask and the frames disagree.
    #[error("{} is {mask}, but the frames are {frames}; make the mask from one of the frames", .path.display())]
    OtherMask {
        /// The mask.
        path: PathBuf,
        /// Its size.
        mask: String,
        /// The frames' size.
        frames: String,
    },
    /// A mask that is not the one found.
    #[error("{}: is not the mask that is found in the frames, so it may have been edited and was kept; {} replaces it", .path.display(), Setting("force"))]
    EditedMask {
        /// The mask.
        path: PathBuf,
    },
    /// A light without strength in a channel that the frames have.
    #[error("{}: light {light} has no intensity in channel {channel}; calibrate it again, or leave out its frames", .path.display())]
    DarkChannel {
        /// `lights.toml`.
        path: PathBuf,
        /// The light.
        light: usize,
        /// R, G or B.
        channel: char,
    },
    /// Black level at or above saturation.
    #[error("{}: black level {black} is not below saturation {saturation}; correct color.toml", .path.display())]
    NoRange {
        /// The frame.
        path: PathBuf,
        /// Black level, raw numbers.
        black: f32,
        /// Saturation, raw numbers.
        saturation: f32,
    },
    /// A light with more exposures than can be merged.
    #[error("{}: light {light} has {found} exposures; at most 64 are merged", .session.display())]
    TooManyExposures {
        /// The manifest.
        session: PathBuf,
        /// The light.
        light: usize,
        /// Its frames.
        found: usize,
    },
    /// A pixel that does not look at the plane.
    #[error("{}: pixel ({u:.0}, {v:.0}) shows no point of the capture session's plane; check the distortion, the pose and [plane]", .calibration.display())]
    Unseen {
        /// `camera.toml`.
        calibration: PathBuf,
        /// Pixel, u.
        u: f64,
        /// Pixel, v.
        v: f64,
    },
    /// More memory than there is.
    #[error(transparent)]
    Memory(#[from] NoMemory),
}
