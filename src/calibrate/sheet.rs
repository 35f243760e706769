//! What one white sheet showed: cells over the frame, every light's mean signal in each.

use super::boards::{self, shape_of};
use super::frames::{Mean, Rect, check_size, grey_picture, mean_in};
use super::inputs::{exposure_warning, fingerprint, no_copies};
use super::levels;
use super::moved::Pattern;
use super::sheet_pose::{Pose, pose_of};
use super::{CalibrateError, Progress};
use crate::instrument::{CAMERA_FILE, Color, Defects, Optics};
use crate::linear::{Levels, seconds_at_iso_100};
use crate::raw::{Ceiling, Histogram};
use crate::session::{Board, FrameEntry, Session};
use nalgebra::Vector3;
use rayon::prelude::*;
use weavelight_calibration::board::BoardView;
use weavelight_calibration::description::{Camera, Plane};
use weavelight_calibration::lights::{Cell, Sample, Sheet};
use weavelight_calibration::projection::Projector;

/// Cells across the longer side of the frame.
const CELLS_ACROSS: usize = 40;
/// Smallest side of a cell in pixels.
const LEAST_CELL_PX: usize = 8;
/// A white sheet reflects this much if nobody says.
const WHITE: f64 = 0.99;
/// A light below this share of the others' is dead.
const DEAD: f64 = 0.02;
/// Share of saturated samples in the sheet's cells from which a frame is overexposed.
const OVEREXPOSED: f64 = 0.01;
/// Good range of the brightest light's brightest cells.
const GOOD_LEVEL: [f64; 2] = [0.5, 0.9];
/// What the advice aims at.
const AIM_LEVEL: f64 = 0.7;
/// Drift of a repeated light that is told.
const DRIFT: f64 = 0.003;
/// Cells darker than this share of the typical one show no sheet; cells rougher than this show its edge, print or dust.
const DARK_CELL: f64 = 0.5;
const ROUGH_CELL: f64 = 0.06;

/// What is known of the instrument when sheets are looked at.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    pub(super) camera: &'a Camera,
    pub(super) optics: &'a Optics,
    pub(super) color: &'a Color,
    pub(super) defects: &'a Defects,
    pub(super) lights: usize,
}

/// What a white sheet's capture session gives.
pub(super) struct Observed {
    pub(super) sheet: Sheet,
    pub(super) warnings: Vec<String>,
    /// Share of full scale that the brightest light's brightest cells reach.
    pub(super) brightest: f64,
    /// Of every frame, in the session's order.
    pub(super) fingerprints: Vec<u64>,
}

/// One frame, averaged.
struct Averaged {
    light: Option<usize>,
    drift_check: bool,
    exposure: f64,
    cells: Vec<Mean>,
    pattern: Pattern,
    board: Option<BoardView>,
    optics: Optics,
    fingerprint: u64,
    /// Where the file's exposure is not the manifest's.
    other_exposure: Option<String>,
    /// Share of the range in which samples do not clip.
    usable_share: f64,
    /// Of a file that leaves it open where samples clip.
    histogram: Option<Histogram>,
}

