//! The one place that speaks to OpenCV: chessboard corners, camera calibration, pose of a board.

mod search;

pub use search::{Detector, Found, detect};

use crate::board::{BoardError, BoardShape, BoardView, CameraFit};
use crate::description::Camera;
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};
use opencv::calib3d;
use opencv::core::{Mat, Point2f, Point3f, Size, TermCriteria, TermCriteria_Type, Vector};
use opencv::prelude::MatTraitConst;
use opencv::prelude::MatTraitConstManual;

fn failed(error: opencv::Error) -> BoardError {
    BoardError::Failed { what: error.message }
}

fn criteria() -> i32 {
    TermCriteria_Type::COUNT as i32 + TermCriteria_Type::EPS as i32
}

/// Camera, lens and poses from views of one board: Zhang's method and Levenberg-Marquardt as OpenCV does it, with the
/// sigma of every parameter.
///
/// Zhang, "A flexible new technique for camera calibration", PAMI 22(11), 2000.
///
/// # Errors
/// Where OpenCV finds no solution.
pub fn calibrate(
    views: &[&BoardView],
    shape: &BoardShape,
    size_px: [usize; 2],
) -> Result<CameraFit, BoardError> {
    let first = fit(views, shape, size_px).map_err(failed)?;
    let Some(clean) = without_outlying_corners(&first, views, shape, size_px) else {
        return Ok(first);
    };
    let clean: Vec<&BoardView> = clean.iter().collect();
    fit(&clean, shape, size_px).map_err(failed)
}

/// A corner does not count that is off by this many times the median over all corners, and by as many pixels.
const OUTLYING: f64 = 7.0;
const OUTLYING_PX: f64 = 0.5;

/// The views without the corners that the fit contradicts; `None` where there is none. A view with many of them is one that
/// does not fit as a whole: it is left as it is.
fn without_outlying_corners(
    fit: &CameraFit,
    views: &[&BoardView],
    shape: &BoardShape,
    size_px: [usize; 2],
) -> Option<Vec<BoardView>> {
    let [fx, fy, cx, cy] = fit.intrinsics;
    let [width_px, height_px] = size_px;
    let corners = shape.corners_mm();
    let off = |view: &BoardView, pose: &IsometryMatrix3<f64>| -> Vec<f64> {
        let (distortion, camera_from_rig) = (fit.distortion, *pose);
        let camera = Camera { width_px, height_px, fx, fy, cx, cy, distortion, camera_from_rig };
        let see = crate::projection::Projector::new(&camera);
        let off = |(p, [u, v]): (&nalgebra::Point3<f64>, &[f64; 2])| {
            see.project(p).map_or(f64::INFINITY, |[x, y]| (x - u).hypot(y - v))
        };
        corners.iter().zip(&view.corners_px).map(off).collect()
    };
    let all: Vec<Vec<f64>> =
        views.iter().zip(&fit.camera_from_board).map(|(view, pose)| off(view, pose)).collect();
    let mut sorted: Vec<f64> = all.iter().flatten().copied().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let limit = (OUTLYING * sorted.get(sorted.len() / 2)?).max(OUTLYING_PX);
    let mut changed = false;
    let clean = views.iter().zip(&all).map(|(view, off)| {
        let outlying: Vec<usize> =
            (0..off.len()).filter(|k| view.counts(*k) && off[*k] > limit).collect();
        let few = outlying.len() + view.doubtful.len() <= corners.len() / 8;
        let mut view = (*view).clone();
        if few && !outlying.is_empty() {
            changed = true;
            view.doubtful.extend(outlying);
            view.doubtful.sort_unstable();
        }
        view
    });
    let clean: Vec<BoardView> = clean.collect();
    changed.then_some(clean)
}

