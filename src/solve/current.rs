//! What is up to date is not made again: a solution remembers the hash of everything it was made from.

use crate::files::{FileError, Input, PROGRAM, sha256_hex, sha256_of_file};
use crate::gpu::Device;
use crate::instrument::{CAMERA_FILE, COLOR_FILE, DEFECTS_FILE, LIGHTS_FILE};
use crate::session::{Session, SessionError};
use crate::solution::{
    self, Grid, MASK_INPUT, NormalY, REPORT_JSON, Report, ResidualFile, Residuals,
};
use crate::solve::output::encode::map_files;
use crate::solve::{Options, SolveError};
use crate::swatch::MaskChoice;
use rayon::prelude::*;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The revision of the solve. Raise it in every change after which the same inputs give other maps, be it in a kernel, in the
/// noise estimate, in what is left out or in how files are encoded: solutions of earlier revisions are then made again. The
/// golden test (`tests/golden.rs`) fails where a map changed and this did not.
pub(crate) const REVISION: u32 = 4;

/// The inputs of a solve as they were when it began.
pub(crate) struct Inputs {
    /// Manifest, calibration files and mask, with the names that the report gives them.
    named: Vec<(PathBuf, Input)>,
    /// Frames of which the manifest has no hash, by place in it.
    frames: Vec<(usize, String)>,
}

impl Inputs {
    /// Hashes everything that a solve reads, except frames whose hash the manifest has.
    pub(crate) fn of(options: &Options, session: &Session) -> Result<Self, FileError> {
        let folder = &options.calibration;
        let mut files = vec![session.manifest_path()];
        files.extend(calibration_files(folder)?);
        let mut names: Vec<String> = files.iter().map(|path| file_name(path)).collect();
        if let Some(mask) = options.mask.file(session) {
            names.push(format!("{MASK_INPUT}{}", file_name(&mask)));
            files.push(mask);
        }
        let named = files.into_par_iter().zip(names).map(|(path, name)| {
            let sha256 = sha256_of_file(&path)?;
            Ok((path, Input { name, sha256 }))
        });
        let unhashed = session.frames.par_iter().enumerate();
        let unhashed = unhashed.filter(|(_, frame)| frame.sha256.is_none());
        let frames = unhashed
            .map(|(k, frame)| sha256_of_file(&session.frame_path(frame)).map(|hash| (k, hash)));
        Ok(Self {
            named: named.collect::<Result<_, FileError>>()?,
            frames: frames.collect::<Result<_, FileError>>()?,
        })
    }

    /// For the report.
    pub(crate) fn for_report(&self) -> Vec<Input> {
        self.named.iter().map(|(_, input)| input.clone()).collect()
    }

    /// The capture session with a hash for every frame, so that what is read is what was hashed.
    pub(crate) fn sealed(&self, session: &Session) -> Session {
        let mut sealed = session.clone();
        for (k, hash) in &self.frames {
            sealed.frames[*k].sha256 = Some(hash.clone());
        }
        sealed
    }

    /// The error of reading a sealed capture session: a frame without a hash of its own was altered meanwhile.
    pub(crate) fn error_of(&self, session: &Session, error: SolveError) -> SolveError {
        match error {
            SolveError::Session(SessionError::FrameAltered { path, .. })
                if self
                    .frames
                    .iter()
                    .any(|(k, _)| session.frame_path(&session.frames[*k]) == path) =>
            {
                SolveError::Changing { path }
            }
            error => error,
        }
    }

    /// Sees that what was read since is what was hashed.
    ///
    /// # Errors
    /// The first file that changed.
    pub(crate) fn still_the_same(&self, session: &Session) -> Result<(), SolveError> {
        for (path, input) in &self.named {
            if sha256_of_file(path)? != input.sha256 {
                return Err(SolveError::Changing { path: path.clone() });
            }
        }
        // Read before it was hashed.
        match Session::load(&session.folder)? == *session {
            true => Ok(()),
            false => Err(SolveError::Changing { path: session.manifest_path() }),
        }
    }

    /// Hash of inputs and settings together: the program's version and the solve's revision, the settings, the manifest (which
    /// holds the frames' hashes), frames whose hash it lacks, the calibration's files and the mask. Which maps are made is no
    /// part of it: it does not change them.
    pub(crate) fn key(&self, options: &Options) -> String {
        let mut text = settings(options);
        let named = self.named.iter().map(|(_, input)| (&input.name, &input.sha256));
        for (name, hash) in named {
            // Writing to a string cannot fail.
            let _ = write!(text, "\n{name} {hash}");
        }
        for (k, hash) in &self.frames {
            let _ = write!(text, "\nframe {k} {hash}");
        }
        sha256_hex(text.as_bytes())
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Everything besides the inputs that changes a map, by names that do not change with the code.
fn settings(options: &Options) -> String {
    let method = options.method.name();
    let grid = match options.grid {
        Grid::Sensor => "sensor",
        Grid::Undistorted => "undistorted",
    };
    let normal_y = match options.normal_y {
        NormalY::Up => "up",
        NormalY::Down => "down",
    };
    let mask = if options.mask == MaskChoice::Found { "found" } else { "given" };
    // Who solves without being named must not matter; one that is asked for by name is to be asked.
    let device = if matches!(options.device, Device::Gpu) { "gpu" } else { "any" };
    let residuals = if options.residuals == Residuals::Write { "written" } else { "left" };
    let scale = options.scale as usize;
    let albedo = options.albedo.name();
    let level = options.reference_lab.map_or_else(String::new, |lab| format!(", level {lab:?}"));
    format!(
        "{PROGRAM}, solve {REVISION}: method {method}, grid {grid}, normal-y {normal_y}, scale {scale}, mask {mask}, device {device}, residuals {residuals}, albedo {albedo}{level}"
    )
}

/// The calibration's files and its gain maps, by name.
fn calibration_files(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let failed = |source| FileError::read(folder, source);
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut paths = entries
        .map(|entry| Ok(entry.map_err(failed)?.path()))
        .collect::<Result<Vec<_>, FileError>>()?;
    paths.retain(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        path.is_file()
            && ([CAMERA_FILE, COLOR_FILE, DEFECTS_FILE, LIGHTS_FILE].contains(&&*name)
                || name.ends_with(".exr"))
    });
    paths.sort();
    Ok(paths)
}

/// The report of the solution that stands at the output's place, if it has every map that is asked for and this key, and
/// every frame still is what the manifest says; with the page, where one is asked for.
pub(crate) fn still_current(
    options: &Options,
    key: &str,
    session: &Session,
    with_page: bool,
) -> Option<Report> {
    let report = Report::read(&options.out.join(REPORT_JSON)).ok()?;
    let there = |name: &&str| options.out.join(name).is_file();
    let page = with_page.then_some(solution::REPORT_HTML);
    let whole = map_files(options.outputs).iter().chain(&page).all(there);
    let residual = |file: &ResidualFile| options.out.join(&file.file).is_file();
    let same = whole && report.residuals.iter().all(residual) && report.key.as_deref() == Some(key);
    // Of a frame that was altered, reading it will tell.
    let unaltered =
        same && session.frames.par_iter().all(|frame| session.read_frame(frame).is_ok());
    unaltered.then_some(report)
}
