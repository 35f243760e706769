//! `lights.toml`: the keys of the format, to and from [`CalibratedLight`].

use super::gain_map::{encode_gain_map, read_gain_map};
use super::{CalibratedLight, LIGHT_COUNT};
use crate::files::{
    Document, FileError, Provenance, ProvenanceTable, inside_folder, remove_owned, sha256_hex,
    write_owned, write_owned_toml,
};
use crate::quantity::{
    BEAM_EXPONENT, DIRECTION, INTENSITY, POSITION_SIGMA_MM, Problem, check_light_place,
};
use nalgebra::{Point3, UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use weavelight_calibration::description::{DirectionalLight, Image, Light, PointLight};

/// The schema of `lights.toml` that this version reads and writes.
const SCHEMA: i64 = 1;

/// The file's name in a calibration folder.
pub const LIGHTS_FILE: &str = "lights.toml";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LightsFile {
    schema: i64,
    #[serde(default)]
    provenance: ProvenanceTable,
    #[serde(default)]
    lights: Vec<LightTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LightTable {
    kind: KindName,
    position_mm: Option<[f64; 3]>,
    axis: Option<[f64; 3]>,
    exponent: Option<f64>,
    direction: Option<[f64; 3]>,
    intensity: [f64; 3],
    gain_map: Option<String>,
    position_sigma_mm: Option<f64>,
    position_claimed: Option<bool>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<String>,
}

#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum KindName {
    Point,
    Directional,
}

/// The folder's lights, or `None` where there is no such file.
pub(super) fn read(folder: &Path) -> Result<Option<(Vec<CalibratedLight>, Provenance)>, FileError> {
    let path = folder.join(LIGHTS_FILE);
    if !path.exists() {
        return Ok(None);
    }
    let document = Document::read(&path)?;
    let file: LightsFile = document.parse(SCHEMA)?;
    check_numbers(&file.lights).map_err(|problem| document.problem(&problem))?;
    let lights = file
        .lights
        .into_iter()
        .enumerate()
        .map(|(k, table)| light_from_table(folder, &document, &format!("lights.{k}"), table))
        .collect::<Result<_, _>>()?;
    Ok(Some((lights, file.provenance.into())))
}

/// Writes `lights.toml` and the gain maps it names into a calibration folder, which is made where absent. The maps have
/// names of their own content, so that until the moment `lights.toml` is replaced the old one finds the old ones.
///
/// # Errors
/// Where something cannot be written, would not be read back, or is not as the program wrote it; the old calibration then stands.
pub fn write_lights(
    folder: &Path,
    lights: &[CalibratedLight],
    provenance: &Provenance,
) -> Result<(), FileError> {
    std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
    let tables = lights
        .iter()
        .enumerate()
        .map(|(k, light)| table_from_light(folder, k, light))
        .collect::<Result<Vec<_>, _>>()?;
    let path = folder.join(LIGHTS_FILE);
    check_numbers(&tables).map_err(|problem| FileError::unwritable(&path, &problem))?;
    let used: Vec<String> = tables.iter().filter_map(|table| table.gain_map.clone()).collect();
    write_owned_toml(
        &path,
        &LightsFile { schema: SCHEMA, provenance: provenance.into(), lights: tables },
    )?;
    // Maps of an earlier calibration; somebody's own stay.
    remove_owned(folder, |name| {
        let is_map = name.starts_with("gain-light-") && name.ends_with(".exr");
        is_map && !used.iter().any(|used| used == name)
    })
}

/// What readers and writers of the format ask of its numbers.
fn check_numbers(lights: &[LightTable]) -> Result<(), Problem> {
    let count = lights.len();
    if !LIGHT_COUNT.contains(&count) {
        let (least, most) = (LIGHT_COUNT.start(), LIGHT_COUNT.end());
        let what = format!("are {count}; a normal needs {least} lights, and {most} is the most");
        return Err(Problem::new("lights", what));
    }
    lights.iter().enumerate().try_for_each(|(k, light)| check_light(&format!("lights.{k}"), light))
}

fn check_light(key: &str, light: &LightTable) -> Result<(), Problem> {
    let key = |name: &str| format!("{key}.{name}");
    if light.intensity.iter().any(|i| *i <= 0.0) {
        let what = format!(
            "is {:?}; every channel must be positive (a dead light is left out of the frames)",
            light.intensity
        );
        return Err(Problem::new(key("intensity"), what));
    }
    INTENSITY.all_at(&key("intensity"), &light.intensity)?;
    POSITION_SIGMA_MM.maybe_at(&key("position_sigma_mm"), light.position_sigma_mm)?;
    BEAM_EXPONENT.maybe_at(&key("exponent"), light.exponent)?;
    if let Some(position) = light.position_mm {
        check_light_place(&key("position_mm"), position)?;
    }
    for (name, vector) in [("axis", &light.axis), ("direction", &light.direction)] {
        DIRECTION.all_at(&key(name), vector.as_ref().map_or(&[][..], |vector| vector))?;
    }
    Ok(())
}

fn light_from_table(
    folder: &Path,
    document: &Document,
    key: &str,
    table: LightTable,
) -> Result<CalibratedLight, FileError> {
    let light = match table.kind {
        KindName::Point => Light::Point(point_light(document, key, &table)?),
        KindName::Directional => Light::Directional(directional_light(document, key, &table)?),
    };
    let gain_map =
        table.gain_map.map(|name| load_gain_map(folder, document, key, &name)).transpose()?;
    Ok(CalibratedLight {
        light,
        gain_map,
        position_sigma_mm: table.position_sigma_mm,
        position_claimed: table.position_claimed,
        warnings: table.warnings,
    })
}

fn point_light(
    document: &Document,
    key: &str,
    table: &LightTable,
) -> Result<PointLight, FileError> {
    let (Some(position), Some(axis), Some(exponent), None) =
        (table.position_mm, table.axis, table.exponent, table.direction)
    else {
        let what = "is a point light: it needs position_mm, axis, exponent and intensity, and no direction";
        return Err(document.invalid(key, what));
    };
    Ok(PointLight {
        position_mm: Point3::from(position),
        axis: unit(document, &format!("{key}.axis"), axis)?,
        exponent,
        intensity: table.intensity,
    })
}

fn directional_light(
    document: &Document,
    key: &str,
    table: &LightTable,
) -> Result<DirectionalLight, FileError> {
    let (Some(direction), None, None, None) =
        (table.direction, table.position_mm, table.axis, table.exponent)
    else {
        let what = "is a directional light: it needs direction and intensity, and no position_mm, axis or exponent";
        return Err(document.invalid(key, what));
    };
    let direction = unit(document, &format!("{key}.direction"), direction)?;
    Ok(DirectionalLight { direction, intensity: table.intensity })
}

fn unit(document: &Document, key: &str, vector: [f64; 3]) -> Result<UnitVector3<f64>, FileError> {
    UnitVector3::try_new(Vector3::from(vector), 1e-9)
        .ok_or_else(|| document.invalid(key, "has no length; write a unit vector in the rig frame"))
}

fn load_gain_map(
    folder: &Path,
    document: &Document,
    key: &str,
    name: &str,
) -> Result<Image<[f32; 3]>, FileError> {
    let key = format!("{key}.gain_map");
    let path = inside_folder(name).map_err(|what| document.invalid(&key, &what))?;
    read_gain_map(&folder.join(path))
}

fn table_from_light(
    folder: &Path,
    k: usize,
    light: &CalibratedLight,
) -> Result<LightTable, FileError> {
    let gain_map = light.gain_map.as_ref().map(|map| write_gain_map(folder, k, map)).transpose()?;
    let mut table = LightTable {
        kind: KindName::Directional,
        position_mm: None,
        axis: None,
        exponent: None,
        direction: None,
        intensity: light.light.intensity(),
        gain_map,
        position_sigma_mm: light.position_sigma_mm,
        position_claimed: light.position_claimed,
        warnings: light.warnings.clone(),
    };
    match &light.light {
        Light::Point(point) => {
            table.kind = KindName::Point;
            table.position_mm = Some(point.position_mm.into());
            table.axis = Some(point.axis.into_inner().into());
            table.exponent = Some(point.exponent);
        }
        Light::Directional(far) => table.direction = Some(far.direction.into_inner().into()),
    }
    Ok(table)
}

fn write_gain_map(folder: &Path, k: usize, map: &Image<[f32; 3]>) -> Result<String, FileError> {
    let bytes = encode_gain_map(folder, k, map)?;
    let name = format!("gain-light-{k:02}-{:.8}.exr", sha256_hex(&bytes));
    write_owned(&folder.join(&name), &bytes)?;
    Ok(name)
}
