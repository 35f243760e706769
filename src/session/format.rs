//! `session.toml` itself: the keys of the format, to and from the types the program works with.

use super::check::check_manifest;
use super::{Board, Encoding, FrameEntry, Kind, MANIFEST, Patch, Session, SessionError, Target};
use crate::files::{
    Document, FileError, datetime_from_timestamp, inside_folder, timestamp_from_datetime,
    write_toml,
};
use crate::quantity::DIRECTION;
use nalgebra::{Point3, UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toml::value::Datetime;
use weavelight_calibration::description::{Cfa, Plane};

/// The schema of `session.toml` that this version reads and writes.
const SCHEMA: i64 = 1;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    schema: i64,
    kind: KindName,
    name: Option<String>,
    captured: Option<Datetime>,
    mask: Option<String>,
    plane: Option<PlaneTable>,
    target: Option<TargetTable>,
    #[serde(default)]
    frames: Vec<FrameTable>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum KindName {
    Swatch,
    White,
    Grey,
    Board,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum EncodingName {
    Linear,
    Srgb,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneTable {
    #[serde(default)]
    point_mm: [f64; 3],
    #[serde(default = "up")]
    normal: [f64; 3],
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetTable {
    reflectance: Option<f64>,
    board: Option<BoardTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    patches: Vec<PatchTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BoardTable {
    columns: usize,
    rows: usize,
    square_mm: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PatchTable {
    rect_px: [f64; 4],
    reflectance: f64,
    lab_d50: Option<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameTable {
    file: String,
    light: Option<usize>,
    exposure_s: Option<f64>,
    iso: Option<f64>,
    sha256: Option<String>,
    encoding: Option<EncodingName>,
    cfa: Option<String>,
    pose: Option<String>,
    captured: Option<Datetime>,
    attempts: Option<u32>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    retries: Vec<String>,
    pins_open: Option<u32>,
    pins_close: Option<u32>,
    board_ms: Option<u64>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    drift_check: bool,
}

/// A file with a `[target]`: whatever else it says is of no interest.
#[derive(Deserialize)]
struct TargetFile {
    target: Option<TargetTable>,
}

impl Target {
    /// The `[target]` of a file: a `session.toml`, or one with nothing but `schema` and that table.
    ///
    /// # Errors
    /// Where it cannot be read, has no such table, or says something impossible; with file, line and remedy.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        let document = Document::read(path)?;
        let file: TargetFile = document.parse(SCHEMA)?;
        let table = file.target.ok_or_else(|| {
            document
                .invalid("target", "is missing; describe the target there, as a session.toml does")
        })?;
        let session = Session {
            target: Some(target_from_table(table)),
            ..Session::new("", Kind::Swatch, "")
        };
        check_manifest(&session).map_err(|problem| document.problem(&problem))?;
        Ok(session.target.unwrap_or_default())
    }
}

impl Session {
    /// Reads a capture session: its folder, or the `session.toml` in it. Frames are not read yet.
    ///
    /// # Errors
    /// Where the manifest cannot be read, or says something impossible; with file, line and remedy.
    pub fn load(path: &Path) -> Result<Self, SessionError> {
        let folder = if path.is_file() && path.file_name().is_some_and(|name| name == MANIFEST) {
            path.parent().unwrap_or(Path::new("."))
        } else {
            path
        };
        let document = Document::read(&folder.join(MANIFEST))?;
        Ok(session_from_manifest(folder, &document)?)
    }

    /// Writes `session.toml` into the folder, whole or not at all.
    ///
    /// # Errors
    /// Where it cannot be written, or would not be read back (the same checks as in [`Session::load`]).
    pub fn save(&self) -> Result<(), SessionError> {
        let path = self.folder.join(MANIFEST);
        let manifest = manifest_from_session(self)
            .map_err(|what| FileError::Unwritable { path: path.clone(), what })?;
        self.check()?;
        write_toml(&path, &manifest)?;
        Ok(())
    }

    /// Whether what it says could be written and read back.
    pub(super) fn check(&self) -> Result<(), FileError> {
        check_manifest(self)
            .map_err(|problem| FileError::unwritable(&self.folder.join(MANIFEST), &problem))
    }
}

pub(super) fn session_from_manifest(
    folder: &Path,
    document: &Document,
) -> Result<Session, FileError> {
    let manifest: Manifest = document.parse(SCHEMA)?;
    let kind = Kind::from(manifest.kind);
    let folder_name = || {
        folder
            .file_name()
            .map_or_else(|| "unnamed".to_owned(), |n| n.to_string_lossy().into_owned())
    };
    let frames = manifest
        .frames
        .into_iter()
        .enumerate()
        .map(|(k, table)| frame_from_table(document, k, table, kind))
        .collect::<Result<Vec<_>, _>>()?;
    let session = Session {
        folder: folder.to_owned(),
        kind,
        name: manifest.name.unwrap_or_else(folder_name),
        captured: moment(document, "captured", manifest.captured)?,
        plane: manifest.plane.map(|table| plane_from_table(document, &table)).transpose()?,
        target: manifest.target.map(target_from_table),
        frames,
        mask: manifest.mask.map(|name| inside(document, "mask", &name)).transpose()?,
    };
    check_manifest(&session).map_err(|problem| document.problem(&problem))?;
    Ok(session)
}

fn frame_from_table(
    document: &Document,
    k: usize,
    table: FrameTable,
    kind: Kind,
) -> Result<FrameEntry, FileError> {
    let key = |name: &str| format!("frames.{k}.{name}");
    // A board is found by its shape: how long it was exposed does not matter, and pictures from elsewhere do not say.
    let required =
        |name: &str, value: Option<f64>, of_a_board: f64| match (value, kind) {
            (Some(value), _) => Ok(value),
            (None, Kind::Board) => Ok(of_a_board),
            (None, _) => Err(document
                .invalid(&key(name), "is missing; every frame needs it, to scale its signal")),
        };
    Ok(FrameEntry {
        light: table.light,
        exposure_s: required("exposure_s", table.exposure_s, 1.0)?,
        iso: required("iso", table.iso, 100.0)?,
        sha256: table.sha256.map(|hash| hash.to_ascii_lowercase()),
        encoding: table.encoding.map(Encoding::from),
        cfa: table.cfa.map(|name| cfa(document, &key("cfa"), &name)).transpose()?,
        pose: table.pose,
        captured: moment(document, &key("captured"), table.captured)?,
        attempts: table.attempts,
        retries: table.retries,
        pins_open: table.pins_open,
        pins_close: table.pins_close,
        board_ms: table.board_ms,
        drift_check: table.drift_check,
        file: inside(document, &key("file"), &table.file)?,
    })
}

fn cfa(document: &Document, key: &str, name: &str) -> Result<Cfa, FileError> {
    let what = || {
        format!("is \"{name}\"; write the four letters of the top-left 2 x 2 cell, as in \"RGGB\"")
    };
    Cfa::parse(name).ok_or_else(|| document.invalid(key, &what()))
}

fn inside(document: &Document, key: &str, name: &str) -> Result<PathBuf, FileError> {
    inside_folder(name).map_err(|what| document.invalid(key, &what))
}

fn moment(
    document: &Document,
    key: &str,
    value: Option<Datetime>,
) -> Result<Option<jiff::Timestamp>, FileError> {
    let read = |datetime| {
        timestamp_from_datetime(&datetime)
            .map_err(|error| document.invalid(key, &format!("is {datetime}, which {error}")))
    };
    value.map(read).transpose()
}

fn plane_from_table(document: &Document, table: &PlaneTable) -> Result<Plane, FileError> {
    DIRECTION
        .all_at("plane.normal", &table.normal)
        .map_err(|problem| document.problem(&problem))?;
    let normal = UnitVector3::try_new(Vector3::from(table.normal), 1e-9)
        .filter(|normal| normal.z > 0.0)
        .ok_or_else(|| {
            document.invalid("plane.normal", "does not point to the camera; its z must be positive")
        })?;
    Ok(Plane { point_mm: Point3::from(table.point_mm), normal })
}

fn target_from_table(table: TargetTable) -> Target {
    let board = |b: BoardTable| Board { columns: b.columns, rows: b.rows, square_mm: b.square_mm };
    let patch = |p: PatchTable| Patch {
        rect_px: p.rect_px,
        reflectance: p.reflectance,
        lab_d50: p.lab_d50,
    };
    Target {
        reflectance: table.reflectance,
        board: table.board.map(board),
        patches: table.patches.into_iter().map(patch).collect(),
    }
}

fn manifest_from_session(session: &Session) -> Result<Manifest, String> {
    Ok(Manifest {
        schema: SCHEMA,
        kind: session.kind.into(),
        name: Some(session.name.clone()),
        captured: session.captured.and_then(datetime_from_timestamp),
        mask: session.mask.as_deref().map(text).transpose()?,
        plane: session.plane.as_ref().map(|plane| PlaneTable {
            point_mm: plane.point_mm.into(),
            normal: plane.normal.into_inner().into(),
        }),
        target: session.target.as_ref().map(table_from_target),
        frames: session.frames.iter().map(table_from_frame).collect::<Result<_, _>>()?,
    })
}

fn table_from_target(target: &Target) -> TargetTable {
    let patch = |p: &Patch| PatchTable {
        rect_px: p.rect_px,
        reflectance: p.reflectance,
        lab_d50: p.lab_d50,
    };
    TargetTable {
        reflectance: target.reflectance,
        board: target.board.map(|b| BoardTable {
            columns: b.columns,
            rows: b.rows,
            square_mm: b.square_mm,
        }),
        patches: target.patches.iter().map(patch).collect(),
    }
}

fn table_from_frame(frame: &FrameEntry) -> Result<FrameTable, String> {
    Ok(FrameTable {
        file: text(&frame.file)?,
        light: frame.light,
        exposure_s: Some(frame.exposure_s),
        iso: Some(frame.iso),
        sha256: frame.sha256.clone(),
        encoding: frame.encoding.map(EncodingName::from),
        cfa: frame.cfa.map(|cfa| cfa.name()),
        pose: frame.pose.clone(),
        captured: frame.captured.and_then(datetime_from_timestamp),
        attempts: frame.attempts,
        retries: frame.retries.clone(),
        pins_open: frame.pins_open,
        pins_close: frame.pins_close,
        board_ms: frame.board_ms,
        drift_check: frame.drift_check,
    })
}

fn text(path: &Path) -> Result<String, String> {
    path.to_str()
        .map(str::to_owned)
        .ok_or_else(|| format!("the file name {} is not UTF-8; rename it", path.display()))
}

impl From<KindName> for Kind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::Swatch => Self::Swatch,
            KindName::White => Self::White,
            KindName::Grey => Self::Grey,
            KindName::Board => Self::Board,
        }
    }
}

impl From<Kind> for KindName {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Swatch => Self::Swatch,
            Kind::White => Self::White,
            Kind::Grey => Self::Grey,
            Kind::Board => Self::Board,
        }
    }
}

impl From<EncodingName> for Encoding {
    fn from(name: EncodingName) -> Self {
        match name {
            EncodingName::Linear => Self::Linear,
            EncodingName::Srgb => Self::Srgb,
        }
    }
}

impl From<Encoding> for EncodingName {
    fn from(encoding: Encoding) -> Self {
        match encoding {
            Encoding::Linear => Self::Linear,
            Encoding::Srgb => Self::Srgb,
        }
    }
}
