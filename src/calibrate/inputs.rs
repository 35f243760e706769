//! What a command is given: capture sessions of one kind, each with pictures and each once.

use super::CalibrateError;
use crate::files::Setting;
use crate::raw::{Frame, Samples};
use crate::session::{FrameEntry, Kind, Session};
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Loads capture sessions that must all be of `kind`, hold frames whose files are there, and differ.
///
/// # Errors
/// The first one that cannot serve, with what to do.
pub(super) fn load_all(paths: &[PathBuf], kind: Kind) -> Result<Vec<Session>, CalibrateError> {
    if paths.is_empty() {
        let remedy = format!("name at least one capture session of kind \"{}\"", name_of(kind));
        return Err(CalibrateError::target(".", "no capture session was given", remedy));
    }
    let sessions: Vec<Session> =
        paths.iter().map(|path| load(path, kind)).collect::<Result<_, _>>()?;
    let mut folders = HashMap::new();
    for session in &sessions {
        let folder = std::fs::canonicalize(&session.folder).unwrap_or(session.folder.clone());
        if folders.insert(folder, ()).is_some() {
            let remedy = "list every capture session once";
            return Err(CalibrateError::target(session.manifest_path(), "is given twice", remedy));
        }
    }
    Ok(sessions)
}

/// Loads one.
///
/// # Errors
/// Where it cannot serve.
pub(super) fn load(path: &Path, kind: Kind) -> Result<Session, CalibrateError> {
    let session = Session::load(path)?;
    let place = session.manifest_path();
    if session.kind != kind {
        return Err(CalibrateError::WrongKind { session: place, expected: name_of(kind) });
    }
    if session.frames.is_empty() {
        let target = match kind {
            Kind::Board => "a board",
            Kind::White => "a white sheet",
            Kind::Grey => "a chart",
            Kind::Swatch => "a fabric",
        };
        let remedy = format!("photograph one: a scan with {} {}", Setting("kind"), name_of(kind));
        return Err(CalibrateError::target(place, format!("no picture of {target}"), remedy));
    }
    session.check_files()?;
    Ok(session)
}

fn name_of(kind: Kind) -> &'static str {
    match kind {
        Kind::Board => "board",
        Kind::White => "white",
        Kind::Grey => "grey",
        Kind::Swatch => "swatch",
    }
}

/// A place that can become a calibration folder.
///
/// # Errors
/// Where a file stands there.
pub(super) fn check_out(out: &Path) -> Result<(), CalibrateError> {
    if out.exists() && !out.is_dir() {
        let remedy = format!("give a calibration folder as {}", Setting("out"));
        return Err(CalibrateError::target(out, "is a file", remedy));
    }
    Ok(())
}

/// A number of all samples of a frame: two pictures of one thing never agree in every sample, a copy does, whatever its file
/// says beside them.
pub(super) fn fingerprint(frame: &Frame) -> u64 {
    let mut hasher = DefaultHasher::new();
    (frame.width, frame.height).hash(&mut hasher);
    match &frame.samples {
        Samples::U16(samples) => samples.hash(&mut hasher),
        Samples::F32(samples) => samples.iter().for_each(|v| v.to_bits().hash(&mut hasher)),
    }
    hasher.finish()
}

/// No picture may stand for two lights. `fingerprints`: in the order of the session's frames.
///
/// # Errors
/// The first two frames of different lights that hold one picture.
pub(super) fn no_copies(session: &Session, fingerprints: &[u64]) -> Result<(), CalibrateError> {
    let mut first: HashMap<u64, &FrameEntry> = HashMap::new();
    for (entry, fingerprint) in session.frames.iter().zip(fingerprints) {
        let Some(light) = entry.light else { continue };
        let earlier = *first.entry(*fingerprint).or_insert(entry);
        if earlier.light != entry.light {
            let what = format!(
                "{} and {} hold the same picture, for light {} and light {light}",
                earlier.file.display(),
                entry.file.display(),
                earlier.light.unwrap_or_default()
            );
            let remedy = "one is a copy: photograph every light by itself";
            return Err(CalibrateError::target(session.manifest_path(), what, remedy));
        }
    }
    Ok(())
}

/// No two capture sessions may hold the same pictures: they would count twice.
///
/// # Errors
/// The first two that do.
pub(super) fn no_copied_sessions(
    sessions: &[Session],
    fingerprints: &[Vec<u64>],
) -> Result<(), CalibrateError> {
    let mut first: HashMap<u64, usize> = HashMap::new();
    for (k, session) in sessions.iter().enumerate() {
        let lit = session.frames.iter().zip(&fingerprints[k]).filter(|(f, _)| f.light.is_some());
        for (entry, fingerprint) in lit {
            let earlier = *first.entry(*fingerprint).or_insert(k);
            if earlier != k {
                let what = format!(
                    "{} is the same picture as in {}",
                    entry.file.display(),
                    sessions[earlier].manifest_path().display()
                );
                let remedy = "leave the copy out, or photograph this sheet at its own pose";
                return Err(CalibrateError::target(session.manifest_path(), what, remedy));
            }
        }
    }
    Ok(())
}

/// Where the exposure that the manifest states is not the one in the frame's own file: a sentence for the first such frame.
pub(super) fn exposure_warning(
    session: &Session,
    entry: &FrameEntry,
    frame: &Frame,
) -> Option<String> {
    let (exposure_s, iso) = (frame.metadata.exposure_s?, frame.metadata.iso.unwrap_or(entry.iso));
    let ratio = exposure_s * iso / (entry.exposure_s * entry.iso);
    // Cameras write 1/30 for 1/32.
    (ratio.is_finite() && ratio > 0.0 && !(0.85..1.18).contains(&ratio)).then(|| {
        format!(
            "{}: session.toml says that {} was exposed {} s at ISO {}, the file says {exposure_s} s at ISO {iso}; correct the wrong one",
            session.name,
            entry.file.display(),
            entry.exposure_s,
            entry.iso
        )
    })
}
