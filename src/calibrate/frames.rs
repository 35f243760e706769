//! Frames of targets: read, made linear, averaged over rectangles.

use super::CalibrateError;
use crate::instrument::Defects;
use crate::linear::{Levels, raw_at};
use crate::raw::{Frame, Layout};
use std::path::Path;
use weavelight_calibration::description::Image;

/// The frame must have the size that `stated_in` says.
pub(super) fn check_size(
    path: &Path,
    frame: &Frame,
    stated_in: &Path,
    expected: [usize; 2],
) -> Result<(), CalibrateError> {
    let found = [frame.width, frame.height];
    if found == expected {
        return Ok(());
    }
    let (frame, rig) = (path.to_owned(), stated_in.to_owned());
    Err(CalibrateError::WrongSize { frame, found, rig, expected })
}

/// A rectangle of pixels: x0, y0 inside, x1, y1 outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rect {
    pub(super) x: [usize; 2],
    pub(super) y: [usize; 2],
}

/// Light in a rectangle per channel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mean {
    /// Mean of linear light, fraction of full scale; NaN where nothing is usable.
    pub(super) value: [f64; 3],
    /// Variance of one sample about that mean.
    pub(super) variance: [f64; 3],
    /// Samples.
    pub(super) count: [f64; 3],
    /// Share of saturated samples.
    pub(super) saturated: f64,
}

/// Mean light of a rectangle, defective photosites left out. A grey frame gives three equal channels.
pub(super) fn mean_in(frame: &Frame, levels: &Levels, defects: &Defects, rect: Rect) -> Mean {
    let (mut sum, mut square, mut count) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let (mut saturated, mut all) = (0.0, 0.0);
    let mut add = |channel: usize, light: Option<f64>| {
        all += 1.0;
        match light {
            Some(light) => {
                sum[channel] += light;
                square[channel] += light * light;
                count[channel] += 1.0;
            }
            None => saturated += 1.0,
        }
    };
    for y in rect.y[0]..rect.y[1].min(frame.height) {
        let mut defective = defects.columns(y, rect.x[0]).peekable();
        for x in rect.x[0]..rect.x[1].min(frame.width) {
            if defective.next_if_eq(&x).is_some() {
                continue;
            }
            let place = (y & 1) * 2 + (x & 1);
            match frame.layout {
                Layout::Mosaic(cfa) => {
                    add(cfa.cell[place] as usize, levels.linear(raw_at(frame, x, y, 0), place));
                }
                Layout::Grey => {
                    (0..3).for_each(|c| add(c, levels.linear(raw_at(frame, x, y, 0), place)));
                }
                Layout::Rgb => {
                    (0..3).for_each(|c| add(c, levels.linear(raw_at(frame, x, y, c), place)));
                }
            }
        }
    }
    let value: [f64; 3] = std::array::from_fn(|k| sum[k] / count[k]);
    let variance = std::array::from_fn(|k| (square[k] / count[k] - value[k] * value[k]).max(0.0));
    Mean { value, variance, count, saturated: saturated / f64::max(all, 1.0) }
}

/// A picture for finding boards: all colours balanced, on the sensor's own grid. A mosaic is filtered with the binomial
/// 3 x 3 kernel, which weighs the four colour places alike everywhere and moves nothing.
pub(super) fn grey_picture(frame: &Frame) -> Image<f32> {
    let (width, height) = (frame.width, frame.height);
    let value = |x: usize, y: usize| match frame.layout {
        Layout::Rgb => (0..3).map(|c| raw_at(frame, x, y, c)).sum::<f64>() as f32 / 3.0,
        _ => raw_at(frame, x, y, 0) as f32,
    };
    let mut data: Vec<f32> = Vec::with_capacity(width * height);
    for y in 0..height {
        data.extend((0..width).map(|x| value(x, y)));
    }
    let mut image = Image { width, height, data };
    if matches!(frame.layout, Layout::Mosaic(_)) {
        balance(&mut image, &frame.black);
        image = without_specks(&image);
        image = binomial(&image);
    }
    image
}

/// Scales the four places of the 2 x 2 cell to one mean above black.
fn balance(image: &mut Image<f32>, black: &[f32; 4]) {
    let mut sums = [(0.0f64, 0.0f64); 4];
    for y in 0..image.height {
        for (x, value) in image.row(y).iter().enumerate() {
            let place = (y & 1) * 2 + (x & 1);
            sums[place].0 += f64::from(value - black[place]);
            sums[place].1 += 1.0;
        }
    }
    let means = sums.map(|(sum, count)| (sum / f64::max(count, 1.0)).max(1e-6));
    let width = image.width;
    for (k, value) in image.data.iter_mut().enumerate() {
        let place = ((k / width) & 1) * 2 + ((k % width) & 1);
        *value = (*value - black[place]) * (means[1] / means[place]) as f32;
    }
}

/// A photosite is a speck if it leaves the range of its neighbours by this share of the picture's contrast.
const SPECK_SHARE: f32 = 0.15;

/// Brings hot and dead photosites back into the range of the eight nearest of their colour, the one highest and the one
/// lowest of these aside (they may be defective too). Everything else stays as it is: edges and corners of a target are wider
/// than one photosite.
fn without_specks(image: &Image<f32>) -> Image<f32> {
    let mut sample: Vec<f32> = image.data.iter().step_by(61).copied().collect();
    sample.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| sample.get((share * sample.len() as f64) as usize).copied();
    let contrast = at(0.98).unwrap_or(0.0) - at(0.02).unwrap_or(0.0);
    let slack = SPECK_SHARE * contrast;
    let mut out = image.clone();
    for y in 2..image.height.saturating_sub(2) {
        let rows = [y - 2, y, y + 2].map(|row| image.row(row));
        for x in 2..image.width.saturating_sub(2) {
            let here = rows[1][x];
            // Most photosites lie between two of their neighbours: these need no sorting.
            let [left, right] = [rows[1][x - 2], rows[1][x + 2]];
            if here <= left.max(right) + slack && here >= left.min(right) - slack {
                continue;
            }
            let mut around = [
                rows[0][x - 2],
                rows[0][x],
                rows[0][x + 2],
                left,
                right,
                rows[2][x - 2],
                rows[2][x],
                rows[2][x + 2],
            ];
            around.sort_unstable_by(f32::total_cmp);
            let (low, high) = (around[1], around[6]);
            if here > high + slack || here < low - slack {
                out.data[y * image.width + x] = here.clamp(low, high);
            }
        }
    }
    out
}

/// [1 2 1] x [1 2 1] / 16, borders mirrored (which keeps the colour places' weights).
fn binomial(image: &Image<f32>) -> Image<f32> {
    let (width, height) = (image.width, image.height);
    let mirrored = |k: usize, step: isize, length: usize| {
        let at = k as isize + step;
        let last = length as isize - 1;
        (if at < 0 {
            -at
        } else if at > last {
            2 * last - at
        } else {
            at
        })
        .clamp(0, last) as usize
    };
    let mut across = image.clone();
    for y in 0..height {
        let row = image.row(y);
        for x in 0..width {
            across.data[y * width + x] =
                0.25 * (row[mirrored(x, -1, width)] + 2.0 * row[x] + row[mirrored(x, 1, width)]);
        }
    }
    let mut out = across.clone();
    for y in 0..height {
        let (above, below) =
            (across.row(mirrored(y, -1, height)), across.row(mirrored(y, 1, height)));
        for (x, value) in out.data[y * width..(y + 1) * width].iter_mut().enumerate() {
            *value = 0.25 * (above[x] + 2.0 * across.row(y)[x] + below[x]);
        }
    }
    out
}
