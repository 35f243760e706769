//! The program killed at random moments: the real firmware, the real port, a watched folder, and another program that saves
//! there what the camera saw.

use crate::laboratory::{Laboratory, Line, SETTINGS, SMALL, prerendered};
use crate::simboard::SimBoard;
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use weavelight::files::sha256_of_file;
use weavelight::session::{FrameEntry, MANIFEST, Session};
use weavelight::simulate;

/// The limit, in the board's time.
const DARK_AFTER_US: u64 = 1_000_000;

/// The other program: waits for the board's trigger, looks at the lights at both ends of the exposure, and saves the frame in
/// pieces.
pub(crate) struct TetheringProgram {
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Pictures of which the lights changed while the shutter was open.
    pub(crate) spoiled: Arc<AtomicUsize>,
}

const TRIGGER: u32 = 1 << 17;

impl TetheringProgram {
    pub(crate) fn start(sim: &SimBoard, frames: HashMap<u32, PathBuf>, folder: PathBuf) -> Self {
        let (end, spoiled) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let (ended, counted) = (Arc::clone(&end), Arc::clone(&spoiled));
        let mut line = Line::to(sim);
        let thread = std::thread::spawn(move || {
            let (mut number, mut before) = (0, 0);
            while !ended.load(Ordering::SeqCst) {
                let pins = line.pins();
                if pins & TRIGGER != 0 && before & TRIGGER == 0 {
                    let open = line.pins() & !TRIGGER;
                    std::thread::sleep(Duration::from_secs_f64(SETTINGS.exposure_s));
                    let close = line.pins() & !TRIGGER;
                    counted.fetch_add(usize::from(open != close), Ordering::SeqCst);
                    // Half lit is not what any of the frames shows; the ambient frame is as wrong.
                    let seen = if open == close { open } else { 0 };
                    save(&frames[&seen], &folder.join(format!("DSC_{number:04}.dng")));
                    number += 1;
                }
                before = pins;
                std::thread::sleep(Duration::from_millis(3));
            }
        });
        Self { end, thread: Some(thread), spoiled }
    }
}

fn save(frame: &Path, target: &Path) {
    use std::io::Write;
    let bytes = std::fs::read(frame).unwrap();
    let mut file = std::fs::File::create(target).unwrap();
    for piece in bytes.chunks(bytes.len() / 3 + 1) {
        file.write_all(piece).unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
}

impl Drop for TetheringProgram {
    fn drop(&mut self) {
        self.end.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Writes the rig's file for a watched folder and the board at `sim`.
pub(crate) fn watched_rig(laboratory: &Laboratory, sim: &SimBoard) -> PathBuf {
    let text = std::fs::read_to_string(laboratory.path("rig/rig.toml")).unwrap();
    let port = format!("[controller]\nkind = \"serial\"\nport = {:?}", sim.port());
    let text = text
        .replacen("kind = \"simulated\"", "kind = \"watched\"\nfolder = \"../watched\"", 1)
        .replacen("[controller]\nkind = \"simulated\"", &port, 1);
    let path = laboratory.path("rig/watched.toml");
    std::fs::write(&path, text).unwrap();
    std::fs::create_dir_all(laboratory.path("watched")).unwrap();
    path
}

fn start(laboratory: &Laboratory, session: &Path) -> Child {
    let program = assert_cmd::cargo::cargo_bin("weavelight");
    let exposure = SETTINGS.exposure_s.to_string();
    Command::new(program)
        .args(["scan", "--resume", "--iso", "1200", "--exposure-s", &exposure, "--rig"])
        .arg(laboratory.path("rig/watched.toml"))
        .arg("--out")
        .arg(session)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The recorded frames, each whole and of the right light.
fn frames(session: &Path, hashes: &HashMap<u32, String>) -> Vec<FrameEntry> {
    if !session.join(MANIFEST).exists() {
        return vec![];
    }
    let session = Session::load(session).expect("the manifest is whole at any moment");
    for frame in &session.frames {
        let found = sha256_of_file(&session.frame_path(frame)).expect("a recorded frame is there");
        assert_eq!(
            frame.sha256.as_ref(),
            Some(&found),
            "{:?} is not what was recorded",
            frame.file
        );
        let pins = frame.light.map_or(0, |light| 1 << light);
        assert_eq!(hashes[&pins], found, "{:?} is of another light", frame.file);
    }
    session.frames
}

/// Kills the program `kills` times and lets it finish whenever a capture session is complete.
fn check(kills: usize, seed: u8) {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let laboratory = Laboratory::new(SMALL, |_: &mut simulate::Options| ());
    watched_rig(&laboratory, &sim);
    let pictures = prerendered(&laboratory.rig, &laboratory.scene, &laboratory.path("rig"));
    let hashes =
        pictures.iter().map(|(pins, file)| (*pins, sha256_of_file(file).unwrap())).collect();
    let program = TetheringProgram::start(&sim, pictures, laboratory.path("watched"));
    let mut random = TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]);
    let (mut done, mut sessions, mut lit, mut latest_us) = (0, 0, 0, 0);
    let mut session = laboratory.path("session-0");
    let mut before: Vec<FrameEntry> = vec![];
    while done < kills {
        let mut child = start(&laboratory, &session);
        let moment = Duration::from_millis(u64::from(random.next_u32() % 2500));
        let ended = wait(&mut child, moment);
        if !ended {
            sim.edges();
            let (killed_us, pins) = sim.pins();
            child.kill().unwrap();
            child.wait().unwrap();
            done += 1;
            sim.wait_for_pins(0);
            if pins & 0xFFFF != 0 {
                let dark_us = sim.edges().iter().rev().find(|edge| edge.1 == 0).map(|edge| edge.0);
                let after_us = dark_us.unwrap_or(killed_us).saturating_sub(killed_us);
                assert!(after_us < DARK_AFTER_US, "dark {after_us} us after the kill");
                latest_us = latest_us.max(after_us);
                lit += 1;
            }
        }
        let now = frames(&session, &hashes);
        let lost = before.iter().find(|frame| !now.contains(frame));
        assert_eq!(lost, None, "a finished frame was lost");
        before = now;
        if ended {
            assert_eq!(before.len(), 12, "{:?}", child.wait_with_output());
            sessions += 1;
            session = laboratory.path(&format!("session-{sessions}"));
            before = vec![];
        }
    }
    // The last one finishes too.
    assert!(wait(&mut start(&laboratory, &session), Duration::from_secs(60)));
    assert_eq!(frames(&session, &hashes).len(), 12);
    println!(
        "{kills} kills over {} capture sessions, {lit} of them with a light on: dark {} ms later at most; {} pictures spoiled and taken again",
        sessions + 1,
        latest_us / 1000,
        program.spoiled.load(Ordering::SeqCst)
    );
}

/// Whether the process ends by itself, and well, within this time.
fn wait(child: &mut Child, time: Duration) -> bool {
    let start = Instant::now();
    while start.elapsed() < time {
        if let Some(status) = child.try_wait().unwrap() {
            let mut said = String::new();
            let _ = std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said);
            assert!(status.success(), "{said}");
            return true;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    false
}

#[test]
fn a_few_kills() {
    check(6, 1);
}

/// `make kills`: the number, or as many as WEAVELIGHT_KILLS says; another seed, other moments.
#[test]
#[ignore = "takes ten minutes: make kills"]
fn two_hundred_kills() {
    let number = |name: &str| std::env::var(name).ok().map(|text| text.parse::<usize>().unwrap());
    check(number("WEAVELIGHT_KILLS").unwrap_or(200), number("WEAVELIGHT_SEED").unwrap_or(2) as u8);
}
