//! Jobs of the Scans room: lists, thumbnails, export, the bin.

pub mod act;
pub mod list;

use crate::jobs::bin::BinnedFolders;
use crate::model::project::Project;
use crate::model::scan_entry::ScanEntry;
use crate::model::settings::SolveSettings;
use eframe::egui::ColorImage;
use std::path::PathBuf;
use weavelight::solution::Reuse;

/// A scan that is in the bin, with its solution.
#[derive(Clone, Debug, PartialEq)]
pub struct Deleted {
    /// The swatch's name.
    pub name: String,
    /// The scan's folder, as it was.
    pub folder: PathBuf,
    /// Both, where they are now.
    pub binned: BinnedFolders,
}

/// Requests of the Scans room.
#[derive(Debug)]
pub enum Command {
    /// What there is of a rig.
    List(Box<Project>),
    /// The picture of a scan of a rig.
    Thumbnail(Box<Project>, PathBuf),
    /// The solution of a scan.
    Solve {
        /// The capture session's folder.
        scan: PathBuf,
        /// How.
        settings: SolveSettings,
        /// Whether one that is up to date stays.
        reuse: Reuse,
    },
    /// A scan and its solution into the system's bin.
    Delete(ScanEntry),
    /// Out of the bin again.
    BringBack(Deleted),
    /// A copy of a solution.
    Export {
        /// The solution.
        solution: PathBuf,
        /// The folder to make; numbered on where it is there.
        to: PathBuf,
    },
}

/// Updates for the Scans room.
#[derive(Debug)]
pub enum Event {
    /// What there is of the rig in a folder.
    List(PathBuf, Vec<ScanEntry>),
    /// The picture of a scan.
    Thumbnail(PathBuf, ColorImage),
    /// The solution of a scan stands; true where it did already.
    Solved(PathBuf, bool),
    /// A scan and its solution are in the bin.
    Deleted(Deleted),
    /// And out of it again.
    BroughtBack(Deleted),
    /// A solution was copied.
    Exported {
        /// The solution.
        solution: PathBuf,
        /// Where the copy is.
        to: PathBuf,
    },
}
