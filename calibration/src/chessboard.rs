//! The one place that speaks to OpenCV: chessboard corners, camera calibration, pose of a board.

use crate::board::{BoardError, BoardShape, BoardView, CameraFit};
use crate::description::{Camera, Image};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};
use opencv::core::{Mat, Point2f, Point3f, Size, TermCriteria, TermCriteria_Type, Vector};
use opencv::prelude::{MatTraitConst, MatTraitConstManual};
use opencv::{calib3d, imgproc};

/// Pictures are searched at this width at most; the corners are then refined on the full picture.
const SEARCH_WIDTH_PX: usize = 1500;
/// Half the window of the refinement, as a share of the distance between corners, and its bounds in pixels.
const WINDOW_SHARE: f64 = 0.25;
const WINDOW_PX: (f64, f64) = (3.0, 40.0);
/// Half the window of the lesser refinement in large pictures, in pixels of the searched picture.
const SMALL_WINDOW_PX: f64 = 4.0;
/// Largest plausible distance between the searched and the refined corner, in pixels of the searched picture.
const REFINE_REACH_PX: f64 = 1.5;

/// Which detector found the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detector {
    /// Sector-based (Duda and Frese, "Accurate detection and localization of checkerboard corners", BMVC 2018).
    SectorBased,
    /// The classic one with sub-pixel refinement.
    Classic,
}

/// The corners of one board, found in two ways. Which is better depends on lens, light and sensor: calibrate with both and
/// keep what fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// As the detector placed them (in large pictures: refined with a small window).
    pub detected: BoardView,
    /// Sub-pixel refined over a window as large as the squares allow; many edge pixels average noise out.
    pub refined: BoardView,
    /// Which detector found the board.
    pub detector: Detector,
}

/// Finds the board; `None` where there is no complete one.
///
/// `grey`: any scale; sensor pixels, (0, 0) is the centre of the first.
///
/// # Errors
/// Where OpenCV fails.
pub fn detect(grey: &Image<f32>, shape: &BoardShape) -> Result<Option<Found>, BoardError> {
    find(grey, shape).map_err(failed)
}

fn failed(error: opencv::Error) -> BoardError {
    BoardError::Failed { what: error.message }
}

fn find(grey: &Image<f32>, shape: &BoardShape) -> opencv::Result<Option<Found>> {
    let factor = grey.width.div_ceil(SEARCH_WIDTH_PX).max(1);
    let small = reduced(grey, factor);
    let bytes = eight_bit(&small);
    let searched = Mat::from_slice(&bytes)?;
    let searched = searched.reshape(1, small.height as i32)?;
    let Some((corners, detector)) = search(&searched, shape)? else { return Ok(None) };
    let scale = factor as f64;
    let full = |c: f32| (f64::from(c) + 0.5) * scale - 0.5;
    let start: Vec<[f64; 2]> = corners.iter().map(|p| [full(p.x), full(p.y)]).collect();
    let reach_px = REFINE_REACH_PX * scale;
    let Some(refined) = refine(grey, &start, window_px(shape, &start), reach_px)? else {
        return Ok(None);
    };
    let small_window = (SMALL_WINDOW_PX * scale) as i32;
    let detected =
        if factor == 1 { Some(start) } else { refine(grey, &start, small_window, reach_px)? };
    let view = |corners: &[[f64; 2]]| BoardView { corners_px: shape.upright(corners) };
    Ok(detected.map(|detected| Found {
        detected: view(&detected),
        refined: view(&refined),
        detector,
    }))
}

fn search(
    picture: &impl opencv::core::ToInputArray,
    shape: &BoardShape,
) -> opencv::Result<Option<(Vector<Point2f>, Detector)>> {
    let size = Size::new(shape.columns as i32, shape.rows as i32);
    let mut corners: Vector<Point2f> = Vector::new();
    let thorough = calib3d::CALIB_CB_NORMALIZE_IMAGE | calib3d::CALIB_CB_EXHAUSTIVE;
    // Normalising equalises the histogram: on an evenly lit sheet, of which the board is a small part, it blows noise up to
    // full contrast. Without it such boards are found.
    for flags in [thorough, 0] {
        let flags = flags | calib3d::CALIB_CB_ACCURACY;
        if calib3d::find_chessboard_corners_sb(picture, size, &mut corners, flags)? {
            return Ok(Some((corners, Detector::SectorBased)));
        }
    }
    let flags = calib3d::CALIB_CB_ADAPTIVE_THRESH | calib3d::CALIB_CB_NORMALIZE_IMAGE;
    if !calib3d::find_chessboard_corners(picture, size, &mut corners, flags)? {
        return Ok(None);
    }
    let places: Vec<[f64; 2]> = corners.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
    sub_pixel(picture, &mut corners, window_px(shape, &places))?;
    Ok(Some((corners, Detector::Classic)))
}

