use crate::random::Key;
use crate::view::View;
use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3};

/// A chessboard with its white margin; the panel's origin is the middle of the inner corners, columns along x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardShape {
    /// Inner corners in a row.
    pub columns: usize,
    /// Inner corners in a column.
    pub rows: usize,
    /// Side of a square, millimetres.
    pub square_mm: f64,
}

/// Reflectance of the print.
const BLACK: [f32; 3] = [0.045; 3];
const WHITE: [f32; 3] = [0.86; 3];
/// White around the squares, in squares.
const MARGIN: f64 = 0.5;
/// Steps in which a pose is drawn back from where it would stick out of the picture.
const SHRINKS: u32 = 40;
/// Pixels that must stay free between a board and the edge of the frame, as a share of the frame's height.
const CLEARANCE: f64 = 0.008;

impl BoardShape {
    /// Half the size of the squares' field, millimetres.
    fn half_mm(&self) -> [f64; 2] {
        [(self.columns + 1) as f64, (self.rows + 1) as f64].map(|n| 0.5 * n * self.square_mm)
    }

    /// Half the size of the card with its margin, millimetres.
    pub fn half_card_mm(&self) -> [f64; 2] {
        self.half_mm().map(|half| half + MARGIN * self.square_mm)
    }

    /// Reflectance; `None` beyond the card.
    pub(crate) fn ink(&self, x: f64, y: f64) -> Option<[f32; 3]> {
        let [card_x, card_y] = self.half_card_mm();
        if x.abs() > card_x || y.abs() > card_y {
            return None;
        }
        let [half_x, half_y] = self.half_mm();
        if x.abs() >= half_x || y.abs() >= half_y {
            return Some(WHITE);
        }
        let square = |c: f64, half: f64| ((c + half) / self.square_mm).floor() as i64;
        let dark = (square(x, half_x) + square(y, half_y)).rem_euclid(2) == 0;
        Some(if dark { BLACK } else { WHITE })
    }

    /// The inner corners on the panel, row by row from the top left, millimetres.
    pub fn corners(&self) -> Vec<[f64; 2]> {
        let half =
            [(self.columns - 1) as f64, (self.rows - 1) as f64].map(|n| 0.5 * n * self.square_mm);
        (0..self.rows)
            .flat_map(|j| {
                (0..self.columns).map(move |i| {
                    [i as f64 * self.square_mm - half[0], half[1] - j as f64 * self.square_mm]
                })
            })
            .collect()
    }

    /// Whether the whole card, so placed, is in the picture.
    pub fn fits(&self, view: &View, rig_from_panel: &IsometryMatrix3<f64>) -> bool {
        let [x, y] = self.half_card_mm();
        let outline = (-4..=4).flat_map(|k| {
            let (along, across) = (x * f64::from(k) / 4.0, y * f64::from(k) / 4.0);
            [[along, y], [along, -y], [x, across], [-x, across]]
        });
        let clearance = CLEARANCE * view.camera.height_px as f64;
        let [right, bottom] =
            [view.camera.width_px, view.camera.height_px].map(|n| n as f64 - 1.0 - clearance);
        outline
            .map(|[a, b]| view.project(&rig_from_panel.transform_point(&Point3::new(a, b, 0.0))))
            .all(|pixel| {
                pixel.is_some_and(|[u, v]| {
                    u >= clearance && v >= clearance && u <= right && v <= bottom
                })
            })
    }
}

/// Poses of a board for calibrating a camera: first flat on the table and centred, columns along x; then tilted this way and
/// that, turned, raised, and pushed towards the edges and corners of the picture as far as the whole board can be seen.
/// None dips below the table.
pub fn board_poses(
    board: &BoardShape,
    view: &View,
    thickness_mm: f64,
    count: usize,
    seed: u64,
) -> Vec<IsometryMatrix3<f64>> {
    let table = IsometryMatrix3::from_parts(
        Translation3::new(0.0, 0.0, thickness_mm),
        Rotation3::identity(),
    );
    let others =
        (1..count).map(|k| board_pose(board, view, k, Key::new(seed).with(0xb0a).with(k as u64)));
    std::iter::once(table).chain(others).collect()
}

