//! A list's bytes as lines, whatever program and system wrote them.

use crate::files::{FileError, InputKind, read_input};
use encoding_rs::{Encoding, UTF_16BE, UTF_16LE, WINDOWS_1252};
use std::path::Path;

/// CP/M's and DOS's mark for the end of a text.
const END_MARK: char = '\u{1a}';

/// Lists are short: 256 lines of a path each. More is another file.
const LONGEST_LIST: usize = 4 << 20;

/// A line with its number, counted from 1.
pub(in super::super) type Numbered = (usize, String);

/// The lines that say something: trimmed, without blank ones.
pub(in super::super) fn read(path: &Path) -> Result<Vec<Numbered>, FileError> {
    let bytes =
        read_input(path, InputKind::Text).map_err(|source| FileError::read(path, source))?;
    let no_list = || FileError::Content {
        path: path.to_owned(),
        what: "is not a list of text lines; give an .lp file, or a list with one direction a line"
            .to_owned(),
    };
    if bytes.len() > LONGEST_LIST {
        return Err(no_list());
    }
    let text = decode(&bytes);
    let text = up_to_end(&text).ok_or_else(no_list)?;
    Ok(lines(text))
}

/// By its byte order mark; else UTF-16 where every other byte is zero, UTF-8 where it is that, and Windows-1252 (which
/// Latin-1 is part of).
fn decode(bytes: &[u8]) -> String {
    let (encoding, mark) = Encoding::for_bom(bytes).unwrap_or_else(|| (guess(bytes), 0));
    encoding.decode_without_bom_handling(&bytes[mark..]).0.into_owned()
}

/// The text before its end mark; `None` where it is none, or goes on behind the mark.
fn up_to_end(text: &str) -> Option<&str> {
    let (text, rest) = text.split_once(END_MARK).unwrap_or((text, ""));
    let text = text.trim_end_matches('\0');
    let padding = |letter: char| matches!(letter, END_MARK | '\0') || letter.is_whitespace();
    let is_text = text.chars().all(|letter| !letter.is_control() || letter.is_whitespace());
    (is_text && rest.chars().all(padding)).then_some(text)
}

fn guess(bytes: &[u8]) -> &'static Encoding {
    let head = &bytes[..bytes.len().min(1024)];
    let zeros = |first: usize| head.iter().skip(first).step_by(2).filter(|&&b| b == 0).count();
    // Digits, spaces and line ends have a zero byte; some letters of other scripts have none.
    let most = |count: usize| count > 0 && 4 * count > head.len();
    if most(zeros(1)) && zeros(0) == 0 {
        UTF_16LE
    } else if most(zeros(0)) && zeros(1) == 0 {
        UTF_16BE
    } else if std::str::from_utf8(bytes).is_ok() {
        encoding_rs::UTF_8
    } else {
        WINDOWS_1252
    }
}

/// Lines end with LF, CR LF, CR (old Macintosh), or Unicode's own separators.
fn lines(text: &str) -> Vec<Numbered> {
    let text = text.replace("\r\n", "\n");
    let ends = |letter| matches!(letter, '\n' | '\r' | '\u{85}' | '\u{2028}' | '\u{2029}');
    let numbered = text.split(ends).enumerate().map(|(k, line)| (k + 1, line.trim()));
    numbered.filter(|(_, line)| !line.is_empty()).map(|(k, line)| (k, line.to_owned())).collect()
}

/// Windows-1252 for names that are no Unicode, as old file systems have them.
pub(in super::super) fn from_unknown(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => WINDOWS_1252.decode_without_bom_handling(bytes).0.into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_and_line_end_gives_the_same_lines() {
        let text = "2\nmünze 1.png 0 0 1\n\nb.png 0 1 1\n";
        let utf16 = |little: bool, mark: bool| -> Vec<u8> {
            let units = mark.then_some(0xfeff).into_iter().chain(text.encode_utf16());
            let bytes = |u: u16| if little { u.to_le_bytes() } else { u.to_be_bytes() };
            units.flat_map(bytes).collect()
        };
        let latin1: Vec<u8> = text.chars().map(|letter| letter as u8).collect();
        let kinds: [Vec<u8>; 11] = [
            text.into(),
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            latin1,
            utf16(true, true),
            utf16(false, true),
            utf16(true, false),
            utf16(false, false),
            text.replace('\n', "\r\n").into(),
            text.replace('\n', "\r").into(),
            text.replace('\n', "\u{2028}").into(),
            format!("{text}\u{1a}\0\0").into(),
        ];
        for (kind, bytes) in kinds.iter().enumerate() {
            let found: Vec<String> = lines(up_to_end(&decode(bytes)).unwrap())
                .into_iter()
                .map(|(_, line)| line)
                .collect();
            assert_eq!(found, ["2", "münze 1.png 0 0 1", "b.png 0 1 1"], "kind {kind}");
        }
        assert_eq!(lines(text)[2], (4, "b.png 0 1 1".to_owned()));
    }
}