/// Reads a white sheet's frames. Sheets whose lights are swapped, dead or overexposed are refused with the light's name.
///
/// # Errors
/// Where frames cannot be read, or the sheet cannot serve; with what to photograph instead.
pub(super) fn observe(
    session: &Session,
    known: Known,
    progress: &Progress,
) -> Result<Observed, CalibrateError> {
    let Known { camera, lights, .. } = known;
    session.check_lights(lights)?;
    let rects = grid(camera);
    let (frames, ceiling) = average_all(session, known, &rects, progress)?;
    let exposures = Exposures { session, lights, frames: &frames, ambient: ambient(&frames) };
    // Before anything is looked for in the pictures: a strip on an overexposed sheet is not found either.
    exposures.check_complete()?;
    exposures.check_saturation(rects.len())?;
    exposures.check_lit(rects.len())?;
    exposures.check_levels(&(0..rects.len()).collect::<Vec<_>>())?;
    let fingerprints: Vec<u64> = frames.iter().map(|frame| frame.fingerprint).collect();
    no_copies(session, &fingerprints)?;
    exposures.check_exposures(rects.len())?;
    still(session, &frames)?;
    let strips: Vec<&BoardView> = frames.iter().filter_map(|frame| frame.board.as_ref()).collect();
    let pose = pose_of(session, camera, &strips)?;
    let cells = cells_on(camera, &pose, &rects, grid_size(camera));
    let mut warnings = optics_warnings(session, known.optics, frames.iter().map(|f| &f.optics));
    warnings.extend(frames.iter().find_map(|frame| frame.other_exposure.clone()));
    warnings.extend(ceiling.map(|ceiling| format!("{}: {}", session.name, ceiling.sentence())));
    warnings.extend(pose.warning.iter().cloned());
    let sheet_cells = exposures.cells_of_the_sheet(&cells)?;
    let numbers: Vec<usize> = sheet_cells.iter().map(|(k, _)| *k).collect();
    let brightest = exposures.check_levels(&numbers)?;
    warnings.extend(exposure_advice(&session.name, brightest));
    exposures.check_drift(&sheet_cells, &mut warnings);
    let samples = sheet_cells
        .iter()
        .flat_map(|(k, _)| (0..lights).map(|light| exposures.sample(light, *k)).collect::<Vec<_>>())
        .collect();
    let reflectance = session.target.as_ref().and_then(|t| t.reflectance).unwrap_or(WHITE);
    let sheet = Sheet {
        name: session.name.clone(),
        plane: pose.plane,
        pose_sigma: pose.sigma,
        reflectance,
        grid: grid_size(camera),
        cells: sheet_cells.into_iter().map(|(_, cell)| cell).collect(),
        samples,
    };
    Ok(Observed { sheet, warnings, brightest, fingerprints })
}

pub(super) fn cell_side(camera: &Camera) -> usize {
    // Even, so that every cell holds whole 2 x 2 cells of the mosaic.
    (camera.width_px.max(camera.height_px) / CELLS_ACROSS).max(LEAST_CELL_PX) & !1
}

fn grid_size(camera: &Camera) -> [usize; 2] {
    let side = cell_side(camera);
    [(camera.width_px / side).max(1), (camera.height_px / side).max(1)]
}

fn grid(camera: &Camera) -> Vec<Rect> {
    let (side, [columns, rows]) = (cell_side(camera), grid_size(camera));
    let rect = |k: usize| {
        let (x, y) = (k % columns * side, k / columns * side);
        Rect { x: [x, x + side], y: [y, y + side] }
    };
    (0..columns * rows).map(rect).collect()
}

fn average_all(
    session: &Session,
    known: Known,
    rects: &[Rect],
    progress: &Progress,
) -> Result<(Vec<Averaged>, Option<Ceiling>), CalibrateError> {
    let first = average_each(session, known, rects, &frames_to_search(session), progress)?;
    let Some(ceiling) = ceiling(&first, known.color) else { return Ok((first, None)) };
    // Clipped samples counted as light: once more without them.
    let color = Color { clip_level: Some(ceiling.level.into()), ..known.color.clone() };
    let known = Known { color: &color, ..known };
    let mut frames = average_each(session, known, rects, &[], progress)?;
    frames.iter_mut().zip(first).for_each(|(frame, first)| frame.board = first.board);
    Ok((frames, Some(ceiling)))
}

/// Where pictures of other programs clip, unless the calibration says: as `solve` has it.
fn ceiling(frames: &[Averaged], color: &Color) -> Option<Ceiling> {
    if color.saturation_level.is_some() {
        return None;
    }
    let histograms = frames.iter().filter_map(|frame| frame.histogram.clone());
    histograms.reduce(Histogram::with)?.ceiling()
}

