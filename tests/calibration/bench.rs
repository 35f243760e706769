//! A simulated rig in a temporary folder, what can be done with its pictures, and ways to spoil them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use weavelight::calibrate::{
    self, CalibrateError, CameraOptions, CameraReport, CheckOptions, CheckReport, ColorOptions,
    ColorReport, LightsOptions, LightsReport,
};
use weavelight::instrument::Calibration;
use weavelight::raw::{self, Hint, Samples};
use weavelight::session::Session;
use weavelight::simulate::{self, Flaws, Instrument, Options, Part, Targets};
use weavelight::solution::Report;
use weavelight::solve;
use weavelight_calibration::description::Light;

/// Small enough for two cores, large enough for the strip's corners.
pub const SIZE: [usize; 2] = [616, 408];
/// Every white sheet.
pub const SIX_SHEETS: [&str; 6] =
    ["white-flat", "white-raised", "white-tilt-1", "white-tilt-2", "white-tilt-3", "white-tilt-4"];
/// The parts that the sheets belong to.
pub const WHITE: [Part; 3] = [Part::WhiteFlat, Part::WhiteRaised, Part::WhiteTilt];

pub fn quiet(_: f64, _: &str) {}

/// What was simulated, and a calibration that is made from it.
pub struct Bench {
    folder: tempfile::TempDir,
    options: Options,
}

impl Bench {
    /// Rulers off by 10 mm RMS per axis (17 mm), vignetting 20 %, a sheet uneven by 2 %, ambient light, noise.
    pub fn new(only: &[Part], change: impl Fn(&mut Options)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut options = Options {
            out: folder.path().join("rig"),
            size_px: Some(SIZE),
            seed: 3,
            only: only.to_vec(),
            flaws: Flaws { ruler_error_mm: 10.0, vignetting: 0.2, psf_px: 0.0, ..Flaws::default() },
            targets: Targets { unevenness: 0.02, ..Targets::default() },
            ..Options::default()
        };
        change(&mut options);
        simulate::run(&options, &quiet).unwrap();
        Self { folder, options }
    }

    /// Something in the simulated rig's folder.
    pub fn rig(&self, name: &str) -> PathBuf {
        self.options.out.join(name)
    }

    /// Beside it.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The calibration that is made.
    pub fn found(&self) -> PathBuf {
        self.beside("calibration")
    }

    /// What is true.
    pub fn truth(&self) -> PathBuf {
        self.rig("calibration")
    }

    /// Puts files of the true calibration where the one to be made will be.
    pub fn know(&self, files: &[&str]) -> &Self {
        std::fs::create_dir_all(self.found()).unwrap();
        for name in files {
            std::fs::copy(self.truth().join(name), self.found().join(name)).unwrap();
        }
        self
    }

