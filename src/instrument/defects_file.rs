//! `defects.toml`: photosites of the camera that do not measure light.

use super::Defects;
use crate::files::{Document, FileError, Provenance, ProvenanceTable, write_owned_toml};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The schema of `defects.toml` that this version reads and writes.
const SCHEMA: i64 = 1;

/// The file's name in a calibration folder.
pub const DEFECTS_FILE: &str = "defects.toml";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DefectsFile {
    schema: i64,
    /// Columns and rows, from the frame's top left.
    #[serde(default)]
    hot: Vec<[u32; 2]>,
    #[serde(default)]
    dead: Vec<[u32; 2]>,
    #[serde(default)]
    provenance: ProvenanceTable,
}

/// The folder's list of defective photosites; none where there is no such file.
pub(super) fn read(folder: &Path) -> Result<Defects, FileError> {
    let path = folder.join(DEFECTS_FILE);
    if !path.exists() {
        return Ok(Defects::default());
    }
    let file: DefectsFile = Document::read(&path)?.parse(SCHEMA)?;
    Ok(Defects::new(file.hot, file.dead))
}

/// Writes `defects.toml` into a calibration folder, which is made where absent.
///
/// # Errors
/// Where it cannot be written, or a `defects.toml` stands there that is not as the program wrote it.
pub fn write_defects(
    folder: &Path,
    defects: &Defects,
    provenance: &Provenance,
) -> Result<(), FileError> {
    std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
    let file = DefectsFile {
        schema: SCHEMA,
        hot: defects.hot().to_vec(),
        dead: defects.dead().to_vec(),
        provenance: provenance.into(),
    };
    write_owned_toml(&folder.join(DEFECTS_FILE), &file)
}
