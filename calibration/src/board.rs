//! Camera calibration from pictures of a chessboard: what does not need OpenCV.

mod outliers;

pub use outliers::outlying_corners;

use crate::description::{Camera, Plane};
use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, UnitVector3, Vector2, Vector3};

/// Inner corners and the side of a square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardShape {
    /// Inner corners in a row.
    pub columns: usize,
    /// Inner corners in a column.
    pub rows: usize,
    /// Side of a square, millimetres.
    pub square_mm: f64,
}

impl BoardShape {
    /// The inner corners, row by row from the top left of a board that is read upright; board frame: x along the columns to
    /// the right, y up, z towards the viewer, origin in the middle; millimetres.
    pub fn corners_mm(&self) -> Vec<Point3<f64>> {
        let middle = |count: usize| (count as f64 - 1.0) / 2.0;
        let corner = |k: usize| {
            let (column, row) = ((k % self.columns) as f64, (k / self.columns) as f64);
            let x = (column - middle(self.columns)) * self.square_mm;
            Point3::new(x, (middle(self.rows) - row) * self.square_mm, 0.0)
        };
        (0..self.columns * self.rows).map(corner).collect()
    }

    /// Reorders detected corners so that the board is read from its front and, of the readings that its symmetry allows, the
    /// one whose columns run nearest to the picture's right is taken.
    ///
    /// `corners`: pixels, row by row in whatever reading the detector chose; `columns * rows` of them.
    pub fn upright(&self, corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut readings = vec![corners.to_vec()];
        let half_turn: Vec<[f64; 2]> = corners.iter().rev().copied().collect();
        readings.push(half_turn);
        if self.columns == self.rows {
            let quarter = |reading: &[[f64; 2]]| -> Vec<[f64; 2]> {
                let n = self.columns;
                (0..n * n).map(|k| reading[(k % n) * n + (n - 1 - k / n)]).collect()
            };
            let turned = [quarter(&readings[0]), quarter(&readings[1])];
            readings.extend(turned);
        }
        let mirrored = |reading: &Vec<[f64; 2]>| -> Vec<[f64; 2]> {
            reading.chunks(self.columns).rev().flatten().copied().collect()
        };
        let readings =
            readings.into_iter().map(|r| if self.turns_left(&r) { mirrored(&r) } else { r });
        let rightness = |reading: &Vec<[f64; 2]>| self.along_columns(reading).normalize().x;
        readings.max_by(|a, b| rightness(a).total_cmp(&rightness(b))).unwrap_or_default()
    }

    fn along_columns(&self, reading: &[[f64; 2]]) -> Vector2<f64> {
        let last = self.columns - 1;
        reading
            .chunks(self.columns)
            .map(|row| Vector2::from(row[last]) - Vector2::from(row[0]))
            .sum()
    }

    /// Whether rows run the wrong way about the columns: a board seen from behind, which is a misreading.
    fn turns_left(&self, reading: &[[f64; 2]]) -> bool {
        let last = (self.rows - 1) * self.columns;
        let down: Vector2<f64> = (0..self.columns)
            .map(|k| Vector2::from(reading[last + k]) - Vector2::from(reading[k]))
            .sum();
        self.along_columns(reading).perp(&down) < 0.0
    }
}

/// The board found in one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardView {
    /// Corners in pixels, in the order of [`BoardShape::corners_mm`].
    pub corners_px: Vec<[f64; 2]>,
    /// Numbers of the corners that do not count, ascending: something beside them (glare, a finger) moves what is read.
    pub doubtful: Vec<usize>,
}

impl BoardView {
    /// A view of which every corner counts.
    pub fn new(corners_px: Vec<[f64; 2]>) -> Self {
        Self { corners_px, doubtful: Vec::new() }
    }

    /// Whether corner `k` counts.
    pub fn counts(&self, k: usize) -> bool {
        self.doubtful.binary_search(&k).is_err()
    }

    /// The mean of views of a board that lay still. A corner counts where it does in any of them.
    pub fn mean(views: &[&Self]) -> Self {
        let corners = views.first().map_or(0, |view| view.corners_px.len());
        let (mut corners_px, mut doubtful) = (Vec::new(), Vec::new());
        for k in 0..corners {
            let mut counted: Vec<&&Self> = views.iter().filter(|view| view.counts(k)).collect();
            if counted.is_empty() {
                doubtful.push(k);
                counted = views.iter().collect();
            }
            let sum = counted.iter().fold([0.0; 2], |sum, view| {
                [sum[0] + view.corners_px[k][0], sum[1] + view.corners_px[k][1]]
            });
            corners_px.push(sum.map(|c| c / counted.len() as f64));
        }
        Self { corners_px, doubtful }
    }
}

