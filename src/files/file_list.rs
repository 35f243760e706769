//! `.weavelight-files`: what the program wrote into a folder, as `sha256sum -c` reads it. What is on it and still has its hash
//! may be deleted by the program; anything else belongs to the user.

use super::{FileError, sha256_of_file, write_atomic};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// The list's name in its folder.
pub const LIST_FILE: &str = ".weavelight-files";
/// No list of ours is longer; whatever is, is not read.
const LONGEST: u64 = 64 << 20;

/// Paths relative to the folder, each with its hash. While a file is being replaced, it is listed with both.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct FileList(BTreeSet<(PathBuf, String)>);

impl FileList {
    /// The list of `folder`; empty where there is none. A line that is none of ours proves nothing, and is passed over.
    pub(super) fn read(folder: &Path) -> Self {
        let path = folder.join(LIST_FILE);
        let plain = |file: &fs::Metadata| file.is_file() && file.len() <= LONGEST;
        if !fs::symlink_metadata(&path).is_ok_and(|file| plain(&file)) {
            return Self::default();
        }
        let text = fs::read(&path).unwrap_or_default();
        Self(text.split(|byte| *byte == b'\n').filter_map(parse).collect())
    }

    /// The hashes of everything in `folder`, and in the folders in it, but for the names in `except`.
    pub(super) fn of(folder: &Path, except: &[&str]) -> Result<Self, FileError> {
        let mut files = Vec::new();
        let walked = walk(folder, Path::new(""), &mut files);
        walked.map_err(|error| FileError::read(folder, error))?;
        files.retain(|file| !except.iter().any(|name| file == Path::new(name)));
        let hashed: Result<BTreeSet<_>, FileError> = files
            .into_par_iter()
            .map(|file| sha256_of_file(&folder.join(&file)).map(|hash| (file, hash)))
            .collect();
        hashed.map(Self)
    }

    /// Writes the list of `folder`; an empty one is taken away.
    pub(super) fn write(&self, folder: &Path) -> Result<(), FileError> {
        let path = folder.join(LIST_FILE);
        if self.0.is_empty() {
            return match fs::remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    Err(FileError::write(&path, error))
                }
                _ => Ok(()),
            };
        }
        write_atomic(&path, &self.text())
    }

    /// As [`FileList::write`], not flushed.
    pub(super) fn write_fast(&self, folder: &Path) -> Result<(), FileError> {
        let path = folder.join(LIST_FILE);
        fs::write(&path, self.text()).map_err(|error| FileError::write(&path, error))
    }

    fn text(&self) -> Vec<u8> {
        let lines: Vec<Vec<u8>> = self.0.iter().map(|(file, hash)| line(file, hash)).collect();
        lines.concat()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&Path, &str)> {
        self.0.iter().map(|(file, hash)| (&**file, &**hash))
    }

    /// The hashes that a file may have.
    pub(super) fn hashes(&self, file: &Path) -> Vec<&str> {
        self.iter().filter(|(listed, _)| *listed == file).map(|(_, hash)| hash).collect()
    }

    pub(super) fn insert(&mut self, file: &Path, hash: &str) {
        self.0.insert((file.to_owned(), hash.to_owned()));
    }

    pub(super) fn remove(&mut self, file: &Path) {
        self.0.retain(|(listed, _)| listed != file);
    }

    /// Whether a listed file lies below this folder.
    pub(super) fn reaches_into(&self, folder: &Path) -> bool {
        self.iter().any(|(file, _)| file != folder && file.starts_with(folder))
    }
}

