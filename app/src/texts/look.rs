//! The Look room's words.

#![allow(missing_docs, reason = "a text says what it is")]

use std::path::Path;

pub const HEADING: &str = "Look";
pub const WHAT: &str = "A solution's maps, pixel by pixel, under any light.";
pub const NOTHING_YET: &str =
    "No solution is open. Choose one among the scans, or drag its folder in here.";
pub const TO_SCANS: &str = "Go to the scans";
pub const FOLDER: &str = "Folder of the solution";
pub const OPEN: &str = "Open";
pub const COMPARE: &str = "Compare";
pub const OPEN_MENU: &str = "Open…";
pub const COMPARE_MENU: &str = "Compare with…";
pub const NO_GRAPHICS: &str = "Maps cannot be drawn: no usable graphics was found.\nInstall a Vulkan driver (mesa-vulkan-drivers) and start again.";

/// What the mouse does, and a hint.
pub const TOOLS: [(&str, &str); 4] = [
    (
        "Hand",
        "Drag the light; without one, drag the cloth. Click a photosite for its lights. The right button always drags the cloth.",
    ),
    ("Line", "Draw a line: its length, slope and height."),
    ("Brush", "Paint what belongs to the swatch."),
    ("Lasso", "Draw around what belongs to the swatch, or does not."),
];
pub const FIT: &str = "Fit";
pub const FIT_HINT: &str = "All of it (F)";
pub const ONE_TO_ONE: &str = "1 : 1";
pub const ONE_TO_ONE_HINT: &str = "A pixel of the screen for each photosite (1)";
pub const UNDO: &str = "Undo";
pub const REDO: &str = "Redo";
pub const UNDO_HINT: &str = "The mask's last step, or the last line (Ctrl+Z)";
pub const REDO_HINT: &str = "Ctrl+Shift+Z";
pub const MAPS: &str = "Maps";
pub const DIVIDER: &str = "Divider";
pub const BEING_MADE: &str = "Reading the frames…";

pub const SHOW: &str = "Show";
pub const MAP: &str = "Map";
pub const SIDES: [&str; 2] = ["Left", "Right"];
pub const COMPOSE: [&str; 3] = ["One", "Split", "Difference"];
/// In the order of the layers.
pub const LAYERS: [&str; 9] = [
    "Relit",
    "Normals",
    "Albedo",
    "Expected error",
    "Slope",
    "Captured frame",
    "Residual of a light",
    "Other solution's normals",
    "Angle to the other solution",
];
pub const UP_TO: &str = "Scale up to";
pub const EXPECTED_ERROR: &str = "Expected error of the normals";
pub const SLOPE: &str = "Slope";
pub const ANGLE: &str = "Angle between the normals";
pub const RESIDUAL: &str = "Measured − predicted";
pub const DIFFERENCE: &str = "Difference, of white";
pub const FRAMES_MISSING: &str = "No frames";
pub const NO_FRAMES: &str = "Its report does not say where the scan is, and this rig has no scan of its name. Solve the scan again to see its frames.";
pub const NO_CALIBRATION: &str = "The calibration that it was solved with is gone, and this rig has none. Calibrate, or put it back, to see the frames.";
pub const OTHER_GRID: &str =
    "These maps were undistorted; the frames lie on another grid. Solve without it to see them.";
pub const NO_OTHER: &str = "Compare with another solution first.";

pub const LIGHT: &str = "Light";
pub const LIGHTS: [&str; 3] = ["Lamp", "Sun", "Rig's lights"];
pub const NO_LIGHTS: &str = "This rig's lights are not calibrated yet.";
pub const HEIGHT: &str = "Height";
pub const DRAG_LAMP: &str = "Drag it over the cloth; Shift and wheel: its height.";
pub const ELEVATION: &str = "Elevation";
pub const AZIMUTH: &str = "Direction";
pub const MOVES: &str = "Rotate";
pub const BRIGHTNESS: &str = "Brightness";
pub const GLOSS: &str = "Gloss";
pub const BESIDE_FRAME: &str = "Beside its captured frame";
pub const NO_FRAME: &str = "This light has no frame.";

pub const PHOTOSITE: &str = "Photosite";
pub const POINT_AT: &str = "Point at the cloth.";
pub const CLICK_FOR_LIGHTS: &str = "Click it to see its lights.";
pub const LOUPE: &str = "Loupe";
pub const PIXEL: &str = "Pixel";
pub const PLACE: &str = "Place";
pub const NORMAL: &str = "Normal";
pub const ALBEDO: &str = "Albedo";
pub const ERROR: &str = "± error";
pub const UNSOLVED: &str = "not solved";
pub const SOLVING_AGAIN: &str = "Reading the frames…";
pub const NOT_SOLVED_AGAIN: &str = "The frames could not be read.";
pub const FRAMES_CHANGED: &str = "Scan or calibration changed since it was solved.";
pub const LIGHT_COLUMNS: [&str; 4] = ["Light", "Measured", "Fit", ""];
pub const USED: &str = "used";
pub const CLIPPED: &str = "clipped";
pub const TURNED_AWAY: &str = "turned away";
pub const TOO_DARK: &str = "shadow";
pub const TOO_BRIGHT: &str = "highlight";