/// Corners sharpened on the full picture; `None` where they run away.
fn refine(
    grey: &Image<f32>,
    start: &[[f64; 2]],
    window: i32,
    reach_px: f64,
) -> opencv::Result<Option<Vec<[f64; 2]>>> {
    let mut places: Vector<Point2f> =
        start.iter().map(|[u, v]| Point2f::new(*u as f32, *v as f32)).collect();
    let picture = Mat::from_slice(&grey.data)?;
    let picture = picture.reshape(1, grey.height as i32)?;
    sub_pixel(&picture, &mut places, window)?;
    let refined: Vec<[f64; 2]> = places.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
    let strayed = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) > reach_px;
    Ok((!refined.iter().zip(start).any(strayed)).then_some(refined))
}

fn sub_pixel(
    picture: &impl opencv::core::ToInputArray,
    corners: &mut Vector<Point2f>,
    window: i32,
) -> opencv::Result<()> {
    let until = TermCriteria::new(criteria(), 60, 1e-4)?;
    imgproc::corner_sub_pix(picture, corners, Size::new(window, window), Size::new(-1, -1), until)
}

fn criteria() -> i32 {
    TermCriteria_Type::COUNT as i32 + TermCriteria_Type::EPS as i32
}

/// Half the refinement window: a share of the smallest distance between neighbouring corners.
fn window_px(shape: &BoardShape, corners: &[[f64; 2]]) -> i32 {
    let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let in_rows = corners
        .chunks(shape.columns)
        .flat_map(|row| row.windows(2).map(|p| distance(&p[0], &p[1])));
    let down = corners.iter().zip(&corners[shape.columns..]).map(|(a, b)| distance(a, b));
    let least = in_rows.chain(down).fold(f64::INFINITY, f64::min);
    (WINDOW_SHARE * least).clamp(WINDOW_PX.0, WINDOW_PX.1) as i32
}

fn reduced(grey: &Image<f32>, factor: usize) -> Image<f32> {
    let (width, height) = (grey.width / factor, grey.height / factor);
    let mut out = Image::filled(width, height, 0.0f32);
    for y in 0..height {
        for row in y * factor..(y + 1) * factor {
            let row = grey.row(row);
            for (x, value) in out.data[y * width..(y + 1) * width].iter_mut().enumerate() {
                *value += row[x * factor..(x + 1) * factor].iter().sum::<f32>();
            }
        }
    }
    out
}

/// Stretches the middle 98 % of the values to 8 bits, by their square root: noise is then alike in dark and bright squares.
fn eight_bit(grey: &Image<f32>) -> Vec<u8> {
    let mut sample: Vec<f32> =
        grey.data.iter().step_by(7).copied().filter(|v| v.is_finite()).collect();
    sample.sort_unstable_by(f32::total_cmp);
    let at =
        |share: f64| sample.get((share * sample.len() as f64) as usize).copied().unwrap_or(0.0);
    let (low, high) = (at(0.01), at(0.99));
    let scale = (high - low).max(f32::MIN_POSITIVE).recip();
    grey.data.iter().map(|v| (255.0 * ((v - low) * scale).clamp(0.0, 1.0).sqrt()) as u8).collect()
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
    fit(views, shape, size_px).map_err(failed)
}

fn fit(views: &[&BoardView], shape: &BoardShape, size_px: [usize; 2]) -> opencv::Result<CameraFit> {
    let object: Vector<Vector<Point3f>> = views.iter().map(|_| object_points(shape)).collect();
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
    let (object, image) = (object_points(shape), image_points(view));
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
    let sum: f64 = corners.iter().zip(&view.corners_px).map(square).sum();
    Ok((found, (sum / corners.len() as f64).sqrt()))
}

fn object_points(shape: &BoardShape) -> Vector<Point3f> {
    shape.corners_mm().iter().map(|p| Point3f::new(p.x as f32, p.y as f32, p.z as f32)).collect()
}

fn image_points(view: &BoardView) -> Vector<Point2f> {
    view.corners_px.iter().map(|[u, v]| Point2f::new(*u as f32, *v as f32)).collect()
}

fn pose(rotation: &Mat, translation: &Mat) -> opencv::Result<IsometryMatrix3<f64>> {
    let vector = |mat: &Mat| -> opencv::Result<Vector3<f64>> {
        Ok(Vector3::from_column_slice(&mat.data_typed::<f64>()?[..3]))
    };
    let turn = Rotation3::new(vector(rotation)?);
    Ok(IsometryMatrix3::from_parts(Translation3::from(vector(translation)?), turn))
}
