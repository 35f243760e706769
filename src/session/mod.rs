//! The capture session: a folder with `session.toml` and the frames as the camera wrote them. The hub that scanning,
//! importing and simulating write and everything else reads.

mod check;
mod error;
mod format;
mod frames;
pub mod import;
#[cfg(test)]
mod tests;
mod writer;

pub use error::SessionError;
pub use writer::SessionWriter;

use std::path::PathBuf;
use weavelight_calibration::description::{Cfa, Plane};

/// The manifest's name in its folder.
pub const MANIFEST: &str = "session.toml";

/// The name of its mask, where Weavelight makes one.
pub const MASK_FILE: &str = "mask.png";

/// A capture session as its `session.toml` describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The folder.
    pub folder: PathBuf,
    /// What was photographed.
    pub kind: Kind,
    /// As in "linen 4021".
    pub name: String,
    /// When, if stated.
    pub captured: Option<jiff::Timestamp>,
    /// The imaged surface, `None` where the file does not say (then it is the table, unless a board on the sheet gives it).
    pub plane: Option<Plane>,
    /// Calibration targets only.
    pub target: Option<Target>,
    /// Every frame, in the file's order.
    pub frames: Vec<FrameEntry>,
    /// Mask picture, relative to the folder.
    pub mask: Option<PathBuf>,
}

/// What a capture session shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A fabric to solve.
    Swatch,
    /// A white sheet.
    White,
    /// A grey or colour chart.
    Grey,
    /// A chessboard.
    Board,
}

/// What a calibration target is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Target {
    /// Reflectance of a white sheet.
    pub reflectance: Option<f64>,
    /// Chessboard.
    pub board: Option<Board>,
    /// Patches of a chart.
    pub patches: Vec<Patch>,
}

/// A chessboard: inner corners and the side of a square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Inner corners in a row.
    pub columns: usize,
    /// Inner corners in a column.
    pub rows: usize,
    /// Side of a square, millimetres.
    pub square_mm: f64,
}

/// One patch of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// u0, v0, u1, v1 in pixels, both ends inside.
    pub rect_px: [f64; 4],
    /// Reflectance, 0..1.
    pub reflectance: f64,
    /// CIE Lab under D50, colour charts only.
    pub lab_d50: Option<[f64; 3]>,
}

/// One frame of a capture session.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameEntry {
    /// File name, relative to the folder.
    pub file: PathBuf,
    /// Which light was on; `None` for an ambient frame and for pictures of a board.
    pub light: Option<usize>,
    /// Exposure time in seconds.
    pub exposure_s: f64,
    /// Sensitivity; signals scale with `exposure_s * iso`.
    pub iso: f64,
    /// SHA-256 of the file, lower-case hexadecimal.
    pub sha256: Option<String>,
    /// How the picture encodes light; 8-bit pictures must say, others are linear where it is absent.
    pub encoding: Option<Encoding>,
    /// Mosaic pattern of a picture that cannot say so itself.
    pub cfa: Option<Cfa>,
    /// "table" for the board picture that fixes the rig frame.
    pub pose: Option<String>,
    /// When, if stated.
    pub captured: Option<jiff::Timestamp>,
    /// How often it was tried.
    pub attempts: Option<u32>,
    /// Why it was tried again, each time.
    pub retries: Vec<String>,
    /// Pins as read back when the shutter opened.
    pub pins_open: Option<u32>,
    /// Pins as read back when it closed.
    pub pins_close: Option<u32>,
    /// The board's clock.
    pub board_ms: Option<u64>,
    /// A light repeated to see drift; not used in the solve.
    pub drift_check: bool,
}

/// How a picture encodes light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Proportional.
    Linear,
    /// sRGB's curve.
    Srgb,
}

impl FrameEntry {
    /// A frame with what every frame has; the rest absent.
    pub fn new(file: impl Into<PathBuf>, light: Option<usize>, exposure_s: f64, iso: f64) -> Self {
        Self {
            file: file.into(),
            light,
            exposure_s,
            iso,
            sha256: None,
            encoding: None,
            cfa: None,
            pose: None,
            captured: None,
            attempts: None,
            retries: Vec::new(),
            pins_open: None,
            pins_close: None,
            board_ms: None,
            drift_check: false,
        }
    }
}

impl Session {
    /// An empty capture session, not yet on disk.
    pub fn new(folder: impl Into<PathBuf>, kind: Kind, name: impl Into<String>) -> Self {
        Self {
            folder: folder.into(),
            kind,
            name: name.into(),
            captured: None,
            plane: None,
            target: None,
            frames: Vec::new(),
            mask: None,
        }
    }

    /// The plane that was imaged: the stated one, else the table.
    pub fn plane_or_table(&self) -> Plane {
        self.plane.clone().unwrap_or_else(Plane::table)
    }
}
