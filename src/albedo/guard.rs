//! Values that a mosaic can hold: a photosite far from its neighbours of the same colour is brought back.

use rayon::prelude::*;
use weavelight_calibration::description::Image;

/// Darkest albedo that has a logarithm of use; one count of a camera's noise lies about here.
pub(super) const DARKEST: f32 = 0.002;
/// Nothing reflects more than a perfect white diffuser does, except for a share of gloss.
pub const BRIGHTEST: f32 = 1.3;
/// A photosite may differ from the median of its neighbours by this factor: white yarn beside indigo differs by seven.
const FARTHEST: f32 = 10.0;

/// Values with their outliers limited; 0 where there is none.
pub(super) struct Guarded {
    pub(super) values: Image<f32>,
    /// How many were limited.
    pub(super) limited: usize,
}

/// Limits each value to a factor of the median of the nine photosites of its own filter around it (distance two).
pub(super) fn guard(mosaic: &Image<f32>, mask: &Image<u8>) -> Guarded {
    let (width, height) = (mosaic.width, mosaic.height);
    let known = |x: usize, y: usize| {
        let at = y * width + x;
        let value = mosaic.data[at];
        if mask.data[at] != 0 && value.is_finite() { value.max(0.0) } else { 0.0 }
    };
    let mut values = Image::filled(width, height, 0.0);
    let limited = values
        .data
        .par_chunks_mut(width.max(1))
        .enumerate()
        .map(|(y, out)| {
            let line = |y: usize| -> Vec<f32> {
                (0..width + 4).map(|x| known(reflected(x, width), y)).collect()
            };
            let rows = [reflected(y, height), y, reflected(y + 4, height)].map(line);
            limit_row([&rows[0], &rows[1], &rows[2]], out)
        })
        .sum();
    Guarded { values, limited }
}

/// Place `padded - 2`, turned back at the ends so that it keeps its filter.
fn reflected(padded: usize, length: usize) -> usize {
    let place = padded as isize - 2;
    let turned = if place < 0 { place + 2 } else { place };
    let turned = turned as usize;
    if turned >= length { length.saturating_sub(1).min(turned.saturating_sub(2)) } else { turned }
}

fn limit_row(rows: [&[f32]; 3], out: &mut [f32]) -> usize {
    let mut limited = 0;
    for (x, out) in out.iter_mut().enumerate() {
        let own = rows[1][x + 2];
        if own <= 0.0 {
            continue;
        }
        // A neighbour without a value is taken to be like the photosite itself.
        let or_own = |value: f32| if value > 0.0 { value } else { own };
        let median = median_of_nine(std::array::from_fn(|k| or_own(rows[k / 3][x + 2 * (k % 3)])));
        let most = (median * FARTHEST).min(BRIGHTEST);
        let value = own.min(most).max((median / FARTHEST).min(most)).max(DARKEST);
        limited += usize::from(value != own);
        *out = value;
    }
    limited
}

fn median_of_nine(v: [f32; 9]) -> f32 {
    let sort = |a: f32, b: f32, c: f32| {
        let (low, high) = (a.min(b), a.max(b));
        (low.min(c), low.max(high.min(c)), high.max(c))
    };
    let (a, b, c) = (sort(v[0], v[1], v[2]), sort(v[3], v[4], v[5]), sort(v[6], v[7], v[8]));
    let lowest = a.0.max(b.0).max(c.0);
    let middle = sort(a.1, b.1, c.1).1;
    let highest = a.2.min(b.2).min(c.2);
    sort(lowest, middle, highest).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_that_of_sorting() {
        let mut state = 1u32;
        for _ in 0..5000 {
            let v: [f32; 9] = std::array::from_fn(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 28) as f32
            });
            let mut sorted = v;
            sorted.sort_by(f32::total_cmp);
            assert_eq!(median_of_nine(v), sorted[4], "{v:?}");
        }
    }

    #[test]
    fn only_outliers_are_limited() {
        let mut mosaic = Image { width: 9, height: 9, data: vec![0.3; 81] };
        let mut mask = Image { width: 9, height: 9, data: vec![255; 81] };
        mosaic.data[40] = 1739.0;
        mosaic.data[0] = 1e-9;
        mosaic.data[80] = 0.9;
        mosaic.data[44] = f32::NAN;
        mask.data[60] = 0;
        let found = guard(&mosaic, &mask);
        let expected = |k: usize| match k {
            40 => 1.3,
            0 => 0.03,
            80 => 0.9,
            44 | 60 => 0.0,
            _ => 0.3,
        };
        for (k, value) in found.values.data.iter().enumerate() {
            assert!((value - expected(k)).abs() < 1e-6, "{k}: {value}");
        }
        assert_eq!(found.limited, 2);
    }

    #[test]
    fn every_size_keeps_its_filters() {
        for length in 1..9 {
            for padded in 0..length + 4 {
                let place = reflected(padded, length);
                assert!(place < length);
                if length > 4 {
                    assert_eq!(place % 2, padded % 2, "{padded} of {length}");
                }
            }
        }
    }
}
