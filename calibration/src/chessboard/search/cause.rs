//! Why no board was found: what to photograph differently.

use super::{SB, Searched};
use crate::board::{BoardShape, NoBoard};
use opencv::calib3d;
use opencv::core::{Mat, Point2f, Size, Vector};
use opencv::prelude::MatTraitConst;

/// Contrast below this share of the brightest value is none: paper, noise.
const NO_CONTRAST: f32 = 0.08;
/// Differences between neighbours, as a share of the contrast, that an edge in focus exceeds somewhere.
const SHARP: f32 = 0.12;
/// Share of the pixels that must have such an edge.
const SHARP_SHARE: f64 = 5e-4;
/// A board that ends this many squares from the edge of the picture is cut off by it.
const EDGE_SQUARES: f64 = 1.7;
/// Share of a board's neighbourhood that is at the top of the range from which there is glare.
const GLARE_SHARE: f64 = 0.01;

/// What no detector need be asked about.
pub(super) fn hopeless(searched: &Searched, shape: &BoardShape) -> Option<NoBoard> {
    if shape.columns.min(shape.rows) < 3 {
        return Some(NoBoard::TooSmall);
    }
    let [low, high] = searched.range;
    let top = searched.small.data.iter().copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
    // Nor where nothing is finite.
    let has_contrast = high - low > NO_CONTRAST * top.max(high);
    if !has_contrast {
        return Some(NoBoard::NoContrast);
    }
    (!searched.can_hold(shape, 1)).then_some(NoBoard::TooFine)
}

/// Looks for a part of the board, or a larger one, else at the sharpness.
pub(super) fn of_failure(searched: &Searched, shape: &BoardShape) -> opencv::Result<NoBoard> {
    if let Some(cause) = part(searched, shape)? {
        return Ok(cause);
    }
    Ok(if is_sharp(searched) { NoBoard::Nothing } else { NoBoard::Blurred })
}

fn part(searched: &Searched, shape: &BoardShape) -> opencv::Result<Option<NoBoard>> {
    let half = |corners: usize| (corners.div_ceil(2)).max(3) as i32;
    let least = Size::new(half(shape.columns), half(shape.rows));
    let flags = SB | calib3d::CALIB_CB_NORMALIZE_IMAGE | calib3d::CALIB_CB_LARGER;
    let (width, bytes) = searched.bytes(1);
    let picture = Mat::from_slice(&bytes)?;
    let picture = picture.reshape(1, (bytes.len() / width) as i32)?;
    let (mut corners, mut meta): (Vector<Point2f>, Mat) = (Vector::new(), Mat::default());
    if !calib3d::find_chessboard_corners_sb_with_meta(
        &picture,
        least,
        &mut corners,
        flags,
        &mut meta,
    )? {
        return Ok(None);
    }
    let found = [meta.cols() as usize, meta.rows() as usize];
    let places: Vec<[f64; 2]> = corners.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
    if found.iter().product::<usize>() != places.len() {
        return Ok(None);
    }
    let sorted = |[a, b]: [usize; 2]| [a.max(b), a.min(b)];
    let ([more, fewer], [columns, rows]) = (sorted(found), sorted([shape.columns, shape.rows]));
    if more > columns || fewer > rows {
        return Ok(Some(NoBoard::Larger([more, fewer])));
    }
    let seen = [more, fewer];
    let square = square_px(&places, found[0]);
    let height = bytes.len() / width;
    let near_edge = |[x, y]: &[f64; 2]| {
        x.min(*y).min(width as f64 - 1.0 - x).min(height as f64 - 1.0 - y) < EDGE_SQUARES * square
    };
    if places.iter().any(near_edge) {
        return Ok(Some(NoBoard::CutOff(seen)));
    }
    let glare = glare_share(searched, &places, square) > GLARE_SHARE;
    Ok(Some(if glare { NoBoard::Glare(seen) } else { NoBoard::Covered(seen) }))
}

/// Mean distance of neighbours along the rows.
fn square_px(places: &[[f64; 2]], columns: usize) -> f64 {
    let steps = places.chunks(columns.max(1)).flat_map(|row| row.windows(2));
    let lengths: Vec<f64> = steps.map(|p| (p[0][0] - p[1][0]).hypot(p[0][1] - p[1][1])).collect();
    lengths.iter().sum::<f64>() / f64::max(lengths.len() as f64, 1.0)
}

/// Share of pixels about the board, three squares around what was found, that stand far above its white squares.
fn glare_share(searched: &Searched, places: &[[f64; 2]], square: f64) -> f64 {
    let image = &searched.small;
    let bound = |axis: usize, length: usize| {
        let (low, high) = places
            .iter()
            .fold((f64::INFINITY, 0.0f64), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
        let low = (low - 3.0 * square).max(0.0) as usize;
        (low, ((high + 3.0 * square) as usize + 1).min(length))
    };
    let ((x0, x1), (y0, y1)) = (bound(0, image.width), bound(1, image.height));
    let inside: Vec<f32> = (y0..y1).flat_map(|y| image.row(y)[x0..x1].iter().copied()).collect();
    let mut sorted = inside.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let (Some(white), Some(top)) = (sorted.get(sorted.len() * 7 / 10), sorted.last()) else {
        return 0.0;
    };
    let limit = (white * 1.25).min(0.999 * top);
    inside.iter().filter(|v| **v > limit).count() as f64 / inside.len() as f64
}

/// Whether some neighbouring pixels differ by much of the picture's contrast.
fn is_sharp(searched: &Searched) -> bool {
    let (image, [low, high]) = (&searched.small, searched.range);
    let limit = SHARP * (high - low);
    let steep = |row: &[f32]| row.windows(2).filter(|p| (p[0] - p[1]).abs() > limit).count();
    let edges: usize = (0..image.height).map(|y| steep(image.row(y))).sum();
    edges as f64 > SHARP_SHARE * image.data.len() as f64
}
