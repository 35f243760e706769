//! A rig for tests: the simulated board with the real firmware, and a camera that sees its pins, with a place to put faults.

use crate::simboard::SimBoard;
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use weavelight::device::board::{Board, PortChoice};
use weavelight::device::camera::{
    Applied, Camera, CameraError, Description, Eyes, Settings, Shutter, SimulatedCamera,
};
use weavelight::device::scan::{About, Begin, Control, Options, ScanError, Subject, Summary, scan};
use weavelight::files::sha256_of_file;
use weavelight::instrument::Rig;
use weavelight::session::Session;
use weavelight::simulate::{self, Flaws, Part, Scene};
use weavelight_sim::cloth::Preset;

/// Exposure of the tests: short in time, long in light.
pub(crate) const SETTINGS: Settings = Settings { exposure_s: 0.02, iso: 1200.0 };

/// A simulated rig's folder, and what the camera did.
pub(crate) struct Laboratory {
    pub(crate) home: tempfile::TempDir,
    pub(crate) rig: Rig,
    pub(crate) scene: Scene,
    /// An output that lights another one's LED.
    pub(crate) bridge: Option<(u32, u32)>,
    pub(crate) log: Log,
}

/// Per picture, by its hash: the outputs at shutter open and close.
pub(crate) type Log = Arc<Mutex<HashMap<String, (u32, u32)>>>;

/// What happens while a shutter is open; an error in place of the picture, or something done to its file.
pub(crate) type Fault = Box<dyn FnMut() -> Option<Mishap> + Send>;

/// What becomes of a picture.
pub(crate) enum Mishap {
    Error(CameraError),
    File(fn(&Path)),
}

impl Laboratory {
    pub(crate) fn new(size_px: [usize; 2], change: impl Fn(&mut simulate::Options)) -> Self {
        Self::in_folder(home(), size_px, change)
    }

    /// On the disk, whose speed matters for timings.
    pub(crate) fn on_disk(size_px: [usize; 2]) -> Self {
        // A dark cloth: exposures of half a second, as on the bench.
        Self::in_folder(tempfile::tempdir().unwrap(), size_px, |options| {
            options.material.preset = Preset::Denim;
        })
    }

    fn in_folder(
        home: tempfile::TempDir,
        size_px: [usize; 2],
        change: impl Fn(&mut simulate::Options),
    ) -> Self {
        let mut options = simulate::Options {
            out: home.path().join("rig"),
            size_px: Some(size_px),
            only: vec![Part::Swatch],
            // Blur costs a simulated camera time that a real one does not take.
            flaws: Flaws { psf_px: 0.0, ..Flaws::default() },
            ..simulate::Options::default()
        };
        change(&mut options);
        simulate::run(&options, &|_, _| ()).unwrap();
        let file = options.out.join("rig.toml");
        let (rig, scene) = (Rig::load(&file).unwrap(), Scene::beside(&file).unwrap());
        Self { home, rig, scene, bridge: None, log: Log::default() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    /// A camera with these eyes; at picture `at` (from 0) of the scan, and at all that follow while `fault` gives mishaps,
    /// `fault` happens.
    pub(crate) fn camera(&self, eyes: Eyes, at: usize, fault: Fault) -> Spy {
        let pins = Arc::new(Mutex::new(Vec::new()));
        let seen = Arc::clone(&pins);
        let bridge = self.bridge;
        let look: Eyes = Box::new(move || {
            let lit = eyes();
            seen.lock().unwrap().push(lit);
            match bridge {
                Some((output, led)) if lit == 1 << output => 1 << led,
                _ => lit,
            }
        });
        let inner = SimulatedCamera::new(&self.rig, self.scene.clone(), look).unwrap();
        Spy { inner, pins, log: Arc::clone(&self.log), at, fault, pictures: 0 }
    }

    pub(crate) fn options(&self, begin: Begin) -> Options {
        Options {
            folder: self.path("session"),
            subject: Subject::Swatch,
            about: About { name: Some("linen".to_owned()), thickness_mm: None },
            begin,
            exposure_s: Some(SETTINGS.exposure_s),
            iso: SETTINGS.iso,
            bracket: vec![],
        }
    }

    /// One run of a scan.
    pub(crate) fn scan(
        &self,
        port: PortChoice,
        camera: &mut dyn Camera,
        begin: Begin,
    ) -> Result<Summary, ScanError> {
        self.scan_with(port, camera, &self.options(begin))
    }

    pub(crate) fn scan_with(
        &self,
        port: PortChoice,
        camera: &mut dyn Camera,
        options: &Options,
    ) -> Result<Summary, ScanError> {
        let board = Board::open(port, Some(self.rig.lights.len()))?;
        scan(&self.rig, options, &board, camera, &Control::default(), &|_| ())
    }

    /// Every recorded frame is whole, unaltered, and of the light that it is said to be of; how many there are.
    pub(crate) fn check_frames(&self) -> usize {
        let session = Session::load(&self.path("session")).unwrap();
        let log = self.log.lock().unwrap();
        for frame in &session.frames {
            let hash = sha256_of_file(&session.frame_path(frame)).unwrap();
            assert_eq!(frame.sha256.as_ref(), Some(&hash), "{:?}", frame.file);
            let expected = frame.light.map_or(0, |light| 1 << self.rig.channel(light));
            assert_eq!(log.get(&hash), Some(&(expected, expected)), "{:?}", frame.file);
            // The trigger output may still be on when a file arrives.
            let lit = [frame.pins_open, frame.pins_close].map(|pins| pins.map(|p| p & 0xFFFF));
            assert_eq!(lit, [Some(expected); 2], "{:?}", frame.file);
        }
        session.frames.len()
    }
}

/// In memory where there is such a place: a killed process leaves the same there as on a disk, and flushing costs nothing.
fn home() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let there = memory.is_dir().then(|| tempfile::tempdir_in(memory).ok()).flatten();
    there.unwrap_or_else(|| tempfile::tempdir().unwrap())
}

/// A connection to the control socket.
pub(crate) struct Line(BufReader<UnixStream>);

impl Line {
    pub(crate) fn to(sim: &SimBoard) -> Self {
        Self(BufReader::new(UnixStream::connect(sim.socket()).unwrap()))
    }

