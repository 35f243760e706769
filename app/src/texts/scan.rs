//! The Scan room.

use weavelight::device::scan::{Channel, Summary};
use weavelight::solution::Report;

/// Of the first swatch.
pub const FIRST_NAME: &str = "linen 1";
/// The fields.
pub const NAME: &str = "Name";
/// The swatch's.
pub const THICKNESS: &str = "Thickness";
/// Time.
pub const EXPOSURE: &str = "Exposure";
/// By test shots.
pub const FIND_EXPOSURE: &str = "find it";
/// Sensitivity.
pub const ISO: &str = "ISO";
/// Simulated rigs only.
pub const ON_THE_TABLE: &str = "On the table";
/// The button.
pub const TEST_SHOT: &str = "Test shot";
/// What it does.
pub const TEST_SHOT_HINT: &str =
    "One picture under one light: exposure, focus, framing. Nothing is kept.";
/// Which.
pub const LIGHT: &str = "under light";
/// In the strip.
pub const LIGHT_NAME: &str = "Light";
/// In the strip.
pub const AMBIENT: &str = "Dark";
/// The group of settings.
pub const SOLVING: &str = "Solving";
/// Methods and what they do.
pub const METHODS: [(&str, &str); 3] = [
    (
        "Automatic",
        "Weighted by the noise; shadows and highlights looked for where the residual asks for it",
    ),
    ("Least squares", "Plain: every unsaturated sample, all of equal weight"),
    ("Robust everywhere", "Shadows and highlights looked for at every photosite"),
];
/// What computes, as on the command line.
pub const DEVICE: &str = "Computed on";
/// The choices.
pub const DEVICES: [&str; 3] = ["whichever is faster", "the processor", "the graphics card"];
/// As on the command line.
pub const UNDISTORT: &str = "Take out the lens's distortion";
/// As on the command line.
pub const NORMAL_Y_DOWN: &str = "Green points down (DirectX)";
/// The big button.
pub const SCAN: &str = "Scan the swatch";
/// Its key.
pub const SPACE: &str = "or press Space";
/// Why it is grey.
pub const BUSY: &str = "Something else is going on; see below";
/// Why it is grey.
pub const TAKEN: &str = "A scan of this name is there already; choose another name";
/// Why it is grey.
pub const UNREAD: &str = "A number above cannot be read; correct it first";
/// Of a thickness.
pub const NOT_MEASURED: &str = "not measured";
/// While it runs.
pub const PAUSE: &str = "Pause";
/// While it rests.
pub const GO_ON: &str = "Continue";
/// Ends it.
pub const STOP: &str = "Stop";
/// What that means.
pub const STOP_HINT: &str = "Frames that are there stay; the scan can be continued later.";
/// Goes on with an unfinished scan.
pub const RESUME: &str = "Continue it";
/// Does not.
pub const LEAVE: &str = "Not now";
/// Opens the Look room.
pub const LOOK_CLOSER: &str = "Look closer";
/// Its key.
pub const ENTER: &str = "Enter";
/// Scans the same again.
pub const REPEAT: &str = "Scan again";
/// What becomes of the old one.
pub const REPEAT_HINT: &str =
    "The scan shown here and its maps go to the bin; Undo brings them back";
/// Brings it back.
pub const UNDO: &str = "Undo";
/// Makes the maps of a scan that has none.
pub const SOLVE: &str = "Solve it";
/// Clears the table.
pub const NEXT: &str = "Next swatch";
/// Work.
pub const TAKING_TEST_SHOT: &str = "Test shot";
/// Work.
pub const METERING: &str = "finding the exposure";
/// Work.
pub const BOARD_LOST: &str = "the light board is gone; plug it in again";
/// Work.
pub const LAYING_OUT: &str = "Laying out the fabric";
/// Work.
pub const BRINGING_BACK: &str = "Bringing the earlier scan back";
/// Layers of the maps.
pub const LAYERS: [&str; 3] = ["Relit", "Normals", "Albedo"];
/// The maps, for those who do not see them.
pub const MAPS: &str = "Maps of the swatch so far";
/// How to see the cloth from all sides.
pub const DRAG_LIGHT: &str = "Drag: move the light. Wheel: zoom. Right button: move the picture.";
/// How to move the maps.
pub const DRAG_MAPS: &str = "Drag: move the picture. Wheel: zoom.";
/// Of the test shot.
pub const MARK_CLIPPED: &str = "Mark what clips";
/// Of the test shot.
pub const HISTOGRAM: &str = "Histogram";
/// Of the test shot.
pub const FOCUS_HINT: &str = "Larger is sharper: turn the focus ring and take another test shot";
/// The empty room.
pub const NOTHING_YET: &str = "Lay the swatch on the table and press Space";
/// The empty room.
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
pub const TO_CALIBRATE: &str = "Go and check it";
/// The way out.
pub const CALIBRATE: &str = "Calibrate it";

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
    format!("{why}; it is taken again")
}

/// A scan that was stopped.
pub fn unfinished(name: &str, frames: usize) -> String {
    let after = match frames {
        1 => "one frame".to_owned(),
        frames => format!("{frames} frames"),
    };
    format!("“{name}” was stopped after {after}. Continue where it stood?")
}

/// A scan that was taken again.
pub fn replaced(name: &str) -> String {
    format!("The other scan of “{name}” is in the bin.")
}

/// A scan that was here before.
pub fn brought_back(name: &str) -> String {
    format!("“{name}” is back")
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