fn average_each(
    session: &Session,
    known: Known,
    rects: &[Rect],
    searched: &[usize],
    progress: &Progress,
) -> Result<Vec<Averaged>, CalibrateError> {
    let done = std::sync::atomic::AtomicUsize::new(0);
    let average = |(k, entry): (usize, &FrameEntry)| {
        let tick = || {
            let done = done.load(std::sync::atomic::Ordering::Relaxed);
            progress(done as f64 / session.frames.len() as f64, &session.name);
        };
        let averaged = average(session, entry, searched.contains(&k), known, rects, &tick)?;
        let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        progress(done as f64 / session.frames.len() as f64, &session.name);
        Ok(averaged)
    };
    session.frames.par_iter().enumerate().with_max_len(1).map(average).collect()
}

/// The printed strip is looked for under three lights, if one is stated.
fn frames_to_search(session: &Session) -> Vec<usize> {
    if session.target.as_ref().is_none_or(|target| target.board.is_none()) {
        return Vec::new();
    }
    let lit: Vec<usize> =
        (0..session.frames.len()).filter(|k| session.frames[*k].light.is_some()).collect();
    let third = lit.len().div_ceil(3).max(1);
    lit.into_iter().step_by(third).take(3).collect()
}

fn average(
    session: &Session,
    entry: &FrameEntry,
    searched: bool,
    known: Known,
    rects: &[Rect],
    tick: &dyn Fn(),
) -> Result<Averaged, CalibrateError> {
    let frame = session.frame(entry)?;
    let size = [known.camera.width_px, known.camera.height_px];
    check_size(&session.frame_path(entry), &frame, std::path::Path::new(CAMERA_FILE), size)?;
    let levels = Levels::of(&frame, known.color);
    let board = session.target.as_ref().and_then(|target| target.board).filter(|_| searched);
    let look = |board: Board| boards::detect(&grey_picture(&frame), &shape_of(&board), tick);
    let board = board.map(look).transpose()?;
    Ok(Averaged {
        light: entry.light,
        drift_check: entry.drift_check,
        exposure: seconds_at_iso_100(entry.exposure_s, entry.iso),
        cells: rects.iter().map(|rect| mean_in(&frame, &levels, known.defects, *rect)).collect(),
        pattern: Pattern::of(&frame),
        board: board.and_then(Result::ok).map(|corners| corners.refined),
        optics: Optics::of(&frame.metadata),
        fingerprint: fingerprint(&frame),
        other_exposure: exposure_warning(session, entry, &frame),
        usable_share: levels.usable_share(),
        histogram: Histogram::of_frame(&frame),
    })
}

/// Another camera or lens than the calibrated one, told once a capture session.
pub(super) fn optics_warnings<'a>(
    session: &Session,
    calibrated: &Optics,
    mut frames: impl Iterator<Item = &'a Optics>,
) -> Vec<String> {
    let differences = |optics: &Optics| Some(calibrated.differences(optics));
    let first = frames.find_map(|optics| differences(optics).filter(|found| !found.is_empty()));
    let tell = |what: String| {
        format!(
            "{}: {what}; calibrate the camera again, or photograph with the calibrated one",
            session.name
        )
    };
    first.into_iter().flatten().map(tell).collect()
}

/// The sheet must not move between the frames.
fn still(session: &Session, frames: &[Averaged]) -> Result<(), CalibrateError> {
    let mut lit = frames.iter().zip(&session.frames).filter(|(frame, _)| frame.light.is_some());
    let Some((first, first_entry)) = lit.next() else { return Ok(()) };
    for (frame, entry) in lit {
        if let Some([u, v]) = first.pattern.shift_to(&frame.pattern) {
            let what = format!(
                "the sheet moved by about {:.1} px between {} and {}",
                u.hypot(v),
                first_entry.file.display(),
                entry.file.display()
            );
            let remedy = "fix sheet and camera, and photograph this pose again";
            return Err(CalibrateError::target(session.manifest_path(), what, remedy));
        }
    }
    Ok(())
}

