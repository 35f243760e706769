//! The calibration targets, sized for a camera's field of view.

use super::{Options, SimulateError};
use crate::session::{Board, Patch};
use nalgebra::IsometryMatrix3;
use weavelight_sim::target::{BoardShape, Chart, Sheet, SheetFlaws, sheet_frames, strip_for};
use weavelight_sim::view::View;

/// The usual board's inner corners.
const BOARD: [usize; 2] = [9, 6];
/// The usual board's squares, millimetres.
const USUAL_SQUARE_MM: f64 = 25.0;
/// Reflectance of a white sheet.
pub(super) const WHITE: f64 = 0.99;

/// A chessboard that leaves room to move in the picture.
pub(super) fn board(options: &Options, view: &View) -> BoardShape {
    let [width, height] =
        [view.camera.width_px, view.camera.height_px].map(|n| view.mm_per_px() * n as f64);
    let room = (0.7 * width / (BOARD[0] as f64 + 2.0)).min(0.76 * height / (BOARD[1] as f64 + 2.0));
    let square_mm = options.targets.square_mm.unwrap_or_else(|| {
        // To half a millimetre, where that is not everything.
        let rounded = (2.0 * room).floor() / 2.0;
        if rounded > 0.0 { rounded.min(USUAL_SQUARE_MM) } else { room }
    });
    BoardShape { columns: BOARD[0], rows: BOARD[1], square_mm }
}

/// As a capture session states it.
pub(super) fn stated(board: &BoardShape) -> Board {
    Board { columns: board.columns, rows: board.rows, square_mm: board.square_mm }
}

/// The chart's patches as a capture session states them.
pub(super) fn stated_patches(chart: &Chart, view: &View) -> Vec<Patch> {
    let patches = chart.patches(view, 0.0).into_iter().map(|patch| Patch {
        rect_px: patch.rect_px,
        reflectance: patch.reflectance,
        lab_d50: patch.lab_d50,
    });
    patches.collect()
}

/// The poses of the white sheet: folder name and place.
pub(super) fn sheet_poses(options: &Options) -> Vec<(String, IsometryMatrix3<f64>)> {
    let targets = &options.targets;
    sheet_frames(targets.tilts, targets.tilt_deg, targets.raised_mm)
}

/// The white sheet, with a strip of chessboard that can be seen whole in all its poses; `pose`: keys what changes from one to
/// the next.
pub(super) fn sheet(options: &Options, view: &View, pose: usize) -> Result<Sheet, SimulateError> {
    let poses: Vec<_> = sheet_poses(options).into_iter().map(|(_, pose)| pose).collect();
    let strip = strip_for(view, &poses)
        .ok_or_else(|| SimulateError::NoBoard { part: "white sheet".to_owned() })?;
    let targets = &options.targets;
    let flaws = SheetFlaws {
        unevenness: targets.unevenness,
        kappa: targets.kappa,
        dust_per_dm2: targets.dust_per_dm2,
        hand: targets.hand,
        sheet_seed: options.seed,
        pose_seed: options.seed.wrapping_add(1000 * (pose as u64 + 1)),
    };
    Ok(Sheet { reflectance: WHITE, strip: Some(strip), flaws })
}
