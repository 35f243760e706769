//! What is remembered from one start to the next: `settings.toml` in the user's configuration folder.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
pub use weavelight::settings::{DeviceName, MethodName, NormalYName, Settings as SolveSettings};

/// What is remembered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Version of this format.
    pub schema: i64,
    /// The rig that was open last.
    pub rig: Option<PathBuf>,
    /// Where new rigs' folders are made.
    pub home: PathBuf,
    /// "light", "dark" or "system".
    pub theme: Theme,
    /// Size of everything relative to the system's.
    pub scale: f32,
    /// Inner size of the window when it is not maximised, logical pixels of the system; `None` until there was one.
    pub window_size: Option<[f32; 2]>,
    /// Whether it was maximised.
    pub maximized: bool,
    /// Which room was open.
    pub room: crate::model::room::Room,
    /// What was written for the last scan.
    pub scan: crate::model::scan_form::ScanForm,
    /// How scans are solved.
    pub solve: SolveSettings,
    /// The calibration targets in use.
    pub targets: crate::model::targets::TargetSettings,
    /// Where these settings are kept; not part of the file.
    #[serde(skip)]
    file: Option<PathBuf>,
    /// Nor is this.
    #[serde(skip)]
    put_aside: Option<PathBuf>,
}

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Theme {
    /// As the system has it.
    #[default]
    System,
    /// Dark on light.
    Light,
    /// Light on dark.
    Dark,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            schema: 1,
            rig: None,
            home: home().join("Weavelight"),
            theme: Theme::default(),
            scale: 1.0,
            window_size: None,
            maximized: false,
            room: crate::model::room::Room::Scan,
            scan: Default::default(),
            solve: SolveSettings::default(),
            targets: Default::default(),
            file: None,
            put_aside: None,
        }
    }
}

/// Sizes of everything that can still be read and used.
const SCALES: std::ops::RangeInclusive<f32> = 0.25..=4.0;
/// Sides of a window, logical pixels.
const SIDES: std::ops::RangeInclusive<f32> = 200.0..=20_000.0;

impl Settings {
    /// Those of this user; see [`Settings::load_from`].
    pub fn load() -> Self {
        Self::load_from(&configuration_folder().join("settings.toml"))
    }

    /// Those in a file; they will be kept there. The defaults where there is none, or it cannot be read: a window that does not
    /// open over its settings would be worse. What cannot be read is put aside, and [`Settings::put_aside`] says where.
    pub fn load_from(file: &Path) -> Self {
        let text = weavelight::files::read_input_text(file);
        let known = text.map(|text| toml::from_str::<Self>(&text));
        let mut settings = Self::default();
        match known {
            Ok(Ok(read)) => settings = read.sensible(),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            _ => settings.put_aside = put_aside(file),
        }
        settings.file = Some(file.to_owned());
        settings
    }

    /// Sizes that no window could have are the default ones.
    fn sensible(mut self) -> Self {
        let default = Self::default();
        if !SCALES.contains(&self.scale) {
            self.scale = default.scale;
        }
        let is_one = |size: &[f32; 2]| size.iter().all(|side| SIDES.contains(side));
        self.window_size = self.window_size.filter(is_one);
        self
    }

    /// Where strokes of masks are kept until they are saved.
    pub fn drafts(&self) -> PathBuf {
        let beside = self.file.as_ref().and_then(|file| file.parent());
        beside.unwrap_or(&self.home).join("drafts")
    }

    /// Where the settings are that could not be read.
    pub fn put_aside(&self) -> Option<&Path> {
        self.put_aside.as_deref()
    }

    /// Writes them where they came from, whole or not at all.
    ///
    /// # Errors
    /// Where that cannot be written.
    pub fn save(&self) -> Result<(), weavelight::files::FileError> {
        let Some(file) = &self.file else { return Ok(()) };
        let mut kept = self.clone();
        // TOML holds text only: a folder of another name is not remembered.
        kept.rig = kept.rig.filter(|rig| rig.to_str().is_some());
        if kept.home.to_str().is_none() {
            kept.home = Self::default().home;
        }
        let text = toml::to_string_pretty(&kept).map_err(|error| {
            let what = error.to_string();
            weavelight::files::FileError::Unwritable { path: file.clone(), what }
        })?;
        if let Some(folder) = file.parent() {
            let _ = std::fs::create_dir_all(folder);
        }
        weavelight::files::write_atomic(file, text.as_bytes())
    }
}

/// Renames a file that cannot be read; `None` where even that is impossible.
fn put_aside(file: &Path) -> Option<PathBuf> {
    let aside = file.with_extension("unreadable.toml");
    std::fs::rename(file, &aside).ok().map(|()| aside)
}

fn home() -> PathBuf {
    std::env::home_dir().unwrap_or_else(|| PathBuf::from("."))
}

fn configuration_folder() -> PathBuf {
    weavelight::machine::config_folder().unwrap_or_else(|| home().join(".config/weavelight"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_saved_is_what_is_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("deep/settings.toml");
        let mut settings = Settings::load_from(&file);
        settings.scale = 1.5;
        settings.theme = Theme::Dark;
        settings.solve.method = MethodName::Robust;
        settings.save().unwrap();
        assert_eq!(Settings::load_from(&file), settings);
    }

    #[test]
    fn a_broken_file_gives_the_defaults_and_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        std::fs::write(&file, "scale = \"huge").unwrap();
        let settings = Settings::load_from(&file);
        let aside = folder.path().join("settings.unreadable.toml");
        assert_eq!((settings.scale, settings.put_aside()), (1.0, Some(aside.as_path())));
        settings.save().unwrap();
        assert_eq!(std::fs::read_to_string(aside).unwrap(), "scale = \"huge");
        assert_eq!(Settings::load_from(&file).put_aside(), None);
    }

    #[test]
    fn sizes_that_no_window_has_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        for (scale, size) in
            [("nan", "[1e30, 800.0]"), ("0.0", "[nan, inf]"), ("1e9", "[0.0, -5.0]")]
        {
            std::fs::write(&file, format!("scale = {scale}\nwindow_size = {size}\n")).unwrap();
            let settings = Settings::load_from(&file);
            assert_eq!((settings.scale, settings.window_size), (1.0, None));
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_rig_whose_folder_is_no_text_does_not_cost_the_settings() {
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        let mut settings = Settings::load_from(&file);
        settings.scale = 1.5;
        settings.rig = Some(std::ffi::OsStr::from_bytes(b"/rig\xff").into());
        settings.save().unwrap();
        let read = Settings::load_from(&file);
        assert_eq!((read.scale, read.rig), (1.5, None));
    }
}
