//! Injects every fault of the table and holds what happens against it.

use crate::laboratory::{
    Fault, Laboratory, Line, Mishap, SETTINGS, SMALL, none, once, prerendered,
};
use crate::simboard::{SimBoard, skip};
use crate::table::{Case, cases};
use rustix::process::{Pid, Signal, kill_process};
use serialport::SerialPort;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use weavelight::device::board::{Board, PortChoice, SimulatedBoard};
use weavelight::device::camera::{Eyes, Waiting, WatchedCamera};
use weavelight::device::scan::{Begin, ScanError, Summary};
use weavelight::session::Session;
use weavelight::simulate::Scene;

/// How a scan with a fault ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    /// With every frame.
    Complete,
    /// With an error; what is finished stays, and `--resume` completes it once the fault is mended.
    Resumes,
    /// Before anything happens.
    Refused,
}

/// How often a fault happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Times {
    Once,
    Always,
}

/// How a fault is made.
#[derive(Clone, Copy)]
pub(crate) enum How {
    /// Commands to the simulated board before the scan.
    Wire(&'static [&'static str]),
    /// The same while the shutter is open for light 2.
    AtShutter(&'static [&'static str]),
    NoPort,
    BusyPort,
    /// Something behind the port that answers so to a request of this number.
    Answers(fn(&str) -> String),
    /// Something about the rig that it does not know.
    Scene(fn(&mut Scene)),
    /// An output that lights another one's LED.
    Bridge((u32, u32)),
    /// Another sensitivity.
    Iso(f64),
    /// At the picture of light 2.
    Camera(Times, fn() -> Mishap),
    /// Files that another program saves for every light.
    Watched(&'static [&'static str]),
    SmallDisk,
    DiskFills,
    Occupied,
    /// Something is done to a capture session that is almost complete.
    BeforeResume(fn(&Path)),
    Stopped,
    /// By another test.
    Elsewhere(&'static str),
}

/// What the program says, and what is then there; `None`: it could not be tried here.
type Outcome = Option<Result<Summary, String>>;

/// Light 2: after the ambient frame and two lights.
const AT: usize = 3;

#[test]
fn every_fault_does_what_the_table_says() {
    // What the user of the command line sees.
    weavelight::files::name_settings(|name| format!("--{name}"));
    let cases = cases();
    assert!(cases.len() >= 25);
    let (next, failures) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        // Most of the time is waiting.
        for _ in 0..4 {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::SeqCst)) {
                    let checked = std::panic::catch_unwind(|| check(case));
                    if let Err(panic) = checked {
                        let why = panic.downcast_ref::<String>().cloned().unwrap_or_default();
                        failures
                            .lock()
                            .unwrap()
                            .push(format!("{}: {}: {why}", case.place, case.fault));
                    }
                }
            });
        }
    });
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn check(case: &Case) {
    let start = Instant::now();
    let mut laboratory = Laboratory::new(SMALL, |_| ());
    let outcome = provoke(case, &mut laboratory);
    let Some(outcome) = outcome else {
        println!("not run: {}: {}", case.place, case.fault);
        return;
    };
    let said = match &outcome {
        Ok(summary) => {
            let retries = summary
                .retries
                .iter()
                .map(|(frame, why)| format!("{frame} was taken again: {why}"));
            retries.chain(summary.warnings.iter().cloned()).collect::<Vec<_>>().join("\n")
        }
        Err(said) => said.clone(),
    };
    println!("{:5.1} s {}: {}: {said}", start.elapsed().as_secs_f64(), case.place, case.fault);
    assert_eq!(outcome.is_ok(), case.ends == Ends::Complete, "{said}");
    assert!(said.contains(case.sees), "says {said:?}");
    if case.sees.is_empty() {
        assert_eq!(said, "", "nothing to see");
    }
}

