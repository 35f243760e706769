use super::BoardShape;
use crate::random::Key;
use crate::view::View;
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, UnitVector3, Vector3};
use std::f64::consts::TAU;

/// A white sheet with a strip of chessboard printed on it; the panel's origin is the middle of the measured area.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Reflectance where it is even.
    pub reflectance: f64,
    /// The strip, if there is one, and the place of its middle on the sheet, millimetres.
    pub strip: Option<(BoardShape, [f64; 2])>,
    /// What is wrong with it.
    pub flaws: SheetFlaws,
}

/// What a light calibration has to live with. All zero by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SheetFlaws {
    /// The sheet's own low-frequency unevenness, peak to peak, relative. The same on every picture of the sheet.
    pub unevenness: f64,
    /// Low-frequency error of each light on its own (gloss of the sheet, stray light), RMS, relative.
    pub kappa: f64,
    /// Specks of dust per square decimetre, some tenths of a millimetre wide.
    pub dust_per_dm2: f64,
    /// A hand that shadows this light: index.
    pub hand: Option<usize>,
    /// Keys the unevenness and the dust: which sheet it is.
    pub sheet_seed: u64,
    /// Keys what changes from pose to pose.
    pub pose_seed: u64,
}

const DUST: [f32; 3] = [0.35; 3];
/// Cells in which at most one speck lies, millimetres.
const DUST_CELL_MM: f64 = 4.0;
/// Height of a tilted sheet's middle: its lower edge is just over the table.
pub const TILTED_HEIGHT_MM: f64 = 60.0;
/// Where the hand's shadow ends, and over how many millimetres.
const HAND_RADIUS_MM: f64 = 55.0;
const HAND_SOFTNESS_MM: f64 = 12.0;

impl Sheet {
    pub(crate) fn ink(&self, x: f64, y: f64) -> Option<[f32; 3]> {
        if let Some((board, [cx, cy])) = &self.strip
            && let Some(ink) = board.ink(x - cx, y - cy)
        {
            return Some(ink);
        }
        if self.flaws.dust_per_dm2 > 0.0 && self.is_dusty(x, y) {
            return Some(DUST);
        }
        Some([self.reflectance as f32; 3])
    }

    fn is_dusty(&self, x: f64, y: f64) -> bool {
        let (column, row) = ((x / DUST_CELL_MM).floor(), (y / DUST_CELL_MM).floor());
        let key = Key::new(self.flaws.sheet_seed)
            .with(0xd5)
            .with_signed(column as i64)
            .with_signed(row as i64);
        let share = self.flaws.dust_per_dm2 * (DUST_CELL_MM / 100.0).powi(2);
        let middle = |cell: f64, k: u64| (cell + 0.2 + 0.6 * key.with(k).unit()) * DUST_CELL_MM;
        let radius = 0.15 + 0.45 * key.with(4).unit();
        key.with(1).unit() < share && (x - middle(column, 2)).hypot(y - middle(row, 3)) < radius
    }

    pub(crate) fn factor(&self, light: Option<usize>, x: f64, y: f64) -> f64 {
        let flaws = &self.flaws;
        let mut factor = 1.0;
        if flaws.unevenness > 0.0 {
            factor += 0.5 * flaws.unevenness * wave(Key::new(flaws.sheet_seed).with(0x0e), x, y);
        }
        let Some(light) = light else { return factor };
        if flaws.kappa > 0.0 {
            let key = Key::new(flaws.pose_seed).with(0x4a).with(light as u64);
            factor *= 1.0 + flaws.kappa * std::f64::consts::SQRT_2 * wave(key, x, y);
        }
        if flaws.hand == Some(light) {
            let key = Key::new(flaws.pose_seed).with(0x4b);
            let middle = [70.0 * key.with(1).signed_unit(), 50.0 * key.with(2).signed_unit()];
            let edge = (x - middle[0]).hypot(y - middle[1]) - HAND_RADIUS_MM;
            factor *= 0.25 + 0.75 * (0.5 + edge / HAND_SOFTNESS_MM).clamp(0.0, 1.0);
        }
        factor
    }
}

/// A wave of amplitude 1, 180 to 420 mm long, of random direction and phase.
fn wave(key: Key, x: f64, y: f64) -> f64 {
    let (sin, cos) = (TAU * key.with(1).unit()).sin_cos();
    let length_mm = 180.0 + 240.0 * key.with(2).unit();
    (TAU * ((x * cos + y * sin) / length_mm + key.with(3).unit())).sin()
}