/// The cells whose centre sees the sheet's plane beside the strip.
fn cells_on(camera: &Camera, pose: &Pose, rects: &[Rect], grid: [usize; 2]) -> Vec<(usize, Cell)> {
    let projector = Projector::new(camera);
    let side_mm =
        cell_side(camera) as f64 * camera.camera_from_rig.translation.vector.z.abs() / camera.fx;
    let cell = |(k, rect): (usize, &Rect)| {
        let pixel = [0, 1].map(|axis| {
            let [low, high] = if axis == 0 { rect.x } else { rect.y };
            (low + high - 1) as f64 / 2.0
        });
        let ray = projector.ray(pixel)?;
        let point_mm = ray.on_plane(&pose.plane)?;
        let on_strip = pose.strip.as_ref().is_some_and(|(rig_from_board, shape)| {
            let at = rig_from_board.inverse() * point_mm;
            let margin = 1.6 * shape.square_mm + 0.75 * side_mm;
            let half = |corners: usize| (corners as f64 - 1.0) / 2.0 * shape.square_mm + margin;
            at.x.abs() < half(shape.columns) && at.y.abs() < half(shape.rows)
        });
        let place = [k % grid[0], k / grid[0]];
        (!on_strip).then_some((k, Cell { place, pixel, point_mm, view: ray.direction }))
    };
    rects.iter().enumerate().filter_map(cell).collect()
}

/// Ambient light per second at ISO 100 in every cell, if there is an ambient frame.
fn ambient(frames: &[Averaged]) -> Option<Vec<[f64; 3]>> {
    let dark: Vec<&Averaged> = frames.iter().filter(|frame| frame.light.is_none()).collect();
    let exposure: f64 = dark.iter().map(|frame| frame.exposure).sum();
    (!dark.is_empty()).then(|| {
        let cell = |k: usize| {
            std::array::from_fn(|c| {
                dark.iter().map(|f| f.cells[k].value[c]).sum::<f64>() / exposure
            })
        };
        (0..dark[0].cells.len()).map(cell).collect()
    })
}

/// All frames of a sheet and the questions that are asked of them.
struct Exposures<'a> {
    session: &'a Session,
    lights: usize,
    frames: &'a [Averaged],
    ambient: Option<Vec<[f64; 3]>>,
}

