//! Lists of light directions and what stands beside them.

use super::ImportError;
use crate::files::{FileError, read_input_text};
use crate::quantity::{DIRECTION, INTENSITY};
use nalgebra::{UnitVector3, Vector3};
use std::path::{Path, PathBuf};

/// A list of directions, with names and intensities where there are any.
pub(super) struct LightList {
    /// The list and the files beside it that were used.
    pub(super) files: Vec<PathBuf>,
    /// From the surface to the light.
    pub(super) directions: Vec<UnitVector3<f64>>,
    /// R, G, B.
    pub(super) intensities: Vec<[f64; 3]>,
    /// Which picture belongs to which direction.
    pub(super) named: Option<Named>,
}

/// Names of pictures, in the order of the directions.
pub(super) struct Named {
    /// Where they stand.
    pub(super) list: PathBuf,
    /// As written there.
    pub(super) names: Vec<String>,
}

/// One line of a list: its number, a name if it has one, and its numbers.
struct Line {
    number: usize,
    name: String,
    values: Vec<f64>,
}

impl LightList {
    pub(super) fn read(path: &Path) -> Result<Self, ImportError> {
        let lines = read_lines(path, 3)?;
        let directions =
            lines.iter().map(|line| direction(path, line)).collect::<Result<Vec<_>, _>>()?;
        let mut files = vec![path.to_owned()];
        let named = match in_list(path, &lines)? {
            Some(named) => Some(named),
            None => beside(path, directions.len())?,
        };
        files.extend(named.iter().map(|named| named.list.clone()).filter(|list| list != path));
        let intensities = read_intensities(path, directions.len(), &mut files)?;
        Ok(Self { files, directions, intensities, named })
    }
}

fn direction(path: &Path, line: &Line) -> Result<UnitVector3<f64>, FileError> {
    if let Some(what) = line.values.iter().find_map(|value| DIRECTION.check(*value).err()) {
        return Err(invalid(path, line.number, &format!("a number of this direction {what}")));
    }
    let vector = Vector3::from_column_slice(&line.values);
    UnitVector3::try_new(vector, 1e-9).ok_or_else(|| {
        invalid(path, line.number, "this direction has no length; write x y z to the light")
    })
}

/// Names that stand in the list itself, as in `.lp` files: in every line or in none.
fn in_list(path: &Path, lines: &[Line]) -> Result<Option<Named>, FileError> {
    let unnamed = lines.iter().find(|line| line.name.is_empty());
    match unnamed {
        None => {
            let names = lines.iter().map(|line| line.name.clone()).collect();
            Ok(Some(Named { list: path.to_owned(), names }))
        }
        Some(_) if lines.iter().all(|line| line.name.is_empty()) => Ok(None),
        Some(line) => Err(invalid(
            path,
            line.number,
            "this line names no picture, but others do; name all or none",
        )),
    }
}

/// `filenames.txt` beside the list.
fn beside(path: &Path, count: usize) -> Result<Option<Named>, ImportError> {
    let list = path.with_file_name("filenames.txt");
    if !list.is_file() {
        return Ok(None);
    }
    let names: Vec<String> =
        meaningful_lines(&read_text(&list)?).map(|(_, line)| line.to_owned()).collect();
    if names.len() != count {
        let what = format!("filenames.txt beside it names {} pictures", names.len());
        return Err(ImportError::Count { path: path.to_owned(), lights: count, what });
    }
    Ok(Some(Named { list, names }))
}

/// `light_intensities.txt` beside the list, one or three numbers a line; 1 where there is no such file.
fn read_intensities(
    path: &Path,
    count: usize,
    files: &mut Vec<PathBuf>,
) -> Result<Vec<[f64; 3]>, ImportError> {
    let list = path.with_file_name("light_intensities.txt");
    if !list.is_file() || list == path {
        return Ok(vec![[1.0; 3]; count]);
    }
    let columns = if first_line_width(&read_text(&list)?) == 1 { 1 } else { 3 };
    let lines = read_lines(&list, columns)?;
    if lines.len() != count {
        let what = format!("light_intensities.txt beside it has {} lines", lines.len());
        return Err(ImportError::Count { path: path.to_owned(), lights: count, what });
    }
    let intensity = |line: &Line| {
        if let Some(what) = line.values.iter().find_map(|value| INTENSITY.check(*value).err()) {
            return Err(invalid(&list, line.number, &format!("an intensity {what}")));
        }
        match line.values[..] {
            [r, g, b] => Ok([r, g, b]),
            _ => Ok([line.values[0]; 3]),
        }
    };
    let intensities = lines.iter().map(intensity).collect::<Result<_, _>>()?;
    files.push(list);
    Ok(intensities)
}

fn first_line_width(text: &str) -> usize {
    meaningful_lines(text).nth(1).map_or(0, |(_, line)| words(line).count())
}

/// Lines of `columns` numbers, a name before them allowed; a first line that is one whole number is their count.
fn read_lines(path: &Path, columns: usize) -> Result<Vec<Line>, FileError> {
    let text = read_text(path)?;
    let mut lines = meaningful_lines(&text).peekable();
    let stated =
        lines.peek().and_then(|(_, line)| line.parse::<usize>().ok()).filter(|_| columns > 1);
    if stated.is_some() {
        lines.next();
    }
    let found = lines
        .map(|(number, line)| parse_line(path, number, line, columns))
        .collect::<Result<Vec<_>, _>>()?;
    match stated {
        Some(stated) if stated != found.len() => {
            let what = format!(
                "states {stated} lines, but {} follow; correct the number or the list",
                found.len()
            );
            Err(invalid(path, 1, &what))
        }
        _ => Ok(found),
    }
}

fn parse_line(path: &Path, number: usize, line: &str, columns: usize) -> Result<Line, FileError> {
    let wrong = || {
        invalid(
            path,
            number,
            &format!("\"{}\" is not {columns} finite numbers; correct this line", shortened(line)),
        )
    };
    let words: Vec<&str> = words(line).collect();
    if words.len() < columns {
        return Err(wrong());
    }
    let (name, values) = words.split_at(words.len() - columns);
    let number_of = |word: &&str| word.parse::<f64>().ok().filter(|value| value.is_finite());
    let values = values.iter().map(number_of).collect::<Option<Vec<f64>>>().ok_or_else(wrong)?;
    // A fourth number is no name: the list has more columns than we know.
    if name.len() == 1
        && columns == 3
        && name[0].parse::<f64>().is_ok()
        && !name[0].contains(char::is_alphabetic)
    {
        return Err(wrong());
    }
    Ok(Line { number, name: name.join(" "), values })
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|letter: char| letter.is_whitespace() || letter == ',')
        .filter(|word| !word.is_empty())
}

fn meaningful_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    lines
        .map(|(k, line)| (k + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

fn read_text(path: &Path) -> Result<String, FileError> {
    read_input_text(path).map_err(|source| FileError::read(path, source))
}

fn shortened(line: &str) -> String {
    line.chars().filter(|letter| !letter.is_control()).take(60).collect()
}

fn invalid(path: &Path, line: usize, what: &str) -> FileError {
    FileError::Invalid { path: path.to_owned(), line, what: what.to_owned() }
}
