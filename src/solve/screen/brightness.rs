//! How bright each frame is, in blocks of photosites: what tells a lit frame from a dark one, and an ambient frame from one
//! that some light was on in.

use crate::linear::{Exposure, Reading};
use crate::raw::{Layout, Samples};
use crate::solve::scene::Scene;
use rayon::prelude::*;
use std::ops::Range;

/// Side of a block, photosites.
const SIDE: usize = 16;
/// Blocks along each side of the frame.
const MOST_BLOCKS: usize = 24;
/// Share of the blocks, counted from the calmest, whose noise is taken for that of the frame: cloth has texture, and hot
/// photosites are few.
const CALM: f64 = 0.1;

/// One frame in blocks.
pub(crate) struct Brightness {
    /// Exposure time times ISO / 100.
    pub(crate) seconds: f64,
    /// Per block and channel (R, G, B; grey as G): median of linear light, fraction of full scale. Infinite where most of it
    /// clips, NaN where the mask leaves nothing.
    pub(crate) levels: Vec<[f64; 3]>,
    /// Standard deviation of a sample in the calmest part of the frame, half a raw number at least.
    pub(crate) noise: f64,
}

impl Brightness {
    pub(crate) fn of(scene: &Scene, exposures: &[Exposure]) -> Vec<Self> {
        exposures.par_iter().map(|exposure| Self::new(scene, exposure)).collect()
    }

    fn new(scene: &Scene, exposure: &Exposure) -> Self {
        let reading = Reading::new(&exposure.frame, &scene.color);
        let blocks = blocks(scene);
        let levels = blocks.iter().map(|corner| levels(scene, &reading, *corner)).collect();
        let mut noise: Vec<f64> =
            blocks.iter().filter_map(|corner| noise(scene, &reading, *corner)).collect();
        noise.sort_by(f64::total_cmp);
        let calm = noise.get((CALM * noise.len() as f64) as usize).copied().unwrap_or(0.0);
        let step = match exposure.frame.samples {
            Samples::U16(_) => 0.5 / f64::from(reading.range()[0]),
            Samples::F32(_) => 0.0,
        };
        Self { seconds: exposure.seconds_at_iso_100(), levels, noise: calm.max(step) }
    }

    /// The level of a block as a rate: per second at ISO 100.
    pub(crate) fn rate(&self, block: usize, channel: usize) -> f64 {
        self.levels[block][channel] / self.seconds
    }
}

/// Top left corners of the blocks, spread over the swatch.
fn blocks(scene: &Scene) -> Vec<[usize; 2]> {
    let places = |range: Range<usize>| -> Vec<usize> {
        let count = (range.len() / SIDE).clamp(1, MOST_BLOCKS);
        let room = range.len().saturating_sub(SIDE);
        // Even corners: every block begins with the same colour.
        (0..count).map(|k| (range.start + room * k / (count - 1).max(1)) & !1).collect()
    };
    let [columns, rows] = bounds(scene).map(places);
    rows.iter().flat_map(|&y| columns.iter().map(move |&x| [x, y])).collect()
}

/// Columns and rows from the first to the last inside the mask.
fn bounds(scene: &Scene) -> [Range<usize>; 2] {
    let Some(mask) = &scene.mask else { return [0..scene.width, 0..scene.height] };
    let column = |x: &usize| (0..mask.height).any(|y| *mask.at(*x, y));
    let row = |y: &usize| mask.row(*y).contains(&true);
    let range = |first: Option<usize>, last: Option<usize>| {
        first.unwrap_or(0)..last.map_or(0, |last| last + 1)
    };
    [
        range((0..mask.width).find(column), (0..mask.width).rfind(column)),
        range((0..mask.height).find(row), (0..mask.height).rfind(row)),
    ]
}

/// Photosites of a block that measure the swatch.
fn photosites(scene: &Scene, [x, y]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let (right, bottom) = ((x + SIDE).min(scene.width), (y + SIDE).min(scene.height));
    let inside = move |at: &[usize; 2]| {
        scene.mask.as_ref().is_none_or(|mask| *mask.at(at[0], at[1]))
            && scene.defects.columns(at[1], at[0]).next() != Some(at[0])
    };
    (y..bottom).flat_map(move |y| (x..right).map(move |x| [x, y])).filter(inside)
}

fn levels(scene: &Scene, reading: &Reading, corner: [usize; 2]) -> [f64; 3] {
    let mut values: [Vec<f64>; 3] = Default::default();
    for [x, y] in photosites(scene, corner) {
        match scene.layout {
            Layout::Mosaic(cfa) => {
                values[cfa.channel(x, y) as usize].push(reading.at(x, y, 0));
            }
            Layout::Grey => values[1].push(reading.at(x, y, 0)),
            Layout::Rgb => (0..3).for_each(|c| values[c].push(reading.at(x, y, c))),
        }
    }
    values.map(median)
}

/// What clips is brighter than all that does not.
fn median(mut values: Vec<f64>) -> f64 {
    values.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = f64::INFINITY);
    let middle = values.len() / 2;
    if values.is_empty() {
        return f64::NAN;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Root mean square of the second differences between photosites of a colour, as the standard deviation of one sample.
fn noise(scene: &Scene, reading: &Reading, corner: [usize; 2]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for [x, y] in photosites(scene, corner) {
        if x < 2 || x + 2 >= scene.width {
            continue;
        }
        let [before, here, after] = [x - 2, x, x + 2].map(|x| reading.at(x, y, 0));
        let second = 2.0 * here - before - after;
        if second.is_finite() {
            sum += second * second / 6.0;
            count += 1.0;
        }
    }
    (count > 0.0).then(|| f64::sqrt(sum / count))
}
