//! Wall time of a scan beside what camera and exposure need.

use crate::laboratory::{Laboratory, Line};
use crate::simboard::SimBoard;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use weavelight::device::board::{Board, PortChoice};
use weavelight::device::camera::{
    Applied, Camera, CameraError, Description, Release, Settings, Shutter,
};
use weavelight::device::scan::{About, Begin, Control, Options, Subject, scan};
use weavelight::session::Session;

/// Full size, as the reference camera's.
const FULL: [usize; 2] = [4928, 3264];
/// What a tethered camera of this kind needs for a frame.
const TRANSFER: Duration = Duration::from_millis(350);

/// Hands over frames that were rendered before, chosen by the pins, at the speed of a tethered camera.
struct Prerendered {
    frames: HashMap<u32, PathBuf>,
    line: Line,
    exposure_s: f64,
    exposures: Vec<(u32, u32)>,
    /// Exposure and transfer, as the camera knows them.
    busy: Duration,
}

impl Camera for Prerendered {
    fn describe(&self) -> Description {
        Description { model: "prerendered".to_owned(), release: Release::Itself }
    }

    fn configure(&mut self, wanted: Settings) -> Result<Applied, CameraError> {
        Ok(Applied::Set(wanted))
    }

    fn capture(
        &mut self,
        folder: &Path,
        shutter: &mut dyn Shutter,
    ) -> Result<PathBuf, CameraError> {
        shutter.open();
        let start = Instant::now();
        let open = self.line.pins();
        std::thread::sleep(Duration::from_secs_f64(self.exposure_s));
        let close = self.line.pins();
        self.busy += start.elapsed();
        shutter.closed();
        let start = Instant::now();
        let target = folder.join("DSC_0001.dng");
        std::fs::copy(&self.frames[&open], &target).unwrap();
        std::thread::sleep(TRANSFER.saturating_sub(start.elapsed()));
        self.busy += start.elapsed();
        self.exposures.push((open, close));
        Ok(target)
    }
}

/// `make scan-timing`
#[test]
#[ignore = "renders full-size frames: make scan-timing"]
fn ten_full_size_frames() {
    let Some(sim) = SimBoard::on_a_port(&[]) else { return };
    let laboratory = Laboratory::on_disk(FULL);
    let swatch = Session::load(&laboratory.path("rig/swatch")).unwrap();
    let exposure_s = swatch.frames[0].exposure_s;
    let taken = swatch.frames.iter().filter(|frame| !frame.drift_check);
    let frames: HashMap<u32, PathBuf> = taken
        .map(|frame| (frame.light.map_or(0, |light| 1 << light), swatch.frame_path(frame)))
        .collect();
    let bytes = std::fs::metadata(&frames[&1]).unwrap().len();
    let mut camera = Prerendered {
        frames,
        line: Line::to(&sim),
        exposure_s,
        exposures: vec![],
        busy: Duration::ZERO,
    };
    let options = Options {
        folder: laboratory.path("session"),
        subject: Subject::Swatch,
        about: About { name: None, thickness_mm: None },
        begin: Begin::Anew,
        exposure_s: Some(exposure_s),
        iso: 100.0,
        bracket: vec![],
    };
    let board = Board::open(PortChoice::Path(sim.port()), Some(10)).unwrap();
    let start = Instant::now();
    let summary =
        scan(&laboratory.rig, &options, &board, &mut camera, &Control::default(), &|_| ()).unwrap();
    let (wall, busy) = (start.elapsed().as_secs_f64(), camera.busy.as_secs_f64());
    println!(
        "{} frames of {} MB: {wall:.2} s, of which exposure and transfer {busy:.2} s: overhead {:.1} %",
        summary.frames,
        bytes >> 20,
        100.0 * (wall / busy - 1.0)
    );
    println!("{:?}", summary.seconds);
    let expected: Vec<u32> =
        std::iter::once(0).chain((0..10).map(|light| 1 << light)).chain([1]).collect();
    let seen: Vec<u32> = camera.exposures.iter().map(|pins| pins.0).collect();
    assert_eq!(seen, expected, "every frame of its light");
    assert!(camera.exposures.iter().all(|(open, close)| open == close));
    assert!(wall <= 1.1 * busy, "{wall} s for {busy} s of exposure and transfer");
}
