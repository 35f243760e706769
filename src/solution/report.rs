use crate::files::{FileError, Input, read_input_text, write_atomic};
use crate::photometry::Method;
use crate::quantity::{DIRECTION, MM_PER_PX, Problem, SURFACE_MM, check_side};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The schema of `report.json` that this version reads and writes.
pub const SCHEMA: i64 = 1;

/// `report.json`: what a solve says of itself. Keys that this version does not know are passed over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Version of this format.
    pub schema: i64,
    /// Program and version, as in "weavelight 0.1.0".
    #[serde(default)]
    pub program: String,
    /// "auto", "least-squares" or "robust".
    #[serde(default)]
    pub method: String,
    /// Width and height of the maps.
    #[serde(default)]
    pub size_px: [usize; 2],
    /// Photosites that a pixel of the maps spans, each way: 1, or more in a preview.
    #[serde(default = "full_resolution")]
    pub scale: usize,
    /// Indices, ascending.
    pub lights_used: Vec<usize>,
    /// Photosites of a frame.
    pub pixels: u64,
    /// Those with a normal.
    pub solved: u64,
    /// Those that took the robust path.
    pub robust_pixels: u64,
    /// Those with at least one clipped sample.
    pub saturated_pixels: u64,
    /// Those that the calibration lists as hot or dead; they have no normal.
    #[serde(default)]
    pub defective_pixels: u64,
    /// Photosites by what became of them, as in "too_few_lights".
    #[serde(default)]
    pub outcomes: BTreeMap<String, u64>,
    /// Root mean square of the fit's residual over the solved photosites, in units of albedo.
    pub residual_rms: Option<f64>,
    /// Seconds per stage.
    pub seconds: BTreeMap<String, f64>,
    /// Size of a pixel on the plane at the picture's centre; `None` without a camera.
    pub mm_per_px: Option<f64>,
    /// Whether the lens distortion was taken out of the maps.
    pub undistorted: bool,
    /// The surface assumed, rig frame.
    pub plane: PlaneReport,
    /// What the albedo's R, G, B are: "linear sRGB" or "white-balanced camera RGB".
    pub color_space: String,
    /// What the albedo is; `None` in a report from before it was written: as it appears.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub albedo: Option<AlbedoReport>,
    /// What was found of the swatch, where the solve was to find it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub swatch: Option<String>,
    /// What the fit leaves over of each light, where it was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub residuals: Vec<ResidualFile>,
    /// Sentences; the same go to standard error.
    pub warnings: Vec<String>,
    /// The capture session's manifest, the calibration's files with its gain maps, and the mask where there is one
    /// ([`MASK_INPUT`](super::MASK_INPUT)), with their hashes.
    pub inputs: Vec<Input>,
    /// Where these were.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folders: Option<InputFolders>,
    /// Who solved the photosites that have all their samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<DeviceReport>,
    /// Hash of inputs and settings together: the same key means the same solution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
}

/// The line on which a key of the outermost object stands.
fn line_of(json: &str, key: &str) -> usize {
    let outermost = key.split('.').next().unwrap_or(key);
    let quoted = format!("\"{outermost}\"");
    1 + json.lines().position(|line| line.trim_start().starts_with(&quoted)).unwrap_or(0)
}

/// Where the inputs of a solve were, in `report.json`: whole paths, for whoever wants to look at the frames again. They may have
/// moved since; the hashes of the inputs tell whether what is there is what was solved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFolders {
    /// The capture session.
    pub session: String,
    /// The calibration.
    pub calibration: String,
}

impl InputFolders {
    /// Of folders as they were named.
    pub fn new(session: &Path, calibration: &Path) -> Self {
        let whole = |path: &Path| {
            let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
            path.display().to_string()
        };
        Self { session: whole(session), calibration: whole(calibration) }
    }
}

