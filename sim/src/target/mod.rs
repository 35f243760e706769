//! Calibration targets: flat things with something on them, anywhere in front of the camera.

mod board;
mod chart;
mod panel;
mod sheet;

pub use board::{BoardShape, board_poses};
pub use chart::{COLOR_PATCHES, Chart, ChartPatch};
pub use panel::{Art, Panel};
pub use sheet::{Sheet, SheetFlaws, TILTED_HEIGHT_MM, sheet_frames, sheet_pose, strip_for};
