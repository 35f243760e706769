//! Every fault that is injected, what the user sees, and what becomes of the scan: the source of `docs/faults.md`.

use crate::faults::{Ends, How, Times};
use crate::laboratory::Mishap;
use std::path::Path;
use std::time::Duration;
use weavelight::device::camera::CameraError;
use weavelight::simulate::{Instrument, Options};

/// One fault.
pub(crate) struct Case {
    pub(crate) place: &'static str,
    pub(crate) fault: &'static str,
    /// A part of what the program says; empty: it says nothing, and nothing is lost.
    pub(crate) sees: &'static str,
    pub(crate) ends: Ends,
    pub(crate) how: How,
}

const fn case(
    place: &'static str,
    fault: &'static str,
    sees: &'static str,
    ends: Ends,
    how: How,
) -> Case {
    Case { place, fault, sees, ends, how }
}

const WAITED: Duration = Duration::from_secs(20);

fn halve(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    std::fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
}

fn jpeg(path: &Path) {
    image::RgbImage::new(96, 64).save_with_format(path, image::ImageFormat::Jpeg).unwrap();
}

fn smaller(path: &Path) {
    let options = Options { size_px: Some([48, 32]), ..Options::default() };
    let instrument = Instrument::from_options(&options).unwrap();
    let bytes = instrument.encode(&[900; 48 * 32], 0.02, 1200.0, None).unwrap();
    std::fs::write(path, bytes).unwrap();
}

fn longer(path: &Path) {
    let options = Options { size_px: Some([96, 64]), ..Options::default() };
    let instrument = Instrument::from_options(&options).unwrap();
    let bytes = instrument.encode(&[900; 96 * 64], 0.5, 1200.0, None).unwrap();
    std::fs::write(path, bytes).unwrap();
}

/// The table.
pub(crate) fn cases() -> Vec<Case> {
    [wire(), board(), lights(), camera_once(), camera_lasting(), files(), disk()]
        .into_iter()
        .flatten()
        .collect()
}

fn wire() -> Vec<Case> {
    use Ends::Complete;
    vec![
        case(
            "wire",
            "half a per cent of the bytes lost, both ways",
            "",
            Complete,
            How::Wire(&["seed 5", "drop 0.005"]),
        ),
        case(
            "wire",
            "half a per cent of the bytes damaged, both ways",
            "",
            Complete,
            How::Wire(&["seed 6", "flip 0.005"]),
        ),
        case(
            "wire",
            "bytes come 20 ms late",
            "",
            Complete,
            How::Wire(&["seed 7", "delay 0.01 20"]),
        ),
        case(
            "wire",
            "cut for 0.2 s while a shutter is open",
            "",
            Complete,
            How::AtShutter(&["mute 1", "sleep 200", "mute 0", "sleep 100"]),
        ),
        case(
            "wire",
            "cut for 1 s while a shutter is open",
            "light 2 was taken again: the outputs changed from 00004 to 00000",
            Complete,
            How::AtShutter(&["mute 1", "sleep 1000", "mute 0", "sleep 300"]),
        ),
        case(
            "wire",
            "cut for 4 s while a shutter is open",
            "light 2 was taken again: the light board did not answer",
            Complete,
            How::AtShutter(&["mute 1", "sleep 4000", "mute 0"]),
        ),
        case(
            "wire",
            "unplugged for a moment",
            "light 2 was taken again: the light board was unplugged",
            Complete,
            How::AtShutter(&["unplug 800", "sleep 300"]),
        ),
        case(
            "wire",
            "unplugged for good",
            "is not connected; plug it in again (the scan goes on from there). 3 frames are safe; continue with --resume",
            Ends::Resumes,
            How::AtShutter(&["unplug 24000", "sleep 300"]),
        ),
    ]
}