/// Why a board was not found.
#[derive(Clone, Debug, PartialEq)]
pub enum NoBoard {
    /// Nothing stands out from anything: black, white, or a sheet of paper.
    NoContrast,
    /// No edge is sharp.
    Blurred,
    /// Two rows or columns of corners look like anything.
    TooSmall,
    /// So many corners would lie nearer to each other than pixels allow.
    TooFine,
    /// Some of it is there, and it ends at the picture's edge: columns and rows that are seen.
    CutOff([usize; 2]),
    /// Some of it is there, and a highlight lies on the rest: columns and rows that are seen.
    Glare([usize; 2]),
    /// Some of it is there, the rest is not: columns and rows that are seen.
    Covered([usize; 2]),
    /// A board is there, of more columns or rows.
    Larger([usize; 2]),
    /// Its corners are there, too many of them out of line.
    Crooked {
        /// How many.
        corners: usize,
    },
    /// Nothing like a board.
    Nothing,
}

impl std::fmt::Display for NoBoard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoContrast => {
                write!(f, "the picture has no contrast: dark, overexposed, or nothing in it")
            }
            Self::Blurred => write!(f, "the picture is blurred"),
            Self::TooSmall => write!(f, "a board needs 3 x 3 inner corners at least"),
            Self::TooFine => write!(f, "its squares would be smaller than a few pixels"),
            Self::CutOff([columns, rows]) => write!(
                f,
                "the board is cut off by the edge of the picture ({columns} x {rows} corners are seen)"
            ),
            Self::Glare([columns, rows]) => {
                write!(f, "glare covers a part of the board ({columns} x {rows} corners are seen)")
            }
            Self::Covered([columns, rows]) => write!(
                f,
                "a part of the board is covered or badly lit ({columns} x {rows} corners are seen)"
            ),
            Self::Larger([columns, rows]) => {
                write!(f, "it shows a board of {columns} x {rows} inner corners")
            }
            Self::Crooked { corners } => write!(
                f,
                "{corners} corners are out of line: glare beside them, a bent board, or blur"
            ),
            Self::Nothing => write!(f, "there is no board in it, or too little of it"),
        }
    }
}

/// A camera fitted to views of the board.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFit {
    /// fx, fy, cx, cy in pixels.
    pub intrinsics: [f64; 4],
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// One sigma of the four and of the five.
    pub sigma: [f64; 9],
    /// Per view: from the board's frame to the camera's (x right, y down, z forward), millimetres.
    pub camera_from_board: Vec<IsometryMatrix3<f64>>,
    /// Per view: one sigma of its pose, three of the rotation (radians) and three of the translation (millimetres).
    pub pose_sigma: Vec<[f64; 6]>,
    /// Per view: root mean square reprojection error, pixels.
    pub view_rms_px: Vec<f64>,
    /// Over all views.
    pub rms_px: f64,
}

/// A view that was left out, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Dropped {
    /// Its number among the views.
    pub view: usize,
    /// Its reprojection error, pixels.
    pub rms_px: f64,
    /// The median of the views kept, pixels.
    pub typical_px: f64,
}

/// What a set of boards cannot give.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum BoardError {
    /// Too few.
    #[error(
        "only {usable} usable pictures of the board; at least {LEAST_VIEWS} are needed, tilted by 20 to 40 degrees in different directions"
    )]
    TooFew {
        /// How many are usable.
        usable: usize,
    },
    /// All from one angle.
    #[error(
        "the board was seen from one angle only (within {spread_deg:.1} degrees), which leaves the focal length open; photograph it tilted by 20 to 40 degrees in different directions"
    )]
    OneAngle {
        /// Largest angle between two boards.
        spread_deg: f64,
    },
    /// The numerics failed.
    #[error(
        "the camera cannot be fitted to these boards ({what}); check columns, rows and square_mm, and that the board is flat"
    )]
    Failed {
        /// In the library's words.
        what: String,
    },
}