fn provoke(case: &Case, laboratory: &mut Laboratory) -> Outcome {
    match case.how {
        How::Wire(commands) => with_firmware(laboratory, commands, none()),
        How::AtShutter(commands) => at_shutter(laboratory, commands),
        How::NoPort => Some(refused(laboratory, "/dev/ttyACM99".into())),
        How::BusyPort => {
            let sim = SimBoard::on_a_port(&[])?;
            let _board = Board::open(PortChoice::Path(sim.port()), None).unwrap();
            Some(refused(laboratory, sim.port()))
        }
        How::Answers(answer) => Some(refused(laboratory, something_else(answer))),
        How::Scene(change) => {
            let sound = laboratory.scene.clone();
            change(&mut laboratory.scene);
            let first = in_memory(laboratory, none(), Begin::Anew, SETTINGS.iso);
            laboratory.scene = sound;
            Some(then_resume(laboratory, first, SETTINGS.iso))
        }
        How::Bridge(bridge) => {
            laboratory.bridge = Some(bridge);
            Some(then_resume(
                laboratory,
                in_memory(laboratory, none(), Begin::Anew, SETTINGS.iso),
                SETTINGS.iso,
            ))
        }
        How::Iso(iso) => {
            Some(then_resume(laboratory, in_memory(laboratory, none(), Begin::Anew, iso), iso))
        }
        How::Camera(times, mishap) => {
            let act = move || Some(mishap());
            let fault: Fault = if times == Times::Once { once(act) } else { Box::new(act) };
            let first = in_memory(laboratory, fault, Begin::Anew, SETTINGS.iso);
            Some(then_resume(laboratory, first, SETTINGS.iso))
        }
        How::Watched(names) => Some(watched(laboratory, names)),
        How::SmallDisk => on_a_small_disk(laboratory, "size=4m", "true"),
        How::DiskFills => on_a_small_disk(
            laboratory,
            "size=40m",
            "while [ ! -e disk/s/light-02.dng ]; do sleep 0.01; done; head -c 100m /dev/zero > disk/fill 2> /dev/null",
        ),
        How::Occupied => {
            in_memory(laboratory, none(), Begin::Anew, SETTINGS.iso).unwrap();
            Some(in_memory(laboratory, none(), Begin::Anew, SETTINGS.iso))
        }
        How::BeforeResume(spoil) => {
            in_memory(laboratory, none(), Begin::Anew, SETTINGS.iso).unwrap();
            spoil(&laboratory.path("session"));
            Some(then_resume(
                laboratory,
                in_memory(laboratory, none(), Begin::Resume, SETTINGS.iso),
                SETTINGS.iso,
            ))
        }
        How::Stopped => Some(stopped(laboratory)),
        How::Elsewhere(test) => {
            println!("{}: see {test}", case.fault);
            None
        }
    }
}

fn words(result: Result<Summary, ScanError>) -> Result<Summary, String> {
    result.map_err(|error| {
        let said = error.to_string();
        assert!(said.lines().count() <= 2, "{said}");
        said
    })
}

/// A board in memory: for faults that are not the board's.
fn in_memory(
    laboratory: &Laboratory,
    fault: Fault,
    begin: Begin,
    iso: f64,
) -> Result<Summary, String> {
    let board = SimulatedBoard::new(10);
    let seen = board.clone();
    let eyes: Eyes = Box::new(move || seen.pins());
    let mut camera = laboratory.camera(eyes, AT, fault);
    let options = weavelight::device::scan::Options { iso, ..laboratory.options(begin) };
    let result = laboratory.scan_with(PortChoice::Simulated(board.clone()), &mut camera, &options);
    assert_eq!(board.pins(), 0, "dark at the end");
    words(result)
}

/// After an error, the mended rig resumes, and what was finished stays as it was. The first outcome is what counts.
fn then_resume(
    laboratory: &Laboratory,
    first: Result<Summary, String>,
    iso: f64,
) -> Result<Summary, String> {
    let before = laboratory.check_frames();
    if first.is_err() {
        let finished = Session::load(&laboratory.path("session")).unwrap().frames;
        in_memory(laboratory, none(), Begin::Resume, iso).unwrap();
        let after = Session::load(&laboratory.path("session")).unwrap().frames;
        assert!(finished.iter().all(|frame| after.contains(frame)), "a finished frame was lost");
        assert!(before < 12);
    }
    assert_eq!(laboratory.check_frames(), 12);
    first
}

