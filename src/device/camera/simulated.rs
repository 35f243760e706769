//! The simulated rig's camera: it looks which lights are lit while its shutter is open and photographs exactly that.

use super::remembered::Remembered;
use super::{Applied, Camera, CameraError, Description, Release, Settings, Shutter};
use crate::files::{FileError, read_input_text};
use crate::instrument::Rig;
use crate::simulate::{Instrument, SCENE_FILE, Scene, SimulateError};
use std::fmt;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;
use weavelight_sim::render::{Shot, Signals, Stage, Subject, Tile, shoot};
use weavelight_sim::sensor::Sensor;

/// Which outputs of the light board are lit at this moment: bit n is output n.
pub type Eyes = Box<dyn Fn() -> u32 + Send>;

/// Exposure times that it has, seconds; any between.
const EXPOSURES_S: RangeInclusive<f64> = 1e-5..=30.0;
/// Sensitivities that it has.
const ISOS: RangeInclusive<f64> = 25.0..=25_600.0;
/// Shots of different numbers have different noise; those of `simulate` have lower ones.
const FIRST_SHOT: u64 = 1_000_000;

/// A camera in software. Its exposures take as long as a real one's.
pub struct SimulatedCamera {
    before: Before,
    /// Where to look what lies on the table now; `None`: what lay there first stays.
    table: Option<Table>,
    eyes: Eyes,
    settings: Settings,
    shots: u64,
}

/// What stands before the camera.
struct Before {
    scene: Scene,
    subject: Remembered,
    instrument: Instrument,
    /// Per output of the board: which light hangs on it in truth, if one does and shines.
    light_of_output: Vec<(u32, Option<usize>)>,
}

/// The table of a rig: `scene.toml` beside the rig's file says what lies on it.
struct Table {
    rig: Rig,
    file: PathBuf,
    /// What it said last.
    said: Option<String>,
}

impl Before {
    fn new(rig: &Rig, scene: Scene) -> Result<Self, SimulateError> {
        let instrument = scene.instrument(rig)?;
        let light_of_output = (0..rig.lights.len())
            .map(|light| (rig.channel(light), scene.flaws.light_that_shines(light)))
            .collect();
        let subject = Remembered::new(scene.subject(&instrument)?, &instrument.stage);
        Ok(Self { subject, scene, instrument, light_of_output })
    }
}

impl Table {
    /// What lies there, if that is not what lay there last.
    fn look(&mut self) -> Result<Option<Before>, SimulateError> {
        let said = read_input_text(&self.file.with_file_name(SCENE_FILE)).ok();
        if said == self.said {
            return Ok(None);
        }
        let before = Before::new(&self.rig, Scene::beside(&self.file)?)?;
        self.said = said;
        Ok(Some(before))
    }
}

