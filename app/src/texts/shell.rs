//! Words of what all rooms share: questions, fields, dialogues, problems.

#![allow(missing_docs, reason = "a text says what it is")]

use crate::model::number::{Unit, Unreadable};
use std::ops::RangeInclusive;

/// What is asked before something ends: heading, text, the button that goes on as before, the one that does not.
pub mod questions {
    pub const STOP_SCAN: [&str; 4] = [
        "Stop the scan?",
        "The frames taken so far are kept, and the scan can be continued later.",
        "Keep scanning",
        "Stop the scan",
    ];
    pub const QUIT_WHILE_SCANNING: [&str; 4] = [
        "A scan is under way",
        "Stop it and quit? The frames taken so far are kept, and the scan can be continued at the next start.",
        "Keep scanning",
        "Stop and quit",
    ];
    /// The window is about to close.
    pub const ENDING: [&str; 4] =
        ["Stopping…", "The window closes when the work has stopped safely.", "", ""];
}

/// Beside a field whose text is no number: what is wrong, and what can be written.
pub fn unreadable(text: &str, why: Unreadable, unit: Unit, range: &RangeInclusive<f64>) -> String {
    const LONGEST: usize = 24;
    let mut short: String = text.trim().chars().take(LONGEST).collect();
    if text.trim().chars().count() > LONGEST {
        short.push('…');
    }
    match why {
        Unreadable::NotANumber => format!("“{short}” is not {}", wanted(unit)),
        Unreadable::NotWhole => format!("“{short}” is not a whole number"),
        Unreadable::OutOfRange => {
            let (from, to) = (range.start(), range.end());
            format!("Out of range: {from} to {to}{}", unit.suffix())
        }
    }
}

/// What a number of this unit looks like.
fn wanted(unit: Unit) -> &'static str {
    match unit {
        Unit::Millimetres => "a length; write it as 1.25 mm",
        Unit::Seconds => "a time; write it as 0.5 s or 1/2",
        Unit::Degrees => "an angle; write it as 30°",
        Unit::Share => "a share; write it as 0.85 or 85 %",
        Unit::Stops => "a number of stops; write it as -1.5 EV",
        Unit::Pixels => "a number of pixels; write it as 12 px",
        Unit::Days => "a number of days; write it as 90",
        Unit::Iso => "a sensitivity; write it as 400",
        Unit::Count => "a number; write it as 7",
    }
}

/// Where the desktop has no dialogue for folders and files.
pub const NO_DIALOGUE: &str = "This desktop offers no dialogue for files: neither a desktop portal (xdg-desktop-portal) nor zenity was found. Install one of them, or type or paste the path into the field.";
pub const COPY: &str = "Copy";
/// Puts the problems out of the way.
pub const HIDE: &str = "Hide";

/// How many problems there are, in the status bar.
pub fn problems(count: usize) -> String {
    if count == 1 { "1 problem".to_owned() } else { format!("{count} problems") }
}

/// Where the system gives no thread; `what` it is for.
pub fn no_thread(what: &str, error: &std::io::Error) -> String {
    format!(
        "no thread can be started {what} ({error}); close other programs or raise the limit (ulimit -u)"
    )
}

/// What threads are for.
pub mod threads {
    pub const WINDOW: &str = "for the window";
    pub const SETTINGS: &str = "to keep the settings";
    pub const STROKES: &str = "to keep the strokes";
    pub const DIALOGUE: &str = "for the dialogue";
    /// What is seen of a scan while it goes on.
    pub const PREVIEWS: &str = "to show the scan while it goes on";
}

/// Why the window does not open.
pub fn no_window(error: &eframe::Error) -> String {
    match error {
        eframe::Error::AppCreation(error) => error.to_string(),
        error => format!(
            "the window cannot be opened ({error}); start it from a desktop, or use the command line (`weavelight help`)"
        ),
    }
}
