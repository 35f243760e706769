//! The simulated rig's folders: what a user of the real rig would have after photographing a fabric and every
//! calibration target, and the truth beside it.
//!
//! `--out DIR` then holds `rig.toml` (what the technician knows), `scene.toml` (what the simulated camera sees in a scan), `calibration/` (the truth), `board/`, `grey/`,
//! `white-flat/`, `white-raised/`, `white-tilt-N/`, `swatch/` and `truth/` (unit mean normal, mean albedo and mean height
//! over each photosite's footprint, on the sensor's own grid; heights count from the swatch's plane).

mod error;
mod instrument;
mod options;
mod parts;
mod scene;
mod table;
mod targets;
mod truth;
mod write;

pub use error::SimulateError;
pub use instrument::Instrument;
pub use options::{Flaws, Material, Options, Part, Targets};
pub use scene::{SCENE_FILE, Scene};
pub use table::{Laid, Lying, lay};

use crate::files::{FileError, OutputKind, Setting, StagedFolder, check_owned};
use crate::machine::check_memory;
use parts::Studio;
use std::path::PathBuf;

/// A folder that `simulate` writes, and may replace.
const OUTPUT: OutputKind = OutputKind { name: "simulation", marker: Some("rig.toml") };

/// What was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The folder.
    pub out: PathBuf,
    /// Folders of the capture sessions in it, by name.
    pub sessions: Vec<String>,
    /// Frames in them, all together.
    pub frames: usize,
    /// Size of a frame.
    pub size_px: [usize; 2],
    /// Exposure of the swatch in seconds at ISO 100, if there is one.
    pub swatch_exposure_s: Option<f64>,
}

/// Writes a simulated rig's folders. `progress` gets the share done (0..1) and what is being made, possibly from several
/// threads. The folder appears under its name only when whole; an earlier simulation of that name is replaced.
///
/// # Errors
/// Where the rig cannot be read, an option makes no sense, nothing could be lit or exposed, or `out` cannot be written.
pub fn run(
    options: &Options,
    progress: &(dyn Fn(f64, &str) + Sync),
) -> Result<Summary, SimulateError> {
    options.check()?;
    let instrument = Instrument::from_options(options)?;
    check_room(options, &instrument)?;
    let staged = StagedFolder::create(&options.out, OUTPUT)?;
    instrument.write(options, staged.path())?;
    let studio = Studio { options, instrument: &instrument, folder: staged.path() };
    let mut summary = Summary {
        out: options.out.clone(),
        sessions: Vec::new(),
        frames: 0,
        size_px: instrument.size_px(),
        swatch_exposure_s: None,
    };
    let parts = studio.parts();
    for (k, part) in parts.iter().enumerate() {
        let done = |share: f64| progress((k as f64 + share) / parts.len() as f64, &part.name);
        done(0.0);
        let written = studio.photograph(part, &done)?;
        summary.frames += written.frames;
        if part.part == Part::Swatch {
            summary.swatch_exposure_s = Some(written.exposure_s);
        }
        summary.sessions.push(part.name.clone());
    }
    staged.commit()?;
    progress(1.0, "done");
    Ok(summary)
}

/// Bytes a photosite of the truth, and of a frame that is being encoded.
const TRUTH_BYTES_PER_PX: u64 = 40;

/// The frames of one capture session are held until all are exposed.
fn check_room(options: &Options, instrument: &Instrument) -> Result<(), SimulateError> {
    let [width, height] = instrument.size_px();
    // A grey chart has one light at several exposures beside all at one.
    let frames = (instrument.stage.lights.len() + 12).max(options.targets.boards) as u64;
    let bytes = (width * height) as u64 * (2 * frames + TRUTH_BYTES_PER_PX);
    let what = || format!("simulating {frames} frames of {width} x {height}");
    Ok(check_memory(
        what,
        bytes,
        format!("give a smaller {}, or close other programs", Setting("size")),
    )?)
}

/// Writes only what a technician has before the first picture, `rig.toml`, and the `scene.toml` that the simulated camera
/// looks at, into the folder `options.out` (made where absent; what else is in it stays).
///
/// # Errors
/// As [`run`], or where one of the two stands there already.
pub fn write_rig(options: &Options) -> Result<(), SimulateError> {
    options.check()?;
    let folder = &options.out;
    std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
    for name in ["rig.toml", SCENE_FILE] {
        check_owned(&folder.join(name))?;
    }
    Instrument::from_options(options)?.write_rig(options, folder)
}

#[cfg(test)]
mod tests;
