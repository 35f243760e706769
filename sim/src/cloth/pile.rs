use super::{Point, Top};
use crate::random::{Key, plane_noise};

/// A dense pile: no yarn to be seen, but tufts, and a nap that a hand has stroked this way and that.
#[derive(Clone, Debug, PartialEq)]
pub struct Pile {
    /// Size of a tuft, millimetres.
    pub tuft_mm: f64,
    /// Height of the tufts over their mean, millimetres.
    pub tuft_height_mm: f64,
    /// Size of a stroke of the nap, millimetres.
    pub nap_mm: f64,
    /// Height that a stroke changes, millimetres.
    pub nap_height_mm: f64,
    /// Reflectance, linear sRGB.
    pub color: [f32; 3],
    /// Makes this piece of cloth differ from another.
    pub seed: u64,
}

impl Pile {
    pub(crate) fn point(&self, x: f64, y: f64) -> Point {
        let key = Key::new(self.seed);
        let (tuft, tuft_slope) = plane_noise(key.with(1), x / self.tuft_mm, y / self.tuft_mm);
        let (nap, nap_slope) = plane_noise(key.with(2), x / self.nap_mm, y / self.nap_mm);
        let slope = |i: usize| {
            self.tuft_height_mm * tuft_slope[i] / self.tuft_mm
                + self.nap_height_mm * nap_slope[i] / self.nap_mm
        };
        Point {
            height_mm: self.tuft_height_mm * tuft + self.nap_height_mm * nap,
            slope: [slope(0), slope(1)],
            top: Top::Ground,
        }
    }

    pub(crate) fn albedo(&self, x: f64, y: f64) -> [f32; 3] {
        let (shade, _) = plane_noise(
            Key::new(self.seed).with(3),
            x / (3.0 * self.tuft_mm),
            y / (3.0 * self.tuft_mm),
        );
        self.color.map(|c| c * (1.0 + 0.08 * shade as f32))
    }

    pub(crate) fn range_mm(&self) -> [f64; 2] {
        let height = self.tuft_height_mm + self.nap_height_mm;
        [-height, height]
    }
}
