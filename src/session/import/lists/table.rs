//! Tables of numbers with names, as people and programs write them: which separator, which decimal sign, where the name
//! ends. What holds must hold for every line, so that no line is read in a way of its own.

use super::text::Numbered;
use crate::files::FileError;
use std::path::Path;

/// Ends of names of pictures.
const PICTURES: [&str; 38] = [
    "png", "tif", "tiff", "jpg", "jpeg", "jpe", "exr", "dng", "nef", "nrw", "cr2", "cr3", "crw",
    "arw", "sr2", "srf", "raf", "rw2", "orf", "pef", "srw", "raw", "rwl", "3fr", "fff", "iiq",
    "mrw", "mos", "mef", "erf", "kdc", "dcr", "x3f", "bmp", "tga", "ppm", "pgm", "heic",
];

/// Lines of numbers, some with names.
pub(in super::super) struct Table {
    pub(in super::super) rows: Vec<Row>,
    /// Whether some lines have columns that are not used.
    pub(in super::super) has_more: bool,
}

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Row {
    /// Its number, from 1.
    pub(in super::super) number: usize,
    /// What its name may be, likeliest first; empty where it has none.
    pub(in super::super) names: Vec<String>,
    pub(in super::super) values: Vec<f64>,
    /// A whole number before the values of a line without a name.
    index: Option<u64>,
    has_more: bool,
}

/// What stands between columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Semicolon,
    Tab,
    Space,
    Comma,
}

/// Reads lines of `columns` numbers each. A first line that is one whole number is their count, one without any number a
/// heading. `expected` rows decide whether a first line of one number counts a table of one column.
pub(in super::super) fn read(
    path: &Path,
    lines: &[Numbered],
    columns: usize,
    expected: Option<usize>,
) -> Result<Table, FileError> {
    let lines: Vec<&Numbered> =
        lines.iter().filter(|(_, line)| !is_comment(line, columns)).collect();
    let counts = columns > 1 || expected.is_some_and(|expected| lines.len() == expected + 1);
    let stated = lines.first().and_then(|(_, line)| whole_number(line)).filter(|_| counts);
    let body = &lines[usize::from(stated.is_some())..];
    let rows = rows(path, body, columns)?;
    if let Some(stated) = stated.filter(|stated| *stated as usize != rows.len()) {
        let what = format!(
            "states {stated} lines, but {} follow; correct the number or the list",
            rows.len()
        );
        return Err(invalid(path, lines[0].0, &what));
    }
    let has_more = rows.iter().any(|row| row.has_more);
    Ok(Table { rows, has_more })
}

/// The rows by the first separator that fits all lines.
fn rows(path: &Path, lines: &[&Numbered], columns: usize) -> Result<Vec<Row>, FileError> {
    let mut furthest: Option<&Numbered> = None;
    for separator in [Separator::Semicolon, Separator::Tab, Separator::Space, Separator::Comma] {
        let headed = lines.first().is_some_and(|(_, line)| is_heading(line));
        let body = &lines[usize::from(headed)..];
        let parsed: Result<Vec<Row>, &Numbered> =
            body.iter().map(|line| row(line, separator, columns).ok_or(*line)).collect();
        match parsed {
            Ok(rows) if is_indexed(&rows) => return Ok(rows),
            Ok(_) => furthest = furthest.or(body.first().copied()),
            Err(line) if furthest.is_none_or(|before| before.0 < line.0) => furthest = Some(line),
            Err(_) => {}
        }
    }
    let Some((number, line)) = furthest else { return Ok(Vec::new()) };
    let shown: String = line.chars().filter(|letter| !letter.is_control()).take(60).collect();
    let what = match columns {
        1 => format!("\"{shown}\" is not a finite number; correct this line"),
        _ => format!("\"{shown}\" is not {columns} finite numbers; correct this line"),
    };
    Err(invalid(path, *number, &what))
}

/// Whole numbers before the values are a column of their own only if they count the lines.
fn is_indexed(rows: &[Row]) -> bool {
    let Some(first) = rows.iter().find_map(|row| row.index) else { return true };
    first <= 1 && rows.iter().zip(first..).all(|(row, k)| row.index == Some(k))
}