pub const SLOPES: &str = "Slopes";
pub const PROFILE: &str = "Along the line";
pub const DRAW_A_LINE: &str = "Draw a line over the cloth.";
pub const SLOPE_ALONG: &str = "Slope, degrees";
pub const HEIGHT_ALONG: &str = "Height, mm";
pub const CLOSE: &str = "Close";
pub const NOTHING_IN_COMMON: &str = "No photosite is solved in both.";

pub const MASK: &str = "Mask";
pub const KEEP: &str = "Keep";
pub const LEAVE_OUT: &str = "Leave out";
pub const BRUSH: &str = "Brush";
pub const ALL: &str = "Keep all";
pub const NONE: &str = "Leave all out";
pub const SAVE_AND_SOLVE: &str = "Save and solve again";
pub const PAINT_FIRST: &str = "Paint what is to be solved first.";
pub const NO_MASK: &str = "A mask needs the frames, which are missing.";
pub const KEPT_ALREADY: &str = "No change: this is kept already. Choose Leave out.";
pub const LEFT_OUT_ALREADY: &str = "No change: this is left out already. Choose Keep.";
pub const DRAFT_IS_BACK: &str =
    "unsaved strokes were restored; save them, or remove them with Undo";
pub const KEEPING_STROKES: &str = "Keeping unsaved strokes";
pub const SHOW_IT: &str = "Show it";
pub const SOLVE_IT: &str = "Solve it";
pub const NOT_NOW: &str = "Not now";
pub const PIN: &str = "Keep this one open";
pub const PIN_HINT: &str = "It stays open when another scan is solved";
pub const OPENING_FOLDER: &str = "Opening the folder";
pub const SAVING_MASK: &str = "Saving the mask";
pub const READING_FRAMES: &str = "Reading the frames";

pub fn opening(name: &str) -> String {
    format!("Opening {name}")
}

pub fn newer(name: &str) -> String {
    format!("“{name}” is solved.")
}

pub fn unsolved(name: &str) -> String {
    format!("“{name}” is a scan that is not solved yet.")
}

pub fn not_solved(scan: &Path) -> String {
    format!("{} is a scan that is not solved yet; solve it first", scan.display())
}

pub fn is_target(folder: &Path) -> String {
    format!(
        "{} is a capture session of a calibration target, which has no maps; choose a solution or a scan",
        folder.display()
    )
}

pub fn is_calibration(folder: &Path) -> String {
    format!("{} is a calibration; choose a solution or a scan", folder.display())
}

pub fn solving(name: &str) -> String {
    format!("Solving {name}")
}

pub fn frame_of(light: usize) -> String {
    format!("Frame of light {light}")
}

pub fn residual_of(light: usize) -> String {
    format!("Residual of light {light}")
}

pub fn light(light: usize) -> String {
    format!("light {light}")
}

pub fn size([width, height]: [usize; 2]) -> String {
    format!("{width} × {height} px")
}

pub fn scale(mm_per_px: f64) -> String {
    format!(" · {mm_per_px:.3} mm per px")
}

pub fn pixels(length: f64) -> String {
    format!("{length:.1} px")
}

/// As many digits as a length deserves.
pub fn length(mm: f64) -> String {
    match mm {
        mm if mm >= 99.5 => format!("{mm:.0} mm"),
        mm if mm >= 10.0 && mm.fract().abs() < 1e-9 => format!("{mm:.0} mm"),
        mm if mm >= 10.0 => format!("{mm:.1} mm"),
        mm if mm >= 1.0 && mm.fract().abs() < 1e-9 => format!("{mm:.0} mm"),
        mm => format!("{mm:.2} mm"),
    }
}

pub fn photosite([x, y]: [usize; 2]) -> String {
    format!("Lights of photosite {x}, {y}")
}

pub fn figures(mean: f64, median: f64, p95: f64) -> String {
    format!("mean {mean:.1}°, median {median:.1}°, 95 % below {p95:.1}°")
}

pub fn line_figures(length_mm: f64, rise_mm: f64) -> String {
    format!("{} long, ends {rise_mm:+.3} mm from where it began", length(length_mm))
}

pub fn frames_gone(folder: &Path) -> String {
    format!("Its scan is no longer at {}. Put it back, or solve it again.", folder.display())
}

pub fn reduced(scale: usize) -> String {
    format!("This is a preview at 1/{scale} of the frames' size. Solve at full size to see them.")
}

pub fn unknown_method(method: &str) -> String {
    format!(
        "These maps were solved by the method \"{method}\", which this version does not know. Solve the scan again to see its frames."
    )
}

pub fn against(name: &str) -> String {
    format!("Against {name}")
}
