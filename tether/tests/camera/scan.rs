//! A whole scan with everything real but the hardware: the firmware in a simulated processor behind a pseudo-terminal, the serial
//! port crate, the helper process, libgphoto2, and a camera that looks which of the board's pins are lit.

use crate::fake::{FakeCamera, Fault, Scene};
use crate::rigging::tether_to;
use crate::simboard::SimBoard;
use std::collections::{HashMap, VecDeque};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use weavelight::compare::{self, Figures, Kind};
use weavelight::device::board::{Board, PortChoice};
use weavelight::device::camera::{Camera, Settings, SimulatedCamera, TetheredCamera};
use weavelight::device::scan::{About, Begin, Control, Event, Options, Subject, Summary, scan};
use weavelight::files::sha256_of_file;
use weavelight::instrument::Rig;
use weavelight::session::Session;
use weavelight::simulate::{self, Part};
use weavelight::solve;
use weavelight_sim::cloth::Preset;

const ISO: f64 = 100.0;

/// Which outputs were lit when the shutter opened and closed, by the picture's hash.
type Log = Arc<Mutex<HashMap<String, (u32, u32)>>>;

/// The board's pins.
struct Eyes(BufReader<UnixStream>);

impl Eyes {
    fn on(board: &SimBoard) -> Self {
        Self(BufReader::new(UnixStream::connect(board.socket()).unwrap()))
    }

    fn lit(&mut self) -> u32 {
        let mut reply = String::new();
        writeln!(self.0.get_mut(), "pins").unwrap();
        self.0.read_line(&mut reply).unwrap();
        u32::from_str_radix(reply.trim_end().split(' ').nth(1).unwrap(), 16).unwrap()
    }
}

/// The table with the swatch, under whatever light is on.
struct Table {
    eyes: Eyes,
    /// What the pins were at open and close, for the one that renders.
    seen: Arc<Mutex<VecDeque<u32>>>,
    renderer: SimulatedCamera,
    folder: tempfile::TempDir,
    log: Log,
}

impl Table {
    fn look(&mut self) -> u32 {
        let lit = self.eyes.lit();
        self.seen.lock().unwrap().push_back(lit);
        lit
    }
}

impl Scene for Table {
    fn opened(&mut self, exposure: Duration) {
        let settings = Settings { exposure_s: exposure.as_secs_f64(), iso: ISO };
        self.renderer.configure(settings).unwrap();
        self.seen.lock().unwrap().clear();
        self.look();
    }

    fn closed(&mut self) -> Vec<u8> {
        self.look();
        let pins: Vec<u32> = self.seen.lock().unwrap().iter().copied().collect();
        let file = self.renderer.capture(self.folder.path(), &mut ()).unwrap();
        self.log.lock().unwrap().insert(sha256_of_file(&file).unwrap(), (pins[0], pins[1]));
        let bytes = std::fs::read(&file).unwrap();
        std::fs::remove_file(file).unwrap();
        bytes
    }
}

/// A simulated rig's folder, the simulated board, and a scan of it.
struct Laboratory {
    home: tempfile::TempDir,
    rig: Rig,
    board: SimBoard,
}

