//! The chessboards' side of the build: with OpenCV, or an error that says how to get it.

use super::CalibrateError;
use crate::session::Board;
use nalgebra::IsometryMatrix3;
use weavelight_calibration::board::{BoardShape, BoardView, CameraFit, Dropped, NoBoard};
use weavelight_calibration::description::{Camera, Image};

/// As the estimators know it.
pub(super) fn shape_of(board: &Board) -> BoardShape {
    BoardShape { columns: board.columns, rows: board.rows, square_mm: board.square_mm }
}

/// The corners of one board, found in two ways; the camera is fitted to whichever set fits better.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Corners {
    /// As the detector placed them.
    pub(super) detected: BoardView,
    /// Refined over windows as large as the squares allow.
    pub(super) refined: BoardView,
}

/// A fit, the numbers of the views kept, and the views dropped.
pub(super) type Fitted = (CameraFit, Vec<usize>, Vec<Dropped>);

#[cfg(feature = "opencv")]
mod with_opencv {
    use super::*;
    use weavelight_calibration::board::fit_without_outliers;
    use weavelight_calibration::chessboard;

    pub(in crate::calibrate) fn detect(
        grey: &Image<f32>,
        shape: &BoardShape,
        tick: &dyn Fn(),
    ) -> Result<Result<Corners, NoBoard>, CalibrateError> {
        let found = chessboard::detect(grey, shape, tick)?;
        Ok(found.map(|found| Corners { detected: found.detected, refined: found.refined }))
    }

    pub(in crate::calibrate) fn fit(
        boards: &[Corners],
        shape: &BoardShape,
        size_px: [usize; 2],
    ) -> Result<Fitted, CalibrateError> {
        let with = |view: &dyn Fn(&Corners) -> BoardView| {
            let views: Vec<BoardView> = boards.iter().map(view).collect();
            let fit = |kept: &[usize]| {
                let views: Vec<&BoardView> = kept.iter().map(|k| &views[*k]).collect();
                chessboard::calibrate(&views, shape, size_px)
            };
            fit_without_outliers(views.len(), &fit)
        };
        let detected = with(&|corners| corners.detected.clone());
        let refined = with(&|corners| corners.refined.clone());
        match (detected, refined) {
            (Ok(detected), Ok(refined)) if detected.0.rms_px < refined.0.rms_px => Ok(detected),
            (Ok(detected), Err(_)) => Ok(detected),
            (_, refined) => Ok(refined?),
        }
    }

    pub(in crate::calibrate) fn pose(
        view: &BoardView,
        shape: &BoardShape,
        camera: &Camera,
    ) -> Result<(IsometryMatrix3<f64>, f64), CalibrateError> {
        Ok(chessboard::board_pose(view, shape, camera)?)
    }
}

#[cfg(not(feature = "opencv"))]
mod without_opencv {
    use super::*;

    pub(in crate::calibrate) fn detect(
        _grey: &Image<f32>,
        _shape: &BoardShape,
        _tick: &dyn Fn(),
    ) -> Result<Result<Corners, NoBoard>, CalibrateError> {
        Err(CalibrateError::NoChessboards)
    }

    pub(in crate::calibrate) fn fit(
        _boards: &[Corners],
        _shape: &BoardShape,
        _size_px: [usize; 2],
    ) -> Result<Fitted, CalibrateError> {
        Err(CalibrateError::NoChessboards)
    }

    pub(in crate::calibrate) fn pose(
        _view: &BoardView,
        _shape: &BoardShape,
        _camera: &Camera,
    ) -> Result<(IsometryMatrix3<f64>, f64), CalibrateError> {
        Err(CalibrateError::NoChessboards)
    }
}

#[cfg(feature = "opencv")]
pub(super) use with_opencv::{detect, fit, pose};
#[cfg(not(feature = "opencv"))]
pub(super) use without_opencv::{detect, fit, pose};
