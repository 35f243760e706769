//! Whether the sheet lay still between the frames of a capture session.

use crate::raw::Frame;
use rayon::prelude::*;
use weavelight_calibration::description::Image;

use super::frames::grey_picture;

/// Pictures are compared at this width at most.
const WIDTH_PX: usize = 1000;
/// Half the side of the window whose mean is taken out: lights shade slowly, edges and print stay.
const WINDOW: usize = 6;
/// A shift counts from here on, in pixels of the reduced picture, if it is also this many sigma.
const LEAST_SHIFT_PX: f64 = 0.35;
const LEAST_SIGMAS: f64 = 8.0;

/// What of a frame stays the same under every light: log brightness, reduced, slow shading taken out.
pub(super) struct Pattern {
    image: Image<f32>,
    factor: usize,
}

impl Pattern {
    pub(super) fn of(frame: &Frame) -> Self {
        let factor = frame.width.div_ceil(WIDTH_PX).max(1);
        let grey = reduced(&grey_picture(frame), factor);
        let floor = grey.data.iter().copied().fold(0.0f32, f32::max) * 1e-3;
        let log =
            Image { data: grey.data.iter().map(|v| v.max(floor).max(1e-6).ln()).collect(), ..grey };
        Self { image: without_shading(&log), factor }
    }

    /// Shift from this pattern to another one in pixels of the full frame, if it certainly moved.
    ///
    /// One step of Lucas and Kanade's method over the whole picture ("An iterative image registration technique", 1981).
    pub(super) fn shift_to(&self, other: &Pattern) -> Option<[f64; 2]> {
        let (a, b) = (&self.image, &other.image);
        if (a.width, a.height) != (b.width, b.height) {
            return None;
        }
        let (mut xx, mut xy, mut yy, mut xt, mut yt, mut tt) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for y in 1..a.height - 1 {
            let (above, here, below) = (a.row(y - 1), a.row(y), a.row(y + 1));
            for x in 1..a.width - 1 {
                let gx = f64::from(here[x + 1] - here[x - 1]) / 2.0;
                let gy = f64::from(below[x] - above[x]) / 2.0;
                let t = f64::from(here[x] - b.row(y)[x]);
                xx += gx * gx;
                xy += gx * gy;
                yy += gy * gy;
                xt += gx * t;
                yt += gy * t;
                tt += t * t;
            }
        }
        let determinant = xx * yy - xy * xy;
        let count = (a.width * a.height) as f64;
        let (u, v) = ((yy * xt - xy * yt) / determinant, (xx * yt - xy * xt) / determinant);
        let variance = (tt - u * xt - v * yt).max(0.0) / count;
        let sigma = (variance * xx.max(yy) / determinant).sqrt();
        let size = u.hypot(v);
        let moved = size > LEAST_SHIFT_PX && size > LEAST_SIGMAS * sigma;
        moved.then(|| [u, v].map(|shift| shift * self.factor as f64))
    }
}

fn reduced(grey: &Image<f32>, factor: usize) -> Image<f32> {
    let (width, height) = (grey.width / factor, grey.height / factor);
    let row = |y: usize| {
        let mut out = vec![0.0f32; width];
        for source in y * factor..(y + 1) * factor {
            for (value, block) in out.iter_mut().zip(grey.row(source).chunks_exact(factor)) {
                *value += block.iter().sum::<f32>();
            }
        }
        out
    };
    Image { width, height, data: (0..height).into_par_iter().flat_map_iter(row).collect() }
}

fn without_shading(log: &Image<f32>) -> Image<f32> {
    let mean = |x: usize, y: usize| {
        let (x0, x1) = (x.saturating_sub(WINDOW), (x + WINDOW + 1).min(log.width));
        let (y0, y1) = (y.saturating_sub(WINDOW), (y + WINDOW + 1).min(log.height));
        let sum: f32 = (y0..y1).map(|y| log.row(y)[x0..x1].iter().sum::<f32>()).sum();
        sum / ((x1 - x0) * (y1 - y0)) as f32
    };
    let pixel = |k: usize| {
        let (x, y) = (k % log.width, k / log.width);
        // A paper's grain and noise say nothing: only clear edges count.
        let value = log.row(y)[x] - mean(x, y);
        if value.abs() < 0.05 { 0.0 } else { value.clamp(-1.0, 1.0) }
    };
    Image { data: (0..log.data.len()).into_par_iter().map(pixel).collect(), ..*log }
}