impl Laboratory {
    fn new(size_px: [usize; 2]) -> Option<Self> {
        let board = SimBoard::on_a_port(&[])?;
        let home = tempfile::tempdir().unwrap();
        let mut options = simulate::Options {
            out: home.path().join("rig"),
            size_px: Some(size_px),
            only: vec![Part::Swatch],
            ..simulate::Options::default()
        };
        // A cloth that does not depend on where within a pixel it is looked at.
        options.material.preset = Preset::Facets;
        simulate::run(&options, &|_, _| ()).unwrap();
        let rig = Rig::load(&options.out.join("rig.toml")).unwrap();
        Some(Self { home, rig, board })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    fn renderer(&self, eyes: weavelight::device::camera::Eyes) -> SimulatedCamera {
        let scene = simulate::Scene::beside(&self.path("rig/rig.toml")).unwrap();
        SimulatedCamera::new(&self.rig, scene, eyes).unwrap()
    }

    fn table(&self, log: &Log) -> Table {
        let seen = Arc::new(Mutex::new(VecDeque::new()));
        let queue = Arc::clone(&seen);
        let eyes = Box::new(move || queue.lock().unwrap().pop_front().unwrap());
        Table {
            eyes: Eyes::on(&self.board),
            seen,
            renderer: self.renderer(eyes),
            folder: tempfile::tempdir().unwrap(),
            log: Arc::clone(log),
        }
    }

    fn scan(&self, camera: &FakeCamera, exposure_s: f64, tell: &dyn Fn(&Event)) -> Summary {
        let options = Options {
            folder: self.path("session"),
            subject: Subject::Swatch,
            about: About { name: None, thickness_mm: None },
            begin: Begin::Anew,
            exposure_s: Some(exposure_s),
            iso: ISO,
            bracket: vec![],
        };
        let mut camera = TetheredCamera::open(tether_to(camera, &self.path("home"))).unwrap();
        let board =
            Board::open(PortChoice::Path(self.board.port()), Some(self.rig.lights.len())).unwrap();
        scan(&self.rig, &options, &board, &mut camera, &Control::default(), tell).unwrap()
    }

    /// Every recorded frame is unaltered, and of the light that it is said to be of.
    fn check_frames(&self, log: &Log) {
        let session = Session::load(&self.path("session")).unwrap();
        assert_eq!(session.frames.len(), 12);
        for frame in &session.frames {
            let hash = sha256_of_file(&session.frame_path(frame)).unwrap();
            assert_eq!(frame.sha256.as_ref(), Some(&hash), "{:?}", frame.file);
            let expected = frame.light.map_or(0, |light| 1 << self.rig.channel(light));
            assert_eq!(
                log.lock().unwrap().get(&hash),
                Some(&(expected, expected)),
                "{:?}",
                frame.file
            );
            assert_eq!((frame.pins_open, frame.pins_close), (Some(expected), Some(expected)));
        }
    }

    /// RMS error of the normals that a capture session gives, degrees.
    fn error_deg(&self, session: &Path, name: &str) -> f64 {
        let out = self.path(name);
        let calibration = self.path("rig/calibration");
        solve::run(&solve::Options::new(session.to_owned(), calibration, &out), &|_| (), None)
            .unwrap();
        let options = compare::Options {
            a: out.join("normal.exr"),
            b: self.path("rig/truth/normal.exr"),
            mask: None,
            kind: Some(Kind::Normal),
        };
        match compare::run(&options).unwrap().figures {
            Figures::Normal(figures) => figures.rms_deg,
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_tethered_scan_with_faults_on_the_way_solves_to_the_right_fabric() {
    let Some(laboratory) = Laboratory::new([330, 218]) else { return };
    let log = Log::default();
    let camera = FakeCamera::start(laboratory.table(&log));
    // Passing faults at three of the frames: each is taken again, of its own light.
    let faults = Mutex::new(HashMap::from([
        (3, Fault::CutAfter(1000)),
        (6, Fault::NoObject),
        (9, Fault::DownloadError),
    ]));
    let tell = |event: &Event| match event {
        Event::Frame { done, .. } => match faults.lock().unwrap().remove(done) {
            Some(fault) => camera.fail(fault),
            None => camera.repair(),
        },
        Event::Again { frame, why } => println!("{frame}: {why}"),
        _ => {}
    };
    // As `simulate` exposes it, or what the camera has next to that.
    let own = Session::load(&laboratory.path("rig/swatch")).unwrap().frames[0].exposure_s;
    let summary = laboratory.scan(&camera, own, &tell);
    assert_eq!((summary.frames, summary.retries.len()), (12, 3), "{:?}", summary.retries);
    laboratory.check_frames(&log);
    let scanned = laboratory.error_deg(&laboratory.path("session"), "scanned");
    let simulated = laboratory.error_deg(&laboratory.path("rig/swatch"), "simulated");
    println!("normals: {scanned:.3} degrees from the scan, {simulated:.3} from `simulate`");
    assert!(scanned < 1.1 * simulated, "{scanned} degrees, but {simulated} from `simulate`");
}

/// Frames that were rendered before, chosen by the pins.
struct Prerendered {
    eyes: Eyes,
    frames: HashMap<u32, Vec<u8>>,
    open: u32,
    log: Log,
    hashes: HashMap<u32, String>,
}

impl Scene for Prerendered {
    fn opened(&mut self, _exposure: Duration) {
        self.open = self.eyes.lit();
    }

    fn closed(&mut self) -> Vec<u8> {
        let close = self.eyes.lit();
        self.log.lock().unwrap().insert(self.hashes[&self.open].clone(), (self.open, close));
        self.frames[&self.open].clone()
    }
}

const EXPOSURE_S: f64 = 0.5;

/// `make tether-timing`
#[test]
#[ignore = "renders full-size frames: make tether-timing"]
fn ten_full_size_frames() {
    let Some(laboratory) = Laboratory::new([4928, 3264]) else { return };
    let (mut frames, mut hashes) = (HashMap::new(), HashMap::new());
    for lit in std::iter::once(0).chain((0..10).map(|light| 1 << light)) {
        let mut renderer = laboratory.renderer(Box::new(move || lit));
        renderer.configure(Settings { exposure_s: EXPOSURE_S, iso: ISO }).unwrap();
        let file = renderer.capture(laboratory.home.path(), &mut ()).unwrap();
        hashes.insert(lit, sha256_of_file(&file).unwrap());
        frames.insert(lit, std::fs::read(&file).unwrap());
        std::fs::remove_file(file).unwrap();
    }
    let log = Log::default();
    let eyes = Eyes::on(&laboratory.board);
    let scene = Prerendered { eyes, frames, open: 0, log: Arc::clone(&log), hashes };
    let camera = FakeCamera::start(scene);
    let start = Instant::now();
    let summary = laboratory.scan(&camera, EXPOSURE_S, &|_| ());
    let wall_s = start.elapsed().as_secs_f64();
    let seconds = summary.seconds;
    let busy_s = seconds.exposing + seconds.transfer;
    println!(
        "12 frames: {wall_s:.2} s with connecting, {:.2} s from the first light on, of which exposure and transfer {busy_s:.2} s: overhead {:.1} %; {seconds:?}",
        seconds.total,
        100.0 * (seconds.total / busy_s - 1.0)
    );
    laboratory.check_frames(&log);
    assert!(
        seconds.total <= 1.1 * busy_s,
        "{} s for {busy_s} s of exposure and transfer",
        seconds.total
    );
}
