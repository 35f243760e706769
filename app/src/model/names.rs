//! A swatch's name as the name of a folder. Any text may be a name; every file system has to take the folder.
//!
//! Different names have different folders, and a folder's name differs from every other in more than upper and lower case, so
//! that a rig can be copied to a disk that does not distinguish them. The name itself is kept in `session.toml`.

use std::path::{Path, PathBuf};
use weavelight::files::sha256_hex;

/// Longest name of a folder, bytes: file systems take 255, encrypted ones 143, and outputs are staged beside it under a longer
/// name.
const LONGEST: usize = 100;
/// Hexadecimal digits of the hash that stands for the rest of a longer name.
const DIGITS: usize = 16;
/// Names of devices on Windows, whatever ending they have.
const DEVICES: [&str; 6] = ["CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$"];
/// The same with a digit.
const NUMBERED_DEVICES: [&str; 2] = ["COM", "LPT"];
/// How many folders may differ in upper and lower case only.
const MOST_ALIKE: usize = 1000;

/// The folder of a name: letters, digits, spaces and `-_.` stand for themselves, everything else is written as `%` and the
/// hexadecimal digits of its bytes; so is a space or dot at either end. Different names give different folders.
pub fn folder_name(name: &str) -> String {
    let ends = ends(name);
    let mut folder = String::new();
    for (at, c) in name.char_indices() {
        let inside = (ends.start..ends.end).contains(&at);
        let plain = c.is_alphanumeric() || "-_".contains(c) || (inside && " .".contains(c));
        let device = at == 0 && is_device(name);
        match plain && !device {
            true => folder.push(c),
            false => folder.push_str(&escaped(c)),
        }
    }
    match folder.len() {
        // No escape is without digits.
        0 => "%".to_owned(),
        1..=LONGEST => folder,
        _ => shortened(&folder),
    }
}

/// Where the spaces and dots at the ends are left off.
fn ends(name: &str) -> std::ops::Range<usize> {
    let at_end = |c: char| c == ' ' || c == '.';
    let start = name.len() - name.trim_start_matches(at_end).len();
    start..name.trim_end_matches(at_end).len()
}

fn escaped(c: char) -> String {
    c.encode_utf8(&mut [0; 4]).bytes().map(|byte| format!("%{byte:02X}")).collect()
}

/// Whether Windows takes it for a device.
fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().trim_end().to_uppercase();
    let numbered =
        NUMBERED_DEVICES.iter().filter_map(|device| stem.strip_prefix(device)).any(|number| {
            let mut digits = number.chars();
            digits.next().is_some_and(|c| c.is_ascii_digit() || "¹²³".contains(c))
                && digits.next().is_none()
        });
    numbered || DEVICES.contains(&stem.as_str())
}

/// `~` stands in no folder otherwise: it would be escaped.
fn shortened(folder: &str) -> String {
    let hash = &sha256_hex(folder.as_bytes())[..DIGITS];
    let mut end = LONGEST - DIGITS - 1;
    while !folder.is_char_boundary(end) {
        end -= 1;
    }
    format!("{}~{hash}", folder[..end].trim_end_matches([' ', '.']))
}

/// Upper and lower case alike.
fn folded(folder: &str) -> String {
    folder.to_uppercase().to_lowercase()
}

/// The folders that are there, by name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScanNames(Vec<String>);

impl ScanNames {
    /// The names of whatever lies in these folders.
    pub fn read(folders: &[PathBuf]) -> Self {
        let entries = folders.iter().flat_map(std::fs::read_dir).flatten().flatten();
        Self(entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect())
    }

    /// Whether a scan has this name. One whose name differs in upper and lower case is another one.
    pub fn has(&self, name: &str) -> bool {
        let folder = folder_name(name);
        self.0.iter().any(|there| *there == folder || is_numbered(there, &folder))
    }

    /// The folder for a new scan of this name, on any disk.
    pub fn free(&self, name: &str) -> String {
        let folder = folder_name(name);
        let numbered = (2..MOST_ALIKE).map(|k| format!("{folder}~{k}"));
        let is_free = |new: &String| !self.0.iter().any(|there| folded(there) == folded(new));
        std::iter::once(folder.clone()).chain(numbered).find(is_free).unwrap_or(folder)
    }
}

