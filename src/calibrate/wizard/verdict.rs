//! The result of the check, saved beside its pictures, so that the next start still knows it.

use super::rig_folder::RigFolder;
use super::task::Pose;
use crate::calibrate::CheckReport;
use crate::files::{FileError, read_input_text, sha256_of_file, write_atomic};
use crate::instrument::LIGHTS_FILE;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The schema of the file that keeps a verdict.
const SCHEMA: i64 = 1;

/// Result of the check with a sheet that was not used for the fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    schema: i64,
    /// Of the lights that were checked: the verdict does not hold for others.
    lights_sha256: String,
    /// Whether the slope error is within the limit.
    pub passed: bool,
    /// Slope error, degrees, RMS over the sheet.
    pub slope_rms_deg: f64,
    /// The largest that passes.
    pub limit_deg: f64,
}

fn file(home: &RigFolder) -> PathBuf {
    home.targets().join(Pose::Check.folder()).join("verdict.toml")
}

fn lights_sha256(home: &RigFolder) -> Option<String> {
    sha256_of_file(&home.calibration().join(LIGHTS_FILE)).ok()
}

impl Verdict {
    /// Of a check of the calibration in use.
    pub fn of(report: &CheckReport, home: &RigFolder) -> Self {
        let worst = report.sheets.iter().map(|sheet| sheet.slope_rms_deg).fold(0.0, f64::max);
        Self {
            schema: SCHEMA,
            lights_sha256: lights_sha256(home).unwrap_or_default(),
            passed: report.passed,
            slope_rms_deg: worst,
            limit_deg: report.threshold_deg,
        }
    }

    /// Keeps it beside the pictures of the check.
    ///
    /// # Errors
    /// Where that cannot be written.
    pub fn keep(&self, home: &RigFolder) -> Result<(), FileError> {
        let text = toml::to_string(self).unwrap_or_default();
        write_atomic(&file(home), text.as_bytes())
    }

    /// The verdict on the lights in use, if they were checked. One that cannot be read counts as none: the check is repeated.
    pub fn load(home: &RigFolder) -> Option<Self> {
        let text = read_input_text(&file(home)).ok()?;
        let verdict: Self = toml::from_str(&text).ok()?;
        let current = verdict.schema == SCHEMA
            && Some(&verdict.lights_sha256) == lights_sha256(home).as_ref();
        current.then_some(verdict)
    }
}
