use super::{FileError, one_line, read_input_text};
use crate::quantity::Problem;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML file in memory: knows the line of every key, so that whoever checks a value can say where it stands.
///
/// Keys are dotted paths with indices from 0: `frames.3.exposure_s`.
#[derive(Clone, Debug)]
pub struct Document {
    path: PathBuf,
    text: String,
}

impl Document {
    /// Reads the file.
    ///
    /// # Errors
    /// Where it cannot be read or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = read_input_text(path).map_err(|source| FileError::read(path, source))?;
        Ok(Self::new(path, text))
    }

    /// A document from text that was read elsewhere.
    pub fn new(path: &Path, text: String) -> Self {
        Self { path: path.to_owned(), text }
    }

    /// Where it came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text itself.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Its content as `T`, after the `schema` number and every number's finiteness are checked.
    ///
    /// # Errors
    /// Not TOML, another schema, NaN or infinite numbers, or keys and types that `T` does not have; each with its line.
    pub fn parse<T: DeserializeOwned>(&self, schema: i64) -> Result<T, FileError> {
        let table = DeTable::parse(&self.text).map_err(|error| self.toml_error(&error))?;
        self.check_schema(table.get_ref(), schema)?;
        self.check_finite("", &Node::Table(table.get_ref()))?;
        toml::from_str(&self.text).map_err(|error| self.toml_error(&error))
    }

    /// An error about the value at `key`; `what` follows the key's name, as in "is -1; exposure times are positive".
    pub fn invalid(&self, key: &str, what: &str) -> FileError {
        self.error_at(self.line_of(key), format!("`{}` {what}", readable(key)))
    }

    /// [`Document::invalid`] for what a check found.
    pub fn problem(&self, problem: &Problem) -> FileError {
        self.invalid(&problem.key, &problem.what)
    }

    /// The line of a key, from 1; of the nearest table around it where it is absent.
    pub fn line_of(&self, key: &str) -> usize {
        let Ok(table) = DeTable::parse(&self.text) else { return 1 };
        let span = span_of(table.get_ref(), key).unwrap_or(0..0);
        self.line_at(span.start)
    }

    fn check_schema(&self, table: &DeTable<'_>, supported: i64) -> Result<(), FileError> {
        let Some(value) = table.get("schema") else {
            return Err(self.error_at(
                1,
                format!("has no `schema` number; this version reads `schema = {supported}`"),
            ));
        };
        let line = self.line_at(value.span().start);
        let number = value
            .get_ref()
            .as_integer()
            .and_then(|n| i64::from_str_radix(n.as_str(), n.radix()).ok());
        match number {
            Some(found) if found == supported => Ok(()),
            Some(found) => {
                Err(FileError::Schema { path: self.path.clone(), line, found, supported })
            }
            None => Err(self.error_at(
                line,
                format!("`schema` is not an integer; this version reads `schema = {supported}`"),
            )),
        }
    }

    fn check_finite(&self, key: &str, value: &Node<'_, '_>) -> Result<(), FileError> {
        let below =
            |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
        match value {
            Node::Table(table) => table.iter().try_for_each(|(name, value)| {
                self.check_finite(&below(name.get_ref()), &Node::Value(value))
            }),
            Node::Value(value) => match value.get_ref() {
                DeValue::Table(table) => self.check_finite(key, &Node::Table(table)),
                DeValue::Array(array) => array.iter().enumerate().try_for_each(|(k, value)| {
                    self.check_finite(&below(&k.to_string()), &Node::Value(value))
                }),
                DeValue::Float(number) if !is_finite(number.as_str()) => Err(self.error_at(
                    self.line_at(value.span().start),
                    format!("`{}` is {}; numbers must be finite", readable(key), number.as_str()),
                )),
                _ => Ok(()),
            },
        }
    }

    fn toml_error(&self, error: &toml::de::Error) -> FileError {
        let line = error.span().map_or(1, |span| self.line_at(span.start));
        let message: Vec<&str> =
            error.message().lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        self.error_at(line, format!("{}; correct this line", message.join(", ")))
    }

    fn error_at(&self, line: usize, what: impl AsRef<str>) -> FileError {
        // Keys and values of the file may be in it, whatever they hold.
        FileError::Invalid {
            path: self.path.clone(),
            line,
            what: one_line(what.as_ref(), LONGEST_MESSAGE),
        }
    }

    fn line_at(&self, offset: usize) -> usize {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        1 + before.iter().filter(|byte| **byte == b'\n').count()
    }
}

/// Characters of a message, and of a key in it.
const LONGEST_MESSAGE: usize = 400;
const LONGEST_NAME: usize = 60;

/// A table or a value: the root of a document is the one, everything in it the other.
enum Node<'a, 'i> {
    Table(&'a DeTable<'i>),
    Value(&'a Spanned<DeValue<'i>>),
}

fn is_finite(number: &str) -> bool {
    number.parse::<f64>().is_ok_and(f64::is_finite)
}

