//! What the patches of a chart read in every frame.

use super::CalibrateError;
use super::frames::{Levels, raw_at, read_frame, seconds_at_iso_100};
use crate::raw::{Frame, Layout, Metadata};
use crate::session::{Patch, Session};
use rayon::prelude::*;
use std::collections::HashMap;
use weavelight_calibration::description::Cfa;

/// One patch in one frame, per place of the 2 x 2 cell, raw numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PatchStats {
    pub(super) mean: [f64; 4],
    /// Of one sample, from differences between neighbours of one colour (what shades the patch cancels).
    pub(super) variance: [f64; 4],
    pub(super) count: [f64; 4],
    pub(super) highest: f64,
}

/// One frame of the chart.
pub(super) struct ChartFrame {
    pub(super) light: Option<usize>,
    pub(super) exposure: f64,
    pub(super) patches: Vec<PatchStats>,
    pub(super) cfa: Cfa,
    /// The file's own levels.
    pub(super) black: [f32; 4],
    pub(super) saturation: [f32; 4],
    /// Largest raw number and how many samples have it.
    pub(super) top: (f64, usize),
    pub(super) size: [usize; 2],
    pub(super) metadata: Metadata,
    /// Samples far above (dark frames) or far below (lit ones) all their neighbours.
    pub(super) suspects: Vec<[u32; 2]>,
}

impl ChartFrame {
    /// Mean light of a patch per channel, fraction of full scale; NaN where it clips.
    pub(super) fn light_in(&self, patch: usize, levels: &Levels) -> [f64; 3] {
        let (mut sum, mut count) = ([0.0; 3], [0.0; 3]);
        for place in 0..4 {
            let stats = &self.patches[patch];
            let channel = self.cfa.cell[place] as usize;
            let light = if stats.highest < levels.saturation[place] {
                levels.linear(stats.mean[place], place).unwrap_or(f64::NAN)
            } else {
                f64::NAN
            };
            sum[channel] += light;
            count[channel] += 1.0;
        }
        std::array::from_fn(|c| sum[c] / count[c])
    }
}

/// Reads every frame of the chart.
pub(super) fn read_chart(
    session: &Session,
    patches: &[Patch],
) -> Result<Vec<ChartFrame>, CalibrateError> {
    let read = |entry| -> Result<ChartFrame, CalibrateError> {
        let frame = read_frame(session, entry)?;
        let Layout::Mosaic(cfa) = frame.layout else {
            let remedy = "take the chart as RAW, or skip this step: without color.toml the frames' own levels are used";
            return Err(CalibrateError::target(
                session.frame_path(entry),
                "this frame is no RAW mosaic",
                remedy,
            ));
        };
        for (k, patch) in patches.iter().enumerate() {
            check_inside(session, patch, k, &frame)?;
        }
        Ok(ChartFrame {
            light: entry.light,
            exposure: seconds_at_iso_100(entry),
            patches: patches.iter().map(|patch| stats(&frame, patch)).collect(),
            cfa,
            black: frame.black,
            saturation: frame.saturation,
            top: top(&frame),
            size: [frame.width, frame.height],
            suspects: suspects(&frame, entry.light.is_none()),
            metadata: frame.metadata,
        })
    };
    session.frames.par_iter().with_max_len(1).map(read).collect()
}

fn check_inside(
    session: &Session,
    patch: &Patch,
    k: usize,
    frame: &Frame,
) -> Result<(), CalibrateError> {
    let [u0, v0, u1, v1] = patch.rect_px;
    let inside = u0 >= 0.0 && v0 >= 0.0 && u1 < frame.width as f64 && v1 < frame.height as f64;
    if inside && u1 - u0 >= 4.0 && v1 - v0 >= 4.0 {
        return Ok(());
    }
    let what = format!(
        "patch {k} at {:?} lies outside the {} x {} frame or is smaller than 5 pixels",
        patch.rect_px, frame.width, frame.height
    );
    Err(CalibrateError::target(session.manifest_path(), what, "correct its rect_px"))
}

