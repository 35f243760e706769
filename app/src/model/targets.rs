//! What the technician states about his calibration targets.

use serde::{Deserialize, Serialize};

/// What the technician says of his targets; the simulated rig knows its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TargetSettings {
    /// Inner corners of the chessboard across and down.
    pub board: [usize; 2],
    /// Side of its squares, millimetres.
    pub board_square_mm: f64,
    /// Inner corners of the strip beside the white sheet.
    pub strip: [usize; 2],
    /// Side of its squares, millimetres.
    pub strip_square_mm: f64,
    /// Height of the raised sheet, millimetres.
    pub raised_mm: f64,
    /// Reflectance of the sheet.
    pub reflectance: f64,
    /// File with the chart's patches.
    pub chart: String,
    /// The light that boards are photographed under.
    pub board_light: usize,
    /// A calibration counts as old after so many days.
    pub expires_after_days: i64,
}

impl Default for TargetSettings {
    fn default() -> Self {
        Self {
            board: [9, 6],
            board_square_mm: 25.0,
            strip: [17, 3],
            strip_square_mm: 9.0,
            raised_mm: 100.0,
            reflectance: 0.99,
            chart: String::new(),
            board_light: 0,
            expires_after_days: 90,
        }
    }
}
