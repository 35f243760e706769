//! What single pictures of a target show, for whoever photographs them: the wizard's eyes. The same detectors and the same
//! cells as in the calibration itself.

use super::boards::{self, Corners, shape_of};
use super::camera::COVERAGE_GRID;
use super::frames::grey_picture;
use super::sheet::{Known, cell_side, observe, tilt_and_height};
use super::{CalibrateError, Progress, inputs, lights};
use crate::instrument::{Calibration, Rig};
use crate::raw::Frame;
use crate::session::{Board, Kind};
use std::path::Path;
use weavelight_calibration::board::{LEAST_VIEWS, coverage};
use weavelight_calibration::description::{Camera, Plane};
use weavelight_calibration::lights::{Foreseen, Sheet, foresee};

/// A chessboard that was found in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenBoard(Corners);

impl SeenBoard {
    /// Its inner corners in pixels, row by row.
    pub fn corners_px(&self) -> &[[f64; 2]] {
        &self.0.refined.corners_px
    }
}

/// Looks for a chessboard; `None` where it is not in the picture whole and sharp. `tick` is called every second or so, and may
/// unwind to end the search.
///
/// # Errors
/// Where this build has no chessboard detection, or that fails.
pub fn find_board(
    frame: &Frame,
    board: &Board,
    tick: &dyn Fn(),
) -> Result<Option<SeenBoard>, CalibrateError> {
    Ok(boards::detect(&grey_picture(frame), &shape_of(board), tick)?.ok().map(SeenBoard))
}

/// How a set of pictures of the board stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardsSoFar {
    /// Corners in each field of a grid over the picture, row by row.
    pub coverage: Vec<usize>,
    /// Fields across and down.
    pub coverage_grid: [usize; 2],
    /// Reprojection error of a camera fitted to them, pixels; `None` while they do not carry one.
    pub rms_px: Option<f64>,
}

/// Looks at the pictures of a board so far, of frames of `size_px`.
pub fn boards_so_far(seen: &[SeenBoard], board: &Board, size_px: [usize; 2]) -> BoardsSoFar {
    let refined: Vec<_> = seen.iter().map(|seen| seen.0.refined.clone()).collect();
    let corners: Vec<Corners> = seen.iter().map(|seen| seen.0.clone()).collect();
    let enough = corners.len() >= LEAST_VIEWS;
    let fitted = enough.then(|| boards::fit(&corners, &shape_of(board), size_px).ok()).flatten();
    BoardsSoFar {
        coverage: coverage(&refined, size_px, COVERAGE_GRID),
        coverage_grid: COVERAGE_GRID,
        rms_px: fitted.map(|(fit, ..)| fit.rms_px),
    }
}

/// A white sheet as the light fit will see it.
#[derive(Clone, Debug)]
pub struct SeenSheet {
    /// Middles of the cells that are measured, pixels.
    pub cells_px: Vec<[f64; 2]>,
    /// Side of a cell, pixels.
    pub cell_px: f64,
    /// From the table.
    pub tilt_deg: f64,
    /// Over the table at its middle.
    pub height_mm: f64,
    /// Share of full scale that the brightest light's brightest cells reach; 0.5 to 0.9 is good.
    pub brightest: f64,
    /// Sentences.
    pub warnings: Vec<String>,
    sheet: Sheet,
}

/// Looks at a white capture session with what of `calibration` is there: its camera at least.
///
/// # Errors
/// Where the sheet cannot serve, with what to photograph instead: the same as `calibrate lights` would say.
pub fn look_at_sheet(
    session: &Path,
    calibration: &Path,
    lights: usize,
    progress: &Progress,
) -> Result<SeenSheet, CalibrateError> {
    let known = Calibration::load(calibration)?;
    let Some(camera) = &known.camera else {
        let remedy = "calibrate the camera first";
        return Err(CalibrateError::target(calibration, "the camera is not calibrated", remedy));
    };
    let with = Known {
        camera,
        optics: &known.optics,
        color: &known.color,
        defects: &known.defects,
        lights,
    };
    let observed = observe(&inputs::load(session, Kind::White)?, with, progress)?;
    let (tilt_deg, height_mm) = tilt_and_height(&observed.sheet.plane);
    Ok(SeenSheet {
        cells_px: observed.sheet.cells.iter().map(|cell| cell.pixel).collect(),
        cell_px: cell_side(camera) as f64,
        tilt_deg,
        height_mm,
        brightest: observed.brightest,
        warnings: observed.warnings,
        sheet: observed.sheet,
    })
}

/// How well the lights' places would be known if they were calibrated with the sheets so far, and with one more that lies on
/// `next`; before the first sheet, how well the ruler knows them. `camera`: the one that the sheets were looked at with.
///
/// # Errors
/// Where the sheets so far cannot be fitted: what `calibrate lights` would say.
pub fn sheets_so_far(
    seen: &[SeenSheet],
    rig: &Rig,
    camera: &Camera,
    next: &Plane,
) -> Result<Foreseen, CalibrateError> {
    let sheets: Vec<Sheet> = seen.iter().map(|seen| seen.sheet.clone()).collect();
    Ok(foresee(camera, &sheets, &lights::priors(rig), next)?)
}
