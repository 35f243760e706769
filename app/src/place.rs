//! The folders of one rig: everything that belongs to it lies beside its `rig.toml`.

use std::path::{Path, PathBuf};
use weavelight::instrument::{Calibration, Rig};

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

    /// The capture session of that name.
    pub fn scan(&self, name: &str) -> PathBuf {
        self.scans().join(folder_name(name))
    }

    /// The solution of a capture session.
    pub fn solution(&self, scan: &Path) -> PathBuf {
        self.folder.join("solutions").join(scan.file_name().unwrap_or_default())
    }
}

/// Age of a calibration's oldest part, days; `None` where none says when it was made.
pub fn age_days(calibration: &Calibration) -> Option<i64> {
    let of = &calibration.provenance;
    let parts = [of.camera.as_ref(), of.color.as_ref(), of.lights.as_ref()];
    let oldest = parts.into_iter().flatten().filter_map(|part| part.created).min()?;
    Some(jiff::Timestamp::now().duration_since(oldest).as_hours() / 24)
}

/// A swatch's name as a folder's: letters, digits, spaces and `-_.`; everything else becomes `-`.
pub fn folder_name(name: &str) -> String {
    let keep = |c: char| if c.is_alphanumeric() || " -_".contains(c) { c } else { '-' };
    let folder: String = name.trim().chars().map(keep).collect();
    if folder.is_empty() { "scan".to_owned() } else { folder }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_folders_that_stay_inside() {
        let check = |name: &str, expected: &str| assert_eq!(folder_name(name), expected);
        check("linen 4021", "linen 4021");
        check(" ../x/y ", "---x-y");
        check("", "scan");
        check("Köper №7", "Köper №7".replace('№', "-").as_str());
    }
}
