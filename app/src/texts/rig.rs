//! The Rig room.

#![allow(missing_docs, reason = "a text says what it is")]

use weavelight::doctor::LightBoard;
use weavelight::instrument::{CameraKind, RigCamera};

/// Where something needs a rig.
pub const NONE_OPEN: &str = "no rig is open; open one in the Rig room";
/// The heading of problems when a rig is opened.
pub const OPENING: &str = "Opening the rig";
/// And when a simulated one is made.
pub const MAKING_SIMULATED: &str = "Making the simulated rig";
pub const FIND: &str = "Look for board and camera";
pub const FIND_HINT: &str = "Checks the rig's port and the camera; takes no picture";
pub const NOT_LOOKED: &str = "Not checked yet.";
pub const FINDING: &str = "Looking for board and camera";
pub const FINDING_BOARD: &str = "light board";
pub const FINDING_CAMERA: &str = "camera";
pub const LIGHTING: &str = "Switching the light";
pub const TESTING: &str = "Testing each light";
/// Back to the welcome.
pub const OTHER_RIG: &str = "Open another rig";
pub const LIGHTS: &str = "Lights";
pub const TEST_EACH: &str = "Test each";
pub const ALL_OFF: &str = "All off";
pub const CLICK_A_LIGHT: &str = "Click a light to switch it on; click it again to switch it off.";
pub const COLUMNS: [&str; 4] = ["Light", "Output", "Ruler, mm", "Calibrated, mm"];
/// In place of a place.
pub const FAR: &str = "far away";

/// Who else works with the rig.
pub fn held(holder: &str) -> String {
    format!("This rig is in use by {holder}. You can view it; scanning and changes have to wait.")
}

/// A scan that belongs to no rig.
pub fn scan_without_rig(scan: &std::path::Path) -> String {
    format!("{} is a scan; open the rig that it was taken with first", scan.display())
}

/// A capture session that is not solved.
pub fn target(folder: &std::path::Path) -> String {
    format!(
        "{} is a capture session of a calibration target; open its rig, and use it in the Calibrate room",
        folder.display()
    )
}

/// A calibration without its rig.
pub fn calibration(folder: &std::path::Path) -> String {
    format!(
        "{} is a calibration without a rig; choose the folder that holds rig.toml",
        folder.display()
    )
}

/// Nothing that the program knows.
pub fn unknown(path: &std::path::Path) -> String {
    format!(
        "{} is not a rig (rig.toml), scan (session.toml) or solution (report.json); drop the folder of one",
        path.display()
    )
}

/// Where the rig was that was open last.
pub fn gone(rig: &std::path::Path) -> String {
    let rig = rig.display();
    format!("{rig} is missing; connect its disk and restart, or open the rig from its new folder")
}

/// Where everything lies.
pub fn folder(name: &str) -> String {
    format!("Folder “{name}”")
}

/// From where the sketch is seen.
pub fn side(front: bool) -> &'static str {
    if front { "From the front" } else { "From above" }
}

/// A light's name.
pub fn light(number: usize, lit: bool) -> String {
    format!("Light {number}{}", if lit { ", on" } else { "" })
}

/// A place, millimetres.
pub fn place(place_mm: [f64; 3]) -> String {
    // Adding zero makes -0 to 0.
    let [x, y, z] = place_mm.map(|mm| mm.round() + 0.0);
    format!("{x:.0}, {y:.0}, {z:.0}")
}

/// A calibrated place, if there is one.
pub fn calibrated(place_mm: Option<[f64; 3]>, sigma_mm: Option<f64>) -> String {
    let tenths = |mm: f64| (10.0 * mm).round() / 10.0 + 0.0;
    match (place_mm.map(|place_mm| place_mm.map(tenths)), sigma_mm) {
        (Some([x, y, z]), Some(sigma)) => format!("{x:.1}, {y:.1}, {z:.1} ± {sigma:.2}"),
        (Some([x, y, z]), None) => format!("{x:.1}, {y:.1}, {z:.1}"),
        (None, _) => "not yet".to_owned(),
    }
}

/// The camera in a line.
pub fn camera(camera: &RigCamera) -> String {
    let kind = match camera.kind {
        CameraKind::Simulated => "simulated",
        CameraKind::Tethered { .. } => "tethered",
        CameraKind::Watched { .. } => "watched folder",
    };
    let model = camera.model.as_deref().unwrap_or("camera");
    format!("{model} ({kind}), {} × {} pixels", camera.width_px, camera.height_px)
}

/// A light board in a line.
pub fn board(board: &LightBoard) -> String {
    let port = board.port.display();
    match (&board.firmware, board.lights) {
        (Some(firmware), Some(lights)) => {
            format!("Light board at {port}: firmware {firmware}, {lights} lights")
        }
        _ => format!("{port}"),
    }
}

/// The board of a simulated rig.
pub fn simulated_board(lights: usize) -> LightBoard {
    LightBoard {
        port: "the simulated port".into(),
        firmware: Some("simulated".to_owned()),
        lights: u8::try_from(lights).ok(),
        back_light: false,
        trigger: false,
        problem: None,
    }
}
