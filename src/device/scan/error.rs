use crate::device::board::BoardError;
use crate::device::camera::CameraError;
use crate::files::{FileError, Setting};
use crate::session::SessionError;
use std::path::PathBuf;

/// What goes wrong with a scan. Each message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// The light board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The capture session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A file or folder.
    #[error(transparent)]
    File(#[from] FileError),
    /// The simulated rig.
    #[error(transparent)]
    Simulate(#[from] crate::simulate::SimulateError),
    /// A simulated camera beside a real board.
    #[error(
        "rig.toml: the camera is simulated and sees simulated lights only; set [controller] kind = \"simulated\""
    )]
    Blind,
    /// A light on an output that no board has.
    #[error("rig.toml: light {light} is on channel {channel}; a light board has outputs 0 to 15")]
    Output {
        /// The light.
        light: usize,
        /// Its channel.
        channel: u32,
    },
    /// A bracket that makes no sense.
    #[error(
        "{bracket}: {factor} makes no sense; give exposures relative to the scan's, each once and other than 1, as in {bracket} 0.25,4",
        bracket = Setting("bracket")
    )]
    Bracket {
        /// The first bad one.
        factor: f64,
    },
    /// A bracket where the target's own exposures are what is wanted.
    #[error("{} is for swatches and white sheets; leave it out", Setting("bracket"))]
    BracketOfTarget,
    /// A light that the rig does not have.
    #[error("{} is {light}; the rig has lights 0 to {last}", Setting("light"))]
    NoSuchLight {
        /// What was asked for.
        light: usize,
        /// The last one.
        last: usize,
    },
    /// A bracket with a camera that cannot be set.
    #[error(
        "{} needs a camera that the program can set, but this one is set by hand; scan without it, or tether the camera",
        Setting("bracket")
    )]
    BracketByHand,
    /// An exposure that makes no sense.
    #[error("{option} is {value}; give a number from {least} to {most}")]
    Option {
        /// Which.
        option: Setting,
        /// What was given.
        value: f64,
        /// What it may be.
        least: f64,
        /// What it may be.
        most: f64,
    },
    /// The system gives no thread to look at frames.
    #[error(
        "no thread can be started to look at frames ({0}); close other programs or raise the limit (ulimit -u)"
    )]
    NoThread(std::io::Error),
    /// The target holds a capture session.
    #[error("{}: holds a capture session already ({name}, {frames} frames); continue it with {}, or choose another {}", .folder.display(), Setting("resume"), Setting("out"))]
    Taken {
        /// The folder.
        folder: PathBuf,
        /// The name of what is there.
        name: String,
        /// How many frames it has.
        frames: usize,
    },
    /// The capture session that is to be resumed or added to is another one.
    #[error("{}: holds another capture session: {what}; choose another {}", .folder.display(), Setting("out"))]
    Another {
        /// The folder.
        folder: PathBuf,
        /// What differs.
        what: String,
    },
    /// Not enough room for the frames.
    #[error("{}: {free_mb} MB free, but the frames need about {needed_mb} MB; free some, or choose another {}", .folder.display(), Setting("out"))]
    NoRoom {
        /// The folder.
        folder: PathBuf,
        /// What there is.
        free_mb: u64,
        /// What it takes.
        needed_mb: u64,
    },
    /// A frame of another size than the rig says.
    #[error(
        "{file}: the frame is {found}, rig.toml says {expected}; correct width_px and height_px in rig.toml, or the camera's image size"
    )]
    Size {
        /// The frame's file.
        file: String,
        /// As in "4928 x 3264".
        found: String,
        /// The same.
        expected: String,
    },
    /// A file that does not say how it was exposed.
    #[error("{file}: the file does not say its exposure time; give the {}", Setting("exposure-s"))]
    ExposureUnknown {
        /// The frame's file.
        file: String,
    },
    /// A frame could not be taken.
    #[error("{frame}: {why}{}", resumable(*.kept))]
    Frame {
        /// As in "light 4".
        frame: String,
        /// A sentence with what to do.
        why: String,
        /// How many frames are safe.
        kept: usize,
    },
    /// Some lights stay dark.
    #[error("{}{}", .why.join("; "), resumable(*.kept))]
    Incomplete {
        /// A sentence for each.
        why: Vec<String>,
        /// How many frames are safe.
        kept: usize,
    },
    /// As asked.
    #[error("stopped{}", resumable(*.kept))]
    Aborted {
        /// How many frames are safe.
        kept: usize,
    },
    /// No light shows under any light: the exposure is too short, or nothing shines.
    #[error(
        "the pictures show no light under any LED at {exposure_s} s and ISO {iso}; give a longer {} or leave it out, take the lens cap off, and look whether the LEDs have power",
        Setting("exposure-s")
    )]
    NothingLit {
        /// Exposure time, seconds.
        exposure_s: f64,
        /// Sensitivity.
        iso: f64,
    },
    /// The capture session's folder vanished.
    #[error("{}: this folder is gone, and the frames in it; bring it back (was its disk unplugged?) and continue with {}, or scan into another", .folder.display(), Setting("resume"))]
    FolderGone {
        /// The folder.
        folder: PathBuf,
    },
    /// Nothing to expose for.
    #[error(
        "light {light} gives no light at {exposure_s} s; look whether it shines on the swatch, or give the {}",
        Setting("exposure-s")
    )]
    Dark {
        /// The light that was tried.
        light: usize,
        /// The longest exposure that was tried.
        exposure_s: f64,
    },
    /// A test shot that is no picture.
    #[error(
        "the test shot cannot be read: {why}; take it again, and see that the camera saves RAW"
    )]
    TestShot {
        /// Why.
        why: String,
    },
}

fn resumable(kept: usize) -> String {
    match kept {
        0 => String::new(),
        1 => format!(". One frame is safe; continue with {}", Setting("resume")),
        _ => format!(". {kept} frames are safe; continue with {}", Setting("resume")),
    }
}