/// Fewest views that carry nine parameters with some redundancy.
pub const LEAST_VIEWS: usize = 4;
/// Two boards must differ by this much somewhere in the set.
const LEAST_SPREAD_DEG: f64 = 8.0;
/// A view whose error exceeds the median by this factor is an outlier (a bent or blurred board, a misread corner) ...
const OUTLIER_FACTOR: f64 = 2.2;
/// ... unless it is this good anyway: a board along the pixels' rows, as on the table, has all its edges at like places between
/// pixels, and their errors do not average out as a tilted board's do.
const GOOD_ANYWAY_PX: f64 = 0.15;

/// Fits, drops the worst outlier view, and fits again until none is left.
///
/// `fit` does one calibration of the views with the given numbers.
///
/// # Errors
/// Where too few views remain, or all show the board from one angle, or `fit` fails.
pub fn fit_without_outliers(
    views: usize,
    fit: &dyn Fn(&[usize]) -> Result<CameraFit, BoardError>,
) -> Result<(CameraFit, Vec<usize>, Vec<Dropped>), BoardError> {
    let mut kept: Vec<usize> = (0..views).collect();
    let mut dropped = Vec::new();
    loop {
        if kept.len() < LEAST_VIEWS {
            return Err(BoardError::TooFew { usable: kept.len() });
        }
        let found = fit(&kept)?;
        let spread_deg = tilt_spread_deg(&found.camera_from_board);
        if spread_deg < LEAST_SPREAD_DEG {
            return Err(BoardError::OneAngle { spread_deg });
        }
        let mut sorted = found.view_rms_px.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let typical_px = sorted[sorted.len() / 2];
        let worst =
            (0..kept.len()).max_by(|a, b| found.view_rms_px[*a].total_cmp(&found.view_rms_px[*b]));
        match worst.filter(|k| is_outlier(found.view_rms_px[*k], typical_px)) {
            None => return Ok((found, kept, dropped)),
            Some(k) => {
                let rms_px = found.view_rms_px[k];
                dropped.push(Dropped { view: kept.remove(k), rms_px, typical_px });
            }
        }
    }
}

fn is_outlier(rms_px: f64, typical_px: f64) -> bool {
    rms_px > (OUTLIER_FACTOR * typical_px).max(GOOD_ANYWAY_PX)
}

/// Largest angle between the normals of any two boards, degrees.
pub fn tilt_spread_deg(camera_from_board: &[IsometryMatrix3<f64>]) -> f64 {
    let normals: Vec<Vector3<f64>> =
        camera_from_board.iter().map(|pose| pose.rotation * Vector3::z()).collect();
    let pairs = normals
        .iter()
        .enumerate()
        .flat_map(|(k, a)| normals[k + 1..].iter().map(move |b| a.angle(b)));
    pairs.fold(0.0, f64::max).to_degrees()
}

/// Where a board lies that is centred on a plane, its columns along the rig's x as far as the plane's tilt allows.
pub fn rig_from_board_on(plane: &Plane) -> IsometryMatrix3<f64> {
    let tilt = Rotation3::rotation_between(&Vector3::z(), &plane.normal)
        .unwrap_or_else(Rotation3::identity);
    IsometryMatrix3::from_parts(Translation3::from(plane.point_mm.coords), tilt)
}

/// The camera whose rig frame is fixed by view `table` of the fit: that board lies centred on `plane`.
pub fn camera_on_table(
    fit: &CameraFit,
    table: usize,
    plane: &Plane,
    size_px: [usize; 2],
) -> Camera {
    let [fx, fy, cx, cy] = fit.intrinsics;
    let camera_from_rig = fit.camera_from_board[table] * rig_from_board_on(plane).inverse();
    let [width_px, height_px] = size_px;
    Camera { width_px, height_px, fx, fy, cx, cy, distortion: fit.distortion, camera_from_rig }
}

/// The plane of a board at a known pose, normal towards the camera.
pub fn plane_of_board(rig_from_board: &IsometryMatrix3<f64>) -> Plane {
    let normal = UnitVector3::new_normalize(rig_from_board.rotation * Vector3::z());
    Plane { point_mm: Point3::from(rig_from_board.translation.vector), normal }
}