fn stats(frame: &Frame, patch: &Patch) -> PatchStats {
    let [u0, v0, u1, v1] = patch.rect_px.map(|c| c.round().max(0.0) as usize);
    let mut out = PatchStats::default();
    let mut pairs = [0.0f64; 4];
    for y in v0..=v1.min(frame.height - 1) {
        for x in u0..=u1.min(frame.width - 1) {
            let place = (y & 1) * 2 + (x & 1);
            let raw = raw_at(frame, x, y, 0);
            out.mean[place] += raw;
            out.count[place] += 1.0;
            out.highest = out.highest.max(raw);
            // Disjoint pairs along the row, so that every difference is independent.
            if x >= u0 + 2 && ((x - u0) / 2) % 2 == 1 {
                out.variance[place] += (raw - raw_at(frame, x - 2, y, 0)).powi(2) / 2.0;
                pairs[place] += 1.0;
            }
        }
    }
    for (place, pairs) in pairs.iter().enumerate() {
        out.mean[place] /= out.count[place];
        out.variance[place] /= pairs;
    }
    out
}

fn top(frame: &Frame) -> (f64, usize) {
    let mut top = (f64::NEG_INFINITY, 0);
    for y in 0..frame.height {
        for x in 0..frame.width {
            let raw = raw_at(frame, x, y, 0);
            if raw > top.0 {
                top = (raw, 1);
            } else if raw == top.0 {
                top.1 += 1;
            }
        }
    }
    top
}

/// A hot photosite exceeds its neighbours of the same colour by this many raw numbers in the dark, relative to the range.
const HOT_SHARE: f64 = 0.01;
/// A dead one has less than this share of the darkest of them, where they are this bright.
const DEAD_SHARE: f64 = 0.4;
const LIT_SHARE: f64 = 0.04;

fn suspects(frame: &Frame, dark: bool) -> Vec<[u32; 2]> {
    let range = f64::from(frame.saturation[0] - frame.black[0]);
    let row = |y: usize| -> Vec<[u32; 2]> {
        let mut found = Vec::new();
        for x in 2..frame.width.saturating_sub(2) {
            let place = (y & 1) * 2 + (x & 1);
            let black = f64::from(frame.black[place]);
            let around = [(x - 2, y), (x + 2, y), (x, y - 2), (x, y + 2)]
                .map(|(x, y)| raw_at(frame, x, y, 0) - black);
            let here = raw_at(frame, x, y, 0) - black;
            let (least, most) = around
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
            let odd = if dark {
                here > most + HOT_SHARE * range
            } else {
                least > LIT_SHARE * range && here < DEAD_SHARE * least
            };
            if odd {
                found.push([x as u32, y as u32]);
            }
        }
        found
    };
    (2..frame.height.saturating_sub(2)).into_par_iter().flat_map_iter(row).collect()
}

/// Photosites that are hot in every dark frame, and those dead in at least two lit frames.
pub(super) fn defects(frames: &[ChartFrame]) -> (Vec<[u32; 2]>, Vec<[u32; 2]>) {
    let count = |dark: bool| {
        let mut counts: HashMap<[u32; 2], usize> = HashMap::new();
        let chosen = frames.iter().filter(|frame| frame.light.is_none() == dark);
        chosen
            .flat_map(|frame| &frame.suspects)
            .for_each(|place| *counts.entry(*place).or_default() += 1);
        counts
    };
    let dark_frames = frames.iter().filter(|frame| frame.light.is_none()).count();
    let sorted = |counts: HashMap<[u32; 2], usize>, least: usize| {
        let mut places: Vec<[u32; 2]> = counts
            .into_iter()
            .filter(|(_, count)| *count >= least)
            .map(|(place, _)| place)
            .collect();
        places.sort_unstable_by_key(|[x, y]| (*y, *x));
        places
    };
    (sorted(count(true), dark_frames.max(1)), sorted(count(false), 2))
}
