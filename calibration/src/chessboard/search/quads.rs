//! How many dark quadrangles the classic detector would have to sort.
//!
//! It joins neighbouring quadrangles to groups, and removes from a group those that are too many one by one, at a cost of the
//! third power of their number: cloth, each thread of which is one, takes minutes. A call cannot be interrupted, so they are
//! counted before it, which takes a fraction of a second.

use crate::board::BoardShape;
use opencv::core::{BORDER_CONSTANT, Mat, Point, Scalar, Vec4i, Vector};
use opencv::prelude::MatTraitConst;
use opencv::{calib3d, imgproc};

/// Quadrangles beyond two for each dark square of the board that a picture may show. Real pictures of boards, with a room
/// around them, have up to 230 in all; from 500 on a call takes many seconds.
const MOST_OTHERS: usize = 250;
/// As the detector thresholds: sides of the neighbourhood, as shares of the picture's shorter side, and how often the white is
/// widened at most.
const NEIGHBOURHOODS: [f64; 2] = [0.2, 0.1];
const DILATIONS: i32 = 7;
/// Its threshold for the whole picture lies this far below the mean, and no lower than this.
const BELOW_MEAN: f64 = 10.0;
/// Dark patches of any shape, from which on it is noise that the threshold has brought out; to follow their outlines takes
/// seconds.
const MOST_PATCHES: i32 = 5000;
/// Smallest bounding box of a quadrangle in pixels, and the coarsest outline that is tried.
const LEAST_AREA_PX: i32 = 25;
const COARSEST_PX: i32 = 7;

/// The flags with which the classic detector is done with a picture soon; `None` where there are none.
///
/// Without local thresholds it goes by the histogram and the mean alone: noise on an even background is then no quadrangles.
pub(super) fn bounded(
    picture: &Mat,
    shape: &BoardShape,
    flags: i32,
) -> opencv::Result<Option<i32>> {
    let dark_squares = ((shape.columns + 1) * (shape.rows + 1)).div_ceil(2);
    let limit = 2 * dark_squares + MOST_OTHERS;
    let few = |white: Mat| -> opencv::Result<bool> { Ok(most_at(white, limit)? <= limit) };
    let mean = opencv::core::mean(picture, &opencv::core::no_array())?[0] - BELOW_MEAN;
    if !few(global(picture, Some(mean))?)? || !few(global(picture, None)?)? {
        return Ok(None);
    }
    // The detector evens the histogram out before it thresholds locally.
    let mut evened = Mat::default();
    imgproc::equalize_hist(picture, &mut evened)?;
    for share in NEIGHBOURHOODS {
        if !few(local(&evened, share)?)? {
            return Ok(Some(flags & !LOCAL));
        }
    }
    Ok(Some(flags))
}

/// Of the detector's flags those that make it threshold locally.
const LOCAL: i32 = calib3d::CALIB_CB_ADAPTIVE_THRESH | calib3d::CALIB_CB_NORMALIZE_IMAGE;

/// At the level given, or at the one that parts the histogram best.
fn global(picture: &Mat, level: Option<f64>) -> opencv::Result<Mat> {
    let mut white = Mat::default();
    let otsu = if level.is_none() { imgproc::THRESH_OTSU } else { 0 };
    let (level, kind) = (level.unwrap_or(0.0).max(BELOW_MEAN), imgproc::THRESH_BINARY | otsu);
    imgproc::threshold(picture, &mut white, level, 255.0, kind)?;
    Ok(white)
}

fn local(picture: &Mat, share: f64) -> opencv::Result<Mat> {
    let side = (f64::from(picture.cols().min(picture.rows())) * share).round() as i32 | 1;
    let mut white = Mat::default();
    let (method, kind) = (imgproc::ADAPTIVE_THRESH_MEAN_C, imgproc::THRESH_BINARY);
    imgproc::adaptive_threshold(picture, &mut white, 255.0, method, kind, side.max(3), 0.0)?;
    Ok(white)
}

/// The most as the white is widened step by step.
fn most_at(mut white: Mat, limit: usize) -> opencv::Result<usize> {
    let mut most = 0;
    for _ in 0..DILATIONS {
        most = most.max(count(&white, limit)?);
        if most > limit {
            break;
        }
        white = widened(&white)?;
    }
    Ok(most)
}

fn widened(white: &Mat) -> opencv::Result<Mat> {
    let mut wider = Mat::default();
    let (square, centre) = (Mat::default(), Point::new(-1, -1));
    let border = imgproc::morphology_default_border_value()?;
    imgproc::dilate(white, &mut wider, &square, centre, 1, BORDER_CONSTANT, border)?;
    Ok(wider)
}

/// Holes in the white that are convex quadrangles; counts to just beyond `limit`, which noise exceeds too.
fn count(white: &Mat, limit: usize) -> opencv::Result<usize> {
    let mut framed = white.clone();
    let frame = opencv::core::Rect::new(0, 0, framed.cols(), framed.rows());
    imgproc::rectangle(&mut framed, frame, Scalar::all(255.0), 3, imgproc::LINE_8, 0)?;
    if patches(&framed)? > MOST_PATCHES {
        return Ok(limit + 1);
    }
    let mut outlines: Vector<Vector<Point>> = Vector::new();
    let mut family: Vector<Vec4i> = Vector::new();
    let (mode, method) = (imgproc::RETR_CCOMP, imgproc::CHAIN_APPROX_SIMPLE);
    imgproc::find_contours_with_hierarchy(
        &framed,
        &mut outlines,
        &mut family,
        mode,
        method,
        Point::new(0, 0),
    )?;
    let mut found = 0;
    for (outline, [.., child, parent]) in outlines.iter().zip(family.iter().map(|links| links.0)) {
        let is_hole = child < 0 && parent >= 0;
        if is_hole && is_quadrangle(&outline)? {
            found += 1;
            if found > limit {
                break;
            }
        }
    }
    Ok(found)
}

/// Dark patches; a diagonal touch does not join them.
fn patches(white: &Mat) -> opencv::Result<i32> {
    let (mut dark, mut labels) = (Mat::default(), Mat::default());
    opencv::core::bitwise_not(white, &mut dark, &opencv::core::no_array())?;
    imgproc::connected_components(&dark, &mut labels, 4, opencv::core::CV_32S)
}

fn is_quadrangle(outline: &Vector<Point>) -> opencv::Result<bool> {
    if imgproc::bounding_rect(outline)?.area() < LEAST_AREA_PX {
        return Ok(false);
    }
    for coarseness in 1..=COARSEST_PX {
        let (mut once, mut simple): (Vector<Point>, Vector<Point>) = (Vector::new(), Vector::new());
        imgproc::approx_poly_dp(outline, &mut once, f64::from(coarseness), true)?;
        // Its own result again, which it does not always simplify at once.
        imgproc::approx_poly_dp(&once, &mut simple, f64::from(coarseness), true)?;
        if once.len() == 4 || simple.len() == 4 {
            return imgproc::is_contour_convex(if once.len() == 4 { &once } else { &simple });
        }
    }
    Ok(false)
}
