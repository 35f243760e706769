//! The folders of one rig: everything that belongs to it lies beside its `rig.toml`.

use crate::model::names::ScanNames;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use weavelight::calibrate::wizard::RigFolder;
use weavelight::solution::{REPORT_JSON, Report};

/// A rig's folder with its scans and their solutions. Everything about the rig and its calibration is in [`RigFolder`].
#[derive(Clone, Debug)]
pub struct Project(RigFolder);

impl Deref for Project {
    type Target = RigFolder;

    fn deref(&self) -> &RigFolder {
        &self.0
    }
}

impl Project {
    /// Opens the folder of a rig, or the rig's file itself.
    ///
    /// # Errors
    /// Where there is no rig, or it cannot be read.
    pub fn open(path: &Path) -> Result<Self, weavelight::files::FileError> {
        Ok(Self(RigFolder::open(path)?))
    }

    /// The folder of a scan, as this rig's paths are written where it is one of its scans.
    pub fn as_ours(&self, scan: &Path) -> PathBuf {
        let ours = scan.parent().is_some_and(|parent| same(parent, &self.scans()));
        let name = scan.file_name().filter(|_| ours);
        name.map_or_else(|| scan.to_owned(), |name| self.scans().join(name))
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
    pub fn names(&self) -> ScanNames {
        ScanNames::read(&[self.scans(), self.solutions()])
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