/// The strip for a sheet that is photographed in the given poses: 17 x 3 inner corners along the lower edge of the
/// picture, as large as can be seen whole in every pose. Gives the shape and its middle on the sheet.
pub fn strip_for(view: &View, poses: &[IsometryMatrix3<f64>]) -> Option<(BoardShape, [f64; 2])> {
    let width_mm = view.mm_per_px() * view.camera.width_px as f64;
    let height_mm = view.mm_per_px() * view.camera.height_px as f64;
    for size in (0..24).map(|k| 0.6 - 0.02 * f64::from(k)) {
        let board = BoardShape {
            columns: 17,
            rows: 3,
            square_mm: (size * width_mm / 19.2 * 10.0).round() / 10.0,
        };
        let low = -0.5 * height_mm;
        for y in (0..24).map(|k| low + 0.01 * height_mm * f64::from(k)) {
            let middle = [0.0, y + board.half_card_mm()[1]];
            let moved =
                |pose: &IsometryMatrix3<f64>| pose * Translation3::new(middle[0], middle[1], 0.0);
            if poses.iter().all(|pose| board.fits(view, &moved(pose))) {
                return Some((board, middle));
            }
        }
    }
    None
}

/// The poses of a white sheet for calibrating lights, by the name of their folder: flat, raised by 100 mm, and tilted by
/// `tilt_deg` in `tilts` directions.
pub fn sheet_frames(
    tilts: usize,
    tilt_deg: f64,
    raised_mm: f64,
) -> Vec<(String, IsometryMatrix3<f64>)> {
    let level = |height_mm: f64| sheet_pose(height_mm, 0.0, 0.0);
    let tilted = |k: usize| {
        let towards_deg = 360.0 * (k as f64 + 0.5) / tilts as f64;
        sheet_pose(TILTED_HEIGHT_MM, tilt_deg, towards_deg)
    };
    let mut frames =
        vec![("white-flat".to_owned(), level(0.0)), ("white-raised".to_owned(), level(raised_mm))];
    frames.extend((0..tilts).map(|k| (format!("white-tilt-{}", k + 1), tilted(k))));
    frames
}

/// A white sheet whose middle is `height_mm` over the table, tilted by `tilt_deg` so that it faces `towards_deg` (0: to the right of
/// the picture, 90: to its top).
pub fn sheet_pose(height_mm: f64, tilt_deg: f64, towards_deg: f64) -> IsometryMatrix3<f64> {
    let (sin, cos) = towards_deg.to_radians().sin_cos();
    let axis = UnitVector3::new_normalize(Vector3::new(-sin, cos, 0.0));
    let rotation = if tilt_deg == 0.0 {
        Rotation3::identity()
    } else {
        Rotation3::from_axis_angle(&axis, tilt_deg.to_radians())
    };
    IsometryMatrix3::from_parts(Translation3::new(0.0, 0.0, height_mm), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::reference_camera;

    #[test]
    fn the_strip_is_whole_in_every_pose() {
        for seed in 0..4 {
            let view =
                View { camera: reference_camera(1232, 816, seed), vignetting: 0.0, psf_px: 0.0 };
            let poses: Vec<_> =
                sheet_frames(4, 20.0, 100.0).into_iter().map(|(_, pose)| pose).collect();
            let (board, middle) = strip_for(&view, &poses).unwrap();
            assert!(board.square_mm > 9.0, "squares of {} mm", board.square_mm);
            // Most of the picture is left to measure.
            assert!(
                middle[1] + board.half_card_mm()[1] < -20.0,
                "the strip reaches up to {middle:?}"
            );
        }
    }

    #[test]
    fn flaws_are_as_large_as_stated() {
        let flaws = SheetFlaws { unevenness: 0.02, kappa: 0.001, ..SheetFlaws::default() };
        let sheet = Sheet { reflectance: 0.99, strip: None, flaws };
        let places: Vec<(f64, f64)> = (0..40_000)
            .map(|k| (4.0 * f64::from(k % 200) - 400.0, 4.0 * f64::from(k / 200) - 400.0))
            .collect();
        let even: Vec<f64> = places.iter().map(|&(x, y)| sheet.factor(None, x, y)).collect();
        let spread =
            even.iter().copied().fold(0.0, f64::max) - even.iter().copied().fold(2.0, f64::min);
        assert!((spread - 0.02).abs() < 2e-4, "unevenness {spread}");
        let square: f64 = places
            .iter()
            .zip(&even)
            .map(|(&(x, y), even)| (sheet.factor(Some(3), x, y) / even - 1.0).powi(2))
            .sum::<f64>()
            / places.len() as f64;
        assert!((square.sqrt() - 0.001).abs() < 1.5e-4, "kappa {}", square.sqrt());
    }
}