    pub(crate) fn command(&mut self, command: &str) -> String {
        let mut reply = String::new();
        writeln!(self.0.get_mut(), "{command}").unwrap();
        self.0.read_line(&mut reply).unwrap();
        reply.trim_end().to_owned()
    }

    /// A camera's eyes on the simulated board.
    pub(crate) fn eyes(sim: &SimBoard) -> Eyes {
        let line = Mutex::new(Self::to(sim));
        Box::new(move || line.lock().unwrap().pins())
    }

    /// The board's time, microseconds.
    pub(crate) fn board_us(&mut self) -> u64 {
        self.command("pins").split(' ').next().unwrap().parse().unwrap()
    }

    /// The outputs.
    pub(crate) fn pins(&mut self) -> u32 {
        let reply = self.command("pins");
        u32::from_str_radix(reply.split(' ').nth(1).unwrap(), 16).unwrap()
    }
}

/// The simulated camera, with a fault in it.
pub(crate) struct Spy {
    inner: SimulatedCamera,
    pins: Arc<Mutex<Vec<u32>>>,
    log: Log,
    at: usize,
    fault: Fault,
    pictures: usize,
}

struct Between<'a> {
    outer: &'a mut dyn Shutter,
    then: &'a mut dyn FnMut(),
}

impl Shutter for Between<'_> {
    fn open(&mut self) {
        self.outer.open();
        // The fault happens while the shutter is open; the camera sees what comes of it.
        (self.then)();
    }

    fn closed(&mut self) {
        self.outer.closed();
    }
}

impl Camera for Spy {
    fn describe(&self) -> Description {
        self.inner.describe()
    }

    fn configure(&mut self, wanted: Settings) -> Result<Applied, CameraError> {
        self.inner.configure(wanted)
    }

    fn capture(
        &mut self,
        folder: &Path,
        shutter: &mut dyn Shutter,
    ) -> Result<PathBuf, CameraError> {
        let due = self.pictures >= self.at;
        self.pictures += 1;
        self.pins.lock().unwrap().clear();
        let (mut mishap, fault) = (None, &mut self.fault);
        let mut then = || {
            if due {
                mishap = fault();
            }
        };
        let path = self.inner.capture(folder, &mut Between { outer: shutter, then: &mut then })?;
        match mishap {
            Some(Mishap::Error(error)) => return Err(error),
            Some(Mishap::File(spoil)) => spoil(&path),
            None => {}
        }
        let pins = self.pins.lock().unwrap();
        self.log.lock().unwrap().insert(sha256_of_file(&path).unwrap(), (pins[0], pins[1]));
        Ok(path)
    }
}

/// No fault.
pub(crate) fn none() -> Fault {
    Box::new(|| None)
}

/// A fault that happens once.
pub(crate) fn once(mut act: impl FnMut() -> Option<Mishap> + Send + 'static) -> Fault {
    let mut done = false;
    Box::new(move || if std::mem::replace(&mut done, true) { None } else { act() })
}

/// An instrument's frame under one output, as a camera's file; the same for the same output.
pub(crate) fn prerendered(rig: &Rig, scene: &Scene, folder: &Path) -> HashMap<u32, PathBuf> {
    let pins = std::iter::once(0).chain((0..rig.lights.len()).map(|light| 1 << rig.channel(light)));
    pins.map(|lit| {
        let mut camera = SimulatedCamera::new(rig, scene.clone(), Box::new(move || lit)).unwrap();
        camera.configure(SETTINGS).unwrap();
        let path = camera.capture(folder, &mut ()).unwrap();
        let named = folder.join(format!("lit-{lit:05x}.dng"));
        std::fs::rename(path, &named).unwrap();
        (lit, named)
    })
    .collect()
}

/// Size of a rig's frames that are only to be told apart.
pub(crate) const SMALL: [usize; 2] = [96, 64];