    /// The same with all of them, gain maps included.
    pub fn know_all(&self) -> &Self {
        let names: Vec<String> = self.files(&self.truth()).into_keys().collect();
        self.know(&names.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// Every file of the calibration that is made.
    pub fn snapshot(&self) -> BTreeMap<String, Vec<u8>> {
        self.files(&self.found())
    }

    fn files(&self, folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let Ok(entries) = std::fs::read_dir(folder) else { return BTreeMap::new() };
        let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
        let paths = entries.map(|entry| entry.unwrap().path());
        paths.map(|path| (name(&path), std::fs::read(&path).unwrap())).collect()
    }

    pub fn camera(&self) -> Result<CameraReport, CalibrateError> {
        let (rig, sessions) = (self.rig("rig.toml"), vec![self.rig("board")]);
        calibrate::camera(&CameraOptions { rig, sessions, out: self.found() }, &quiet)
    }

    pub fn color(&self) -> Result<ColorReport, CalibrateError> {
        let (rig, session) = (self.rig("rig.toml"), self.rig("grey"));
        calibrate::color(&ColorOptions { rig, session, out: self.found() }, &quiet)
    }

    pub fn lights(&self, sheets: &[&str]) -> Result<LightsReport, CalibrateError> {
        let sessions = sheets.iter().map(|name| self.rig(name)).collect();
        let (rig, out) = (self.rig("rig.toml"), self.found());
        calibrate::lights(&LightsOptions { rig, sessions, out }, &quiet)
    }

    pub fn check(&self, sheets: &[&str]) -> Result<CheckReport, CalibrateError> {
        let options = CheckOptions {
            calibration: self.found(),
            sessions: sheets.iter().map(|name| self.rig(name)).collect(),
            threshold_deg: 0.1,
            out: Some(self.beside("residuals")),
        };
        calibrate::check(&options, &quiet)
    }

    /// Solves a capture session with a calibration into a folder of that name.
    pub fn solve(&self, session: &str, calibration: &Path, out: &str) -> Report {
        let options = solve::Options::new(self.rig(session), calibration, self.beside(out));
        solve::run(&options, &|_| {}, None).unwrap().report
    }

    /// RMS over the lights of the distance between found and true positions.
    pub fn position_rms_mm(&self) -> f64 {
        let (found, truth) = (lights_of(&self.found()), lights_of(&self.truth()));
        let position = |light: &Light| match light {
            Light::Point(light) => light.position_mm,
            Light::Directional(_) => panic!("a far light"),
        };
        let pairs = found.iter().zip(&truth);
        let square: f64 = pairs.map(|(a, b)| (position(a) - position(b)).norm_squared()).sum();
        (square / found.len() as f64).sqrt()
    }

    /// Changes the raw numbers of the frames whose file's name starts with `prefix`. Their hashes go.
    pub fn spoil(&self, session: &str, prefix: &str, change: impl Fn(&mut Picture)) -> &Self {
        let instrument = Instrument::from_options(&self.options).unwrap();
        let mut session = Session::load(&self.rig(session)).unwrap();
        for k in 0..session.frames.len() {
            let path = session.frame_path(&session.frames[k]);
            let entry = &mut session.frames[k];
            if !entry.file.to_string_lossy().starts_with(prefix) {
                continue;
            }
            let frame = raw::decode(&std::fs::read(&path).unwrap(), &Hint::default()).unwrap();
            let Samples::U16(samples) = frame.samples else { panic!("simulated RAW is integer") };
            let mut picture = Picture { width: frame.width, height: frame.height, samples };
            change(&mut picture);
            let bytes = instrument.encode(&picture.samples, entry.exposure_s, entry.iso, None);
            std::fs::write(&path, bytes.unwrap()).unwrap();
            entry.sha256 = None;
        }
        session.save().unwrap();
        self
    }
}

/// The lights of a calibration.
pub fn lights_of(calibration: &Path) -> Vec<Light> {
    let lights = Calibration::load(calibration).unwrap().lights;
    lights.into_iter().map(|light| light.light).collect()
}

/// Replaces text in a file.
pub fn edit(path: impl AsRef<Path>, change: impl Fn(&str) -> String) {
    let text = std::fs::read_to_string(path.as_ref()).unwrap();
    std::fs::write(path, change(&text)).unwrap();
}

/// The raw numbers of a frame.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub samples: Vec<u16>,
}

/// The simulated sensor's black.
pub const BLACK: u16 = 600;

impl Picture {
    fn replace(&mut self, at: impl Fn(&Self, usize, usize) -> u16) {
        let places = 0..self.samples.len();
        self.samples = places.map(|k| at(self, k % self.width, k / self.width)).collect();
    }

    /// Moves everything by an even number of photosites (colours stay in place); dark from beyond the edge.
    pub fn shift(&mut self, right: isize, down: isize) {
        self.replace(|from, x, y| {
            let (x, y) = (x as isize - right, y as isize - down);
            let inside =
                (0..from.width as isize).contains(&x) && (0..from.height as isize).contains(&y);
            if inside { from.samples[y as usize * from.width + x as usize] } else { BLACK }
        });
    }

    /// Mean over (2 n + 1)^2 photosites of the same colour.
    pub fn blur(&mut self, n: usize) {
        self.replace(|from, x, y| {
            let line = |at: usize, length: usize| {
                (0..=2 * n)
                    .filter_map(move |k| (at + 2 * k).checked_sub(2 * n))
                    .filter(move |c| *c < length)
            };
            let (mut sum, mut count) = (0u64, 0);
            for row in line(y, from.height) {
                for column in line(x, from.width) {
                    sum += u64::from(from.samples[row * from.width + column]);
                    count += 1;
                }
            }
            (sum / count) as u16
        });
    }
}
