//! Scans as the gallery lists them.

use std::path::PathBuf;

/// A capture session of a swatch.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanEntry {
    /// Its folder.
    pub folder: PathBuf,
    /// The swatch's name.
    pub name: String,
    /// When it was taken.
    pub captured: Option<jiff::Timestamp>,
    /// Frames that are there, and that there ought to be.
    pub frames: [usize; 2],
    /// Its solution's folder, if there is one.
    pub solution: Option<PathBuf>,
}

impl ScanEntry {
    /// Every light has been photographed.
    pub fn is_complete(&self) -> bool {
        self.frames[0] >= self.frames[1]
    }
}

/// A scan that was stopped before its end.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfinishedScan {
    /// Its folder.
    pub folder: PathBuf,
    /// The swatch's name.
    pub name: String,
    /// How many frames are there.
    pub frames: usize,
}
