//! The Scan room.

#![allow(missing_docs, reason = "a text says what it is")]

use weavelight::device::scan::{Channel, Summary};
use weavelight::solution::Report;

/// Of the first swatch.
pub const FIRST_NAME: &str = "linen 1";
pub const NAME: &str = "Name";
pub const THICKNESS: &str = "Thickness";
pub const EXPOSURE: &str = "Exposure";
pub const FIND_EXPOSURE: &str = "automatic";
pub const ISO: &str = "ISO";
pub const ON_THE_TABLE: &str = "On the table";
pub const TEST_SHOT: &str = "Test shot";
pub const TEST_SHOT_HINT: &str =
    "One picture under one light: exposure, focus, framing. Nothing is kept.";
pub const LIGHT: &str = "under light";
pub const LIGHT_NAME: &str = "Light";
pub const AMBIENT: &str = "Dark";
/// The group of settings.
pub const SOLVING: &str = "Solving";
/// Methods and what they do.
pub const METHODS: [(&str, &str); 3] = [
    (
        "Automatic",
        "Weighted by noise; shadows and highlights are searched for where the residual is large",
    ),
    ("Least squares", "Every unsaturated sample, with equal weight"),
    ("Robust everywhere", "Shadows and highlights are searched for at every photosite"),
];
/// What computes, as on the command line.
pub const DEVICE: &str = "Compute on";
pub const DEVICES: [&str; 3] = ["the faster one", "the processor", "the graphics card"];
/// As on the command line.
pub const UNDISTORT: &str = "Remove lens distortion";
/// As on the command line.
pub const NORMAL_Y_DOWN: &str = "Green points down (DirectX)";
pub const SCAN: &str = "Scan the swatch";
pub const SPACE: &str = "or press Space";
/// Why it is grey.
pub const BUSY: &str = "Busy: see the status bar";
/// Why it is grey.
pub const TAKEN: &str = "A scan of this name exists; choose another name";
/// Why it is grey.
pub const UNREAD: &str = "A number above cannot be read; correct it first";
pub const NOT_MEASURED: &str = "not measured";
pub const PAUSE: &str = "Pause";
pub const GO_ON: &str = "Continue";
pub const STOP: &str = "Stop";
pub const STOP_HINT: &str = "Frames taken so far are kept; the scan can be continued later.";
/// Goes on with an unfinished scan.
pub const RESUME: &str = "Continue scan";
pub const LEAVE: &str = "Not now";
/// Opens the Look room.
pub const LOOK_CLOSER: &str = "Look closer";
pub const ENTER: &str = "Enter";
/// Scans the same again.
pub const REPEAT: &str = "Scan again";
/// What becomes of the old one.
pub const REPEAT_HINT: &str =
    "The scan shown here and its maps go to the bin; Undo brings them back";
pub const UNDO: &str = "Undo";
/// Makes the maps of a scan that has none.
pub const SOLVE: &str = "Solve it";
pub const NEXT: &str = "Next swatch";
pub const TAKING_TEST_SHOT: &str = "Test shot";
pub const METERING: &str = "finding the exposure";
pub const BOARD_LOST: &str = "the light board is gone; plug it in again";
pub const LAYING_OUT: &str = "Changing the fabric";
pub const BRINGING_BACK: &str = "Restoring the earlier scan";
/// Layers of the maps.
pub const LAYERS: [&str; 3] = ["Relit", "Normals", "Albedo"];
/// The maps, for those who do not see them.
pub const MAPS: &str = "Maps of the swatch so far";
/// How to see the cloth from all sides.
pub const DRAG_LIGHT: &str = "Drag: move the light. Wheel: zoom. Right button: move the picture.";
/// How to move the maps.
pub const DRAG_MAPS: &str = "Drag: move the picture. Wheel: zoom.";
/// Of the test shot.
pub const MARK_CLIPPED: &str = "Mark clipped pixels";
/// Of the test shot.
pub const HISTOGRAM: &str = "Histogram";
/// Of the test shot.
pub const FOCUS_HINT: &str = "Larger is sharper: turn the focus ring and take another test shot";
pub const NOTHING_YET: &str = "Lay the swatch on the table and press Space";
pub const HOW_TO: &str =
    "A test shot shows exposure and focus first. Maps appear here while the lights fire.";
/// While the first lights fire.
pub const MAPS_COME: &str = "Maps appear after the third light";
/// While lights fire, without a calibration.
pub const NO_MAPS: &str = "Frames are taken; maps need a calibration first";
/// The empty room without a calibration.
pub const NOT_CALIBRATED: &str =
    "This rig is not calibrated yet: scans can be taken, but maps need a calibration";
/// Where the calibration is old.
pub const TO_CALIBRATE: &str = "Check calibration";
pub const CALIBRATE: &str = "Calibrate the rig";

/// Work.
pub fn scanning(name: &str) -> String {
    format!("Scanning {name}")
}

/// Work.
pub fn solving(name: &str) -> String {
    format!("Solving {name}")
}

/// A frame taken again.
pub fn again(why: &str) -> String {
    format!("{why}; the frame is taken again")
}

/// A scan that was stopped.
pub fn unfinished(name: &str, frames: usize) -> String {
    let after = match frames {
        1 => "one frame".to_owned(),
        frames => format!("{frames} frames"),
    };
    format!("“{name}” was stopped after {after}. Continue it?")
}

/// A scan that was taken again.
pub fn replaced(name: &str) -> String {
    format!("The previous scan of “{name}” is in the bin.")
}

/// A scan that was here before.
pub fn brought_back(name: &str) -> String {
    format!("“{name}” is restored")
}

/// A frame's place in the strip, in words.
pub fn frame(name: &str, taking: bool, taken: bool) -> String {
    let state = if taking {
        "being taken"
    } else if taken {
        "taken"
    } else {
        "waiting"
    };
    format!("{name}, {state}")
}

/// A scan that is complete.
pub fn scanned(summary: &Summary) -> String {
    let exposure = summary.settings.map(|s| format!(" of {} s", s.exposure_s)).unwrap_or_default();
    format!("{} frames{exposure} in {:.0} s", summary.frames, summary.seconds.total)
}

/// A solution; `expected_deg`: expected error of a normal, median.
pub fn solved(report: &Report, expected_deg: Option<f64>) -> String {
    let percent = |count: u64| 100.0 * count as f64 / report.pixels.max(1) as f64;
    let normals = expected_deg.map(|deg| format!("Normals ± {deg:.2}°; "));
    format!(
        "{}{:.1} % solved from {} lights, {:.1} % clipped",
        normals.unwrap_or_default(),
        percent(report.solved),
        report.lights_used.len(),
        percent(report.saturated_pixels)
    )
}

/// One line of the histogram.
pub fn channel(channel: &Channel) -> String {
    format!(
        "{}: brightest {:.0} %, clipped {:.2} %",
        channel.name,
        100.0 * channel.high.min(1.0),
        100.0 * channel.clipped
    )
}

/// The focus measure.
pub fn focus(sharpness: f64) -> String {
    format!("Focus {sharpness:.4}")
}

/// How many warnings a scan and its solution have.
pub fn warnings(count: usize) -> String {
    if count == 1 { "1 warning".to_owned() } else { format!("{count} warnings") }
}
