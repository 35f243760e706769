//! Lists of light directions and what stands beside them.

use super::ImportError;
use super::lists::table::{self, Row, invalid};
use super::lists::text;
use super::names::last_part;
use crate::files::FileError;
use crate::quantity::{DIRECTION, INTENSITY};
use nalgebra::{UnitVector3, Vector3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A list of directions, with names and intensities where there are any.
pub(super) struct LightList {
    /// The list and the files beside it that were used.
    pub(super) files: Vec<PathBuf>,
    /// From the surface to the light.
    pub(super) directions: Vec<UnitVector3<f64>>,
    /// R, G, B.
    pub(super) intensities: Vec<[f64; 3]>,
    /// Whether these come from a file.
    pub(super) has_intensities: bool,
    /// Which picture belongs to which direction.
    pub(super) named: Option<Named>,
    /// Sentences for the user.
    pub(super) warnings: Vec<String>,
}

/// Names of pictures, in the order of the directions.
pub(super) struct Named {
    /// Where they stand.
    pub(super) list: PathBuf,
    pub(super) names: Vec<Name>,
}

/// The name of a picture in a list.
#[derive(Clone, Debug)]
pub(super) struct Name {
    /// Its line, from 1.
    pub(super) line: usize,
    /// What it may be, likeliest first; never empty.
    pub(super) candidates: Vec<String>,
}

impl Name {
    /// As in the list.
    pub(super) fn text(&self) -> &str {
        &self.candidates[0]
    }
}

impl LightList {
    pub(super) fn read(path: &Path) -> Result<Self, ImportError> {
        let table = table::read(path, &text::read(path)?, 3, None)?;
        let rows = &table.rows;
        let directions =
            rows.iter().map(|row| direction(path, row)).collect::<Result<Vec<_>, _>>()?;
        let mut list = Self {
            files: vec![path.to_owned()],
            intensities: vec![[1.0; 3]; directions.len()],
            has_intensities: false,
            named: in_list(path, rows)?,
            warnings: Vec::new(),
            directions,
        };
        if table.has_more {
            list.warnings.push(format!(
                "{}: only the first three numbers after a name are used, as x y z",
                path.display()
            ));
        }
        if list.named.is_none() {
            list.named = beside(path, list.directions.len())?;
        }
        let names = list.named.iter().map(|named| named.list.clone());
        list.files.extend(names.filter(|list| list != path));
        list.read_intensities(path)?;
        Ok(list)
    }

    /// `light_intensities.txt` beside the list, one or three numbers a line; 1 where there is no such file.
    fn read_intensities(&mut self, path: &Path) -> Result<(), ImportError> {
        let list = path.with_file_name("light_intensities.txt");
        if !list.is_file() || list == path {
            return Ok(());
        }
        let count = self.directions.len();
        let lines = text::read(&list)?;
        let rows = match table::read(&list, &lines, 3, Some(count)) {
            Ok(table) => table.rows,
            Err(error) => table::read(&list, &lines, 1, Some(count)).map_err(|_| error)?.rows,
        };
        let rows = self.in_order(rows);
        if rows.len() != count {
            let what = format!("light_intensities.txt beside it has {} lines", rows.len());
            return Err(ImportError::Count { path: path.to_owned(), lights: count, what });
        }
        let intensities = rows.iter().map(|row| intensity(&list, row));
        self.intensities = intensities.collect::<Result<_, _>>()?;
        self.has_intensities = true;
        self.files.push(list);
        Ok(())
    }

    /// Rows that name their pictures, in the order of the list's names; others stay as they are.
    fn in_order(&self, rows: Vec<Row>) -> Vec<Row> {
        let Some(named) = &self.named else { return rows };
        let mut by_name: HashMap<String, &Row> = HashMap::new();
        for row in &rows {
            for name in &row.names {
                by_name.entry(last_part(name).to_lowercase()).or_insert(row);
            }
        }
        let of = |name: &Name| {
            let mut keys = name.candidates.iter().map(|text| last_part(text).to_lowercase());
            keys.find_map(|key| by_name.get(&key).map(|row| (*row).clone()))
        };
        named.names.iter().map(of).collect::<Option<Vec<Row>>>().unwrap_or(rows)
    }
}

fn direction(path: &Path, row: &Row) -> Result<UnitVector3<f64>, FileError> {
    if let Some(what) = row.values.iter().find_map(|value| DIRECTION.check(*value).err()) {
        return Err(invalid(path, row.number, &format!("a number of this direction {what}")));
    }
    let vector = Vector3::from_column_slice(&row.values);
    UnitVector3::try_new(vector, 1e-9).ok_or_else(|| {
        invalid(path, row.number, "this direction has no length; write x y z to the light")
    })
}

fn intensity(list: &Path, row: &Row) -> Result<[f64; 3], FileError> {
    if let Some(what) = row.values.iter().find_map(|value| INTENSITY.check(*value).err()) {
        return Err(invalid(list, row.number, &format!("an intensity {what}")));
    }
    match row.values[..] {
        [r, g, b] => Ok([r, g, b]),
        _ => Ok([row.values[0]; 3]),
    }
}

/// Names that stand in the list itself, as in `.lp` files: in every line or in none.
fn in_list(path: &Path, rows: &[Row]) -> Result<Option<Named>, FileError> {
    let unnamed = rows.iter().find(|row| row.names.is_empty());
    match unnamed {
        None => {
            let name = |row: &Row| Name { line: row.number, candidates: row.names.clone() };
            Ok(Some(Named { list: path.to_owned(), names: rows.iter().map(name).collect() }))
        }
        Some(_) if rows.iter().all(|row| row.names.is_empty()) => Ok(None),
        Some(row) => Err(invalid(
            path,
            row.number,
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
    let names: Vec<Name> = table::read_names(&text::read(&list)?, count)
        .into_iter()
        .filter(|(_, candidates)| !candidates.is_empty())
        .map(|(line, candidates)| Name { line, candidates })
        .collect();
    if names.len() != count {
        let what = format!("filenames.txt beside it names {} pictures", names.len());
        return Err(ImportError::Count { path: path.to_owned(), lights: count, what });
    }
    Ok(Some(Named { list, names }))
}