fn with_firmware(laboratory: &Laboratory, commands: &[&str], fault: Fault) -> Outcome {
    let mut sim = SimBoard::on_a_port(&[])?;
    for command in commands {
        sim.command(command);
    }
    Some(with_board(laboratory, &mut sim, fault))
}

fn with_board(
    laboratory: &Laboratory,
    sim: &mut SimBoard,
    fault: Fault,
) -> Result<Summary, String> {
    let mut camera = laboratory.camera(Line::eyes(sim), AT, fault);
    let path = sim.port();
    let port = || PortChoice::Path(path.clone());
    let first = words(laboratory.scan(port(), &mut camera, Begin::Anew));
    expect_dark(sim);
    if first.is_err() {
        // Mended: an unplugged board comes back by itself.
        let start = Instant::now();
        let mut camera = laboratory.camera(Line::eyes(sim), AT, none());
        while let Err(error) = laboratory.scan(port(), &mut camera, Begin::Resume) {
            assert!(start.elapsed() < Duration::from_secs(30), "{error}");
            std::thread::sleep(Duration::from_millis(500));
        }
    }
    assert_eq!(laboratory.check_frames(), 12);
    expect_dark(sim);
    first
}

/// What the light must be after a fault and after the end, in microseconds of the board's clock: the limit.
const DARK_AFTER_US: u64 = 1_000_000;

fn expect_dark(sim: &mut SimBoard) {
    let (end_us, _) = sim.pins();
    sim.wait_for_pins(0);
    let dark_us = sim.pins().0;
    assert!(dark_us - end_us < DARK_AFTER_US, "dark {} us after the end", dark_us - end_us);
}

/// Does the commands once while the shutter is open for light 2: the light is off within a second, or still the right one.
fn at_shutter(laboratory: &Laboratory, commands: &'static [&'static str]) -> Outcome {
    let mut sim = SimBoard::on_a_port(&[])?;
    let mut line = Line::to(&sim);
    let begun = Arc::new(AtomicU64::new(0));
    let noted = Arc::clone(&begun);
    let fault = once(move || {
        noted.store(line.board_us(), Ordering::SeqCst);
        for command in commands {
            match command.strip_prefix("sleep ") {
                Some(ms) => std::thread::sleep(Duration::from_millis(ms.parse().unwrap())),
                None => drop(line.command(command)),
            }
        }
        None
    });
    let first = with_board(laboratory, &mut sim, fault);
    let (edges, begun_us) = (sim.edges(), begun.load(Ordering::SeqCst));
    assert!(edges.iter().all(|edge| (edge.1 & 0xFFFF).count_ones() <= 1), "two lights at once");
    let harmless = first.as_ref().is_ok_and(|summary| summary.retries.is_empty());
    let dark = edges.iter().find(|edge| edge.0 > begun_us && edge.1 & 0xFFFF == 0);
    let after_us = dark.map_or(u64::MAX, |edge| edge.0 - begun_us);
    assert!(harmless || after_us < DARK_AFTER_US, "dark {after_us} us after {commands:?}");
    Some(first)
}

fn refused(laboratory: &Laboratory, port: PathBuf) -> Result<Summary, String> {
    let mut camera = laboratory.camera(Box::new(|| 0), AT, none());
    let result = laboratory.scan(PortChoice::Path(port), &mut camera, Begin::Anew);
    assert!(!laboratory.path("session").exists(), "nothing is left behind");
    words(result)
}

