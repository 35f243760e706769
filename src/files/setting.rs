//! What a user can set, as messages name it.

use std::fmt;
use std::sync::OnceLock;

/// The words of the interface that this process has.
static WORDS: OnceLock<fn(&str) -> String> = OnceLock::new();

/// Something that a user can set, by its name in the command line without the dashes: `exposure-s`. Shown, it is what the
/// process's interface calls it ([`name_settings`]): an option, a field, a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting(pub &'static str);

/// Gives settings the names that the process's interface has for them; the first call counts. Without it they are called
/// by their plain words.
pub fn name_settings(words: fn(&str) -> String) {
    // A second interface in one process keeps the first one's words.
    let _ = WORDS.set(words);
}

/// `exposure-s` is "exposure", `out` is "output folder".
pub fn plain_words(name: &str) -> String {
    match name {
        "out" => "output folder".to_owned(),
        "iso" => "ISO".to_owned(),
        name => {
            let unit = ["-mm", "-s", "-deg", "-e"].iter().find_map(|unit| name.strip_suffix(unit));
            unit.unwrap_or(name).replace('-', " ")
        }
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&WORDS.get().map_or_else(|| plain_words(self.0), |words| words(self.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_an_interface_settings_have_plain_words() {
        let names = ["exposure-s", "out", "same-exposure", "board-thickness-mm", "light"];
        assert_eq!(
            names.map(|name| Setting(name).to_string()),
            ["exposure", "output folder", "same exposure", "board thickness", "light"]
        );
    }
}
