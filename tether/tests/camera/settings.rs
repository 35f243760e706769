//! Setting the camera up: from its own lists, read back, and nothing else.

use crate::fake::{code, dial, quality};
use crate::rigging::{Bench, SETTINGS};
use weavelight::device::camera::tethered::diagnose;
use weavelight::device::camera::{Applied, Camera, CameraError, Settings};

#[test]
fn whatever_a_measurement_needs_is_set() {
    let bench = Bench::new();
    bench.ready();
    let check =
        |code: u16, expected: u32| assert_eq!(bench.camera.setting(code), expected, "{code:04X}");
    check(code::SHUTTER, 200);
    check(code::ISO, 100);
    check(code::QUALITY, quality::NEF);
    check(code::AUTO_ISO, 0);
    check(code::LONG_EXPOSURE_NOISE, 0);
    check(code::RELEASE, 1);
    assert_ne!(bench.camera.setting(code::WHITE_BALANCE), 2, "automatic");
}

#[test]
fn a_fixed_white_balance_stays() {
    let bench = Bench::new();
    bench.camera.turn(code::WHITE_BALANCE, 6);
    bench.ready();
    assert_eq!(bench.camera.setting(code::WHITE_BALANCE), 6);
}

#[test]
fn the_nearest_exposure_that_the_camera_has_is_taken() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let check = |camera: &mut dyn Camera, wanted: f64, expected: f64| {
        let applied = camera.configure(Settings { exposure_s: wanted, iso: 200.0 }).unwrap();
        assert_eq!(applied, Applied::Set(Settings { exposure_s: expected, iso: 200.0 }));
    };
    check(&mut camera, 0.5, 0.5);
    check(&mut camera, 0.45, 0.5);
    check(&mut camera, 1.0 / 60.0, 0.0166);
    check(&mut camera, 30.0, 30.0);
}

#[test]
fn what_the_camera_does_not_have_is_refused_with_what_it_has() {
    let bench = Bench::new();
    let mut camera = bench.open().unwrap();
    let mut check = |exposure_s: f64, iso: f64, expected: &str| {
        let error = camera.configure(Settings { exposure_s, iso }).unwrap_err();
        assert!(matches!(error, CameraError::Setting { .. }), "{error}");
        assert!(error.to_string().contains(expected), "{error}");
    };
    check(100.0, 100.0, "it has 30.0000s");
    check(0.5, 50.0, "it has 100");
    check(f64::NAN, 100.0, "exposure");
    assert!(camera.configure(SETTINGS).is_ok(), "after being refused");
}

#[test]
fn a_dial_off_m_is_told() {
    let bench = Bench::new();
    let check = |dial: u32, mode: &str| {
        bench.camera.turn_dial(dial);
        let error = bench.open().unwrap().configure(SETTINGS).unwrap_err();
        assert!(matches!(&error, CameraError::WrongMode { mode: told } if told == mode), "{error}");
        println!("{error}");
    };
    check(dial::PROGRAM, "P");
    check(dial::AUTO, "Auto");
    bench.camera.turn_dial(dial::MANUAL);
    bench.ready();
}

#[test]
fn a_low_battery_is_told_before_anything_is_begun() {
    let bench = Bench::new();
    bench.camera.turn(code::BATTERY, 4);
    let error = bench.open().unwrap().configure(SETTINGS).unwrap_err();
    assert!(matches!(error, CameraError::BatteryLow { percent: Some(5) }), "{error}");
}

#[test]
fn the_users_own_settings_of_libgphoto2_are_not_touched() {
    let bench = Bench::new();
    bench.ready();
    let settings = std::fs::read_to_string(bench.home().join(".gphoto/settings")).unwrap();
    assert!(settings.contains("capturetarget=sdram"), "{settings}");
}

#[test]
fn a_diagnosis_tells_what_is_there() {
    let bench = Bench::new();
    let found = diagnose(&bench.tether());
    assert!(found.libgphoto2.unwrap().starts_with("2."));
    let [camera] = &found.cameras[..] else { panic!("{:?}", found.cameras) };
    assert!(camera.model.contains("D5100"), "{camera:?}");
    assert_eq!(camera.battery_percent, Some(80));
    assert!(camera.problem.is_none(), "{camera:?}");
    let tether = bench.tether();
    drop(bench);
    let found = diagnose(&tether);
    assert!(
        matches!(found.cameras[0].problem, Some(CameraError::NoneFound)),
        "{:?}",
        found.cameras
    );
}