/// `frames.3.exposure_s` as a person writes it: `frames[3].exposure_s`.
pub(super) fn readable(key: &str) -> String {
    let mut text = String::new();
    for part in key.split('.') {
        if part.parse::<usize>().is_ok() && !text.is_empty() {
            text.push_str(&format!("[{part}]"));
        } else {
            let dot = if text.is_empty() { "" } else { "." };
            text.push_str(dot);
            text.push_str(&one_line(part, LONGEST_NAME));
        }
    }
    text
}

/// The place of the value at `key`, or of the nearest thing around it.
fn span_of(root: &DeTable<'_>, key: &str) -> Option<Range<usize>> {
    let mut parts = key.split('.');
    let mut value = root.get(parts.next()?)?;
    for part in parts {
        let next = match value.get_ref() {
            DeValue::Table(table) => table.get(part),
            DeValue::Array(array) => part.parse::<usize>().ok().and_then(|k| array.get(k)),
            _ => None,
        };
        let Some(next) = next else { break };
        value = next;
    }
    Some(value.span())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only the reading is tested")]
    struct Example {
        schema: i64,
        size: Option<f64>,
        place: Option<Vec<f64>>,
        inner: Option<Vec<Inner>>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only the reading is tested")]
    struct Inner {
        depth: f64,
    }

    /// The error of reading `text`, or "fine".
    fn check(text: &str, expected: &str) {
        let found = match Document::new(Path::new("a.toml"), text.to_owned()).parse::<Example>(1) {
            Ok(_) => "fine".to_owned(),
            Err(error) => error.to_string(),
        };
        assert!(found.starts_with(expected), "{text:?}: {found}");
        assert!(found.lines().count() <= 2, "{text:?}: {found}");
    }

    #[test]
    fn errors_name_the_line_and_the_key() {
        check("schema = 1\nsize = 2", "fine");
        check("size = 2", "a.toml:1: has no `schema` number");
        check("\nschema = 7", "a.toml:2: schema 7, but this version reads schema 1");
        check("schema = \"1\"", "a.toml:1: `schema` is not an integer");
        check("schema = 1\n\nsize = nan", "a.toml:3: `size` is nan; numbers must be finite");
        check("schema = 1\nsize = 1e999", "a.toml:2: `size` is 1e999");
        check("schema = 1\nplace = [1.0,\n -inf]", "a.toml:3: `place[1]` is -inf");
        check(
            "schema = 1\n[[inner]]\ndepth = 1\n[[inner]]\ndepth = +inf",
            "a.toml:5: `inner[1].depth` is +inf",
        );
        check("schema = 1\nsiez = 2", "a.toml:2: unknown field `siez`");
        check("schema = 1\nsize = \"big\"", "a.toml:2: invalid type: string \"big\"");
        check("schema = 1\nsize = = 3", "a.toml:2: ");
        check("", "a.toml:1: has no `schema`");
        check("\u{0}\u{1}", "a.toml:1: ");
    }

    #[test]
    fn keys_and_values_are_shown_shortened_and_harmless() {
        let error = |text: String| {
            Document::new(Path::new("a.toml"), text).parse::<Example>(1).unwrap_err().to_string()
        };
        let long = "k".repeat(100_000);
        for text in [
            format!("schema = 1\nsize = \"{long}\""),
            format!("schema = 1\n{long} = 2"),
            format!("schema = 1\n{long} = nan"),
            "schema = 1\n\"\\u001b[2J\\u202e\" = nan".to_owned(),
            "schema = 1\nsize = \"\\u001b[2J\\u202e\\n\"".to_owned(),
        ] {
            let found = error(text);
            assert!(found.len() < 600 && found.starts_with("a.toml:2: "), "{found}");
            assert!(!found.contains(['\u{1b}', '\u{202e}', '\n']), "{found}");
        }
    }

    #[test]
    fn deep_nesting_is_an_error() {
        let deep = 100_000;
        let dotted = vec!["a"; deep].join(".");
        for text in [
            format!("schema = 1\na = {}", "[".repeat(deep)),
            format!("schema = 1\na = {}{}", "[".repeat(deep), "]".repeat(deep)),
            format!("schema = 1\na = {}1{}", "{b=".repeat(deep), "}".repeat(deep)),
            format!("schema = 1\n{dotted} = 1"),
            format!("schema = 1\n[{dotted}]"),
            format!("schema = 1\n[[{dotted}]]"),
        ] {
            let found = Document::new(Path::new("a.toml"), text).parse::<Example>(1);
            let found = found.unwrap_err().to_string();
            assert!(found.contains("a.toml:") && found.len() < 600, "{found}");
        }
    }

    #[test]
    fn lines_of_keys_and_of_what_is_around_them() {
        let text = "schema = 1\n[[frames]]\nfile = \"a\"\n[[frames]]\nfile = \"b\"\niso = -1\n";
        let document = Document::new(Path::new("s.toml"), text.to_owned());
        assert_eq!(document.line_of("frames.1.iso"), 6);
        assert_eq!(document.line_of("frames.0.file"), 3);
        assert_eq!(document.line_of("nowhere.at.all"), 1);
        let error = document.invalid("frames.1.iso", "is -1; it must be positive").to_string();
        assert_eq!(error, "s.toml:6: `frames[1].iso` is -1; it must be positive");
    }
}