impl fmt::Debug for SimulatedCamera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedCamera").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl SimulatedCamera {
    /// The camera of `rig`, over what `scene` says and with its flaws, for ever.
    ///
    /// # Errors
    /// Where the rig does not say what a simulation needs.
    pub fn new(rig: &Rig, scene: Scene, eyes: Eyes) -> Result<Self, SimulateError> {
        Ok(Self::over(Before::new(rig, scene)?, None, eyes))
    }

    /// The camera of `rig`, which is read from `file`, over whatever the scene beside the file says at each picture.
    ///
    /// # Errors
    /// Where the rig does not say what a simulation needs, or the scene cannot be read.
    pub fn over_table(rig: &Rig, file: &Path, eyes: Eyes) -> Result<Self, SimulateError> {
        let said = read_input_text(&file.with_file_name(SCENE_FILE)).ok();
        let before = Before::new(rig, Scene::beside(file)?)?;
        let table = Table { rig: rig.clone(), file: file.to_owned(), said };
        Ok(Self::over(before, Some(table), eyes))
    }

    fn over(before: Before, table: Option<Table>, eyes: Eyes) -> Self {
        let settings = Settings { exposure_s: 0.5, iso: 100.0 };
        Self { before, table, eyes, settings, shots: 0 }
    }

    /// How strongly each light contributes, given the outputs at both ends of the exposure.
    fn strengths(&self, open: u32, close: u32) -> Vec<(usize, f64)> {
        let lights = self.before.instrument.stage.lights.len() as f64;
        let drifted =
            1.0 + self.before.scene.flaws.drift * (self.shots as f64 / (lights + 1.0)).min(1.0);
        let share = |output: u32| {
            let lit = |pins: u32| f64::from(pins.checked_shr(output).unwrap_or(0) & 1);
            0.5 * (lit(open) + lit(close)) * drifted
        };
        let lit = self.before.light_of_output.iter().filter_map(|&(output, light)| {
            Some((light?, share(output))).filter(|(_, share)| *share > 0.0)
        });
        lit.collect()
    }

    fn photograph(&self, open: u32, close: u32) -> Vec<u16> {
        let Instrument { stage, sensor, .. } = &self.before.instrument;
        let gain = self.settings.iso / 100.0;
        // The range ends at fewer electrons: shorter exposures have more noise.
        let sensor = Sensor { full_well_e: sensor.full_well_e / gain, ..sensor.clone() };
        let strengths = self.strengths(open, close);
        let lit = Lit {
            subject: &self.before.subject,
            stage,
            lit: strengths.iter().map(|&(light, strength)| (light, strength as f32)).collect(),
        };
        // One lamp for all that is lit, so that nothing else is rendered.
        let first = stage.lights[..1].to_vec();
        let shot = Shot {
            light: Some(0),
            exposure: self.settings.exposure_s * gain,
            strength: 1.0,
            number: FIRST_SHOT + self.shots,
        };
        let seen = Stage { lights: first, ..stage.clone() };
        shoot(&lit, &seen, &sensor, &[shot], &|_| ()).pop().unwrap_or_default()
    }
}

impl Camera for SimulatedCamera {
    fn describe(&self) -> Description {
        let model = self.before.instrument.rig.camera.model.clone();
        Description {
            model: model.unwrap_or_else(|| "simulated camera".to_owned()),
            release: Release::Itself,
        }
    }

    fn configure(&mut self, wanted: Settings) -> Result<Applied, CameraError> {
        let within = |what, value: f64, range: RangeInclusive<f64>, unit: &str| {
            if range.contains(&value) {
                return Ok(());
            }
            let (wanted, choices) =
                (format!("{value}{unit}"), format!("{} to {}{unit}", range.start(), range.end()));
            Err(CameraError::Setting { what, wanted, choices })
        };
        within("exposure time", wanted.exposure_s, EXPOSURES_S, " s")?;
        within("sensitivity", wanted.iso, ISOS, "")?;
        self.settings = wanted;
        Ok(Applied::Set(wanted))
    }

    fn capture(
        &mut self,
        folder: &Path,
        shutter: &mut dyn Shutter,
    ) -> Result<PathBuf, CameraError> {
        if let Some(before) = self.table.as_mut().map(Table::look).transpose()?.flatten() {
            self.before = before;
        }
        shutter.open();
        let open = (self.eyes)();
        std::thread::sleep(Duration::from_secs_f64(self.settings.exposure_s));
        let close = (self.eyes)();
        shutter.closed();
        let samples = self.photograph(open, close);
        let Settings { exposure_s, iso } = self.settings;
        let path = folder.join(format!("SIM_{:04}.dng", self.shots));
        let now = Some(jiff::Timestamp::now());
        let written = self
            .before
            .instrument
            .encode(&samples, exposure_s, iso, now)
            .and_then(|bytes| std::fs::write(&path, bytes));
        written.map_err(|source| FileError::write(&path, source))?;
        self.shots += 1;
        Ok(path)
    }
}