/// What the albedo is, in `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlbedoReport {
    /// "reflectance": shading by unresolved relief is divided out and lies in `shade.exr`; "appearance": it is left in.
    pub kind: String,
    /// Expected relative error of its level, one standard deviation; `None` where nothing tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level_sigma: Option<f64>,
    /// Dyes that the colours follow: 1, or 2 for several; `None` where that was not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dyes: Option<u32>,
    /// Share of the picture that was taken for a print.
    #[serde(default)]
    pub gated_share: f64,
    /// Photosites whose value no reflectance can have, and that were limited.
    #[serde(default)]
    pub clamped: u64,
    /// Distance of the yarns in photosites, where the normals show one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yarns_px: Option<f64>,
    /// The reading that the level was scaled to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceReport>,
}

/// A reading that the albedo's level was scaled to, in `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceReport {
    /// CIE L*a*b*, D50, 2 degrees.
    pub lab_d50: [f64; 3],
    /// What the albedo was multiplied by.
    pub factor: f64,
    /// CIEDE2000 between the scaled albedo's mean and the reading: what one factor cannot mend.
    pub remaining_de2000: f64,
}

/// Who solved, in `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceReport {
    /// "cpu" or "gpu".
    pub kind: String,
    /// Why this one.
    pub why: String,
    /// The graphics processor's name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adapter: Option<String>,
    /// Its driver.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub driver: Option<String>,
    /// Whether it is a program that plays a graphics processor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub software: Option<bool>,
    /// Megabytes sent to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sent_mb: Option<f64>,
    /// Megabytes brought back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub received_mb: Option<f64>,
    /// Time that threads of the processor spent sending to it and waiting for it, all together. The time of the whole solve
    /// is among the report's `seconds`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub busy_s: Option<f64>,
}

impl DeviceReport {
    /// The processor alone.
    pub fn processor(why: String) -> Self {
        Self {
            kind: "cpu".to_owned(),
            why,
            adapter: None,
            driver: None,
            software: None,
            sent_mb: None,
            received_mb: None,
            busy_s: None,
        }
    }
}

fn full_resolution() -> usize {
    1
}

/// A light's residuals in `report.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResidualFile {
    /// Its number in the rig.
    pub light: usize,
    /// The file, in the solution's folder.
    pub file: String,
}

/// A plane in `report.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaneReport {
    /// A point on it, rig frame.
    pub point_mm: [f64; 3],
    /// Its unit normal, rig frame.
    pub normal: [f64; 3],
}

impl Report {
    /// How the solution was solved; `None` where the report names a method that this version does not know. Reports without
    /// the key are of versions that knew one way only.
    pub fn solved_by(&self) -> Option<Method> {
        match self.method.as_str() {
            "" => Some(Method::Auto),
            name => Method::named(name),
        }
    }

