//! The folder that a solve writes: names of its files, and `report.json`.

mod choices;
mod maps;
mod report;

pub use choices::{AlbedoKind, Grid, NormalY, Outputs, Residuals, Reuse, Scale};
pub use maps::Finished;
pub use report::{
    AlbedoReport, DeviceReport, InputFolders, PlaneReport, ReferenceReport, Report, ResidualFile,
    SCHEMA as REPORT_SCHEMA,
};

use crate::files::{FileError, OutputKind};
use std::path::{Path, PathBuf};

/// Normals, rig frame: 32-bit float, channels R, G, B = nx, ny, nz; 0 where unsolved.
pub const NORMAL_EXR: &str = "normal.exr";
/// Albedo, linear RGB, float; 0 where unsolved.
pub const ALBEDO_EXR: &str = "albedo.exr";
/// What was divided out of the albedo, channel Y: the share of light that unresolved relief leaves; 0 where unsolved. A solution
/// without it has its albedo as it appears, and its shade is 1.
pub const SHADE_EXR: &str = "shade.exr";
/// Expected RMS of the normal's total angular error, degrees, channel Y; 0 where unsolved.
pub const CONFIDENCE_EXR: &str = "confidence.exr";
/// Normals for looking and for engines, 16 bit.
pub const NORMAL_PNG: &str = "normal.png";
/// Albedo, 16 bit, sRGB-encoded.
pub const ALBEDO_PNG: &str = "albedo.png";
/// 255 = solved.
pub const MASK_PNG: &str = "mask.png";
/// Start of the names of the files that hold what the fit leaves over of each light, on request; see [`residual_exr`].
const RESIDUAL: &str = "residual-";
/// What the solve says of itself.
pub const REPORT_JSON: &str = "report.json";
/// The page that a person looks at.
pub const REPORT_HTML: &str = "report.html";
/// Start of the name of the mask among a report's inputs; the file's name follows.
pub const MASK_INPUT: &str = "mask:";
/// The calibration's camera, copied.
pub const CAMERA_TOML: &str = crate::instrument::CAMERA_FILE;

/// A solution as an output folder: an earlier one may be replaced if it holds nothing else.
pub const OUTPUT: OutputKind = OutputKind { name: "solution", marker: Some(REPORT_JSON) };

/// Name of the file with what the fit leaves over of a light: channel Y, 32-bit float, in units of the albedo, as a fraction
/// of what a perfect white diffuser facing the light sends back; highlights positive, cast shadows negative; 0 where
/// unsolved or clipped. Of a mosaic, under each photosite's own filter.
pub fn residual_exr(light: usize) -> String {
    format!("{RESIDUAL}{light:02}.exr")
}

/// A solution on disk.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The folder.
    pub folder: PathBuf,
    /// Its `report.json`.
    pub report: Report,
}

impl Solution {
    /// Reads a solution's report; the maps are read by whoever needs them.
    ///
    /// # Errors
    /// Where there is no report, or it is of another schema or broken.
    pub fn load(folder: &Path) -> Result<Self, FileError> {
        Ok(Self { folder: folder.to_owned(), report: Report::read(&folder.join(REPORT_JSON))? })
    }

    /// Where one of its files is.
    pub fn path(&self, file: &str) -> PathBuf {
        self.folder.join(file)
    }
}
