use crate::device::camera::Settings;
use std::path::PathBuf;
use std::time::Duration;

/// How a scan goes.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The exposure is being found.
    Metering,
    /// A frame is being taken.
    Frame {
        /// As in "light 4".
        frame: String,
        /// Frames that are there.
        done: usize,
        /// Frames that there will be.
        total: usize,
        /// Time left, once known.
        left: Option<Duration>,
    },
    /// The camera waits for something: with a camera that is released by hand, for the picture.
    Waiting {
        /// As in "light 4".
        frame: String,
        /// What for; a sentence without its full stop.
        what: String,
        /// Frames that are there.
        done: usize,
        /// Frames that there will be.
        total: usize,
    },
    /// A frame is safe on disk.
    Kept {
        /// Its light; `None`: every LED off.
        light: Option<usize>,
        /// The first light again, to see drift.
        drift_check: bool,
        /// Where it is.
        file: PathBuf,
        /// How it was exposed.
        settings: Settings,
    },
    /// A frame is taken again.
    Again {
        /// As in "light 4".
        frame: String,
        /// A sentence.
        why: String,
    },
    /// The board is looked for.
    BoardLost,
    /// It rests until it is told to go on.
    Paused,
}

/// Where the time went, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// From the first step to the last.
    pub total: f64,
    /// From shutter open to shutter close.
    pub exposing: f64,
    /// From shutter close until the file was there.
    pub transfer: f64,
    /// Switching lights and waiting for their acknowledgement.
    pub lights: f64,
    /// Making frames safe.
    pub disk: f64,
}

/// A scan that is complete.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The capture session's folder.
    pub folder: PathBuf,
    /// Frames in it.
    pub frames: usize,
    /// How many of them were there before.
    pub resumed: usize,
    /// The exposure.
    pub settings: Option<Settings>,
    /// Frames that were taken again, each with the reason.
    pub retries: Vec<(String, String)>,
    /// Sentences.
    pub warnings: Vec<String>,
    /// Where the time went.
    pub seconds: Seconds,
}