/// How many corners fell into each field of a grid over the picture, row by row.
pub fn coverage(views: &[BoardView], size_px: [usize; 2], grid: [usize; 2]) -> Vec<usize> {
    let mut counts = vec![0; grid[0] * grid[1]];
    let counted = |view: &BoardView| -> Vec<[f64; 2]> {
        let all = view.corners_px.iter().enumerate();
        all.filter(|(k, _)| view.counts(*k)).map(|(_, corner)| *corner).collect()
    };
    for [u, v] in views.iter().flat_map(counted) {
        let field = |at: f64, length: usize, fields: usize| {
            (((at + 0.5) / length as f64 * fields as f64).max(0.0) as usize).min(fields - 1)
        };
        counts[field(v, size_px[1], grid[1]) * grid[0] + field(u, size_px[0], grid[0])] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: BoardShape = BoardShape { columns: 4, rows: 3, square_mm: 10.0 };

    fn seen(shape: &BoardShape, turn_deg: f64) -> Vec<[f64; 2]> {
        let turn = nalgebra::Rotation2::new(-turn_deg.to_radians());
        let seen = |p: &Point3<f64>| turn * Vector2::new(p.x, -p.y) + Vector2::new(100.0, 80.0);
        shape.corners_mm().iter().map(|p| seen(p).into()).collect()
    }

    fn close(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
        a.iter().zip(b).all(|(a, b)| (Vector2::from(*a) - Vector2::from(*b)).norm() < 1e-9)
    }

    #[test]
    fn a_board_is_read_with_its_columns_to_the_right_whatever_the_detector_says() {
        for turn in [-40.0, 0.0, 25.0, 80.0] {
            let expected = seen(&SHAPE, turn);
            let reversed: Vec<_> = expected.iter().rev().copied().collect();
            let mirrored: Vec<_> = expected.chunks(4).rev().flatten().copied().collect();
            for reading in [&expected, &reversed, &mirrored] {
                assert!(close(&SHAPE.upright(reading), &expected), "turned by {turn}");
            }
        }
        let square = BoardShape { columns: 3, rows: 3, square_mm: 10.0 };
        for turn in [0.0, 90.0, 180.0, 270.0, 30.0] {
            let nearest = (turn + 45.0_f64).rem_euclid(90.0) - 45.0;
            assert!(
                close(&square.upright(&seen(&square, turn)), &seen(&square, nearest)),
                "{turn}"
            );
        }
    }

    fn made_up(views: &[usize], rms: &[f64], tilt_deg: f64) -> CameraFit {
        let pose = |k: &usize| {
            let tilt =
                Rotation3::from_axis_angle(&Vector3::x_axis(), (*k as f64 * tilt_deg).to_radians());
            IsometryMatrix3::from_parts(Translation3::identity(), tilt)
        };
        CameraFit {
            intrinsics: [1000.0, 1000.0, 320.0, 240.0],
            distortion: [0.0; 5],
            sigma: [0.0; 9],
            camera_from_board: views.iter().map(pose).collect(),
            pose_sigma: vec![[0.0; 6]; views.len()],
            view_rms_px: views.iter().map(|k| rms[*k]).collect(),
            rms_px: 0.2,
        }
    }

    #[test]
    fn outliers_go_one_by_one_and_one_angle_is_refused() {
        let rms = [0.2, 0.21, 1.2, 0.19, 0.22, 0.7];
        let fit = |views: &[usize]| Ok(made_up(views, &rms, 10.0));
        let (_, kept, dropped) = fit_without_outliers(6, &fit).unwrap();
        assert_eq!(kept, [0, 1, 3, 4]);
        assert_eq!(dropped.iter().map(|d| d.view).collect::<Vec<_>>(), [2, 5]);
        let flat = |views: &[usize]| Ok(made_up(views, &rms, 0.5));
        assert!(matches!(fit_without_outliers(6, &flat), Err(BoardError::OneAngle { .. })));
        assert_eq!(fit_without_outliers(3, &fit).unwrap_err(), BoardError::TooFew { usable: 3 });
    }

    #[test]
    fn a_thick_board_lifts_the_rig_frame_by_its_thickness() {
        let mut fit = made_up(&[0], &[0.1], 0.0);
        fit.camera_from_board[0] = Camera::looking_down(600.0);
        let plane = Plane { point_mm: Point3::new(0.0, 0.0, 5.0), normal: Vector3::z_axis() };
        let camera = camera_on_table(&fit, 0, &plane, [640, 480]);
        let centre = camera.camera_from_rig.inverse_transform_point(&Point3::origin());
        assert!((centre - Point3::new(0.0, 0.0, 605.0)).norm() < 1e-9, "{centre}");
    }
}
