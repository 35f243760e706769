//! Every word that the window says, by room; what goes wrong is told in the library's own words.

pub mod calibrate;
pub mod shell;

/// The window's title.
pub const TITLE: &str = "Weavelight";
/// Where the program itself is at fault.
pub const BUG: &str = "the program stumbled over itself; nothing was lost. Please try again, and report it if it comes back";
/// The button that opens the system's folder dialogue.
pub const BROWSE: &str = "Browse…";
/// What is remembered.
pub const SETTINGS: &str = "Settings";
/// Where they cannot be kept.
pub const KEEPING_SETTINGS: &str = "Keeping the settings";
/// The button that ends work.
pub const CANCEL: &str = "Cancel";
/// The button that puts a problem away.
pub const DISMISS: &str = "Dismiss";
/// The button that puts all problems away.
pub const DISMISS_ALL: &str = "Dismiss all";
/// When the worker rests.
pub const READY: &str = "Ready";
/// The heading of the problems' panel.
pub const PROBLEMS: &str = "Problems";
/// The heading of an error.
pub const FAILED: &str = "failed";
/// The menu of colours and sizes.
pub const VIEW: &str = "View";
/// Light and dark.
pub const THEMES: [&str; 3] = ["As the system", "Light", "Dark"];
/// Size of everything.
pub const SCALE: &str = "Size";

/// Keys and what they do.
pub const KEYS: [(&str, &str); 9] = [
    ("Space     ", "scan, or take the picture"),
    ("Arrows    ", "choose a scan"),
    ("Enter     ", "look at it"),
    ("Ctrl+E    ", "export its maps"),
    ("Delete    ", "move it to the bin"),
    ("Ctrl+Z    ", "undo"),
    ("Ctrl+1…5  ", "open a room"),
    ("Esc       ", "leave a field or menu; stop the work"),
    ("Ctrl+Q    ", "quit"),
];

/// Where the settings could not be read.
pub fn settings_put_aside(file: &std::path::Path) -> String {
    let file = file.display();
    format!("the settings could not be read, so the window begins anew; they are kept in {file}")
}

/// Time left, in words.
pub fn time_left(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "less than a second left".to_owned(),
        s if s < 90.0 => format!("{s:.0} s left"),
        s => format!("{:.0} min left", s / 60.0),
    }
}

/// Names of the rooms.
pub mod rooms {
    /// The instrument.
    pub const RIG: &str = "Rig";
    /// The wizard.
    pub const CALIBRATE: &str = "Calibrate";
    /// The daily work.
    pub const SCAN: &str = "Scan";
    /// Maps under a light.
    pub const LOOK: &str = "Look";
    /// What was captured.
    pub const SCANS: &str = "Scans";
}

/// Where there is no rig yet.
pub mod welcome {
    /// The heading.
    pub const HEADING: &str = "Welcome to Weavelight";
    /// What this is about.
    pub const WHAT: &str =
        "A camera, some lights and a swatch become the material's normals, colour and height.";
    /// The first choice.
    pub const TRY: &str = "Try it with a simulated rig";
    /// What comes of it.
    pub const TRY_WHAT: &str = "No hardware needed: calibrate, scan a piece of linen and look at it, in about five minutes.";
    /// The second choice.
    pub const OPEN: &str = "Open a rig";
    /// What it wants.
    pub const OPEN_WHAT: &str = "The folder that holds rig.toml; or drag it into this window.";
    /// The path's field.
    pub const PATH: &str = "Folder of the rig";
    /// Its button.
    pub const OPEN_IT: &str = "Open";
    /// Name of the simulated rig's folder.
    pub const SIMULATED: &str = "simulated rig";
}

/// The Rig room.
pub mod rig {
    use weavelight::doctor::LightBoard;
    use weavelight::instrument::{CameraKind, RigCamera};

    /// Where something needs a rig.
    pub const NONE_OPEN: &str = "no rig is open; open one in the Rig room";
    /// The heading of problems when a rig is opened.
    pub const OPENING: &str = "Opening the rig";
    /// And when a simulated one is made.
    pub const MAKING_SIMULATED: &str = "Making the simulated rig";
    /// The button.
    pub const FIND: &str = "Look for board and camera";
    /// What it does.
    pub const FIND_HINT: &str = "Asks at the rig's port and at the camera; nothing is photographed";
    /// Before that.
    pub const NOT_LOOKED: &str = "Not looked for yet.";
    /// Work.
    pub const FINDING: &str = "Looking for board and camera";
    /// Work.
    pub const FINDING_BOARD: &str = "light board";
    /// Work.
    pub const FINDING_CAMERA: &str = "camera";
    /// Work.
    pub const LIGHTING: &str = "Switching the light";
    /// Work.
    pub const TESTING: &str = "Testing each light";
    /// Back to the welcome.
    pub const OTHER_RIG: &str = "Open another rig";
    /// The heading.
    pub const LIGHTS: &str = "Lights";
    /// The button.
    pub const TEST_EACH: &str = "Test each";
    /// The button.
    pub const ALL_OFF: &str = "All off";
    /// How to.
    pub const CLICK_A_LIGHT: &str =
        "Click a light to switch it on; click it again to switch it off.";
    /// Of the table.
    pub const COLUMNS: [&str; 4] = ["Light", "Output", "By the ruler, mm", "Calibrated, mm"];
    /// In place of a place.
    pub const FAR: &str = "far away";

