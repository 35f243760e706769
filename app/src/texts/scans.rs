//! The Scans room.

#![allow(missing_docs, reason = "a text says what it is")]

use crate::model::scan_entry::ScanEntry;
use std::path::Path;

pub const SEARCH: &str = "Search by name";
/// Until they are there.
pub const LISTING: &str = "Loading scans…";
pub const NONE: &str = "No scans yet";
pub const GO_SCAN: &str = "Scan the first swatch";
/// Into the Look room.
pub const OPEN: &str = "Open";
/// Where there is no solution.
pub const SOLVE: &str = "Solve";
/// Where there is one.
pub const SOLVE_AGAIN: &str = "Solve again";
pub const UP_TO_DATE: &str =
    "Up to date: it was solved from the same frames and calibration with the same settings.";
pub const SOLVE_ALL_THE_SAME: &str = "Solve anyway";
pub const DELETE_HINT: &str =
    "Frames and maps go to the system's bin, from where they can be restored";
/// Brings back what was deleted.
pub const UNDO: &str = "Undo";
pub const BRINGING_BACK: &str = "Restoring the scan";
pub const EXPORT_TO: &str = "Export the maps to";
pub const EXPORT: &str = "Export";
pub const EXPORTING: &str = "Exporting";
pub const DELETING: &str = "Deleting the scan";

/// Into the bin.
pub fn delete(name: &str) -> String {
    format!("Delete “{name}”")
}

/// A search without result.
pub fn nothing_found(search: &str) -> String {
    format!("No scan is called “{search}”")
}

/// What was deleted last.
pub fn in_the_bin(name: &str) -> String {
    format!("“{name}” is in the bin.")
}

/// Where maps went.
pub fn exported(to: &Path) -> String {
    format!("Exported to {}", to.display())
}

/// Below a scan's name.
pub fn state(entry: &ScanEntry) -> String {
    match (entry.is_complete(), &entry.solution) {
        (false, _) => {
            format!("stopped after {} of {} frames", entry.frames[0], entry.frames[1])
        }
        (true, None) => "not solved yet".to_owned(),
        (true, Some(_)) => "solved".to_owned(),
    }
}

/// Beside the gallery.
pub fn details(entry: &ScanEntry) -> Vec<(&'static str, String)> {
    let captured = entry.captured.map(crate::model::clock::local);
    vec![
        ("Taken", captured.unwrap_or_else(|| "unknown".to_owned())),
        ("State", state(entry)),
        ("Frames", format!("{} of {}", entry.frames[0], entry.frames[1])),
        ("Folder", entry.folder.display().to_string()),
    ]
}
