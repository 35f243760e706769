//! Looks for the board: several detectors on several versions of the picture, each of bounded cost, the likeliest first.

use super::{criteria, failed};
use crate::board::{BoardError, BoardShape, BoardView, NoBoard, outlying_corners};
use crate::description::Image;
use opencv::core::{Mat, Point2f, Size, TermCriteria, Vector};
use opencv::prelude::{CLAHETrait, MatTraitConst};
use opencv::{calib3d, imgproc};

mod cause;
mod picture;
mod quads;

use picture::Searched;

/// Half the window of the refinement, as a share of the distance between corners, and its bounds in pixels.
const WINDOW_SHARE: f64 = 0.25;
const WINDOW_PX: (f64, f64) = (3.0, 40.0);
/// Half the window of the lesser refinement in large pictures, in pixels of the searched picture.
const SMALL_WINDOW_PX: f64 = 4.0;
/// Largest plausible distance between the searched and the refined corner, in pixels of the searched picture.
const REFINE_REACH_PX: f64 = 1.5;
/// A board of which more than this share of the corners is doubtful is not used.
const DOUBTFUL_SHARE: f64 = 0.2;
/// Corners nearer than this in the searched picture are not told apart.
const LEAST_SQUARE_PX: usize = 4;

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

/// Finds the board, or why there is none.
///
/// `grey`: any scale; sensor pixels, (0, 0) is the centre of the first. `tick` is called between steps of about a second each;
/// where it unwinds, the search ends.
///
/// # Errors
/// Where OpenCV fails.
pub fn detect(
    grey: &Image<f32>,
    shape: &BoardShape,
    tick: &dyn Fn(),
) -> Result<Result<Found, NoBoard>, BoardError> {
    find(grey, shape, tick, &mut Effort::default()).map_err(failed)
}

/// What a search has cost: calls of the detectors, and pixels looked at by either.
#[derive(Clone, Copy, Debug, Default)]
struct Effort {
    sector_based: usize,
    classic: usize,
    pixels: usize,
}

/// One way to look.
#[derive(Clone, Copy)]
struct Attempt {
    detector: Detector,
    version: Version,
    flags: i32,
}

/// What is looked at.
#[derive(Clone, Copy, PartialEq)]
enum Version {
    /// As wide as is searched at most.
    Whole,
    /// At half that width: texture and blur are finer than the squares.
    Half,
    /// At a quarter.
    Quarter,
    /// Contrast evened out over the picture: glare and shadow.
    Even,
}

const SB: i32 = calib3d::CALIB_CB_ACCURACY;
const CLASSIC: i32 = calib3d::CALIB_CB_ADAPTIVE_THRESH | calib3d::CALIB_CB_NORMALIZE_IMAGE;

/// Normalising equalises the histogram: on an evenly lit sheet, of which the board is a small part, it blows noise up to full
/// contrast. Without it such boards are found.
const ATTEMPTS: [Attempt; 9] = {
    use Detector::{Classic, SectorBased};
    use Version::{Even, Half, Quarter, Whole};
    let thorough = SB | calib3d::CALIB_CB_NORMALIZE_IMAGE | calib3d::CALIB_CB_EXHAUSTIVE;
    let normalised = SB | calib3d::CALIB_CB_NORMALIZE_IMAGE;
    [
        Attempt { detector: SectorBased, version: Whole, flags: thorough },
        Attempt { detector: SectorBased, version: Whole, flags: SB },
        Attempt { detector: SectorBased, version: Half, flags: normalised },
        Attempt { detector: SectorBased, version: Even, flags: normalised },
        Attempt { detector: Classic, version: Half, flags: CLASSIC },
        Attempt { detector: Classic, version: Whole, flags: CLASSIC },
        Attempt { detector: Classic, version: Even, flags: CLASSIC },
        Attempt { detector: SectorBased, version: Quarter, flags: normalised },
        Attempt { detector: Classic, version: Quarter, flags: CLASSIC },
    ]
};

fn find(
    grey: &Image<f32>,
    shape: &BoardShape,
    tick: &dyn Fn(),
    effort: &mut Effort,
) -> opencv::Result<Result<Found, NoBoard>> {
    let searched = Searched::of(grey);
    if let Some(cause) = cause::hopeless(&searched, shape) {
        return Ok(Err(cause));
    }
    let mut crooked: Option<usize> = None;
    for attempt in ATTEMPTS {
        tick();
        let Some(start) = corners_of(&searched, shape, attempt, effort)? else { continue };
        tick();
        let found = refine_both(grey, &searched, shape, &start, attempt.detector)?;
        let doubtful = found.refined.doubtful.len();
        if doubtful as f64 <= DOUBTFUL_SHARE * start.len() as f64 {
            return Ok(Ok(found));
        }
        crooked = Some(crooked.map_or(doubtful, |least| least.min(doubtful)));
    }
    if let Some(corners) = crooked {
        return Ok(Err(NoBoard::Crooked { corners }));
    }
    tick();
    Ok(Err(cause::of_failure(&searched, shape)?))
}