    /// Who else works with the rig.
    pub fn held(holder: &str) -> String {
        format!(
            "This rig is in use by {holder}. It can be looked at; scanning and changes wait until that is done."
        )
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
            "{} is no rig (rig.toml), scan (session.toml) or solution (report.json); drop one of their folders",
            path.display()
        )
    }

    /// Where the rig was that was open last.
    pub fn gone(rig: &std::path::Path) -> String {
        let rig = rig.display();
        format!(
            "{rig} is not there any more; connect its disk and start again, or open the rig from where it is now"
        )
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
}

/// The Scan room.
pub mod scan {
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
    pub const DRAG_LIGHT: &str =
        "Drag: move the light. Wheel: zoom. Right button: move the picture.";
    /// How to move the maps.
    pub const DRAG_MAPS: &str = "Drag: move the picture. Wheel: zoom.";
    /// Of the test shot.
    pub const MARK_CLIPPED: &str = "Mark what clips";
    /// Of the test shot.
    pub const HISTOGRAM: &str = "Histogram";
    /// Of the test shot.
    pub const FOCUS_HINT: &str =
        "Larger is sharper: turn the focus ring and take another test shot";
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
        let exposure =
            summary.settings.map(|s| format!(" of {} s", s.exposure_s)).unwrap_or_default();
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
}

/// The Scans room.
pub mod scans {
    use crate::rooms::scans::Entry;
    use std::path::Path;

    /// The field.
    pub const SEARCH: &str = "Search by name";
    /// Until they are there.
    pub const LISTING: &str = "Looking what there is…";
    /// The empty room.
    pub const NONE: &str = "No scans yet";
    /// The empty room.
    pub const GO_SCAN: &str = "Scan the first swatch";
    /// Into the Look room.
    pub const OPEN: &str = "Open";
    /// Where there is no solution.
    pub const SOLVE: &str = "Solve";
    /// Where there is one.
    pub const SOLVE_AGAIN: &str = "Solve again";
    /// Nothing to solve.
    pub const UP_TO_DATE: &str =
        "Up to date: it was solved from the same frames and calibration with the same settings.";
    /// Solve it nevertheless.
    pub const SOLVE_ALL_THE_SAME: &str = "Solve it all the same";
    /// What that means.
    pub const DELETE_HINT: &str =
        "Frames and maps go to the system's bin, from where they can be restored";
    /// Brings back what was deleted.
    pub const UNDO: &str = "Undo";
    /// Work.
    pub const BRINGING_BACK: &str = "Bringing the scan back";
    /// The field.
    pub const EXPORT_TO: &str = "Export the maps to";
    /// The button.
    pub const EXPORT: &str = "Export";
    /// Work.
    pub const EXPORTING: &str = "Exporting";
    /// Work.
    pub const DELETING: &str = "Deleting the scan";

    /// Into the bin.
    pub fn delete(name: &str) -> String {
        format!("Delete “{name}”")
    }

    /// A search without result.
    pub fn nothing_found(search: &str) -> String {
        format!("No scan is called “{search}”")
    }

    /// What was deleted last.
    pub fn in_the_bin(name: &str) -> String {
        format!("“{name}” is in the bin.")
    }

    /// Where maps went.
    pub fn exported(to: &Path) -> String {
        format!("Exported to {}", to.display())
    }

    /// Below a scan's name.
    pub fn state(entry: &Entry) -> String {
        match (entry.is_complete(), &entry.solution) {
            (false, _) => {
                format!("stopped after {} of {} frames", entry.frames[0], entry.frames[1])
            }
            (true, None) => "not solved yet".to_owned(),
            (true, Some(_)) => "solved".to_owned(),
        }
    }

    /// Beside the gallery.
    pub fn details(entry: &Entry) -> Vec<(&'static str, String)> {
        let captured = entry.captured.map(crate::clock::local);
        vec![
            ("Taken", captured.unwrap_or_else(|| "unknown".to_owned())),
            ("State", state(entry)),
            ("Frames", format!("{} of {}", entry.frames[0], entry.frames[1])),
            ("Folder", entry.folder.display().to_string()),
        ]
    }
}

/// The Look room.
pub mod look;

/// What the window calls a setting that a message of the library names.
pub fn setting(name: &str) -> String {
    match name {
        "out" => "place".to_owned(),
        "resume" => format!("“{}”", scan::RESUME),
        "force" => "“Solve again”".to_owned(),
        name => weavelight::files::plain_words(name),
    }
}
