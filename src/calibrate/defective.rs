//! Hot and dead photosites, from all frames of the chart together.

use crate::instrument::Defects;
use crate::linear::{range_between, raw_at};
use crate::raw::Frame;
use rayon::prelude::*;

/// A hot photosite exceeds its neighbours of the same colour by this share of the range in the dark, frame by frame on
/// average.
const HOT_SHARE: f64 = 0.01;
/// A dead one has less than this share of them in the light; one stuck near saturation has more than the inverse.
const DEAD_SHARE: f64 = 0.4;
/// Neighbours must be brighter than this share of the range on average over the lit frames: far above the noise of so many
/// frames together, even on the dark table beside the chart.
const LIT_SHARE: f64 = 0.002;

/// Finds photosites that are bright in the dark, and those that are dark (or stuck bright) in the light.
///
/// `frames`: of one size and layout; each with whether a light was on. Sums over all frames of either kind are compared with
/// the eight nearest photosites of the same colour, the one lowest and the one highest of these aside (they may be defective
/// too), so that no shadow, print or single bright speck is taken for a defect.
pub(super) fn find(frames: &[(bool, &Frame)]) -> Defects {
    let of_kind = |lit: bool| -> Vec<&Frame> {
        frames.iter().filter(|(l, _)| *l == lit).map(|(_, frame)| *frame).collect()
    };
    let (dark, lit) = (of_kind(false), of_kind(true));
    let hot = odd_ones(&dark, &|here, low, high, range| here > high.max(low) + HOT_SHARE * range);
    let dead = odd_ones(&lit, &|here, low, high, range| {
        let lit = LIT_SHARE * range;
        (low > lit && here < DEAD_SHARE * low) || (high > lit && here > high / DEAD_SHARE)
    });
    // Stuck at the top means bright in the dark as well: with or without a dark frame it is a hot one.
    let (stuck, dead): (Vec<_>, Vec<_>) = dead.into_iter().partition(|(_, bright)| *bright);
    let places = |found: Vec<([u32; 2], bool)>| found.into_iter().map(|(place, _)| place);
    let mut hot: Vec<[u32; 2]> = places(hot).chain(places(stuck)).collect();
    hot.sort_unstable();
    hot.dedup();
    Defects::new(hot, places(dead).collect())
}

/// Photosites whose sum over the frames is odd; whether each is brighter than its neighbours. `odd` is asked with the
/// photosite's sum, the second lowest and second highest of its neighbours', and the range, all in raw numbers, black removed.
fn odd_ones(
    frames: &[&Frame],
    odd: &(dyn Fn(f64, f64, f64, f64) -> bool + Sync),
) -> Vec<([u32; 2], bool)> {
    let Some(first) = frames.first() else { return Vec::new() };
    let (width, height) = (first.width, first.height);
    let sum_of_row = |y: usize| -> Vec<f64> {
        let at = |x: usize| {
            let black = f64::from(first.black[(y & 1) * 2 + (x & 1)]);
            frames.iter().map(|frame| raw_at(frame, x, y, 0) - black).sum::<f64>()
        };
        (0..width).map(at).collect()
    };
    let range = f64::from(range_between(first.black[0], first.saturation[0])) * frames.len() as f64;
    let row = |y: usize| -> Vec<([u32; 2], bool)> {
        let rows = [y - 2, y, y + 2].map(sum_of_row);
        let judge = |x: usize| {
            let here = rows[1][x];
            let mut around = [
                rows[0][x - 2],
                rows[0][x],
                rows[0][x + 2],
                rows[1][x - 2],
                rows[1][x + 2],
                rows[2][x - 2],
                rows[2][x],
                rows[2][x + 2],
            ];
            around.sort_unstable_by(f64::total_cmp);
            let (low, high) = (around[1], around[6]);
            odd(here, low, high, range).then_some(([x as u32, y as u32], here > high))
        };
        (2..width.saturating_sub(2)).filter_map(judge).collect()
    };
    (2..height.saturating_sub(2)).into_par_iter().flat_map_iter(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::{Layout, Metadata, Samples};
    use weavelight_calibration::description::Cfa;

    const SIDE: usize = 24;

    fn frame(raw: impl Fn(usize, usize) -> u16) -> Frame {
        Frame {
            width: SIDE,
            height: SIDE,
            layout: Layout::Mosaic(Cfa::RGGB),
            samples: Samples::U16((0..SIDE * SIDE).map(|k| raw(k % SIDE, k / SIDE)).collect()),
            black: [600.0; 4],
            saturation: [16_383.0; 4],
            metadata: Metadata::default(),
        }
    }

    #[test]
    fn stuck_photosites_are_told_from_edges_and_specks() {
        // The left half is print, a tenth as bright; one white speck of dust; two hot neighbours of one colour.
        let lit = |x: usize, y: usize| match (x, y) {
            (5, 7) | (15, 9) => 600,
            (18, 12) | (18, 14) => 16_383,
            (8, 18) => 800,
            _ if x < 12 => 700,
            _ => 2_000,
        };
        let dark = |x: usize, y: usize| if x == 18 && (y == 12 || y == 14) { 16_383 } else { 602 };
        let (lit, dark) = (frame(lit), frame(dark));
        let found = find(&[(true, &lit), (true, &lit), (false, &dark)]);
        assert_eq!(found, Defects::new(vec![[18, 12], [18, 14]], vec![[5, 7], [15, 9]]));
        // Without a picture of the dark, what is stuck at the top still shows.
        assert_eq!(find(&[(true, &lit)]), found);
    }
}
