//! The folders of one rig: everything that belongs to it lies beside its `rig.toml`.

use crate::names::Taken;
use std::path::{Path, PathBuf};
use weavelight::instrument::{Calibration, Rig};
use weavelight::solution::{REPORT_JSON, Report};

/// Name of the rig's file.
pub const RIG_FILE: &str = "rig.toml";

/// A rig and its folders.
#[derive(Clone, Debug)]
pub struct Place {
    /// The folder.
    pub folder: PathBuf,
    /// What `rig.toml` says.
    pub rig: Rig,
}

impl Place {
    /// Opens the folder of a rig, or the rig's file itself.
    ///
    /// # Errors
    /// Where there is no rig, or it cannot be read.
    pub fn open(path: &Path) -> Result<Self, weavelight::files::FileError> {
        let file = if path.is_dir() { path.join(RIG_FILE) } else { path.to_owned() };
        let rig = Rig::load(&file)?;
        let folder = file.parent().unwrap_or(Path::new(".")).to_owned();
        Ok(Self { folder, rig })
    }

    /// The rig's file.
    pub fn rig_file(&self) -> PathBuf {
        self.folder.join(RIG_FILE)
    }

    /// The calibration in use.
    pub fn calibration(&self) -> PathBuf {
        self.folder.join("calibration")
    }

    /// Whether maps can be made: lights are measured.
    pub fn is_calibrated(&self) -> bool {
        self.calibration().join(weavelight::instrument::LIGHTS_FILE).exists()
    }

    /// The folder of a scan, as this rig's paths are written where it is one of its scans.
    pub fn as_ours(&self, scan: &Path) -> PathBuf {
        let ours = scan.parent().is_some_and(|parent| same(parent, &self.scans()));
        let name = scan.file_name().filter(|_| ours);
        name.map_or_else(|| scan.to_owned(), |name| self.scans().join(name))
    }

    /// Age of the oldest part of the calibration, days; `None` where there is none that can be read.
    pub fn calibration_age_days(&self) -> Option<i64> {
        Calibration::load(&self.calibration()).ok().as_ref().and_then(age_days)
    }

    /// Capture sessions of calibration targets.
    pub fn targets(&self) -> PathBuf {
        self.folder.join("targets")
    }

    /// Capture sessions of swatches.
    pub fn scans(&self) -> PathBuf {
        self.folder.join("scans")
    }

    /// Solutions of swatches.
    pub fn solutions(&self) -> PathBuf {
        self.folder.join("solutions")
    }

    /// The names that scans have; and solutions, since a new scan must not take the place of one whose scan is gone.
    pub fn taken(&self) -> Taken {
        Taken::read(&[self.scans(), self.solutions()])
    }

    /// The solution of a capture session. That of a capture session from elsewhere never takes the place of another's: it is
    /// numbered on.
    pub fn solution(&self, scan: &Path) -> PathBuf {
        let name = scan.file_name().unwrap_or_default();
        let solution = self.solutions().join(name);
        let ours = |scan: &Path| scan.parent().is_some_and(|parent| same(parent, &self.scans()));
        if ours(scan) {
            return solution;
        }
        let name = name.to_string_lossy().into_owned();
        let numbered = (2..).map(|k| self.solutions().join(format!("{name}~{k}")));
        let is_free = |path: &PathBuf| {
            let of_a_scan = path.file_name().is_some_and(|name| self.scans().join(name).exists());
            !of_a_scan && (!path.exists() || is_solution_of(path, scan))
        };
        std::iter::once(solution.clone()).chain(numbered).find(is_free).unwrap_or(solution)
    }

    /// Every solution of a capture session that lies among those of this rig, the newest last.
    pub fn solutions_of(&self, scan: &Path) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.solutions()).into_iter().flatten().flatten();
        let own = self.solution(scan);
        let mut found: Vec<PathBuf> = entries
            .map(|entry| entry.path())
            .filter(|path| path.join(REPORT_JSON).exists())
            .filter(|path| *path == own || is_solution_of(path, scan))
            .collect();
        let made = |path: &PathBuf| {
            path.join(REPORT_JSON).metadata().and_then(|metadata| metadata.modified()).ok()
        };
        found.sort_by_key(made);
        found
    }
}

/// Whether a solution says that it was made from this capture session.
fn is_solution_of(solution: &Path, scan: &Path) -> bool {
    let report = Report::read(&solution.join(REPORT_JSON)).ok();
    let folders = report.and_then(|report| report.folders);
    folders.is_some_and(|folders| same(Path::new(&folders.session), scan))
}

/// Whether two paths are one folder.
pub fn same(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    a == b || real(a).zip(real(b)).is_some_and(|(a, b)| a == b)
}

/// Age of a calibration's oldest part, days; `None` where none says when it was made.
pub fn age_days(calibration: &Calibration) -> Option<i64> {
    let of = &calibration.provenance;
    let parts = [of.camera.as_ref(), of.color.as_ref(), of.lights.as_ref()];
    let oldest = parts.into_iter().flatten().filter_map(|part| part.created).min()?;
    Some(jiff::Timestamp::now().duration_since(oldest).as_hours() / 24)
}
