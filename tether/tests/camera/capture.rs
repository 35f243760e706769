//! Taking frames.

use crate::fake::{Fault, Scene};
use crate::rigging::Bench;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use weavelight::device::camera::{Camera, CameraError, Release, Shutter};

/// Numbers its pictures, and writes down what happens.
struct Diary {
    events: Arc<Mutex<Vec<&'static str>>>,
    pictures: u8,
}

impl Scene for Diary {
    fn opened(&mut self, _exposure: Duration) {
        self.events.lock().unwrap().push("opened");
    }

    fn closed(&mut self) -> Vec<u8> {
        self.events.lock().unwrap().push("closed");
        self.pictures += 1;
        vec![self.pictures; 3 << 20]
    }
}

struct Told(Arc<Mutex<Vec<&'static str>>>);

impl Shutter for Told {
    fn open(&mut self) {
        self.0.lock().unwrap().push("told: opens");
    }

    fn closed(&mut self) {
        self.0.lock().unwrap().push("told: closed");
    }
}

#[test]
fn frames_come_whole_and_in_order_and_the_shutter_is_told_around_each() {
    let events = Arc::new(Mutex::new(Vec::new()));
    let bench = Bench::with(Diary { events: Arc::clone(&events), pictures: 0 });
    let mut camera = bench.ready();
    assert_eq!(camera.describe().release, Release::Itself);
    assert!(camera.describe().model.contains("D5100"), "{:?}", camera.describe());
    for number in 1..=3 {
        let picture = bench.shoot_and_tell(&mut camera, &mut Told(Arc::clone(&events))).unwrap();
        assert!(picture == vec![number; 3 << 20], "picture {number} is another");
        let told = std::mem::take(&mut *events.lock().unwrap());
        assert_eq!(told, ["told: opens", "opened", "closed", "told: closed"]);
    }
    assert_eq!(bench.files(), ["tethered-0001.nef", "tethered-0002.nef", "tethered-0003.nef"]);
}

#[test]
fn a_picture_that_comes_too_late_is_not_taken_for_the_next_one() {
    let events = Arc::new(Mutex::new(Vec::new()));
    let bench = Bench::with(Diary { events, pictures: 0 });
    let mut camera = bench.ready();
    bench.camera.fail(Fault::Late(Duration::from_millis(1500)));
    let error = bench.shoot(&mut camera).unwrap_err();
    assert!(matches!(error, CameraError::NoPicture { .. }), "{error}");
    bench.camera.repair();
    std::thread::sleep(Duration::from_secs(1));
    let picture = bench.shoot(&mut camera).unwrap();
    assert_eq!(picture[0], 2, "the picture of the capture before");
}

/// A frame of a D5100 is about so large.
const FRAME: usize = 16 << 20;
/// Far above what it takes (0.2 s), for machines that do more than this.
const SLOW: Duration = Duration::from_secs(3);

#[test]
fn a_frame_of_full_size_comes_quickly() {
    let noise: Vec<u8> =
        (0..FRAME as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let bench = Bench::with(crate::fake::Still(noise.clone()));
    let mut camera = bench.ready();
    let mut times = Vec::new();
    for _ in 0..3 {
        let start = Instant::now();
        let picture = bench.shoot(&mut camera).unwrap();
        times.push(start.elapsed());
        assert!(picture == noise, "the picture is another");
    }
    println!("capture of 20 ms and transfer of 16 MiB: {times:?}");
    assert!(times.iter().all(|time| *time < SLOW), "{times:?}");
}
