use super::sha256_hex;
use std::ffi::{OsStr, OsString};

/// Longest file name of common file systems, bytes.
const LONGEST: usize = 255;
/// Between the name of an output and what makes the name of the folder under construction its own.
pub(super) const PARTIAL: &str = ".partial-";
/// What `tempfile` appends.
pub(super) const RANDOM: usize = 6;

/// `.NAME` with `ending`: the name of something that the program puts beside NAME for a while. Where that were too long for a
/// file system, a hash stands for the name.
pub(super) fn hidden_name(name: &OsStr, ending: &str) -> OsString {
    let mut hidden = OsString::from(".");
    if name.len() + ending.len() + RANDOM + 2 <= LONGEST {
        hidden.push(name);
    } else {
        hidden.push(&sha256_hex(name.as_encoded_bytes())[..32]);
    }
    hidden.push(ending);
    hidden
}
