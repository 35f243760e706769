//! What came of the check, kept beside its pictures: a window that is opened again knows it still.

use super::task::Pose;
use crate::place::Place;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use weavelight::calibrate::CheckReport;
use weavelight::files::{FileError, read_input_text, sha256_of_file, write_atomic};
use weavelight::instrument::LIGHTS_FILE;

/// The schema of the verdict's file that this version reads and writes.
const SCHEMA: i64 = 1;

/// What the sheet that the calibration has not seen says of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    schema: i64,
    /// Of the lights that were checked, so that it does not count for others.
    lights_sha256: String,
    /// Whether slopes were solved right.
    pub passed: bool,
    /// Slope error, degrees, RMS over the sheet.
    pub slope_rms_deg: f64,
    /// The largest that passes.
    pub limit_deg: f64,
}

fn file(place: &Place) -> PathBuf {
    place.targets().join(Pose::Check.folder()).join("verdict.toml")
}

fn lights_sha256(place: &Place) -> Option<String> {
    sha256_of_file(&place.calibration().join(LIGHTS_FILE)).ok()
}

impl Verdict {
    /// Of a check of the calibration in use.
    pub(super) fn of(report: &CheckReport, place: &Place) -> Self {
        let worst = report.sheets.iter().map(|sheet| sheet.slope_rms_deg).fold(0.0, f64::max);
        Self {
            schema: SCHEMA,
            lights_sha256: lights_sha256(place).unwrap_or_default(),
            passed: report.passed,
            slope_rms_deg: worst,
            limit_deg: report.threshold_deg,
        }
    }

    /// Keeps it beside the pictures of the check.
    ///
    /// # Errors
    /// Where that cannot be written.
    pub(super) fn keep(&self, place: &Place) -> Result<(), FileError> {
        let text = toml::to_string(self).unwrap_or_default();
        write_atomic(&file(place), text.as_bytes())
    }

    /// The one on the lights in use, if they were checked. One that cannot be read is as good as none: the check is made again.
    pub(super) fn load(place: &Place) -> Option<Self> {
        let text = read_input_text(&file(place)).ok()?;
        let verdict: Self = toml::from_str(&text).ok()?;
        let current = verdict.schema == SCHEMA
            && Some(&verdict.lights_sha256) == lights_sha256(place).as_ref();
        current.then_some(verdict)
    }
}
