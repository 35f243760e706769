//! The program in a real window, on a display of its own: started, a swatch scanned with the simulated board and camera, lit
//! anew, exported, quit. With `WEAVELIGHT_PICTURES=DIR` its pictures are kept there: the README's.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its table up has failed")]

mod desktop;
mod shell;

use desktop::{Desktop, exists, until};
use std::path::Path;
use std::time::{Duration, Instant};

/// Frames of the rig that is scanned: small, so that the test is quick; larger for pictures.
const FRAME: [usize; 2] = [308, 204];
const PICTURE_FRAME: [usize; 2] = [1232, 816];

/// Pixels that differ visibly between two pictures.
fn changed_pixels(before: &Path, after: &Path) -> usize {
    let read = |file: &Path| image::open(file).unwrap().to_rgb8();
    let differ =
        |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 8);
    read(before).pixels().zip(read(after).pixels()).filter(|pair| differ(*pair)).count()
}

#[test]
fn a_scan_in_a_real_window_is_lit_anew_and_exported() {
    let Some(mut desktop) = Desktop::start() else { return };
    let pictures = std::env::var_os("WEAVELIGHT_PICTURES").is_some();
    let (rig, settings) = desktop.rig(if pictures { PICTURE_FRAME } else { FRAME });

    desktop.open();
    desktop.key("ctrl+3");
    desktop.key("space");
    exists(&rig.join("scans/linen 1/light-05.dng"));
    desktop.picture("app-scan");
    exists(&rig.join("solutions/linen 1/report.json"));
    desktop.picture("app-scanned");
    desktop.key("ctrl+1");
    desktop.picture("app-rig");
    desktop.key("ctrl+2");
    desktop.picture("app-calibrate");
    desktop.key("ctrl+5");
    std::thread::sleep(Duration::from_secs(1));
    desktop.key("Right");
    desktop.picture("app-scans");
    desktop.key("ctrl+e");
    exists(&desktop.home().join("exports/linen 1 maps/normal.exr"));
    desktop.key("Return");
    std::thread::sleep(Duration::from_secs(2));
    let before = desktop.picture("app-look");
    // The hand on the light: it follows, and the cloth with it.
    desktop.xdotool(&["mousemove", "560", "420", "mousedown", "1"]);
    for place in [["520", "380"], ["470", "330"], ["420", "280"]] {
        desktop.xdotool(&["mousemove", place[0], place[1]]);
        std::thread::sleep(Duration::from_millis(150));
    }
    desktop.xdotool(&["mouseup", "1"]);
    let after = desktop.picture("app-relit");
    let changed = changed_pixels(&before, &after);
    assert!(changed > 50_000, "{changed} pixels changed under the light that was dragged");
    desktop.quit();
    let kept = std::fs::read_to_string(settings).unwrap();
    assert!(kept.contains("room = \"look\""), "the room is remembered:\n{kept}");
}

/// The program is killed while it scans; started again, it opens the rig and the room, and goes on where the scan stood.
#[test]
fn a_killed_window_reopens_the_scan_where_it_stood() {
    let Some(mut desktop) = Desktop::start() else { return };
    let (rig, _) = desktop.rig(FRAME);
    let scan = rig.join("scans/linen 1");
    desktop.open();
    desktop.key("ctrl+3");
    desktop.key("space");
    exists(&scan.join("light-04.dng"));
    desktop.kill();
    let frame = |light: usize| std::fs::metadata(scan.join(format!("light-{light:02}.dng")));
    assert!(frame(9).is_err(), "it was killed in the middle");
    let before = frame(3).unwrap().modified().unwrap();

    desktop.open();
    desktop.picture("app-reopened");
    // "Continue scan" has the keyboard from the start: one key goes on.
    desktop.key("Return");
    exists(&rig.join("solutions/linen 1/report.json"));
    assert!(frame(9).is_ok());
    assert_eq!(frame(3).unwrap().modified().unwrap(), before, "what was there is not taken again");
    desktop.quit();
}

/// From nothing to a hand on the light, as somebody does it who has only just installed the program: the simulated rig at a
/// quarter of full size, calibrated, a swatch scanned, looked at. `--run-ignored all --no-capture` tells how long it takes.
#[test]
#[ignore = "two minutes of measuring time"]
fn the_first_run_takes_five_minutes() {
    let Some(mut desktop) = Desktop::start() else { return };
    desktop.settings("schema = 1\nwindow_size = [1280.0, 800.0]\n");
    let rig = desktop.home().join("Weavelight/simulated rig");
    let begun = Instant::now();
    let tell = |what: &str| println!("{:5.1} s: {what}", begun.elapsed().as_secs_f64());
    desktop.open();
    tell("the window is there");
    // Where the buttons are in a window of 1280 x 800 points: see the rooms' pictures.
    let (try_it, calibrate, by_itself) = ([698, 287], [844, 259], [780, 128]);
    desktop.click(try_it);
    exists(&rig.join("rig.toml"));
    desktop.click(calibrate);
    desktop.click(by_itself);
    exists(&rig.join("calibration/camera.toml"));
    tell("the camera is calibrated");
    exists(&rig.join("calibration/lights.toml"));
    tell("the lights are calibrated");
    desktop.key("ctrl+3");
    // The big button wakes up when the check is done.
    until("the scan has begun", || {
        desktop.key("space");
        rig.join("scans/linen 1").exists().then_some(())
    });
    tell("the rig is checked, the scan has begun");
    exists(&rig.join("solutions/linen 1/report.json"));
    tell("the swatch is scanned and solved");
    std::thread::sleep(Duration::from_secs(1));
    desktop.key("Return");
    std::thread::sleep(Duration::from_secs(1));
    let before = desktop.picture("first-look");
    desktop.xdotool(&["mousemove", "500", "400", "mousedown", "1", "mousemove", "300", "500"]);
    let after = desktop.picture("first-relit");
    tell("the light is in the hand");
    assert!(changed_pixels(&before, &after) > 50_000);
    assert!(begun.elapsed() < Duration::from_secs(300));
    desktop.quit();
}