/// Whether `there` is `folder` with a number because another one is spelt alike.
fn is_numbered(there: &str, folder: &str) -> bool {
    let number = there.strip_prefix(folder).and_then(|rest| rest.strip_prefix('~'));
    number.is_some_and(|number| number.len() < 4 && number.parse::<usize>().is_ok())
}

/// A path that is free: as it is, or numbered on.
pub fn free_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let numbered = (2..).map(|k| path.with_file_name(format!("{name} {k}")));
    // An empty folder was made for this.
    let is_free = |path: &PathBuf| {
        let is_empty = || std::fs::read_dir(path).is_ok_and(|mut inside| inside.next().is_none());
        path.symlink_metadata().is_err() || is_empty()
    };
    std::iter::once(path.to_owned()).chain(numbered).find(is_free).unwrap_or(path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn names_become_folders_that_stay_inside() {
        let check = |name: &str, expected: &str| assert_eq!(folder_name(name), expected);
        check("linen 4021", "linen 4021");
        check("Köper №7", "Köper %E2%84%967");
        check("麻布 3", "麻布 3");
        check("silk 4.5 mm", "silk 4.5 mm");
        check("a/b", "a%2Fb");
        check("a-b", "a-b");
        check("..", "%2E%2E");
        check(" ../x/y ", "%20%2E%2E%2Fx%2Fy%20");
        check(".hidden", "%2Ehidden");
        check("end. ", "end%2E%20");
        check("a\\b:c*d?e\"f<g>h|i\0\n", "a%5Cb%3Ac%2Ad%3Fe%22f%3Cg%3Eh%7Ci%00%0A");
        check("", "%");
        check("nul", "%6Eul");
        check("CON.linen", "%43ON.linen");
        check("com1 .x", "%63om1 .x");
        check("lpt³", "%6Cpt³");
        check("comb", "comb");
        check("com10", "com10");
    }

    #[test]
    fn different_names_have_different_folders_that_any_disk_takes() {
        let long = "a".repeat(300);
        let parts = [
            "", " ", ".", "..", "/", "a", "A", "-", "%", "%2F", "2F", "~", "~2", "nul", "é",
            "e\u{301}", "麻", "😀", "\0", &long,
        ];
        let mut folders = HashMap::new();
        for a in parts {
            for b in parts {
                for c in ["", " ", "x", "/", "~2"] {
                    let name = format!("{a}{b}{c}");
                    let folder = folder_name(&name);
                    assert!(folder.len() <= LONGEST && !folder.is_empty(), "{name:?}: {folder}");
                    assert!(!folder.ends_with([' ', '.']) && !folder.starts_with([' ', '.']));
                    assert!(!is_device(&folder), "{name:?}: {folder}");
                    if let Some(other) = folders.insert(folder, name.clone()) {
                        assert_eq!(other, name, "both have the same folder");
                    }
                }
            }
        }
        let folder = tempfile::tempdir().unwrap();
        for name in folders.keys() {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
    }

    #[test]
    fn names_that_differ_in_case_only_are_two_scans() {
        let folder = tempfile::tempdir().unwrap();
        let read = || ScanNames::read(&[folder.path().to_owned()]);
        for name in ["Linen 1", "linen 1", "LINEN 1"] {
            assert!(!read().has(name), "{name}");
            std::fs::create_dir(folder.path().join(read().free(name))).unwrap();
            assert!(read().has(name), "{name}");
        }
        assert!(!read().has("linen"));
        let mut found = read().0;
        found.sort_unstable();
        assert_eq!(found, ["LINEN 1~3", "Linen 1", "linen 1~2"]);
    }

    #[test]
    fn a_path_is_numbered_on_where_something_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a maps");
        assert_eq!(free_path(&path), path);
        std::fs::create_dir(&path).unwrap();
        assert_eq!(free_path(&path), path, "empty");
        std::fs::write(path.join("x"), "").unwrap();
        let second = folder.path().join("a maps 2");
        assert_eq!(free_path(&path), second);
        std::fs::write(&second, "").unwrap();
        assert_eq!(free_path(&path), folder.path().join("a maps 3"));
    }
}
