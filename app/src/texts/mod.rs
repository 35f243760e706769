//! Every text of the window, by room. Errors are in the library's own words.

#![allow(missing_docs, reason = "a text says what it is")]

pub mod calibrate;
pub mod look;
pub mod rig;
pub mod rooms;
pub mod scan;
pub mod scans;
pub mod settings;
pub mod shell;
pub mod welcome;

pub const TITLE: &str = "Weavelight";
/// Where the program itself is at fault.
pub const BUG: &str =
    "internal error; no data was lost. Please try again, and report it if it happens again";
/// The button that opens the system's folder dialogue.
pub const BROWSE: &str = "Browse…";
pub const SETTINGS: &str = "Settings";
/// Where they cannot be kept.
pub const KEEPING_SETTINGS: &str = "Saving the settings";
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
pub const THEMES: [&str; 3] = ["System", "Light", "Dark"];
pub const SCALE: &str = "Size";

/// Keys and what they do.
pub const KEYS: [(&str, &str); 9] = [
    ("Space     ", "scan, or take the picture"),
    ("Arrows    ", "choose a scan"),
    ("Enter     ", "open it"),
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
    format!(
        "the settings could not be read, so the defaults are used; the old file is kept as {file}"
    )
}

/// Time left, in words.
pub fn time_left(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "less than a second left".to_owned(),
        s if s < 90.0 => format!("{s:.0} s left"),
        s => format!("{:.0} min left", s / 60.0),
    }
}