fn row((number, line): &Numbered, separator: Separator, columns: usize) -> Option<Row> {
    let mut tokens = tokens(line, separator);
    let value = |token: &Token| token.number(separator);
    let numbers_at = |tokens: &[Token], at: usize| {
        tokens.get(at..at + columns)?.iter().map(value).collect::<Option<Vec<f64>>>()
    };
    // Remarks stand behind the numbers.
    let remark = (columns..tokens.len())
        .find(|&k| tokens[k].starts_remark() && numbers_at(&tokens, k - columns).is_some());
    tokens.truncate(remark.unwrap_or(tokens.len()));
    let found = |names, values, index, has_more| {
        Some(Row { number: *number, names, values, index, has_more })
    };
    let named_end = (0..tokens.len())
        .rev()
        .find(|&k| tokens[k].is_picture() && numbers_at(&tokens, k + 1).is_some());
    if let Some(end) = named_end {
        let rest = &tokens[end + 1 + columns..];
        if separator == Separator::Comma
            && rest.len() == columns
            && rest.iter().all(Token::is_digits)
        {
            // Decimal commas between commas: no telling which is which.
            return None;
        }
        let names = names(line, &tokens[..=end]);
        return found(names, numbers_at(&tokens, end + 1)?, None, !rest.is_empty());
    }
    let before = tokens.len().checked_sub(columns)?;
    let behind = tokens.last().is_some_and(Token::is_picture);
    for skipped in [0, 1] {
        if behind
            && before > skipped
            && value(&tokens[skipped + columns]).is_none()
            && let Some(values) = numbers_at(&tokens, skipped)
        {
            return found(names(line, &tokens[skipped + columns..]), values, None, false);
        }
    }
    let values = numbers_at(&tokens, before)?;
    let prefix = &tokens[..before];
    match prefix {
        [] => found(Vec::new(), values, None, false),
        [index] if value(index).is_some() => {
            found(Vec::new(), values, Some(whole_number(index.text())?), false)
        }
        _ if prefix.iter().all(|token| value(token).is_some()) => None,
        _ => found(names(line, prefix), values, None, false),
    }
}

/// What a name may be: all of it, or what follows a whole number before it.
fn names(line: &str, tokens: &[Token]) -> Vec<String> {
    let text = |tokens: &[Token]| match tokens {
        [] => None,
        [only] => Some(only.text().to_owned()),
        [first, .., last] => Some(line[first.start..last.end].to_owned()),
    };
    let whole = text(tokens);
    let is_index = |token: &Token| {
        whole_number(token.text().trim_end_matches(['.', ')', ':'])).is_some() && !token.quoted
    };
    let later = tokens.first().filter(|first| is_index(first)).and_then(|_| text(&tokens[1..]));
    let trimmed = |name: String| {
        let name = name.trim().trim_end_matches([',', ';', ':']).trim_end();
        (!name.is_empty()).then(|| unquoted(name).to_owned())
    };
    whole.into_iter().chain(later).filter_map(trimmed).collect()
}

/// Names alone, one a line, as `filenames.txt` has them; a first line may count them.
pub(in super::super) fn read_names(lines: &[Numbered], count: usize) -> Vec<(usize, Vec<String>)> {
    let lines: Vec<&Numbered> = lines
        .iter()
        .filter(|(_, line)| !line.starts_with('#') && !line.starts_with("//"))
        .collect();
    let counted = lines.len() == count + 1
        && lines.first().is_some_and(|(_, line)| whole_number(line) == Some(count as u64));
    let named = lines.iter().skip(usize::from(counted)).map(|(number, line)| {
        let separator = if line.contains(';') { Separator::Semicolon } else { Separator::Space };
        (*number, names(line, &tokens(line, separator)))
    });
    named.collect()
}

/// A column of a line.
#[derive(Clone, Debug)]
struct Token {
    /// Where it stands in the line, quotes included.
    start: usize,
    end: usize,
    text: String,
    quoted: bool,
}

impl Token {
    fn text(&self) -> &str {
        self.text.trim()
    }

    /// A finite number with a decimal point, or a decimal comma where commas do not separate.
    fn number(&self, separator: Separator) -> Option<f64> {
        let text = self.text().trim_end_matches([',', ';']).replace('\u{2212}', "-");
        let commas = text.matches(',').count();
        let text = match commas {
            0 => text,
            1 if !text.contains('.') && (separator != Separator::Comma || self.quoted) => {
                text.replace(',', ".")
            }
            _ => return None,
        };
        // "nan", "inf" and hexadecimal words are names.
        let plain = |letter: char| letter.is_ascii_digit() || "+-.eE".contains(letter);
        if !text.chars().all(plain) {
            return None;
        }
        text.parse().ok().filter(|value: &f64| value.is_finite())
    }

    fn is_digits(&self) -> bool {
        self.text().bytes().all(|byte| byte.is_ascii_digit())
    }

