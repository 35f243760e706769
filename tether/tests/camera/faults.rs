//! Everything that goes wrong with a camera: which error it is, that nothing is left behind, and that the next frame comes as
//! soon as the cause is gone.

use crate::fake::{FakeCamera, Fault, code};
use crate::rigging::{Bench, SETTINGS};
use std::time::{Duration, Instant};
use weavelight::device::camera::tethered::{Tether, TetheredCamera};
use weavelight::device::camera::{Camera, CameraError};

/// The fault while a frame is taken, then its end.
fn check(fault: Fault, expected: impl Fn(&CameraError) -> bool) {
    check_with(fault, expected, |tether| tether);
}

fn check_with(
    fault: Fault,
    expected: impl Fn(&CameraError) -> bool,
    change: impl Fn(Tether) -> Tether,
) {
    let bench = Bench::new();
    let mut camera = TetheredCamera::open(change(bench.tether())).unwrap();
    camera.configure(SETTINGS).unwrap();
    bench.camera.fail(fault);
    let error = bench.shoot(&mut camera).unwrap_err();
    assert!(expected(&error), "{fault:?}: {error}");
    println!("{fault:?}: {error}");
    assert_eq!(bench.files(), [""; 0], "{fault:?} left something behind");
    bench.camera.repair();
    let picture = bench.shoot(&mut camera).unwrap();
    assert!(picture.starts_with(b"a picture"), "after {fault:?}");
    assert_eq!(bench.camera.setting(code::SHUTTER), 200, "after {fault:?}");
}

#[test]
fn out_of_focus() {
    check(Fault::OutOfFocus, |error| matches!(error, CameraError::OutOfFocus));
}

#[test]
fn card_full() {
    check(Fault::CardFull, |error| matches!(error, CameraError::CardFull));
}

#[test]
fn no_picture() {
    check(Fault::NoObject, |error| matches!(error, CameraError::NoPicture { .. }));
}

#[test]
fn the_link_is_cut_during_the_transfer() {
    check(Fault::CutAfter(7), |error| matches!(error, CameraError::LinkLost { .. }));
}

#[test]
fn an_error_instead_of_the_picture() {
    check(Fault::DownloadError, |error| matches!(error, CameraError::Refused { .. }));
}

#[test]
fn jpeg_instead_of_raw() {
    check(Fault::Jpeg, |error| matches!(error, CameraError::NotRaw { found } if found == "JPEG"));
}

#[test]
fn it_stops_answering() {
    check(Fault::Frozen, |error| matches!(error, CameraError::Asleep));
}

#[test]
fn it_never_becomes_ready_and_the_blocked_helper_is_killed() {
    let start = Instant::now();
    check_with(
        Fault::NeverReady,
        |error| matches!(error, CameraError::NeverReady { .. }),
        |tether| Tether { patience: Duration::from_secs(3), ..tether },
    );
    assert!(start.elapsed() < Duration::from_secs(30), "{:?}", start.elapsed());
}

#[test]
fn a_camera_that_cannot_be_had_is_named_as_such() {
    let check = |fault: Fault, expected: fn(&CameraError) -> bool| {
        let bench = Bench::new();
        bench.camera.fail(fault);
        let error = bench.open().unwrap_err();
        assert!(expected(&error), "{fault:?}: {error}");
        println!("{fault:?}: {error}");
        bench.camera.repair();
        assert!(bench.ready().opened().model.contains("D5100"));
    };
    check(Fault::Asleep, |error| matches!(error, CameraError::Asleep));
    check(Fault::Claimed, |error| matches!(error, CameraError::Claimed { .. }));
}

#[test]
fn a_camera_that_the_helper_of_a_killed_scan_still_holds_is_waited_for() {
    let bench = Bench::new();
    bench.camera.fail(Fault::Claimed);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_secs(1));
            bench.camera.repair();
        });
        bench.open().unwrap();
    });
}

#[test]
fn no_camera() {
    let mut tether = Bench::new().tether();
    // Nobody listens where the camera was.
    let error = TetheredCamera::open(tether.clone()).unwrap_err();
    assert!(matches!(error, CameraError::NoneFound), "{error}");
    tether.port = Some("usb:099,099".to_owned());
    let error = TetheredCamera::open(tether.clone()).unwrap_err();
    assert!(matches!(error, CameraError::NoneFound), "{error}");
    tether.port = Some("nonsense".to_owned());
    let error = TetheredCamera::open(tether).unwrap_err();
    assert!(matches!(error, CameraError::NoneFound), "{error}");
}

#[test]
fn a_camera_that_is_switched_off_between_frames_is_missed_and_found_again() {
    let mut bench = Bench::new();
    let mut camera = bench.ready();
    bench.shoot(&mut camera).unwrap();
    bench.camera.fail(Fault::CutAfter(0));
    assert!(bench.shoot(&mut camera).is_err());
    let port = bench.camera.port();
    bench.camera = FakeCamera::start(crate::fake::Still(Vec::new()));
    let error = bench.shoot(&mut camera).unwrap_err();
    assert!(matches!(error, CameraError::NoneFound), "{error} at {port}");
}

#[test]
fn a_full_disk_is_no_fault_of_the_camera() {
    let bench = Bench::new();
    let mut camera = bench.ready();
    let gone = bench.frames().join("nowhere");
    let error = camera.capture(&gone, &mut ()).unwrap_err();
    println!("{error}");
    assert!(error.to_string().contains("nowhere"), "{error}");
    assert!(bench.shoot(&mut camera).is_ok());
}
