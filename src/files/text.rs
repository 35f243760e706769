//! Text from files, paths and devices in messages: it may be long, and it may hold what moves a terminal's cursor or turns
//! the direction of reading.

use serde::Serializer;
use std::borrow::Cow;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Text on one line, of at most about `most` characters: what is too long loses its middle, since messages say at their
/// beginning what is wrong and at their end what to do. Characters that control a terminal appear as their codes.
pub fn one_line(text: &str, most: usize) -> String {
    let length = text.chars().count();
    if length <= most {
        return escaped(text, |_| false).into_owned();
    }
    let (head, tail) = (most * 2 / 3, most / 3);
    let end: String = text.chars().skip(length - tail).collect();
    let start: String = text.chars().take(head).collect();
    format!("{} ... {}", escaped(&start, |_| false), escaped(&end, |_| false))
}

/// Text of several lines for a terminal: line ends stay, all else that controls it appears as its code.
pub fn harmless(text: &str) -> Cow<'_, str> {
    escaped(text, |letter| letter == '\n')
}

/// JSON with what controls a terminal in JSON's own escapes: the same values for whoever reads it.
pub fn harmless_json(json: &str) -> Cow<'_, str> {
    if !json.contains(controls) {
        return Cow::Borrowed(json);
    }
    let mut out = String::with_capacity(json.len() + 16);
    for letter in json.chars() {
        if controls(letter) {
            // Writing to a String does not fail.
            letter.encode_utf16(&mut [0; 2]).iter().for_each(|unit| {
                let _ = write!(out, "\\u{unit:04x}");
            });
        } else {
            out.push(letter);
        }
    }
    Cow::Owned(out)
}

fn escaped(text: &str, stays: impl Fn(char) -> bool) -> Cow<'_, str> {
    let hides = |letter: char| controls(letter) && !stays(letter);
    if !text.contains(hides) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for letter in text.chars() {
        match letter {
            letter if !hides(letter) => out.push(letter),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            letter => out.extend(letter.escape_unicode()),
        }
    }
    Cow::Owned(out)
}

/// Control characters, line and paragraph separators, and what changes the direction of reading or is invisible (Unicode's
/// bidirectional and tag characters).
fn controls(letter: char) -> bool {
    letter.is_control()
        || matches!(
            letter,
            '\u{ad}'
                | '\u{61c}'
                | '\u{200b}'
                | '\u{200e}'
                | '\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{feff}'
                | '\u{fff9}'..='\u{fffb}'
                | '\u{e0000}'..='\u{e007f}'
        )
}

/// A path as text: for JSON and reports, which hold no others. What is not UTF-8 in it becomes U+FFFD.
pub fn path_text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// [`path_text`] for `#[serde(serialize_with)]`: a path that is not UTF-8 must not make work fail that is done.
///
/// # Errors
/// The serializer's.
pub fn serialize_path<S: Serializer>(path: &Path, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&path_text(path))
}

/// [`serialize_path`] of a path that may be absent.
///
/// # Errors
/// The serializer's.
pub fn serialize_maybe_path<S: Serializer>(
    path: &Option<PathBuf>,
    to: S,
) -> Result<S::Ok, S::Error> {
    match path {
        Some(path) => to.serialize_some(&path_text(path)),
        None => to.serialize_none(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_controls_a_terminal_is_shown_as_its_code() {
        let evil = "a\u{1b}[31mred\u{7}\nb\u{202e}cba\u{9b}2J\r\u{7f}";
        let expected = "a\\u{1b}[31mred\\u{7}\\nb\\u{202e}cba\\u{9b}2J\\r\\u{7f}";
        assert_eq!(one_line(evil, 100), expected);
        assert_eq!(harmless("one\ntwo\u{1b}"), "one\ntwo\\u{1b}");
        for fine in ["", "swatch 4021, \u{fc}n\u{ef}c\u{f6}de, \u{5e03}, \u{1f9f5}", "C:\\x"] {
            assert_eq!(one_line(fine, 100), fine);
        }
    }

    #[test]
    fn what_is_long_loses_its_middle() {
        let long = format!("start{}end", "x".repeat(100_000));
        let short = one_line(&long, 60);
        assert!(short.starts_with("startxxx") && short.ends_with("xxxend"), "{short}");
        assert!(short.len() < 70 && short.contains(" ... "), "{short}");
        assert!(one_line(&"\u{1b}".repeat(50), 60).len() <= 50 * 6);
    }

    #[test]
    fn json_holds_the_same_values() {
        let evil = "x\u{202e}y\u{9b}z\u{e0041}";
        let json = serde_json::to_string(evil).unwrap();
        let safe = harmless_json(&json);
        assert!(safe.is_ascii(), "{safe}");
        assert_eq!(serde_json::from_str::<String>(&safe).unwrap(), evil);
    }

    #[cfg(unix)]
    #[test]
    fn paths_that_are_no_text_are_told_all_the_same() {
        use std::os::unix::ffi::OsStrExt;
        #[derive(serde::Serialize)]
        struct Found {
            #[serde(serialize_with = "serialize_path")]
            path: PathBuf,
            #[serde(serialize_with = "serialize_maybe_path")]
            map: Option<PathBuf>,
        }
        let path = PathBuf::from(std::ffi::OsStr::from_bytes(b"a\xffb"));
        let found = Found { map: Some(path.clone()), path };
        let json = serde_json::to_string(&found).unwrap();
        assert_eq!(json, "{\"path\":\"a\u{fffd}b\",\"map\":\"a\u{fffd}b\"}");
    }
}
