//! What a folder or file is that was opened or dropped into the window: people name any of a rig's.

use crate::model::project::{Project, same};
use std::path::{Path, PathBuf};
use weavelight::calibrate::wizard::RIG_FILE;
use weavelight::instrument::{CAMERA_FILE, COLOR_FILE, LIGHTS_FILE};
use weavelight::session::{Kind, MANIFEST, Session};
use weavelight::solution::REPORT_JSON;

/// What lies somewhere.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum What {
    /// A solution.
    Solution(PathBuf),
    /// A capture session, of a swatch or whatever cannot be read.
    Scan(PathBuf),
    /// A capture session of a calibration target.
    Target(PathBuf),
    /// A rig.
    Rig(PathBuf),
    /// A calibration; the rig that it belongs to, if it lies beside one.
    Calibration(PathBuf, Option<PathBuf>),
    /// Nothing that the program knows.
    Other(PathBuf),
}

/// Folders of a rig that hold further ones.
const COLLECTIONS: [&str; 4] = ["scans", "solutions", "targets", "history"];

impl What {
    /// Of a folder, or of a file in it.
    pub(crate) fn is(path: &Path) -> Self {
        match Self::of_folder(path) {
            // A file says what its folder is.
            None if path.is_file() => path.parent().and_then(Self::of_folder),
            found => found,
        }
        .unwrap_or_else(|| Self::Other(path.to_owned()))
    }

    fn of_folder(folder: &Path) -> Option<Self> {
        let has = |file: &str| folder.join(file).is_file();
        let above = || folder.parent().filter(|above| above.join(RIG_FILE).is_file());
        let owned = folder.to_owned();
        if has(REPORT_JSON) {
            return Some(Self::Solution(owned));
        }
        if has(MANIFEST) {
            let target = Session::load(folder).is_ok_and(|session| session.kind != Kind::Swatch);
            return Some(if target { Self::Target(owned) } else { Self::Scan(owned) });
        }
        if has(RIG_FILE) {
            return Some(Self::Rig(owned));
        }
        if [CAMERA_FILE, COLOR_FILE, LIGHTS_FILE].into_iter().any(has) {
            return Some(Self::Calibration(owned, above().map(Path::to_owned)));
        }
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let collection = COLLECTIONS.contains(&&*name);
        above().filter(|_| collection).map(|above| Self::Rig(above.to_owned()))
    }
}

/// The newest solution of a capture session: among those of the rig that is open, or of the rig that it lies in.
pub(crate) fn newest_solution(scan: &Path, project: Option<&Project>) -> Option<PathBuf> {
    let of_open = project.and_then(|project| project.solutions_of(scan).pop());
    of_open.or_else(|| rig_of(scan)?.solutions_of(scan).pop())
}

/// The rig that a capture session lies in: among its scans, or right beside the rig's file, as the simulator writes them.
pub(crate) fn rig_of(scan: &Path) -> Option<Project> {
    let scan = std::path::absolute(scan).ok()?;
    let mut above = scan.ancestors().skip(1).take(2);
    above.find_map(|folder| folder.join(RIG_FILE).is_file().then(|| Project::open(folder).ok())?)
}

/// Whether a rig is the one that is open.
pub(crate) fn is_open(folder: &Path, project: Option<&Project>) -> bool {
    project.is_some_and(|project| same(&project.folder, folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_files_are_known_by_what_lies_in_them() {
        let home = tempfile::tempdir().unwrap();
        let rig = home.path().join("rig");
        let make = |file: &str, text: &str| {
            let path = home.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        make("rig/rig.toml", "");
        make("rig/scans/a/session.toml", "schema = 1\nkind = \"swatch\"\n");
        make("rig/scans/a/light-00.dng", "");
        make("rig/targets/white/session.toml", "schema = 1\nkind = \"white\"\n");
        make("rig/solutions/a/report.json", "{}");
        make("rig/solutions/a/camera.toml", "");
        make("rig/calibration/lights.toml", "");
        make("elsewhere/calibration/camera.toml", "");
        make("pictures/cat.jpg", "");
        let check = |path: &str, expected: What| {
            assert_eq!(What::is(&home.path().join(path)), expected, "{path}");
        };
        let at = |path: &str| home.path().join(path);
        check("rig", What::Rig(rig.clone()));
        check("rig/rig.toml", What::Rig(rig.clone()));
        for collection in COLLECTIONS {
            std::fs::create_dir_all(rig.join(collection)).unwrap();
            check(&format!("rig/{collection}"), What::Rig(rig.clone()));
        }
        check("rig/scans/a", What::Scan(at("rig/scans/a")));
        check("rig/scans/a/light-00.dng", What::Scan(at("rig/scans/a")));
        check("rig/targets/white", What::Target(at("rig/targets/white")));
        check("rig/solutions/a", What::Solution(at("rig/solutions/a")));
        check("rig/solutions/a/camera.toml", What::Solution(at("rig/solutions/a")));
        check("rig/calibration", What::Calibration(at("rig/calibration"), Some(rig.clone())));
        let elsewhere = at("elsewhere/calibration");
        check("elsewhere/calibration/camera.toml", What::Calibration(elsewhere, None));
        for other in ["pictures", "pictures/cat.jpg", "nowhere", "rig/no such"] {
            check(other, What::Other(at(other)));
        }
    }
}
