//! The `[solve]` table of a settings file.

use crate::files::{Document, FileError};
use crate::gpu::Device;
use crate::photometry::Method;
use crate::solution::{Grid, NormalY};
use crate::solve::Options;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How capture sessions are solved, as somebody set it once: the `[solve]` table of a settings file. The window keeps its own
/// there; `weavelight solve --settings FILE` reads the same, and so makes the same maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Settings {
    /// `--method`
    pub method: MethodName,
    /// `--undistort`
    pub undistort: bool,
    /// `--normal-y`
    pub normal_y: NormalYName,
    /// `--device`
    pub device: DeviceName,
}

/// As on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// Robust where the residual asks for it.
    #[default]
    Auto,
    /// Plain.
    LeastSquares,
    /// Robust everywhere.
    Robust,
}

/// As on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalYName {
    /// OpenGL.
    #[default]
    Up,
    /// DirectX.
    Down,
}

/// As on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceName {
    /// Whichever was measured to be faster here.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// The graphics processor.
    Gpu,
}

/// A settings file as far as it is about solving; the rest is the window's.
#[derive(Deserialize)]
struct File {
    #[serde(default)]
    solve: Settings,
}

/// Version of settings files.
const SCHEMA: i64 = 1;

impl Settings {
    /// The `[solve]` table of a settings file; the defaults where it has none.
    ///
    /// # Errors
    /// Where the file cannot be read, or the table says something unknown.
    pub fn read(file: &Path) -> Result<Self, FileError> {
        Ok(Document::read(file)?.parse::<File>(SCHEMA)?.solve)
    }

    /// The options of a solve; everything that is not set here at its default.
    pub fn options(self, session: &Path, calibration: &Path, out: &Path) -> Options {
        let mut options = Options::new(session, calibration, out);
        options.method = match self.method {
            MethodName::Auto => Method::Auto,
            MethodName::LeastSquares => Method::LeastSquares,
            MethodName::Robust => Method::Robust,
        };
        options.grid = if self.undistort { Grid::Undistorted } else { Grid::Sensor };
        options.normal_y = match self.normal_y {
            NormalYName::Up => NormalY::Up,
            NormalYName::Down => NormalY::Down,
        };
        options.device = match self.device {
            DeviceName::Auto => Device::Auto { memory: device_memory() },
            DeviceName::Cpu => Device::Cpu,
            DeviceName::Gpu => Device::Gpu,
        };
        options
    }
}

/// The file among the user's cached ones that remembers what was measured.
fn device_memory() -> Option<PathBuf> {
    Some(crate::machine::cache_folder()?.join("device.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: Result<Settings, &str>) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        std::fs::write(&file, text).unwrap();
        match (Settings::read(&file), expected) {
            (Ok(found), Ok(expected)) => assert_eq!(found, expected),
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{error}"),
            (found, expected) => panic!("{found:?}, not {expected:?}"),
        }
    }

    #[test]
    fn the_table_of_the_windows_settings_is_read() {
        let settings = Settings {
            method: MethodName::LeastSquares,
            undistort: true,
            normal_y: NormalYName::Down,
            device: DeviceName::Cpu,
        };
        let table = "[solve]\nmethod = \"least-squares\"\nundistort = true\nnormal-y = \"down\"\ndevice = \"cpu\"\n";
        check(&format!("schema = 1\ntheme = \"dark\"\n{table}"), Ok(settings));
        check("schema = 1\n", Ok(Settings::default()));
        check("schema = 1\n[solve]\nmethod = \"magic\"\n", Err(":3: unknown variant"));
        check("schema = 9\n", Err("9"));
    }
}