fn board_pose(board: &BoardShape, view: &View, k: usize, key: Key) -> IsometryMatrix3<f64> {
    // Golden-angle steps: any number of poses covers the picture and the directions of tilt.
    let around = 2.399_963 * k as f64;
    let tilt = (18.0 + 17.0 * key.with(1).unit()).to_radians();
    let spin = (12.0 * key.with(2).signed_unit()).to_radians();
    let half =
        [view.camera.width_px, view.camera.height_px].map(|n| 0.5 * view.mm_per_px() * n as f64);
    // Two poses in three go as far out as they can.
    let push = if k.is_multiple_of(3) { 0.6 * key.with(3).unit() } else { 1.0 };
    let lean = around + 2.1 * key.with(4).unit();
    let height = 40.0 * key.with(5).unit();
    for shrink in (0..=SHRINKS).map(|step| 1.0 - f64::from(step) / f64::from(SHRINKS)) {
        let offset =
            [push * shrink * half[0] * around.cos(), push * shrink * half[1] * around.sin()];
        let pose = tilted(
            board,
            offset,
            lean,
            tilt * (0.5 + 0.5 * shrink),
            spin * shrink,
            height * shrink,
        );
        if board.fits(view, &pose) {
            return pose;
        }
    }
    tilted(board, [0.0; 2], lean, 0.3 * tilt, 0.0, 0.0)
}

fn tilted(
    board: &BoardShape,
    offset: [f64; 2],
    lean: f64,
    tilt: f64,
    spin: f64,
    height: f64,
) -> IsometryMatrix3<f64> {
    let axis =
        nalgebra::UnitVector3::new_normalize(nalgebra::Vector3::new(lean.cos(), lean.sin(), 0.0));
    let rotation = Rotation3::from_axis_angle(&axis, tilt)
        * Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), spin);
    let [x, y] = board.half_card_mm();
    let lowest = [[x, y], [x, -y], [-x, y], [-x, -y]]
        .into_iter()
        .map(|[a, b]| (rotation * nalgebra::Vector3::new(a, b, 0.0)).z)
        .fold(f64::INFINITY, f64::min);
    IsometryMatrix3::from_parts(Translation3::new(offset[0], offset[1], height - lowest), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::reference_camera;

    #[test]
    fn every_board_is_whole_and_the_picture_is_covered() {
        let board = BoardShape { columns: 9, rows: 6, square_mm: 25.0 };
        for seed in 0..5 {
            let view =
                View { camera: reference_camera(1232, 816, seed), vignetting: 0.0, psf_px: 0.0 };
            let poses = board_poses(&board, &view, 0.0, 14, seed);
            let mut seen = [[false; 6]; 4];
            for (k, pose) in poses.iter().enumerate() {
                assert!(board.fits(&view, pose), "seed {seed}, pose {k} is cut off");
                for [x, y] in board.corners() {
                    let [u, v] =
                        view.project(&pose.transform_point(&Point3::new(x, y, 0.0))).unwrap();
                    seen[(v / 204.0) as usize][(u / 205.4) as usize] = true;
                }
            }
            let covered = seen.iter().flatten().filter(|s| **s).count();
            assert!(covered >= 20, "seed {seed}: corners in {covered} of 24 fields");
        }
    }

    #[test]
    fn squares_alternate_around_every_corner() {
        let board = BoardShape { columns: 5, rows: 3, square_mm: 10.0 };
        for [x, y] in board.corners() {
            let at = |dx: f64, dy: f64| board.ink(x + dx, y + dy).unwrap();
            assert_eq!(at(1.0, 1.0), at(-1.0, -1.0));
            assert_eq!(at(1.0, -1.0), at(-1.0, 1.0));
            assert_ne!(at(1.0, 1.0), at(1.0, -1.0));
        }
    }
}