/// The subject under several lights at once, as one lamp.
struct Lit<'a> {
    subject: &'a Remembered,
    stage: &'a Stage,
    /// Lights of the stage with their strengths.
    lit: Vec<(usize, f32)>,
}

impl Subject for Lit<'_> {
    fn expose(&self, _: &Stage, tile: Tile, signals: &mut Signals) {
        let (sum, ambient) = self.subject.sum(self.stage, &self.lit, tile);
        signals.lights[0] = sum;
        signals.ambient = ambient;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::{Hint, Samples, decode};
    use crate::simulate::Options;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// A rig's camera whose board's outputs are set by hand, without noise.
    fn camera(change: impl Fn(&mut Options)) -> (SimulatedCamera, Arc<AtomicU32>) {
        let mut options = Options { size_px: Some([48, 32]), ..Options::default() };
        options.flaws.noise = false;
        change(&mut options);
        let instrument = Instrument::from_options(&options).unwrap();
        let scene = Scene::of(&options, &instrument);
        let pins = Arc::new(AtomicU32::new(0));
        let seen = Arc::clone(&pins);
        let eyes = Box::new(move || seen.load(Ordering::SeqCst));
        let mut camera = SimulatedCamera::new(&instrument.rig, scene, eyes).unwrap();
        camera.configure(Settings { exposure_s: 0.01, iso: 5000.0 }).unwrap();
        (camera, pins)
    }

    /// Sum of the samples over black while these outputs are lit.
    fn brightness(camera: &mut SimulatedCamera, pins: &AtomicU32, lit: u32) -> f64 {
        let folder = tempfile::tempdir().unwrap();
        pins.store(lit, Ordering::SeqCst);
        let path = camera.capture(folder.path(), &mut ()).unwrap();
        let frame = decode(&std::fs::read(path).unwrap(), &Hint::default()).unwrap();
        assert_eq!(frame.metadata.exposure_s, Some(0.01));
        let Samples::U16(samples) = frame.samples else { panic!("not integers") };
        samples.iter().map(|&s| f64::from(s) - f64::from(frame.black[0])).sum()
    }

    #[test]
    fn it_sees_what_is_lit() {
        let (mut camera, pins) = camera(|_| ());
        let mut at = |lit| brightness(&mut camera, &pins, lit);
        let (dark, three, five) = (at(0), at(1 << 3), at(1 << 5));
        assert!(three > 10.0 * dark && five > 10.0 * dark && three != five);
        let both = at(1 << 3 | 1 << 5);
        assert!((both - (three + five - dark)).abs() < 0.01 * both, "{both}: {three} and {five}");
        assert_eq!(at(1 << 16), dark, "the back light is behind the cloth");
    }

    #[test]
    fn wires_and_leds_are_what_the_scene_says() {
        let (mut plain, pins) = camera(|_| ());
        let (mut flawed, flawed_pins) = camera(|options| {
            options.flaws.swapped = Some([2, 7]);
            options.flaws.dead = Some(4);
        });
        for (asked, shines) in [(2, 1 << 7), (7, 1 << 2), (4, 0), (5, 1 << 5)] {
            assert_eq!(
                brightness(&mut flawed, &flawed_pins, 1 << asked),
                brightness(&mut plain, &pins, shines),
                "light {asked}"
            );
        }
    }

    #[test]
    fn what_it_does_not_have_is_told() {
        let (mut camera, _) = camera(|_| ());
        let error = camera.configure(Settings { exposure_s: 900.0, iso: 100.0 }).unwrap_err();
        assert!(error.to_string().contains("exposure time to 900 s; it has"), "{error}");
    }

    /// A light that goes out half-way is in the picture half.
    #[test]
    fn a_light_that_goes_out() {
        let (camera, _) = camera(|_| ());
        assert_eq!(camera.strengths(1 << 3, 0), [(3, 0.5)]);
        assert_eq!(camera.strengths(1 << 3, 1 << 3), [(3, 1.0)]);
        assert_eq!(camera.strengths(0, 0), []);
    }
}