fn board() -> Vec<Case> {
    use Ends::{Complete, Refused};
    vec![
        case(
            "board",
            "its reset button",
            "light 2 was taken again: the light board restarted (RESET)",
            Complete,
            How::AtShutter(&["reset", "sleep 200"]),
        ),
        case(
            "board",
            "its program hangs",
            "light 2 was taken again: the light board restarted (WATCHDOG)",
            Complete,
            How::AtShutter(&["hang", "sleep 700"]),
        ),
        case("board", "stands still for 0.7 s", "", Complete, How::AtShutter(&["freeze 700"])),
        case("board", "takes 1.5 s to start", "", Complete, How::Wire(&["boot-delay 1500"])),
        case(
            "board",
            "not there",
            "there is no such port; connect the light board, or correct [controller] port in rig.toml",
            Refused,
            How::NoPort,
        ),
        case(
            "board",
            "another program has the port",
            "another program is using this port; close it",
            Refused,
            How::BusyPort,
        ),
        case(
            "board",
            "nothing answers",
            "nothing answers; is this the light board, and is its firmware loaded",
            Refused,
            How::Answers(|_| String::new()),
        ),
        case(
            "board",
            "not ours",
            "this is not a Weavelight light board (it says \"echo\"); choose another port, or load the firmware",
            Refused,
            How::Answers(|_| "echo\n".to_owned()),
        ),
        case(
            "board",
            "older protocol",
            "speaks protocol 0, this program 1; load the firmware that came with this program",
            Refused,
            How::Answers(|seq| {
                weavelight::device::board::wire::seal(&format!("{seq} OK WEAVELIGHT 0.9.2 0 10 -"))
            }),
        ),
        case(
            "board",
            "another number of lights than the rig",
            "the board has 8 lights, rig.toml has 10; correct rig.toml",
            Refused,
            How::Answers(|seq| {
                weavelight::device::board::wire::seal(&format!("{seq} OK WEAVELIGHT 1.0.0 1 8 LBT"))
            }),
        ),
    ]
}

fn lights() -> Vec<Case> {
    use Ends::{Complete, Resumes};
    vec![
        case(
            "lights",
            "an LED that stays dark",
            "light 4 stays dark although the board switched it on; look at its LED, driver and wiring. 11 frames are safe",
            Resumes,
            How::Scene(|scene| scene.flaws.dead = Some(4)),
        ),
        case(
            "lights",
            "the first LED stays dark",
            "light 0 stays dark although the board switched it on; look at its LED, driver and wiring. 10 frames are safe",
            Resumes,
            How::Scene(|scene| scene.flaws.dead = Some(0)),
        ),
        case(
            "lights",
            "two outputs at one LED",
            "Lights 2 and 5 give the same picture; look for stray light, a light that stays on, or two outputs at one LED.",
            Complete,
            How::Bridge((5, 2)),
        ),
        case(
            "lights",
            "the room is not dark",
            "as bright as under a light; darken the room.",
            Complete,
            How::Scene(|scene| scene.flaws.ambient = 300.0),
        ),
        case(
            "lights",
            "the exposure is too long",
            "of the samples clip under light",
            Complete,
            How::Iso(12_800.0),
        ),
        case(
            "lights",
            "the exposure is too short",
            "of full scale only; a longer exposure gives less noise.",
            Complete,
            How::Iso(200.0),
        ),
    ]
}

/// What passes by itself.
fn camera_once() -> Vec<Case> {
    use CameraError as E;
    let camera = |fault, sees, make: fn() -> Mishap| {
        case("camera", fault, sees, Ends::Complete, How::Camera(Times::Once, make))
    };
    vec![
        camera(
            "asleep",
            "light 2 was taken again: the camera does not answer, as if asleep; wake it",
            || Mishap::Error(E::Asleep),
        ),
        camera(
            "out of focus",
            "light 2 was taken again: the camera does not find focus; focus by hand",
            || Mishap::Error(E::OutOfFocus),
        ),
        camera(
            "no picture after the shutter",
            "light 2 was taken again: the camera released its shutter, but no picture came within 20 s",
            || Mishap::Error(E::NoPicture { after: WAITED }),
        ),
        camera(
            "link cut while a frame is read",
            "light 2 was taken again: the connection to the camera broke (end of file); check its cable",
            || Mishap::Error(E::LinkLost { reason: "end of file".to_owned() }),
        ),
        camera(
            "busy with its menus",
            "light 2 was taken again: the camera is busy with something else; leave its menus",
            || Mishap::Error(E::Busy),
        ),
    ]
}

