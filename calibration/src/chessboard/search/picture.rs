//! The picture as it is searched: reduced, and in eight bits.

use super::LEAST_SQUARE_PX;
use crate::board::BoardShape;
use crate::description::Image;

/// Pictures are searched at this size at most; the corners are then refined on the full picture.
const SEARCH_SIDE_PX: usize = 1500;

/// A picture reduced by `factor`.
pub(super) struct Searched {
    pub(super) factor: usize,
    pub(super) small: Image<f32>,
    /// The first and the 99th percentile of its values.
    pub(super) range: [f32; 2],
}

impl Searched {
    pub(super) fn of(grey: &Image<f32>) -> Self {
        let factor = grey.width.max(grey.height).div_ceil(SEARCH_SIDE_PX).max(1);
        let small = reduced(grey, factor);
        let range = percentiles(&small);
        Self { factor, small, range }
    }

    /// Whether a board of that many corners can be told in the picture reduced once more.
    pub(super) fn can_hold(&self, shape: &BoardShape, reduction: usize) -> bool {
        let [longer, shorter] = [
            self.small.width.max(self.small.height) / reduction,
            self.small.width.min(self.small.height) / reduction,
        ];
        let [more, fewer] = [shape.columns.max(shape.rows), shape.columns.min(shape.rows)];
        // A diagonal board has a little more room.
        let room = |side: usize| side * 14 / 10 / LEAST_SQUARE_PX;
        more <= room(longer) && fewer <= room(shorter) && shorter >= 16
    }

    /// Width and eight-bit values of the picture reduced once more: the middle 98 % stretched by their square root, so that
    /// noise is alike in dark and bright squares.
    pub(super) fn bytes(&self, reduction: usize) -> (usize, Vec<u8>) {
        let again;
        let (image, [low, high]) = if reduction == 1 {
            (&self.small, self.range)
        } else {
            again = reduced(&self.small, reduction);
            (&again, percentiles(&again))
        };
        let scale = (high - low).max(f32::MIN_POSITIVE).recip();
        let byte = |v: &f32| (255.0 * ((v - low) * scale).clamp(0.0, 1.0).sqrt()) as u8;
        (image.width, image.data.iter().map(byte).collect())
    }
}

fn percentiles(image: &Image<f32>) -> [f32; 2] {
    let mut sample: Vec<f32> =
        image.data.iter().step_by(7).copied().filter(|v| v.is_finite()).collect();
    sample.sort_unstable_by(f32::total_cmp);
    let at =
        |share: f64| sample.get((share * sample.len() as f64) as usize).copied().unwrap_or(0.0);
    [at(0.01), at(0.99)]
}

pub(super) fn reduced(grey: &Image<f32>, factor: usize) -> Image<f32> {
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
