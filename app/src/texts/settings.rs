//! What the window calls the settings that messages of the library name.

use crate::texts::scan;

/// What the window calls a setting that a message of the library names.
pub fn name(name: &str) -> String {
    match name {
        "out" => "place".to_owned(),
        "resume" => format!("“{}”", scan::RESUME),
        "force" => "“Solve again”".to_owned(),
        name => weavelight::files::plain_words(name),
    }
}