    fn is_picture(&self) -> bool {
        let name = self.text().trim_end_matches([',', ';', ':']);
        is_picture_name(unquoted(name))
    }

    fn starts_remark(&self) -> bool {
        !self.quoted && (self.text.starts_with(['#', '%']) || self.text.starts_with("//"))
    }
}

/// Whether a name ends like a picture's.
pub(in super::super) fn is_picture_name(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(stem, end)| {
        !stem.is_empty() && PICTURES.iter().any(|known| known.eq_ignore_ascii_case(end))
    })
}

fn tokens(line: &str, separator: Separator) -> Vec<Token> {
    let parts = |letter: char| match separator {
        Separator::Semicolon => letter == ';',
        Separator::Tab => letter == '\t',
        Separator::Space => letter.is_whitespace(),
        Separator::Comma => letter == ',' || letter.is_whitespace(),
    };
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(offset) =
        line[at..].find(|letter: char| !parts(letter) && !letter.is_whitespace())
    {
        let start = at + offset;
        let rest = &line[start..];
        let quoted = quoted(rest).filter(|(_, length)| {
            rest[*length..].chars().next().is_none_or(|next| {
                parts(next) || next.is_whitespace() || matches!(next, ',' | ';' | ':')
            })
        });
        let (text, length, is_quoted) = match quoted {
            Some((text, length)) => (text, length, true),
            None => {
                let length = rest.find(parts).unwrap_or(rest.len());
                let length = rest[..length].trim_end().len();
                (rest[..length].to_owned(), length, false)
            }
        };
        at = start + length;
        found.push(Token { start, end: at, text, quoted: is_quoted });
    }
    found
}

/// Pairs of quotation marks.
const QUOTES: [(char, &str); 6] = [
    ('"', "\""),
    ('\'', "'"),
    ('\u{201c}', "\u{201d}"),
    ('\u{201e}', "\u{201c}\u{201d}"),
    ('\u{2018}', "\u{2019}"),
    ('\u{ab}', "\u{bb}"),
];

/// The text between the quotation marks that `rest` begins with, and how many bytes they span; a doubled mark stands for
/// itself.
fn quoted(rest: &str) -> Option<(String, usize)> {
    let mut letters = rest.char_indices().peekable();
    let (_, open) = letters.next()?;
    let (_, closing) = QUOTES.iter().find(|(mark, _)| *mark == open)?;
    let mut text = String::new();
    while let Some((at, letter)) = letters.next() {
        if !closing.contains(letter) {
            text.push(letter);
        } else if open == letter && letters.peek().is_some_and(|(_, next)| *next == letter) {
            text.push(letter);
            letters.next();
        } else {
            return Some((text, at + letter.len_utf8()));
        }
    }
    None
}

fn unquoted(name: &str) -> &str {
    let inner = || {
        let open = name.chars().next()?;
        let (_, closing) = QUOTES.iter().find(|(mark, _)| *mark == open)?;
        name[open.len_utf8()..].strip_suffix(|last| closing.contains(last))
    };
    inner().unwrap_or(name)
}

/// Words alone, however they are separated, none of them a number or a picture's name.
fn is_heading(line: &str) -> bool {
    tokens(&line.replace(';', " "), Separator::Space).iter().all(|token| {
        let words = || token.text().split(',').filter(|word| !word.is_empty());
        let is_word = |word: &str| {
            // "nan", "inf" and "1e5" are numbers.
            word.chars().any(char::is_alphabetic)
                && word.parse::<f64>().is_err()
                && !is_picture_name(word)
        };
        !token.is_picture() && words().all(is_word)
    })
}

/// A line that begins with a mark of comments and is no picture's: "%1.png 0 0 1" is one's.
fn is_comment(line: &str, columns: usize) -> bool {
    let marked = line.starts_with(['#', '%', ';']) || line.starts_with("//");
    let named = || {
        let numbered = (0, line.to_owned());
        let row = row(&numbered, Separator::Space, columns);
        row.is_some_and(|row| {
            row.names
                .first()
                .is_some_and(|name| is_picture_name(name) && !name.contains(char::is_whitespace))
        })
    };
    marked && !named()
}

fn whole_number(text: &str) -> Option<u64> {
    let text = unquoted(text.trim().trim_end_matches([',', ';', '\t', ' ']));
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

pub(in super::super) fn invalid(path: &Path, line: usize, what: &str) -> FileError {
    FileError::Invalid { path: path.to_owned(), line, what: what.to_owned() }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