/// Something that is not our board, behind a port.
fn something_else(answer: fn(&str) -> String) -> PathBuf {
    let (mut ours, mut theirs) = serialport::TTYPort::pair().unwrap();
    theirs.set_exclusive(false).unwrap();
    let name = theirs.name().unwrap();
    std::thread::spawn(move || {
        let mut bytes = [0; 64];
        loop {
            match ours.read(&mut bytes) {
                Ok(count) => {
                    let heard = String::from_utf8_lossy(&bytes[..count]).trim().to_owned();
                    let said = answer(heard.split(' ').next().unwrap_or_default());
                    let _ = ours.write_all(said.as_bytes());
                }
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    });
    name.into()
}

/// Another program saves `names` whenever a light is on.
fn watched(laboratory: &Laboratory, names: &'static [&'static str]) -> Result<Summary, String> {
    let folder = laboratory.path("watched");
    std::fs::create_dir(&folder).unwrap();
    let frames = prerendered(&laboratory.rig, &laboratory.scene, &laboratory.path("rig"));
    for (pins, frame) in &frames {
        let hash = weavelight::files::sha256_of_file(frame).unwrap();
        laboratory.log.lock().unwrap().insert(hash, (*pins, *pins));
    }
    let board = SimulatedBoard::new(10);
    let (seen, target) = (board.clone(), folder.clone());
    let jpeg = laboratory.path("rig/x.jpg");
    image::RgbImage::new(16, 16).save(&jpeg).unwrap();
    let cr3 = laboratory.path("rig/x.cr3");
    std::fs::write(&cr3, [&b"\0\0\0\x18ftypcrx \0\0\0\x01crx isom"[..], &[7; 4096]].concat())
        .unwrap();
    // It ends with the test's process.
    std::thread::spawn(move || {
        let (mut number, mut before) = (0, 0);
        loop {
            let pins = seen.pins();
            if pins & 1 << 17 != 0 && before & 1 << 17 == 0 {
                number += 1;
                std::thread::sleep(Duration::from_millis(60));
                for name in names {
                    let frame = match name.rsplit('.').next() {
                        Some("jpg") => &jpeg,
                        Some("cr3") => &cr3,
                        _ => &frames[&(pins & 0xFFFF)],
                    };
                    save(frame, &target, number, name);
                }
            }
            before = pins;
            std::thread::sleep(Duration::from_millis(3));
        }
    });
    let waiting = Waiting {
        arrival: Duration::from_millis(1500),
        partner: Duration::from_millis(3000),
        second: Duration::from_millis(1500),
        ..Waiting::default()
    };
    let mut camera = WatchedCamera::new(&folder, None, waiting);
    let port = PortChoice::Simulated(board);
    let first = words(laboratory.scan(port, &mut camera, Begin::Anew));
    then_resume(laboratory, first, SETTINGS.iso)
}

/// Saves a picture as other programs do: under a new name or one that repeats, the RAW file after its JPEG, or a second
/// picture when the next light is on.
fn save(frame: &Path, folder: &Path, number: usize, name: &'static str) {
    let path = match name {
        "late" => folder.join(format!("{number}late.dng")),
        repeats if repeats.starts_with("capt") => folder.join(repeats),
        _ => folder.join(format!("{number}{name}")),
    };
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let frame = frame.to_owned();
    match name {
        "late" => drop(std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(270));
            let _ = std::fs::copy(frame, path);
        })),
        _ => {
            let _ = std::fs::copy(frame, path);
            std::thread::sleep(Duration::from_millis(if name.ends_with("jpg") { 100 } else { 0 }));
        }
    }
}

const PROGRAM_ARGUMENTS: &str = "--exposure-s 0.02 --iso 1200";