    /// Reads `report.json`.
    ///
    /// # Errors
    /// Where it cannot be read, or is of another schema or broken; with file, line and remedy.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = read_input_text(path).map_err(|source| FileError::read(path, source))?;
        let broken = |error: serde_json::Error| FileError::Invalid {
            path: path.to_owned(),
            line: error.line().max(1),
            what: format!("{error}; run `weavelight solve` again"),
        };
        let value: serde_json::Value = serde_json::from_str(&text).map_err(broken)?;
        if let Some(found) =
            value.get("schema").and_then(serde_json::Value::as_i64).filter(|found| *found != SCHEMA)
        {
            return Err(FileError::Schema {
                path: path.to_owned(),
                line: 1,
                found,
                supported: SCHEMA,
            });
        }
        let report: Self = serde_json::from_str(&text).map_err(broken)?;
        report.check().map_err(|problem| FileError::Invalid {
            path: path.to_owned(),
            line: line_of(&text, &problem.key),
            what: format!("`{}` {}; run `weavelight solve` again", problem.key, problem.what),
        })?;
        Ok(report)
    }

    /// What readers and writers of the format ask of its numbers.
    fn check(&self) -> Result<(), Problem> {
        // A report from before the size was written has none.
        if self.size_px != [0, 0] {
            self.size_px.iter().try_for_each(|side| check_side("size_px", *side))?;
        }
        if !(1..=64).contains(&self.scale) {
            let what = format!("is {}; pixels span 1 to 64 photosites", self.scale);
            return Err(Problem::new("scale", what));
        }
        MM_PER_PX.maybe_at("mm_per_px", self.mm_per_px)?;
        SURFACE_MM.all_at("plane", &self.plane.point_mm)?;
        DIRECTION.all_at("plane", &self.plane.normal)?;
        if self.plane.normal.iter().all(|part| part.abs() < 1e-6) {
            return Err(Problem::new("plane", "has a normal without length"));
        }
        Ok(())
    }

    /// Writes `report.json`, whole or not at all.
    ///
    /// # Errors
    /// Where it cannot be written, or holds numbers that JSON cannot.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        let unwritable = |what: String| FileError::Unwritable { path: path.to_owned(), what };
        self.check().map_err(|problem| FileError::unwritable(path, &problem))?;
        if !self.is_finite() {
            return Err(unwritable("a figure is not a finite number".to_owned()));
        }
        let mut text =
            serde_json::to_string_pretty(self).map_err(|error| unwritable(error.to_string()))?;
        text.push('\n');
        write_atomic(path, text.as_bytes())
    }

    fn is_finite(&self) -> bool {
        let plane = self.plane.point_mm.iter().chain(&self.plane.normal);
        let figures = self.residual_rms.iter().chain(&self.mm_per_px).chain(self.seconds.values());
        plane.chain(figures).all(|number| number.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        Report {
            schema: SCHEMA,
            program: "weavelight 0.1.0".into(),
            method: "auto".into(),
            size_px: [2, 3],
            scale: 1,
            swatch: None,
            lights_used: vec![0, 2, 3],
            pixels: 6,
            solved: 5,
            robust_pixels: 1,
            saturated_pixels: 0,
            defective_pixels: 2,
            outcomes: [("masked".to_owned(), 1)].into(),
            residual_rms: Some(1.0 / 3.0),
            seconds: [("decode".to_owned(), 0.25)].into(),
            mm_per_px: None,
            undistorted: false,
            plane: PlaneReport { point_mm: [0.0, 0.0, 5.0], normal: [0.0, 0.0, 1.0] },
            color_space: "linear sRGB".into(),
            albedo: Some(AlbedoReport {
                kind: "reflectance".into(),
                level_sigma: Some(0.02),
                dyes: Some(1),
                gated_share: 0.25,
                clamped: 3,
                yarns_px: Some(2.3),
                reference: Some(ReferenceReport {
                    lab_d50: [62.0, 3.5, 12.25],
                    factor: 1.0625,
                    remaining_de2000: 0.5,
                }),
            }),
            residuals: vec![ResidualFile { light: 3, file: "residual-03.exr".into() }],
            warnings: vec!["light 1 has no frame".into()],
            inputs: vec![Input { name: "session.toml".into(), sha256: "ab".into() }],
            folders: Some(InputFolders::new(Path::new("/scans/linen"), Path::new("calibration"))),
            device: Some(DeviceReport::processor("asked for".into())),
            key: None,
        }
    }

    #[test]
    fn what_is_written_is_what_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.json");
        report().write(&path).unwrap();
        assert_eq!(Report::read(&path).unwrap(), report());
        let folders = report().folders.unwrap();
        assert_eq!(Path::new(&folders.session), Path::new("/scans/linen"));
        assert!(Path::new(&folders.calibration).is_absolute(), "{folders:?}");
        let unfinished = Report { residual_rms: Some(f64::NAN), ..report() };
        assert!(unfinished.write(&path).unwrap_err().to_string().contains("not a finite number"));
        assert_eq!(Report::read(&path).unwrap(), report());
    }

    #[test]
    fn broken_reports_are_told() {
        let check = |text: &str, expected: &str| {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("report.json");
            std::fs::write(&path, text).unwrap();
            let error = Report::read(&path).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        check("{\"schema\": 9}", "report.json:1: schema 9, but this version reads schema 1");
        check("{\"schema\": 1,\n \"pixels\": }", "report.json:2: expected value");
        check("{\"schema\": 1}", "missing field `lights_used`");
        check("", "report.json:1: EOF");
    }
}
