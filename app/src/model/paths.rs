//! Paths as users type and paste them into a field.

use std::path::{Path, PathBuf};

/// The path that is meant; `None` where nothing is written. `~` is the user's home; quotes as a terminal writes them and
/// `file://` as a file manager does are taken off.
pub fn typed(text: &str) -> Option<PathBuf> {
    meant(text, std::env::home_dir().as_deref())
}

fn meant(text: &str, home: Option<&Path>) -> Option<PathBuf> {
    let text = unquoted(text.trim());
    if text.is_empty() {
        return None;
    }
    // Of several files that were pasted, the first.
    let uri = text.strip_prefix("file://").and_then(|rest| rest.split("file://").next());
    if let Some(rest) = uri.map(str::trim_end) {
        // A host may stand before the path: this one's.
        let path = rest.find('/').map_or(rest, |start| &rest[start..]);
        return Some(PathBuf::from(decoded(path)));
    }
    let rest = text.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with('/'));
    match (rest, home) {
        (Some(rest), Some(home)) => Some(home.join(rest.trim_start_matches('/'))),
        _ => Some(PathBuf::from(text)),
    }
}

/// Without the quotes around it, if there is a pair.
fn unquoted(text: &str) -> &str {
    let within = |quote: char| text.strip_prefix(quote)?.strip_suffix(quote);
    within('\'').or_else(|| within('"')).unwrap_or(text)
}

/// With every `%20` a space again, and so on; what is no such code stays.
fn decoded(uri: &str) -> std::ffi::OsString {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let code = uri.get(at + 1..at + 3).filter(|_| bytes[at] == b'%');
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                at += 3;
            }
            None => {
                out.push(bytes[at]);
                at += 1;
            }
        }
    }
    to_os(out)
}

#[cfg(unix)]
fn to_os(bytes: Vec<u8>) -> std::ffi::OsString {
    std::os::unix::ffi::OsStringExt::from_vec(bytes)
}

#[cfg(not(unix))]
fn to_os(bytes: Vec<u8>) -> std::ffi::OsString {
    String::from_utf8_lossy(&bytes).into_owned().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_what_their_writer_means() {
        let check = |text: &str, expected: Option<&str>| {
            assert_eq!(
                meant(text, Some(Path::new("/home/ada"))),
                expected.map(PathBuf::from),
                "{text:?}"
            );
        };
        check("/rigs/one", Some("/rigs/one"));
        check("  /rigs/one \n", Some("/rigs/one"));
        check("~", Some("/home/ada"));
        check("~/rigs/one", Some("/home/ada/rigs/one"));
        check("~//rigs", Some("/home/ada/rigs"));
        // Another user's home is not ours to find; a folder may be called so.
        check("~ada/rigs", Some("~ada/rigs"));
        check("a~b", Some("a~b"));
        check("'/rigs/with space'", Some("/rigs/with space"));
        check("\"/rigs/with space\"", Some("/rigs/with space"));
        check("'/rigs/o", Some("'/rigs/o"));
        check("file:///rigs/with%20space/%C3%A9", Some("/rigs/with space/é"));
        check("file://localhost/rigs/100%", Some("/rigs/100%"));
        check("file:///rigs/é%2", Some("/rigs/é%2"));
        check("file:///rigs/one\r\nfile:///rigs/two", Some("/rigs/one"));
        check("file:///rigs/one  file:///rigs/two", Some("/rigs/one"));
        check("scans/one", Some("scans/one"));
        check("", None);
        check("  \t", None);
        check("''", None);
    }
}
