//! What the patches of a chart read in every frame.

use super::CalibrateError;
use super::defective;
use super::inputs::{exposure_warning, fingerprint};
use crate::instrument::Defects;
use crate::linear::{Levels, raw_at, seconds_at_iso_100};
use crate::raw::{Ceiling, Frame, Histogram, Layout, Metadata};
use crate::session::{FrameEntry, Patch, Session};
use rayon::prelude::*;
use weavelight_calibration::description::Cfa;

/// One patch in one frame, per place of the 2 x 2 cell, raw numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PatchStats {
    pub(super) mean: [f64; 4],
    /// Of one sample, from differences between neighbours of one colour (what shades the patch cancels).
    pub(super) variance: [f64; 4],
    pub(super) count: [f64; 4],
    pub(super) highest: f64,
    /// Of one sample about the patch's mean: shading, and whatever else lies in the rectangle.
    pub(super) spread: [f64; 4],
}

/// One frame of the chart.
pub(super) struct ChartFrame {
    pub(super) light: Option<usize>,
    pub(super) exposure: f64,
    pub(super) patches: Vec<PatchStats>,
    pub(super) cfa: Cfa,
    /// The file's own levels; saturation no higher than where the chart's pictures clip.
    pub(super) black: [f32; 4],
    pub(super) saturation: [f32; 4],
    /// Largest raw number and how many samples have it.
    pub(super) top: (f64, usize),
    pub(super) size: [usize; 2],
    pub(super) metadata: Metadata,
}

/// All frames of the chart and the photosites that measure nothing.
pub(super) struct ChartFrames {
    pub(super) frames: Vec<ChartFrame>,
    pub(super) defects: Defects,
    /// Of every frame, in the session's order.
    pub(super) fingerprints: Vec<u64>,
    /// Where a file's exposure is not the manifest's.
    pub(super) other_exposure: Option<String>,
    /// Where the pictures clip, if that is below the files' full scale.
    pub(super) ceiling: Option<Ceiling>,
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

/// Reads every frame of the chart; they are held together, because defects show in the sum of all.
pub(super) fn read_chart(
    session: &Session,
    patches: &[Patch],
) -> Result<ChartFrames, CalibrateError> {
    let read = |entry: &FrameEntry| -> Result<(Frame, Cfa), CalibrateError> {
        let frame = session.frame(entry)?;
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
        Ok((frame, cfa))
    };
    let read: Vec<(Frame, Cfa)> =
        session.frames.par_iter().with_max_len(1).map(read).collect::<Result<_, _>>()?;
    check_one_size(session, &read)?;
    let lit = |entry: &FrameEntry| entry.light.is_some();
    let all: Vec<(bool, &Frame)> =
        session.frames.iter().zip(&read).map(|(entry, (frame, _))| (lit(entry), frame)).collect();
    let defects = defective::find(&all);
    let ceiling = Histogram::of(read.par_iter().map(|(frame, _)| frame)).and_then(|h| h.ceiling());
    let clip = ceiling.map_or(f32::INFINITY, |ceiling| ceiling.level.into());
    let of_frame = |(entry, (frame, cfa)): (&FrameEntry, &(Frame, Cfa))| ChartFrame {
        light: entry.light,
        exposure: seconds_at_iso_100(entry.exposure_s, entry.iso),
        patches: patches.iter().map(|patch| stats(frame, patch, &defects)).collect(),
        cfa: *cfa,
        black: frame.black,
        saturation: frame.saturation.map(|level| level.min(clip)),
        top: top(frame, &defects),
        size: [frame.width, frame.height],
        metadata: frame.metadata.clone(),
    };
    let frames = session.frames.par_iter().zip(&read).map(of_frame).collect();
    let fingerprints = read.par_iter().map(|(frame, _)| fingerprint(frame)).collect();
    let pairs = session.frames.iter().zip(&read);
    let other_exposure =
        pairs.filter_map(|(entry, (frame, _))| exposure_warning(session, entry, frame)).next();
    Ok(ChartFrames { frames, defects, fingerprints, other_exposure, ceiling })
}

/// Frames of two sizes have no photosites in common.
fn check_one_size(session: &Session, read: &[(Frame, Cfa)]) -> Result<(), CalibrateError> {
    let size = |frame: &Frame| [frame.width, frame.height];
    let Some((first, _)) = read.first() else { return Ok(()) };
    let Some(k) = read.iter().position(|(frame, _)| size(frame) != size(first)) else {
        return Ok(());
    };
    let path = |k: usize| session.frame_path(&session.frames[k]);
    let (found, expected) = (size(&read[k].0), size(first));
    Err(CalibrateError::WrongSize { frame: path(k), found, rig: path(0), expected })
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

fn stats(frame: &Frame, patch: &Patch, defects: &Defects) -> PatchStats {
    let [u0, v0, u1, v1] = patch.rect_px.map(|c| c.round().max(0.0) as usize);
    let mut out = PatchStats::default();
    let mut pairs = [0.0f64; 4];
    let mut square = [0.0f64; 4];
    for y in v0..=v1.min(frame.height - 1) {
        let defective: Vec<usize> = defects.columns(y, u0).take_while(|x| *x <= u1).collect();
        for x in u0..=u1.min(frame.width - 1) {
            if defective.contains(&x) {
                continue;
            }
            let place = (y & 1) * 2 + (x & 1);
            let raw = raw_at(frame, x, y, 0);
            out.mean[place] += raw;
            out.count[place] += 1.0;
            out.highest = out.highest.max(raw);
            square[place] += raw * raw;
            // Disjoint pairs along the row, so that every difference is independent.
            if x >= u0 + 2 && ((x - u0) / 2) % 2 == 1 && !defective.contains(&(x - 2)) {
                out.variance[place] += (raw - raw_at(frame, x - 2, y, 0)).powi(2) / 2.0;
                pairs[place] += 1.0;
            }
        }
    }
    for (place, pairs) in pairs.iter().enumerate() {
        out.mean[place] /= out.count[place];
        out.variance[place] /= pairs;
        out.spread[place] = (square[place] / out.count[place] - out.mean[place].powi(2)).max(0.0);
    }
    out
}

fn top(frame: &Frame, defects: &Defects) -> (f64, usize) {
    let mut top = (f64::NEG_INFINITY, 0);
    for y in 0..frame.height {
        let mut defective = defects.columns(y, 0).peekable();
        for x in 0..frame.width {
            if defective.next_if_eq(&x).is_some() {
                continue;
            }
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
