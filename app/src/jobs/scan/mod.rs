//! Jobs of the Scan room: test shots, scans, solutions.

pub mod act;
mod again;
mod live_preview;
pub mod solve;
mod unfinished;

use crate::jobs::scans::Deleted;
use crate::model::names::ScanNames;
use crate::model::scan_entry::UnfinishedScan;
use crate::model::settings::SolveSettings;
use crate::viewer::maps::Maps;
use crate::viewer::picture::Thumb;
use std::path::PathBuf;
use weavelight::device::camera::Settings;
use weavelight::device::scan::{Preview, Summary};
use weavelight::solution::Report;
use weavelight_sim::cloth::Preset;

/// A scan that has come back.
#[derive(Debug)]
pub struct RestoredScan {
    /// Its folder.
    pub folder: PathBuf,
    /// Its solution, and what that says of itself; `None` where it was not solved.
    pub solution: Option<(PathBuf, Box<Report>)>,
    /// What it took the place of.
    pub replaced: Option<Deleted>,
}

/// Requests of the Scan room.
#[derive(Debug)]
pub enum Command {
    /// A picture under one light.
    TestShot {
        /// The rig's light.
        light: usize,
        /// Exposure.
        settings: Settings,
    },
    /// A scan, and its solution.
    Scan(Order),
    /// A solution.
    Solve {
        /// The capture session's folder.
        scan: PathBuf,
        /// How.
        settings: SolveSettings,
    },
    /// Another fabric on the simulated table.
    LayOut(Preset),
    /// Whether there is a scan that was stopped.
    LookForUnfinished,
    /// What was scanned again back out of the bin, and what took its place there.
    Undo(Deleted),
}

/// What to scan and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// Of the swatch.
    pub name: String,
    /// Of the swatch, millimetres.
    pub thickness_mm: Option<f64>,
    /// `None`: to be found.
    pub exposure_s: Option<f64>,
    /// Sensitivity.
    pub iso: f64,
    /// Whether something is there.
    pub what: What,
    /// How to solve it.
    pub solve: SolveSettings,
}

/// What is scanned: the form says how, but not whether it is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum What {
    /// Another swatch.
    New,
    /// What is in this folder, from where it stood.
    Resume(PathBuf),
    /// What is in this folder once more; that goes to the bin.
    Again(PathBuf),
}

/// Updates for the Scan room.
#[derive(Debug)]
pub enum Event {
    /// A test shot.
    TestShot(Box<Preview>),
    /// The names that the scans of the rig in a folder have.
    Names(PathBuf, ScanNames),
    /// The scan's folder.
    Begun(PathBuf),
    /// What is scanned again is in the bin.
    Replaced(Option<Deleted>),
    /// Another scan is in the place of the one that was shown.
    Restored(RestoredScan),
    /// The frame that is being taken, as in "light 4".
    Taking(String),
    /// It rests.
    Paused,
    /// A frame that is safe.
    Frame(Box<Thumb>),
    /// Maps from the frames so far.
    Maps(Box<Maps>),
    /// All frames are there.
    Complete(Box<Summary>),
    /// The solution stands.
    Solved {
        /// The capture session's folder.
        scan: PathBuf,
        /// Its folder.
        solution: PathBuf,
        /// What it says of itself.
        report: Box<Report>,
        /// Expected error of a normal, median, degrees; `None` where the maps were there already.
        expected_deg: Option<f64>,
    },
    /// The folder of a scan to solve.
    Dropped(PathBuf),
    /// The scan under way was stopped or failed; these lights have a frame (`None`: no light).
    Ended(Vec<Option<usize>>),
    /// A scan that was stopped, if there is one.
    Unfinished(Option<UnfinishedScan>),
}
