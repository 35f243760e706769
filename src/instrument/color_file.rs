//! `color.toml`: the keys of the format, to and from [`Color`].

use super::{Color, Noise};
use crate::files::{
    Document, FileError, Owned, Provenance, ProvenanceTable, update_owned_toml, write_owned_toml,
};
use crate::quantity::{
    BLACK_DN, COLOR_MATRIX, ELECTRONS_PER_DN, KAPPA, Problem, READ_NOISE_E, SATURATION_DN,
    WHITE_BALANCE, check_response,
};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The schema of `color.toml` that this version reads and writes.
const SCHEMA: i64 = 1;

/// The file's name in a calibration folder.
pub const COLOR_FILE: &str = "color.toml";

/// How far a row of the colour matrix may be from summing to 1: rounded digits.
const ROW_SUM_SLACK: f64 = 5e-3;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ColorFile {
    schema: i64,
    black_level: Option<[f64; 4]>,
    saturation_level: Option<f64>,
    #[serde(default = "linear")]
    response: Vec<f64>,
    camera_to_linear_srgb: Option<[[f64; 3]; 3]>,
    noise: Option<NoiseTable>,
    #[serde(default)]
    provenance: ProvenanceTable,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lights: Vec<LightTable>,
}

fn linear() -> Vec<f64> {
    vec![0.0, 1.0]
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NoiseTable {
    electrons_per_dn: f64,
    read_noise_e: f64,
    #[serde(default)]
    kappa: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LightTable {
    white_balance: [f64; 3],
}

/// The folder's colour calibration, or `None` where there is no such file.
pub(super) fn read(folder: &Path) -> Result<Option<(Color, Provenance)>, FileError> {
    let path = folder.join(COLOR_FILE);
    if !path.exists() {
        return Ok(None);
    }
    let document = Document::read(&path)?;
    let file: ColorFile = document.parse(SCHEMA)?;
    check_numbers(&file).map_err(|problem| document.problem(&problem))?;
    let noise = |n: NoiseTable| Noise {
        electrons_per_dn: n.electrons_per_dn,
        read_noise_e: n.read_noise_e,
        kappa: n.kappa,
    };
    let color = Color {
        black_level: file.black_level,
        saturation_level: file.saturation_level,
        clip_level: None,
        response: file.response,
        // nalgebra stores columns; the file has rows.
        camera_to_linear_srgb: file
            .camera_to_linear_srgb
            .map(|rows| Matrix3::from(rows).transpose()),
        white_balance: file.lights.into_iter().map(|light| light.white_balance).collect(),
        noise: file.noise.map(noise),
    };
    Ok(Some((color, file.provenance.into())))
}

/// Writes `color.toml` into a calibration folder, which is made where absent.
///
/// # Errors
/// Where it cannot be written, would not be read back, or a `color.toml` stands there that is not as the program wrote it.
pub fn write_color(folder: &Path, color: &Color, provenance: &Provenance) -> Result<(), FileError> {
    std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
    let (path, file) = (folder.join(COLOR_FILE), file_of(color, provenance));
    check_numbers(&file).map_err(|problem| FileError::unwritable(&path, &problem))?;
    write_owned_toml(&path, &file)
}

/// As [`write_color`], with what `color.toml` said but for what was measured since. A file that was edited stays as it is.
///
/// # Errors
/// Where it cannot be written.
pub fn update_color(
    folder: &Path,
    color: &Color,
    provenance: &Provenance,
) -> Result<Owned, FileError> {
    let (path, file) = (folder.join(COLOR_FILE), file_of(color, provenance));
    check_numbers(&file).map_err(|problem| FileError::unwritable(&path, &problem))?;
    update_owned_toml(&path, &file)
}

fn file_of(color: &Color, provenance: &Provenance) -> ColorFile {
    let noise = |n: Noise| NoiseTable {
        electrons_per_dn: n.electrons_per_dn,
        read_noise_e: n.read_noise_e,
        kappa: n.kappa,
    };
    ColorFile {
        schema: SCHEMA,
        black_level: color.black_level,
        saturation_level: color.saturation_level,
        response: color.response.clone(),
        camera_to_linear_srgb: color.camera_to_linear_srgb.map(|matrix| matrix.transpose().into()),
        noise: color.noise.map(noise),
        provenance: provenance.into(),
        lights: color
            .white_balance
            .iter()
            .map(|gains| LightTable { white_balance: *gains })
            .collect(),
    }
}

/// What readers and writers of the format ask of its numbers.
fn check_numbers(file: &ColorFile) -> Result<(), Problem> {
    check_levels(file)?;
    check_response("response", &file.response)?;
    for (k, row) in file.camera_to_linear_srgb.iter().flatten().enumerate() {
        let key = format!("camera_to_linear_srgb.{k}");
        COLOR_MATRIX.all_at(&key, row)?;
        let sum: f64 = row.iter().sum();
        if (sum - 1.0).abs() > ROW_SUM_SLACK {
            let what = format!("sums to {sum}; rows sum to 1, so that white stays white");
            return Err(Problem::new(key, what));
        }
    }
    for (k, light) in file.lights.iter().enumerate() {
        WHITE_BALANCE.all_at(&format!("lights.{k}.white_balance"), &light.white_balance)?;
    }
    let Some(noise) = &file.noise else { return Ok(()) };
    ELECTRONS_PER_DN.at("noise.electrons_per_dn", noise.electrons_per_dn)?;
    READ_NOISE_E.at("noise.read_noise_e", noise.read_noise_e)?;
    KAPPA.at("noise.kappa", noise.kappa)
}

fn check_levels(file: &ColorFile) -> Result<(), Problem> {
    let levels = file.black_level.as_ref().map_or(&[][..], |levels| levels);
    BLACK_DN.all_at("black_level", levels)?;
    SATURATION_DN.maybe_at("saturation_level", file.saturation_level)?;
    let darkest = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match file.saturation_level {
        Some(saturation) if saturation <= darkest => {
            let what = format!(
                "is {saturation}, not above the black level {darkest}; both are raw numbers, black included"
            );
            Err(Problem::new("saturation_level", what))
        }
        _ => Ok(()),
    }
}
