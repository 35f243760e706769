//! What is up to date is not made again: a solution remembers the hash of everything it was made from.

use super::encode::map_files;
use super::{Device, MaskChoice, Options, Residuals, SolveError};
use crate::files::{FileError, PROGRAM, sha256_hex, sha256_of_file};
use crate::instrument::{CAMERA_FILE, COLOR_FILE, Calibration, DEFECTS_FILE, LIGHTS_FILE};
use crate::session::Session;
use crate::solution::{self, REPORT_JSON, Report, ResidualFile};
use rayon::prelude::*;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Hash of inputs and settings together: the program's version, the settings, the manifest (which holds the frames'
/// hashes), frames whose hash it lacks, the calibration's files and the mask. Which maps are made is no part of it: it does
/// not change them.
pub(crate) fn key(
    options: &Options,
    session: &Session,
    calibration: &Calibration,
) -> Result<String, SolveError> {
    let Options { method, grid, normal_y, scale, .. } = options;
    let found = options.mask == MaskChoice::Found;
    let mut text = format!("{PROGRAM} {method:?} {grid:?} {normal_y:?} {scale:?} {found}");
    // Who solves without being named must not matter; one that is asked for by name is to be asked.
    if matches!(options.device, Device::Gpu) {
        text.push_str(" gpu");
    }
    if options.residuals == Residuals::Write {
        text.push_str(" residuals");
    }
    let unhashed = session.frames.iter().filter(|frame| frame.sha256.is_none());
    let mut files = vec![session.manifest_path()];
    files.extend(unhashed.map(|frame| session.frame_path(frame)));
    files.extend(calibration_files(&calibration.folder)?);
    files.extend(options.mask.file(session));
    let hashes: Vec<Result<String, FileError>> =
        files.par_iter().map(|path| sha256_of_file(path)).collect();
    for hash in hashes {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{}", hash?);
    }
    Ok(sha256_hex(text.as_bytes()))
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
