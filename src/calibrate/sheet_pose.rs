//! Where a white sheet lay, and how well that is known.

use super::CalibrateError;
use super::boards::{self, shape_of};
use super::sheet::tilt_and_height;
use crate::session::Session;
use nalgebra::IsometryMatrix3;
use weavelight_calibration::board::{BoardShape, BoardView, plane_of_board};
use weavelight_calibration::description::{Camera, Plane};
use weavelight_calibration::lights::PoseSigma;

/// Where the sheet lay, and the strip on it.
pub(super) struct Pose {
    pub(super) plane: Plane,
    pub(super) sigma: PoseSigma,
    pub(super) strip: Option<(IsometryMatrix3<f64>, BoardShape)>,
    pub(super) warning: Option<String>,
}

/// Where the sheet lay: as stated, else where its printed strip says, else on the table.
pub(super) fn pose_of(
    session: &Session,
    camera: &Camera,
    strips: &[&BoardView],
) -> Result<Pose, CalibrateError> {
    let board =
        session.target.as_ref().and_then(|target| target.board).map(|board| shape_of(&board));
    let strip = board.map(|shape| strip_pose(session, camera, strips, shape)).transpose()?;
    let exact = PoseSigma::default();
    Ok(match (&session.plane, strip) {
        (Some(plane), None) => {
            Pose { plane: plane.clone(), sigma: exact, strip: None, warning: None }
        }
        (None, None) => Pose { plane: Plane::table(), sigma: exact, strip: None, warning: None },
        (Some(plane), Some((pose, shape, _))) => {
            let found = plane_of_board(&pose);
            let off = plane.normal.angle(&found.normal).to_degrees();
            let warning = (off > STATED_TOLERANCE_DEG).then(|| {
                format!("{}: the stated plane and the printed strip differ by {off:.1} degrees; the stated one is used", session.name)
            });
            Pose { plane: plane.clone(), sigma: exact, strip: Some((pose, shape)), warning }
        }
        (None, Some((pose, shape, sigma))) => {
            let (plane, sigma) = lying_or_found(plane_of_board(&pose), sigma);
            Pose { plane, sigma, strip: Some((pose, shape)), warning: None }
        }
    })
}

/// A sheet whose strip agrees with the table lies on it: a narrow strip tells height and tilt far worse than that.
fn lying_or_found(found: Plane, sigma: PoseSigma) -> (Plane, PoseSigma) {
    let (tilt_deg, height_mm) = tilt_and_height(&found);
    let lies = tilt_deg < LYING_TILT_DEG + 3.0 * sigma.tilt_rad.to_degrees()
        && tilt_deg < LYING_MOST_DEG
        && height_mm.abs() < LYING_HEIGHT_MM + 3.0 * sigma.offset_mm;
    if lies { (Plane::table(), PoseSigma::default()) } else { (found, sigma) }
}

/// What a sheet on the table may seem to be off by beyond its strip's sigma, and the tilt that is never taken for none.
const LYING_TILT_DEG: f64 = 0.3;
const LYING_MOST_DEG: f64 = 4.0;
const LYING_HEIGHT_MM: f64 = 2.0;

/// Stated plane and strip may differ by this much before a word is said.
const STATED_TOLERANCE_DEG: f64 = 0.5;

/// The strip's pose in the rig frame from its corners, averaged over the frames searched, and how well it is known.
fn strip_pose(
    session: &Session,
    camera: &Camera,
    strips: &[&BoardView],
    shape: BoardShape,
) -> Result<(IsometryMatrix3<f64>, BoardShape, PoseSigma), CalibrateError> {
    if strips.is_empty() {
        let what = format!(
            "the printed strip of {} x {} inner corners was not found",
            shape.columns, shape.rows
        );
        let remedy = "photograph the sheet with the whole strip in the picture and not overexposed, or correct [target] board";
        return Err(CalibrateError::target(session.manifest_path(), what, remedy));
    }
    let view = BoardView::mean(strips);
    let (camera_from_board, rms_px) = boards::pose(&view, &shape, camera)?;
    let sigma = pose_sigma(&camera_from_board, &shape, camera, rms_px);
    Ok((camera.camera_from_rig.inverse() * camera_from_board, shape, sigma))
}

/// A tilt by a moves a corner x from the middle by f a x^2 / z^2 pixels, a lift by dz by f x dz / z^2.
fn pose_sigma(
    camera_from_board: &IsometryMatrix3<f64>,
    shape: &BoardShape,
    camera: &Camera,
    rms_px: f64,
) -> PoseSigma {
    let z2 = camera_from_board.translation.vector.z.powi(2);
    let corners = shape.corners_mm();
    let count = corners.len() as f64;
    let fourth = |axis: usize| corners.iter().map(|p| p[axis].powi(4)).sum::<f64>();
    let second: f64 = corners.iter().map(|p| p.x * p.x + p.y * p.y).sum();
    let rms_px = rms_px.max(LEAST_CORNER_PX);
    PoseSigma {
        tilt_rad: rms_px * z2 / camera.fx / fourth(0).min(fourth(1)).sqrt(),
        offset_mm: rms_px * z2 / camera.fx / second.sqrt()
            + rms_px * z2 / camera.fx / (count * second).sqrt(),
    }
}

/// No corner is known better than this, whatever the residuals say.
const LEAST_CORNER_PX: f64 = 0.03;