/// What somebody has to mend.
fn camera_lasting() -> Vec<Case> {
    use CameraError as E;
    let camera = |fault, sees, make: fn() -> Mishap| {
        case("camera", fault, sees, Ends::Resumes, How::Camera(Times::Always, make))
    };
    vec![
        camera(
            "unplugged for good",
            "light 2: no camera found; connect it by USB and switch it on",
            || Mishap::Error(E::NoneFound),
        ),
        camera(
            "battery low",
            "light 2: the camera's battery is low (7 %); charge or change it",
            || Mishap::Error(E::BatteryLow { percent: Some(7) }),
        ),
        camera(
            "mode dial off M",
            "light 2: the camera's mode dial is at P, so exposures cannot be set; turn it to M",
            || Mishap::Error(E::WrongMode { mode: "P".to_owned() }),
        ),
        camera("memory card full", "light 2: the camera's memory card is full; empty it", || {
            Mishap::Error(E::CardFull)
        }),
        camera(
            "never ready",
            "light 2: the camera is not ready after 20 s; switch it off and on. 3 frames are safe",
            || Mishap::Error(E::NeverReady { after: WAITED }),
        ),
        camera(
            "taken by another program",
            "light 2: another program is using the camera (gvfs-gphoto2); close it",
            || Mishap::Error(E::Claimed { by: Some("gvfs-gphoto2".to_owned()) }),
        ),
        camera(
            "permission denied",
            "light 2: permission to use the camera is denied; install the udev rules",
            || Mishap::Error(E::Permission),
        ),
    ]
}

fn files() -> Vec<Case> {
    use Ends::{Complete, Resumes};
    use Times::Once;
    let file = |fault, sees, ends, spoil: fn() -> Mishap| {
        case("frame", fault, sees, ends, How::Camera(Once, spoil))
    };
    vec![
        file("half of the file is missing", "light 2 was taken again: ", Complete, || {
            Mishap::File(halve)
        }),
        file(
            "JPEG instead of RAW",
            "the camera saves JPEG instead of RAW; set its image quality to NEF (RAW)",
            Resumes,
            || Mishap::File(jpeg),
        ),
        file(
            "another size than the rig says",
            "the frame is 48 x 32, rig.toml says 96 x 64; correct width_px and height_px in rig.toml",
            Resumes,
            || Mishap::File(smaller),
        ),
        file(
            "exposed otherwise than asked",
            "the camera exposed 0.5 s at ISO 1200 instead of 0.02 s at ISO 1200; set it to manual (M)",
            Resumes,
            || Mishap::File(longer),
        ),
        case(
            "watched folder",
            "no picture comes",
            "no picture came within",
            Resumes,
            How::Watched(&[]),
        ),
        case(
            "watched folder",
            "two pictures for one light",
            "",
            Ends::Complete,
            How::Watched(&["a.dng", "b.dng"]),
        ),
        case(
            "watched folder",
            "a second, late picture of every light",
            "",
            Ends::Complete,
            How::Watched(&["a.dng", "late"]),
        ),
        case(
            "watched folder",
            "a RAW file seconds after its JPEG, in folders by date",
            "",
            Ends::Complete,
            How::Watched(&["2026-11-30/a.jpg", "2026-11-30/a.dng"]),
        ),
        case(
            "watched folder",
            "names that repeat, RAW and JPEG",
            "",
            Ends::Complete,
            How::Watched(&["capt0000.jpg", "capt0000.dng"]),
        ),
        case(
            "watched folder",
            "a RAW file of a kind that is not read",
            "Canon CR3",
            Resumes,
            How::Watched(&["a.cr3"]),
        ),
        case(
            "watched folder",
            "only a JPEG comes",
            "the camera saves JPG instead of RAW; set its image quality",
            Resumes,
            How::Watched(&["a.jpg"]),
        ),
    ]
}

fn disk() -> Vec<Case> {
    use Ends::{Complete, Refused, Resumes};
    vec![
        case(
            "disk",
            "not enough room at the start",
            "MB free, but the frames need about",
            Refused,
            How::SmallDisk,
        ),
        case(
            "disk",
            "fills up while scanning",
            "no space left on this disk; free some or choose another --out",
            Resumes,
            How::DiskFills,
        ),
        case(
            "disk",
            "the target holds another capture session",
            "holds a capture session already (linen, 12 frames); continue it with --resume, or choose another --out",
            Refused,
            How::Occupied,
        ),
        case(
            "disk",
            "a frame was altered before the scan resumes",
            "this frame was altered",
            Complete,
            How::BeforeResume(|session| std::fs::write(session.join("light-03.dng"), "x").unwrap()),
        ),
        case(
            "disk",
            "a frame is missing when the scan resumes",
            "this frame is missing",
            Complete,
            How::BeforeResume(|session| {
                std::fs::remove_file(session.join("light-03.dng")).unwrap();
            }),
        ),
        case(
            "process",
            "killed at a random moment, 200 times",
            "",
            Resumes,
            How::Elsewhere("kills.rs"),
        ),
        case(
            "process",
            "stopped for 2 s (Ctrl-Z), then continued",
            "was taken again: the light board went dark (SILENCE)",
            Complete,
            How::Stopped,
        ),
    ]
}