/// The program itself with its target on a disk of this size, while `meanwhile` runs beside it.
fn on_a_small_disk(laboratory: &Laboratory, size: &str, meanwhile: &str) -> Outcome {
    let program = assert_cmd::cargo::cargo_bin("weavelight");
    let script = format!(
        "mkdir disk && mount -t tmpfs -o {size} none disk || exit 99
         ( {meanwhile} ) & other=$!
         {program} scan --rig rig/rig.toml --out disk/s {PROGRAM_ARGUMENTS}; status=$?
         wait $other; rm -f disk/fill
         if [ -e disk/s ]; then {program} scan --rig rig/rig.toml --out disk/s {PROGRAM_ARGUMENTS} --resume 2>/dev/null || exit 98; fi
         exit $status",
        program = program.display()
    );
    let output = Command::new("unshare")
        .args(["--user", "--map-root-user", "--mount", "bash", "-c", &script])
        .current_dir(laboratory.home.path())
        .output()
        .ok()?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    match output.status.code() {
        Some(1) if said.contains("error: ") => {
            Some(Err(said.lines().filter(|line| line.starts_with("error: ")).collect()))
        }
        Some(99) => skip::need("unshare", Err(format!("no small disk can be mounted: {said}"))),
        Some(98) => panic!("did not resume: {said}"),
        status => panic!("a full disk was not noticed ({status:?}): {said}"),
    }
}

/// The program stopped for two seconds in the middle of a frame.
fn stopped(laboratory: &Laboratory) -> Result<Summary, String> {
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("weavelight"))
        .args([
            "scan",
            "--rig",
            "rig/rig.toml",
            "--out",
            "session",
            "--exposure-s",
            "0.3",
            "--iso",
            "100",
        ])
        .current_dir(laboratory.home.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !laboratory.path("session/light-01.dng").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(150));
    let signal = |signal| kill_process(Pid::from_child(&child), signal).unwrap();
    signal(Signal::STOP);
    std::thread::sleep(Duration::from_secs(2));
    signal(Signal::CONT);
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    if !child.wait().unwrap().success() {
        return Err(said);
    }
    let session = Session::load(&laboratory.path("session")).unwrap();
    assert_eq!(session.frames.len(), 12);
    for frame in &session.frames {
        let expected = frame.light.map_or(0, |light| 1 << light);
        assert_eq!((frame.pins_open, frame.pins_close), (Some(expected), Some(expected)));
    }
    assert!(said.contains("was taken again: the light board went dark (SILENCE)"), "{said}");
    Ok(Summary {
        folder: session.folder.clone(),
        frames: 12,
        resumed: 0,
        settings: None,
        retries: vec![("a frame".to_owned(), "the light board went dark (SILENCE)".to_owned())],
        warnings: vec![],
        seconds: Default::default(),
    })
}

/// `docs/faults.md` is the table; `WEAVELIGHT_UPDATE_DOCS=1` writes it.
#[test]
fn the_document_is_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/faults.md");
    let expected = document();
    if std::env::var_os("WEAVELIGHT_UPDATE_DOCS").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == expected,
        "docs/faults.md is out of date; run this test with WEAVELIGHT_UPDATE_DOCS=1"
    );
}

fn document() -> String {
    let mut text = "# Faults: what the user sees\n\n\
        Every row is injected by a test (tests/scan/faults.rs; kills: tests/scan/kills.rs and `make kills`), which also sees that no\n\
        finished frame is lost, that every recorded frame is of its own light, and that the lights are off within a second. Wire and board:\n\
        the real firmware in a simulated processor. Camera: its error is injected where the scan meets it; that a real libgphoto2 leads to it\n\
        is tested beside the tethered camera. This file is written by that test: change tests/scan/table.rs.\n\n\
        | where | fault | what the program says | then |\n| --- | --- | --- | --- |\n"
        .to_owned();
    for case in cases() {
        let sees = match case.sees {
            "" => "nothing".to_owned(),
            sees => format!("... {}", sees.trim()),
        };
        let then = match case.ends {
            Ends::Complete => "the scan completes",
            Ends::Resumes => "the scan stops; finished frames stay, `--resume` completes it",
            Ends::Refused => "nothing is begun or changed",
        };
        text += &format!("| {} | {} | {sees} | {then} |\n", case.place, case.fault);
    }
    text
}