fn fit(views: &[&BoardView], shape: &BoardShape, size_px: [usize; 2]) -> opencv::Result<CameraFit> {
    let object: Vector<Vector<Point3f>> =
        views.iter().map(|view| object_points(shape, view)).collect();
    let image: Vector<Vector<Point2f>> = views.iter().map(|view| image_points(view)).collect();
    let (mut matrix, mut distortion) = (Mat::default(), Mat::default());
    let (mut rotations, mut translations): (Vector<Mat>, Vector<Mat>) =
        (Vector::new(), Vector::new());
    let (mut sigma, mut sigma_poses, mut errors) = (Mat::default(), Mat::default(), Mat::default());
    let size = Size::new(size_px[0] as i32, size_px[1] as i32);
    let rms_px = calib3d::calibrate_camera_extended(
        &object,
        &image,
        size,
        &mut matrix,
        &mut distortion,
        &mut rotations,
        &mut translations,
        &mut sigma,
        &mut sigma_poses,
        &mut errors,
        0,
        TermCriteria::new(criteria(), 200, 1e-12)?,
    )?;
    let matrix = matrix.data_typed::<f64>()?;
    let found = distortion.data_typed::<f64>()?;
    let sigma = sigma.data_typed::<f64>()?;
    let sigma_poses = sigma_poses.data_typed::<f64>()?;
    let poses = rotations.iter().zip(translations.iter());
    Ok(CameraFit {
        intrinsics: [matrix[0], matrix[4], matrix[2], matrix[5]],
        distortion: std::array::from_fn(|k| found.get(k).copied().unwrap_or(0.0)),
        sigma: std::array::from_fn(|k| sigma.get(k).copied().unwrap_or(f64::NAN)),
        camera_from_board: poses.map(|(r, t)| pose(&r, &t)).collect::<opencv::Result<_>>()?,
        pose_sigma: sigma_poses.as_chunks::<6>().0.to_vec(),
        view_rms_px: errors.data_typed::<f64>()?.to_vec(),
        rms_px,
    })
}

/// Pose of a board for a known camera: from the board's frame to the camera's, and its reprojection error in pixels.
///
/// # Errors
/// Where OpenCV finds no solution.
pub fn board_pose(
    view: &BoardView,
    shape: &BoardShape,
    camera: &Camera,
) -> Result<(IsometryMatrix3<f64>, f64), BoardError> {
    let (pose, rms_px) = solve_pose(view, shape, camera).map_err(failed)?;
    Ok((pose, rms_px))
}

fn solve_pose(
    view: &BoardView,
    shape: &BoardShape,
    camera: &Camera,
) -> opencv::Result<(IsometryMatrix3<f64>, f64)> {
    let entries = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0];
    let matrix = Mat::from_slice(&entries)?;
    let matrix = matrix.reshape(1, 3)?;
    let distortion = Mat::from_slice(&camera.distortion)?;
    let (object, image) = (object_points(shape, view), image_points(view));
    let (mut rotation, mut translation) = (Mat::default(), Mat::default());
    let method = calib3d::SOLVEPNP_ITERATIVE;
    calib3d::solve_pnp(
        &object,
        &image,
        &matrix,
        &distortion,
        &mut rotation,
        &mut translation,
        false,
        method,
    )?;
    let found = pose(&rotation, &translation)?;
    let local = Camera { camera_from_rig: found, ..camera.clone() };
    let view_of = crate::projection::Projector::new(&local);
    let square = |(p, [u, v]): (&nalgebra::Point3<f64>, &[f64; 2])| {
        view_of.project(p).map_or(f64::NAN, |[x, y]| (x - u).powi(2) + (y - v).powi(2))
    };
    let corners = shape.corners_mm();
    let counted = corners.iter().zip(&view.corners_px).enumerate().filter(|(k, _)| view.counts(*k));
    let squares: Vec<f64> = counted.map(|(_, pair)| square(pair)).collect();
    Ok((found, (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()))
}

fn object_points(shape: &BoardShape, view: &BoardView) -> Vector<Point3f> {
    let counted = shape.corners_mm().into_iter().enumerate().filter(|(k, _)| view.counts(*k));
    counted.map(|(_, p)| Point3f::new(p.x as f32, p.y as f32, p.z as f32)).collect()
}

fn image_points(view: &BoardView) -> Vector<Point2f> {
    let counted = view.corners_px.iter().enumerate().filter(|(k, _)| view.counts(*k));
    counted.map(|(_, [u, v])| Point2f::new(*u as f32, *v as f32)).collect()
}

fn pose(rotation: &Mat, translation: &Mat) -> opencv::Result<IsometryMatrix3<f64>> {
    let vector = |mat: &Mat| -> opencv::Result<Vector3<f64>> {
        Ok(Vector3::from_column_slice(&mat.data_typed::<f64>()?[..3]))
    };
    let turn = Rotation3::new(vector(rotation)?);
    Ok(IsometryMatrix3::from_parts(Translation3::from(vector(translation)?), turn))
}
