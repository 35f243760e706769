//! Which file a list's name means: as written, in other case, in another form of Unicode, with another extension, under a
//! path of another machine; as long as only one fits.

use super::ImportError;
use super::lights::{Name, Named};
use super::lists::table::{invalid, is_picture_name};
use super::lists::text::from_unknown;
use std::path::{Path, PathBuf};
use unicode_normalization::UnicodeNormalization;

/// Files that names may mean.
pub(super) struct Pool {
    files: Vec<(PathBuf, String)>,
}

/// How well a file fits a name, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    /// With its folders as far as the list gives them.
    Path,
    /// Its last part.
    Name,
    /// Its last part, but for capitals.
    Letters,
    /// All but the extension.
    Stem,
}

impl Pool {
    pub(super) fn new(files: impl IntoIterator<Item = PathBuf>) -> Self {
        let named = |path: PathBuf| {
            let bytes = path.as_os_str().as_encoded_bytes();
            let text = plain(&from_unknown(bytes));
            (path, text)
        };
        Self { files: files.into_iter().map(named).collect() }
    }

    /// The files of a folder; empty where it cannot be read.
    pub(super) fn of_folder(folder: &Path) -> Self {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> =
            entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
        files.sort();
        Self::new(files)
    }

    /// The one file that fits best, and how; `None` where none does.
    ///
    /// # Errors
    /// Several fit equally well.
    pub(super) fn find(
        &self,
        named: &Named,
        name: &Name,
    ) -> Result<Option<(&Path, Fit)>, ImportError> {
        let decoded = name.candidates.iter().filter_map(|text| without_percents(text));
        let candidates: Vec<String> =
            name.candidates.iter().cloned().chain(decoded).map(|text| plain(&text)).collect();
        for fit in [Fit::Path, Fit::Name, Fit::Letters, Fit::Stem] {
            for candidate in &candidates {
                let fitting: Vec<&PathBuf> = self
                    .files
                    .iter()
                    .filter(|(_, text)| fits(text, candidate, fit))
                    .map(|(path, _)| path)
                    .collect();
                match fitting.as_slice() {
                    [] => {}
                    [one] => return Ok(Some((one, fit))),
                    [one, other, ..] => {
                        let what = format!(
                            "{} may be {} or {}; write the name as the file has it",
                            name.text(),
                            one.display(),
                            other.display()
                        );
                        return Err(invalid(&named.list, name.line, &what).into());
                    }
                }
            }
        }
        Ok(None)
    }
}

fn fits(file: &str, name: &str, fit: Fit) -> bool {
    let (own, wanted) = (last_part(file), last_part(name));
    match fit {
        Fit::Path => {
            let mut parts = file.rsplit(['/', '\\']);
            let wanted = name.rsplit(['/', '\\']).filter(|part| *part != ".");
            wanted.into_iter().all(|part| parts.next() == Some(part))
        }
        Fit::Name => own == wanted,
        Fit::Letters => own.to_lowercase() == wanted.to_lowercase(),
        Fit::Stem => {
            is_picture_name(own)
                && is_picture_name(wanted)
                && stem(own).to_lowercase() == stem(wanted).to_lowercase()
        }
    }
}

fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// Composed, as most systems write names; macOS writes them decomposed.
fn plain(text: &str) -> String {
    text.nfc().collect()
}

/// What follows the last slash of either kind.
pub(super) fn last_part(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// A name as URLs have it: "gray%200.png" is "gray 0.png". `None` where there is nothing to decode.
fn without_percents(name: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.strip_prefix("file://").unwrap_or(name).as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let code = after.get(..2).filter(|_| byte == b'%');
        let code = code.and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(code) => {
                bytes.push(code);
                rest = &after[2..];
            }
            None => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).ok().filter(|decoded| decoded != name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(files: &[&str], candidates: &[&str]) -> Result<Option<(String, Fit)>, String> {
        let pool = Pool::new(files.iter().map(PathBuf::from));
        let named = Named { list: "l.lp".into(), names: Vec::new() };
        let name =
            Name { line: 7, candidates: candidates.iter().map(|text| (*text).into()).collect() };
        let found = pool.find(&named, &name).map_err(|error| error.to_string())?;
        Ok(found.map(|(path, fit)| (path.display().to_string(), fit)))
    }

    #[test]
    fn the_one_file_that_fits() {
        let check = |files: &[&str], name: &str, expected: Option<(&str, Fit)>| {
            let found = find(files, &[name]).unwrap();
            assert_eq!(found, expected.map(|(file, fit)| (file.to_owned(), fit)), "{name}");
        };
        let files = ["x/a.png", "y/a.png", "x/b.PNG", "x/c.tif", "x/me\u{301}.png", "x/d e.png"];
        check(&files, "x/a.png", Some(("x/a.png", Fit::Path)));
        check(&files, "y\\a.png", Some(("y/a.png", Fit::Path)));
        check(&files, "b.png", Some(("x/b.PNG", Fit::Letters)));
        check(&files, "C:\\old\\b.PNG", Some(("x/b.PNG", Fit::Name)));
        check(&files, "c.jpg", Some(("x/c.tif", Fit::Stem)));
        check(&files, "m\u{e9}.png", Some(("x/me\u{301}.png", Fit::Path)));
        check(&files, "d%20e.png", Some(("x/d e.png", Fit::Path)));
        check(&files, "f.png", None);
        check(&["a.txt"], "a.png", None);
        let either = find(&["x/0 a.png", "x/a.png"], &["0 a.png", "a.png"]).unwrap();
        assert_eq!(either, Some(("x/0 a.png".to_owned(), Fit::Path)));
    }

    #[test]
    fn several_that_fit_are_named() {
        let check = |files: &[&str], name: &str| {
            let error = find(files, &[name]).unwrap_err();
            let expected = format!("l.lp:7: {name} may be {} or {}", files[0], files[1]);
            assert!(error.starts_with(&expected), "{error}");
        };
        check(&["a.PNG", "A.png"], "a.png");
        check(&["x/a.png", "y/a.png"], "a.png");
        check(&["a.tif", "a.jpg"], "a.png");
    }
}