impl Exposures<'_> {
    fn of_light(&self, light: usize) -> impl Iterator<Item = &Averaged> {
        self.frames.iter().filter(move |frame| frame.light == Some(light) && !frame.drift_check)
    }

    /// Signal of one frame in a cell per second at ISO 100.
    fn signal(&self, frame: &Averaged, cell: usize) -> [f64; 3] {
        let ambient = self.ambient.as_ref().map_or([0.0; 3], |ambient| ambient[cell]);
        std::array::from_fn(|c| frame.cells[cell].value[c] / frame.exposure - ambient[c])
    }

    /// The longest exposure of a light that clips nowhere in the cell.
    fn sample(&self, light: usize, cell: usize) -> Sample {
        let clean = self.of_light(light).filter(|frame| frame.cells[cell].saturated == 0.0);
        let Some(frame) = clean.max_by(|a, b| a.exposure.total_cmp(&b.exposure)) else {
            return Sample::UNUSABLE;
        };
        let signal = self.signal(frame, cell);
        let mean = &frame.cells[cell];
        let sigma =
            |c: usize| (mean.variance[c] / mean.count[c]).sqrt() / frame.exposure / signal[c];
        let sample = Sample { signal, relative_sigma: std::array::from_fn(sigma) };
        if sample.is_usable() { sample } else { Sample::UNUSABLE }
    }

    /// Keeps cells that are bright and smooth under most lights.
    fn cells_of_the_sheet(
        &self,
        cells: &[(usize, Cell)],
    ) -> Result<Vec<(usize, Cell)>, CalibrateError> {
        let lit: Vec<&Averaged> =
            self.frames.iter().filter(|f| f.light.is_some() && !f.drift_check).collect();
        let brightness = |k: usize| {
            lit.iter().map(|f| self.signal(f, k)[1].max(0.0)).filter(|v| v.is_finite()).sum::<f64>()
        };
        let roughness = |k: usize| {
            let one = |f: &&Averaged| f.cells[k].variance[1].sqrt() / f.cells[k].value[1];
            lit.iter().map(one).filter(|r| r.is_finite()).fold(f64::INFINITY, f64::min)
        };
        let mut typical: Vec<f64> = cells.iter().map(|(k, _)| brightness(*k)).collect();
        typical.sort_unstable_by(f64::total_cmp);
        let typical = typical.get(typical.len() / 2).copied().unwrap_or(0.0);
        let mut rough: Vec<f64> = cells.iter().map(|(k, _)| roughness(*k)).collect();
        rough.sort_unstable_by(f64::total_cmp);
        let usual = rough.get(rough.len() / 2).copied().unwrap_or(0.0);
        let limit = ROUGH_CELL.max(2.0 * usual);
        let good = |(k, _): &&(usize, Cell)| {
            // Nothing measured at all is for the overexposure test to tell.
            let rough = roughness(*k);
            brightness(*k) > DARK_CELL * typical && (rough < limit || rough.is_infinite())
        };
        let kept: Vec<(usize, Cell)> = cells.iter().filter(good).cloned().collect();
        if kept.len() < LEAST_CELLS {
            let what = format!("only {} cells show a white sheet", kept.len());
            let remedy = "the sheet should fill the picture, evenly white beside the printed strip";
            return Err(CalibrateError::target(self.session.manifest_path(), what, remedy));
        }
        Ok(kept)
    }

    /// Every light of the rig must have been photographed.
    fn check_complete(&self) -> Result<(), CalibrateError> {
        let missing: Vec<usize> =
            (0..self.lights).filter(|l| self.of_light(*l).next().is_none()).collect();
        if !missing.is_empty() {
            let what = format!("no frame of light {missing:?}");
            let remedy = "photograph this sheet under every light of the rig";
            return Err(CalibrateError::target(self.session.manifest_path(), what, remedy));
        }
        Ok(())
    }

    /// The level of the brightest light; a dead one is an error.
    fn check_levels(&self, cells: &[usize]) -> Result<f64, CalibrateError> {
        let place = || self.session.manifest_path();
        let levels: Vec<f64> = (0..self.lights).map(|l| self.level(l, cells)).collect();
        let brightest = levels.iter().copied().fold(0.0, f64::max);
        let mut sorted = levels.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let typical = sorted[sorted.len() / 2];
        if let Some(dead) =
            levels.iter().position(|level| level.is_nan() || *level < DEAD * typical)
        {
            let what = format!("light {dead} is dark");
            let remedy = "check the LED, its wire and its channel in the rig file, and photograph this sheet again";
            return Err(CalibrateError::target(place(), what, remedy));
        }
        Ok(brightest)
    }

    /// Some light must be there at all: nothing can be said of a black picture, and least that it shows no sheet.
    fn check_lit(&self, cells: usize) -> Result<(), CalibrateError> {
        let cells: Vec<usize> = (0..cells).collect();
        let brightest = (0..self.lights).map(|l| self.level(l, &cells)).fold(0.0, f64::max);
        let ambient = self.frames.iter().filter(|frame| frame.light.is_none());
        let ambient = ambient
            .flat_map(|frame| frame.cells.iter().map(|cell| cell.value[1] / frame.usable_share))
            .filter(|v| v.is_finite())
            .fold(0.0, f64::max);
        levels::check_lit(&self.session.manifest_path(), brightest, ambient)
    }

    /// Frames of one light at several exposures must agree on how bright it is.
    fn check_exposures(&self, cells: usize) -> Result<(), CalibrateError> {
        let entries = || self.frames.iter().zip(&self.session.frames);
        for (k, (a, first)) in entries().enumerate() {
            let others = entries().skip(k + 1).filter(|(b, _)| {
                a.light.is_some() && b.light == a.light && !(a.drift_check || b.drift_check)
            });
            for (b, second) in others {
                let clean = (0..cells).filter(|c| {
                    a.cells[*c].saturated + b.cells[*c].saturated == 0.0
                        && a.cells[*c].value[1].min(b.cells[*c].value[1]) > levels::LEAST_SIGNAL
                });
                let mut ratios: Vec<f64> =
                    clean.map(|c| self.signal(b, c)[1] / self.signal(a, c)[1]).collect();
                ratios.sort_unstable_by(f64::total_cmp);
                let Some(ratio) = ratios.get(ratios.len() / 2).copied() else { continue };
                let files = [&first.file, &second.file];
                let place = self.session.manifest_path();
                levels::check_agree(&place, files, b.exposure / a.exposure, ratio)?;
            }
        }
        Ok(())
    }

    fn check_saturation(&self, cells: usize) -> Result<(), CalibrateError> {
        for light in 0..self.lights {
            let share = |frame: &Averaged| {
                frame.cells.iter().map(|cell| cell.saturated).sum::<f64>() / cells as f64
            };
            let least = self.of_light(light).map(share).fold(f64::INFINITY, f64::min);
            if least > OVEREXPOSED {
                let what =
                    format!("light {light} overexposes {:.0} % of the picture", 100.0 * least);
                let remedy = "shorten the exposure until the brightest light reaches 50 to 90 % of full scale, and photograph this sheet again";
                return Err(CalibrateError::target(self.session.manifest_path(), what, remedy));
            }
        }
        Ok(())
    }

    /// Share of full scale (or of what lies below the clipping) that a light's brightest cells reach (99th percentile) in its
    /// brightest frame.
    fn level(&self, light: usize, cells: &[usize]) -> f64 {
        let of_frame = |frame: &Averaged| {
            let mut values: Vec<f64> = cells
                .iter()
                .map(|k| self.signal(frame, *k)[1] * frame.exposure / frame.usable_share)
                .filter(|v| v.is_finite())
                .collect();
            values.sort_unstable_by(f64::total_cmp);
            values.get((values.len() * 99) / 100).copied().unwrap_or(f64::NAN)
        };
        self.of_light(light).map(of_frame).fold(f64::NAN, f64::max)
    }

    /// The first frame repeated last.
    fn check_drift(&self, cells: &[(usize, Cell)], warnings: &mut Vec<String>) {
        for repeated in self.frames.iter().filter(|frame| frame.drift_check) {
            let Some(light) = repeated.light else { continue };
            let first = self.of_light(light).min_by(|a, b| {
                (a.exposure - repeated.exposure)
                    .abs()
                    .total_cmp(&(b.exposure - repeated.exposure).abs())
            });
            let Some(first) = first else { continue };
            let ratio =
                |(k, _): &(usize, Cell)| self.signal(repeated, *k)[1] / self.signal(first, *k)[1];
            let mut ratios: Vec<f64> = cells.iter().map(ratio).filter(|r| r.is_finite()).collect();
            ratios.sort_unstable_by(f64::total_cmp);
            let drift = ratios.get(ratios.len() / 2).map_or(0.0, |ratio| ratio - 1.0);
            if drift.abs() > DRIFT {
                warnings.push(format!(
                    "{}: light {light} drifted by {:+.2} % during the capture session; let the LEDs warm up and photograph this sheet again",
                    self.session.name,
                    100.0 * drift
                ));
            }
        }
    }
}

/// What to change of an exposure whose brightest light reaches `brightest` of full scale; nothing where that is good.
pub(super) fn exposure_advice(name: &str, brightest: f64) -> Option<String> {
    let percent = 100.0 * brightest;
    if brightest > GOOD_LEVEL[1] {
        return Some(format!(
            "{name}: the brightest light reaches {percent:.0} % of full scale, close to clipping; expose {:.1} times shorter",
            brightest / AIM_LEVEL
        ));
    }
    (brightest < GOOD_LEVEL[0]).then(|| {
        format!(
            "{name}: the brightest light reaches {percent:.0} % of full scale; expose {:.1} times longer (50 to 90 % is best)",
            AIM_LEVEL / brightest
        )
    })
}

/// Fewest cells that carry a fit.
const LEAST_CELLS: usize = 60;

/// Angle of a sheet from the table, degrees, and its height at the origin, millimetres.
pub(super) fn tilt_and_height(plane: &Plane) -> (f64, f64) {
    let tilt = plane.normal.angle(&Vector3::z_axis()).to_degrees();
    (tilt, plane.normal.dot(&plane.point_mm.coords) / plane.normal.z)
}
