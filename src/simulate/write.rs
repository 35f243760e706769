//! Frames and their manifest.

use super::{Instrument, SimulateError};
use crate::files::{FileError, PROGRAM, sha256_hex};
use crate::session::{FrameEntry, Session};
use rayon::prelude::*;
use std::path::Path;
use weavelight_sim::dng::Dng;
use weavelight_sim::render::Frames;

/// One picture as the manifest will describe it.
pub(super) struct Picture {
    /// The file's name without its ending.
    pub(super) stem: String,
    pub(super) light: Option<usize>,
    pub(super) exposure_s: f64,
    pub(super) pose: Option<String>,
    pub(super) drift_check: bool,
}

impl Picture {
    pub(super) fn new(stem: String, light: Option<usize>, exposure_s: f64) -> Self {
        Self { stem, light, exposure_s, pose: None, drift_check: false }
    }
}

/// Pictures with their raw numbers.
pub(super) struct Pictures {
    pub(super) pictures: Vec<Picture>,
    pub(super) frames: Frames,
    /// Number of the part: its place in the simulated day.
    pub(super) part: usize,
}

const ISO: f64 = 100.0;
/// When the simulated day begins, seconds since 1970: fixed, so that the same seed gives the same bytes.
const DAY_BEGINS_S: i64 = 1_767_261_600; // 2026-01-01 10:00 UTC
/// Time for one part and for one frame.
const PART_S: i64 = 600;
const FRAME_S: i64 = 3;

/// Writes the frames and then the manifest with their hashes.
pub(super) fn write_session(
    mut session: Session,
    pictures: Pictures,
    instrument: &Instrument,
) -> Result<(), SimulateError> {
    let folder = session.folder.clone();
    std::fs::create_dir_all(&folder).map_err(|source| FileError::write(&folder, source))?;
    let begin_s = DAY_BEGINS_S + PART_S * pictures.part as i64;
    session.captured = jiff::Timestamp::from_second(begin_s).ok();
    let work: Vec<(usize, (Picture, Vec<u16>))> =
        pictures.pictures.into_iter().zip(pictures.frames).enumerate().collect();
    let entries: Result<Vec<FrameEntry>, FileError> = work
        .into_par_iter()
        .map(|(k, (picture, samples))| {
            let taken = jiff::Timestamp::from_second(begin_s + FRAME_S * k as i64).ok();
            write_frame(&folder, picture, &samples, taken, instrument)
        })
        .collect();
    session.frames = entries?;
    session.save()?;
    Ok(())
}

fn write_frame(
    folder: &Path,
    picture: Picture,
    samples: &[u16],
    captured: Option<jiff::Timestamp>,
    instrument: &Instrument,
) -> Result<FrameEntry, FileError> {
    let name = format!("{}.dng", picture.stem);
    let path = folder.join(&name);
    let failed = |source| FileError::write(&path, source);
    let bytes = instrument.encode(samples, picture.exposure_s, ISO, captured).map_err(failed)?;
    std::fs::write(&path, &bytes).map_err(failed)?;
    Ok(FrameEntry {
        sha256: Some(sha256_hex(&bytes)),
        captured,
        pose: picture.pose,
        drift_check: picture.drift_check,
        ..FrameEntry::new(name, picture.light, picture.exposure_s, ISO)
    })
}

impl Instrument {
    /// A frame's DNG file: what a camera of this kind would hand over.
    ///
    /// # Errors
    /// Where the samples do not fill the frame.
    pub fn encode(
        &self,
        samples: &[u16],
        exposure_s: f64,
        iso: f64,
        captured: Option<jiff::Timestamp>,
    ) -> std::io::Result<Vec<u8>> {
        let [width, height] = self.size_px();
        let optics = self.optics();
        let name = optics.camera_model.as_deref().unwrap_or_default();
        let (make, model) = name.split_once(' ').unwrap_or(("Weavelight", name));
        let date_time =
            captured.map_or_else(String::new, |at| at.strftime("%Y:%m:%d %H:%M:%S").to_string());
        let dng = Dng {
            width,
            height,
            samples,
            cfa: self.stage.cfa,
            black: self.sensor.black,
            white: self.sensor.saturation,
            make,
            model,
            software: PROGRAM,
            date_time: &date_time,
            exposure_s,
            iso,
            focal_length_mm: optics.focal_length_mm.unwrap_or(0.0),
            lens: optics.lens.as_deref().unwrap_or_default(),
            neutral: self.neutral(),
            camera_from_xyz: self.camera_from_xyz(),
        };
        let mut bytes = Vec::with_capacity(samples.len() * 2 + 4096);
        dng.write(&mut bytes)?;
        Ok(bytes)
    }
}