fn walk(root: &Path, below: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(root.join(below))? {
        let entry = entry?;
        let path = below.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            walk(root, &path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

/// As `sha256sum` writes it: a name that would break the line is escaped, and a backslash before the hash says so.
fn line(file: &Path, hash: &str) -> Vec<u8> {
    let parts: Vec<&[u8]> = file.iter().map(OsStr::as_encoded_bytes).collect();
    let name = parts.join(&b'/');
    let mut escaped = Vec::with_capacity(name.len());
    for byte in &name {
        match byte {
            b'\\' => escaped.extend(b"\\\\"),
            b'\n' => escaped.extend(b"\\n"),
            b'\r' => escaped.extend(b"\\r"),
            byte => escaped.push(*byte),
        }
    }
    let mark: &[u8] = if escaped == name { b"" } else { b"\\" };
    [mark, hash.as_bytes(), b"  ", &escaped, b"\n"].concat()
}

fn parse(line: &[u8]) -> Option<(PathBuf, String)> {
    let (is_escaped, line) = line.strip_prefix(b"\\").map_or((false, line), |rest| (true, rest));
    let (hash, rest) = line.split_at_checked(64)?;
    let name = rest.strip_prefix(b"  ").or_else(|| rest.strip_prefix(b" *"))?;
    let hash = std::str::from_utf8(hash).ok()?;
    let name = if is_escaped { unescape(name)? } else { name.to_vec() };
    let file = path_of(name)?;
    // Whoever writes such a list by hand must not make the program delete files elsewhere.
    let stays = file.components().all(|part| matches!(part, Component::Normal(_)));
    let is_hash = hash.bytes().all(|byte| byte.is_ascii_hexdigit());
    (stays && is_hash && file.file_name().is_some()).then(|| (file, hash.to_ascii_lowercase()))
}

fn unescape(name: &[u8]) -> Option<Vec<u8>> {
    let mut plain = Vec::with_capacity(name.len());
    let mut bytes = name.iter();
    while let Some(byte) = bytes.next() {
        plain.push(match (byte, byte == &b'\\') {
            (byte, false) => *byte,
            (_, true) => match bytes.next()? {
                b'\\' => b'\\',
                b'n' => b'\n',
                b'r' => b'\r',
                _ => return None,
            },
        });
    }
    Some(plain)
}

#[cfg(unix)]
fn path_of(name: Vec<u8>) -> Option<PathBuf> {
    use std::os::unix::ffi::OsStringExt;
    Some(std::ffi::OsString::from_vec(name).into())
}

#[cfg(not(unix))]
fn path_of(name: Vec<u8>) -> Option<PathBuf> {
    String::from_utf8(name).ok().map(PathBuf::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_comes_back_and_names_may_be_anything() {
        let home = tempfile::tempdir().unwrap();
        fs::create_dir(home.path().join("sub")).unwrap();
        for name in ["plain", "sub/a b", "back\\slash", "two\nlines", "sub/\u{fc}.png"] {
            fs::write(home.path().join(name), name).unwrap();
        }
        let list = FileList::of(home.path(), &[LIST_FILE]).unwrap();
        assert_eq!(list.iter().count(), 5);
        list.write(home.path()).unwrap();
        assert_eq!(FileList::read(home.path()), list);
        assert_eq!(FileList::of(home.path(), &[LIST_FILE]).unwrap(), list);
        assert!(list.reaches_into(Path::new("sub")));
        assert!(!list.reaches_into(Path::new("plai")));
        assert!(!list.reaches_into(Path::new("plain")));
    }

    #[test]
    fn lines_that_prove_nothing_are_passed_over() {
        let home = tempfile::tempdir().unwrap();
        let hash = "0123456789abcdef".repeat(4);
        let lines = [
            format!("{hash}  ../elsewhere"),
            format!("{hash}  /etc/passwd"),
            format!("{hash}  "),
            format!("{}  short", &hash[1..]),
            format!("{}  not-hexadecimal", hash.replace('a', "x")),
            "# a remark".to_owned(),
            format!("{}  good", hash.to_uppercase()),
        ];
        fs::write(home.path().join(LIST_FILE), lines.join("\n")).unwrap();
        let list = FileList::read(home.path());
        assert_eq!(list.iter().collect::<Vec<_>>(), [(Path::new("good"), &*hash)]);
    }

    #[cfg(unix)]
    #[test]
    fn ordinary_tools_read_the_list() {
        let home = tempfile::tempdir().unwrap();
        fs::write(home.path().join("back\\slash"), "a").unwrap();
        fs::write(home.path().join("plain"), "b").unwrap();
        FileList::of(home.path(), &[]).unwrap().write(home.path()).unwrap();
        let check = |expected: bool| {
            let mut sha256sum = std::process::Command::new("sha256sum");
            sha256sum.args(["--check", "--quiet", LIST_FILE]).current_dir(home.path());
            // Not every system has it.
            if let Ok(said) = sha256sum.output() {
                assert_eq!(said.status.success(), expected, "{said:?}");
            }
        };
        check(true);
        fs::write(home.path().join("plain"), "edited").unwrap();
        check(false);
    }
}