/// Corners of one attempt in pixels of the full picture.
fn corners_of(
    searched: &Searched,
    shape: &BoardShape,
    attempt: Attempt,
    effort: &mut Effort,
) -> opencv::Result<Option<Vec<[f64; 2]>>> {
    let (reduction, even) = match attempt.version {
        Version::Whole => (1, false),
        Version::Even => (1, true),
        Version::Half => (2, false),
        Version::Quarter => (4, false),
    };
    if !searched.can_hold(shape, reduction) {
        return Ok(None);
    }
    let (width, bytes) = searched.bytes(reduction);
    let plain = Mat::from_slice(&bytes)?;
    let plain = plain.reshape(1, (bytes.len() / width) as i32)?;
    let mut evened = Mat::default();
    if even {
        imgproc::create_clahe(4.0, Size::new(8, 8))?.apply(&plain, &mut evened)?;
    } else {
        plain.copy_to(&mut evened)?;
    }
    let mut corners: Vector<Point2f> = Vector::new();
    effort.pixels += (evened.cols() * evened.rows()) as usize;
    if !search(&evened, shape, attempt, &mut corners, effort)? {
        return Ok(None);
    }
    let scale = (searched.factor * reduction) as f64;
    let full = |c: f32| (f64::from(c) + 0.5) * scale - 0.5;
    let corners: Vec<[f64; 2]> = corners.iter().map(|p| [full(p.x), full(p.y)]).collect();
    Ok((corners.len() == shape.columns * shape.rows).then_some(corners))
}

fn search(
    picture: &Mat,
    shape: &BoardShape,
    attempt: Attempt,
    corners: &mut Vector<Point2f>,
    effort: &mut Effort,
) -> opencv::Result<bool> {
    let size = Size::new(shape.columns as i32, shape.rows as i32);
    if attempt.detector == Detector::SectorBased {
        effort.sector_based += 1;
        return calib3d::find_chessboard_corners_sb(picture, size, corners, attempt.flags);
    }
    let Some(flags) = quads::bounded(picture, shape, attempt.flags)? else { return Ok(false) };
    effort.classic += 1;
    if !calib3d::find_chessboard_corners(picture, size, corners, flags)? {
        return Ok(false);
    }
    let places: Vec<[f64; 2]> = corners.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
    sub_pixel(picture, corners, window_px(shape, &places))?;
    Ok(true)
}

/// Corners sharpened on the full picture, in both ways; those that run away or lie out of line do not count.
fn refine_both(
    grey: &Image<f32>,
    searched: &Searched,
    shape: &BoardShape,
    start: &[[f64; 2]],
    detector: Detector,
) -> opencv::Result<Found> {
    let scale = searched.factor as f64;
    let reach_px = REFINE_REACH_PX * scale;
    let small = (SMALL_WINDOW_PX * scale) as i32;
    let view = |corners: Vec<[f64; 2]>, strayed: Vec<bool>| -> BoardView {
        // Flags travel with their corners when the board is read the other way round.
        let upright = shape.upright(&corners);
        let mut doubtful = outlying_corners(shape, &upright, scale);
        for (corner, _) in corners.iter().zip(&strayed).filter(|(_, strayed)| **strayed) {
            doubtful.extend(upright.iter().position(|other| other == corner));
        }
        doubtful.sort_unstable();
        doubtful.dedup();
        BoardView { corners_px: upright, doubtful }
    };
    let (refined, strayed) = refine(grey, start, window_px(shape, start), reach_px)?;
    let refined = view(refined, strayed);
    let detected = if searched.factor == 1 {
        view(start.to_vec(), vec![false; start.len()])
    } else {
        let (corners, strayed) = refine(grey, start, small, reach_px)?;
        view(corners, strayed)
    };
    Ok(Found { detected, refined, detector })
}

/// Corners sharpened on the full picture. One that runs away is sharpened over less, as something else lies in its window;
/// one that runs away still stays where it was found and is marked.
fn refine(
    grey: &Image<f32>,
    start: &[[f64; 2]],
    window: i32,
    reach_px: f64,
) -> opencv::Result<(Vec<[f64; 2]>, Vec<bool>)> {
    let picture = Mat::from_slice(&grey.data)?;
    let picture = picture.reshape(1, grey.height as i32)?;
    let (mut out, mut strayed) = (start.to_vec(), vec![true; start.len()]);
    let windows = [window, window / 2, window / 4].map(|window| window.max(WINDOW_PX.0 as i32));
    for window in windows {
        let open: Vec<usize> = (0..start.len()).filter(|k| strayed[*k]).collect();
        if open.is_empty() {
            break;
        }
        let place = |k: &usize| Point2f::new(start[*k][0] as f32, start[*k][1] as f32);
        let mut places: Vector<Point2f> = open.iter().map(place).collect();
        sub_pixel(&picture, &mut places, window)?;
        for (k, p) in open.into_iter().zip(places.iter()) {
            let [u, v] = [f64::from(p.x), f64::from(p.y)];
            if (u - start[k][0]).hypot(v - start[k][1]) <= reach_px {
                (out[k], strayed[k]) = ([u, v], false);
            }
        }
    }
    Ok((out, strayed))
}

fn sub_pixel(
    picture: &impl opencv::core::ToInputArray,
    corners: &mut Vector<Point2f>,
    window: i32,
) -> opencv::Result<()> {
    let until = TermCriteria::new(criteria(), 60, 1e-4)?;
    imgproc::corner_sub_pix(picture, corners, Size::new(window, window), Size::new(-1, -1), until)
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

#[cfg(test)]
mod tests;
