//! `rig.toml`: the keys of the format, to and from [`Rig`].

use super::{CameraKind, Controller, LIGHT_COUNT, Rig, RigCamera, RigLight, RigLightPlace};
use crate::files::{Document, FileError, write_toml};
use crate::quantity::{
    CAMERA_HEIGHT_MM, DIRECTION, FOCAL_LENGTH_MM, PIXEL_PITCH_UM, POSITION_SIGMA_MM, Problem,
    check_light_place, check_side, check_view,
};
use nalgebra::{Point3, UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The schema of `rig.toml` that this version reads and writes.
const SCHEMA: i64 = 1;

/// How well a ruler places a light where the file does not say.
const RULER_SIGMA_MM: f64 = 10.0;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFile {
    schema: i64,
    name: Option<String>,
    camera: CameraTable,
    controller: Option<ControllerTable>,
    #[serde(default)]
    lights: Vec<LightTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    #[serde(default)]
    kind: CameraKindName,
    port: Option<String>,
    folder: Option<String>,
    model: Option<String>,
    width_px: usize,
    height_px: usize,
    focal_length_mm: Option<f64>,
    pixel_pitch_um: Option<f64>,
    height_mm: Option<f64>,
}

#[derive(Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum CameraKindName {
    #[default]
    Tethered,
    Watched,
    Simulated,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ControllerTable {
    #[serde(default)]
    kind: ControllerKindName,
    port: Option<String>,
}

#[derive(Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ControllerKindName {
    #[default]
    Serial,
    Simulated,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LightTable {
    channel: Option<u32>,
    #[serde(default)]
    kind: LightKindName,
    position_mm: Option<[f64; 3]>,
    position_sigma_mm: Option<f64>,
    direction: Option<[f64; 3]>,
}

#[derive(Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum LightKindName {
    #[default]
    Point,
    Directional,
}

impl Rig {
    /// Reads `rig.toml`.
    ///
    /// # Errors
    /// Where it cannot be read, or says something impossible; with file, line and remedy.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        rig_from_document(&Document::read(path)?)
    }

    /// Writes `rig.toml`, whole or not at all.
    ///
    /// # Errors
    /// Where it cannot be written, or would not be read back.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        if let CameraKind::Watched { folder } = &self.camera.kind
            && folder.to_str().is_none()
        {
            let what = format!("is {}, which is not UTF-8; rename the folder", folder.display());
            return Err(FileError::unwritable(path, &Problem::new("camera.folder", what)));
        }
        let file = file_from_rig(self);
        check_numbers(&file).map_err(|problem| FileError::unwritable(path, &problem))?;
        write_toml(path, &file)
    }

    /// The controller's output of a light.
    pub fn channel(&self, light: usize) -> u32 {
        channel_of(&self.lights, light)
    }
}

fn channel_of(lights: &[RigLight], light: usize) -> u32 {
    let own = lights.get(light).and_then(|light| light.channel);
    own.unwrap_or_else(|| u32::try_from(light).unwrap_or(u32::MAX))
}

fn rig_from_document(document: &Document) -> Result<Rig, FileError> {
    let file: RigFile = document.parse(SCHEMA)?;
    check_numbers(&file).map_err(|problem| document.problem(&problem))?;
    let lights = file
        .lights
        .iter()
        .enumerate()
        .map(|(k, table)| light_from_table(document, &format!("lights.{k}"), table))
        .collect::<Result<Vec<_>, _>>()?;
    check_channels(document, &lights)?;
    Ok(Rig {
        name: file.name.unwrap_or_else(|| "rig".to_owned()),
        camera: camera_from_table(document, file.camera)?,
        controller: file.controller.map(controller_from_table),
        lights,
    })
}

/// What readers and writers of the format ask of its numbers.
fn check_numbers(file: &RigFile) -> Result<(), Problem> {
    let (camera, count) = (&file.camera, file.lights.len());
    if !LIGHT_COUNT.contains(&count) {
        let (least, most) = (LIGHT_COUNT.start(), LIGHT_COUNT.end());
        let what = format!("are {count}; a rig has {least} to {most}, one [[lights]] each");
        return Err(Problem::new("lights", what));
    }
    check_side("camera.width_px", camera.width_px)?;
    check_side("camera.height_px", camera.height_px)?;
    FOCAL_LENGTH_MM.maybe_at("camera.focal_length_mm", camera.focal_length_mm)?;
    PIXEL_PITCH_UM.maybe_at("camera.pixel_pitch_um", camera.pixel_pitch_um)?;
    CAMERA_HEIGHT_MM.maybe_at("camera.height_mm", camera.height_mm)?;
    if let (Some(focal_mm), Some(pitch_um), Some(height_mm)) =
        (camera.focal_length_mm, camera.pixel_pitch_um, camera.height_mm)
    {
        check_view("camera.pixel_pitch_um", camera.width_px, pitch_um, focal_mm, height_mm)?;
    }
    file.lights.iter().enumerate().try_for_each(|(k, light)| check_light(k, light))
}

fn check_light(k: usize, light: &LightTable) -> Result<(), Problem> {
    if let Some(position) = light.position_mm {
        check_light_place(&format!("lights.{k}.position_mm"), position)?;
    }
    POSITION_SIGMA_MM
        .maybe_at(&format!("lights.{k}.position_sigma_mm"), light.position_sigma_mm)?;
    let direction = light.direction.as_ref().map_or(&[][..], |direction| direction);
    DIRECTION.all_at(&format!("lights.{k}.direction"), direction)
}

fn camera_from_table(document: &Document, table: CameraTable) -> Result<RigCamera, FileError> {
    let kind = match (table.kind, table.folder) {
        (CameraKindName::Watched, Some(folder)) => {
            CameraKind::Watched { folder: PathBuf::from(folder) }
        }
        (CameraKindName::Watched, None) => {
            return Err(document
                .invalid("camera.kind", "is \"watched\"; say which folder = \"...\" is watched"));
        }
        // Keys of another kind mean nothing here: they may wait for the day when the kind is changed back.
        (CameraKindName::Tethered, _) => CameraKind::Tethered { port: table.port },
        (CameraKindName::Simulated, _) => CameraKind::Simulated,
    };
    Ok(RigCamera {
        kind,
        model: table.model,
        width_px: table.width_px,
        height_px: table.height_px,
        focal_length_mm: table.focal_length_mm,
        pixel_pitch_um: table.pixel_pitch_um,
        height_mm: table.height_mm,
    })
}

fn controller_from_table(table: ControllerTable) -> Controller {
    match table.kind {
        ControllerKindName::Serial => Controller::Serial { port: table.port },
        // A port may wait for the day when the kind is changed back.
        ControllerKindName::Simulated => Controller::Simulated,
    }
}

fn light_from_table(
    document: &Document,
    key: &str,
    table: &LightTable,
) -> Result<RigLight, FileError> {
    let place = match (table.kind, table.position_mm, table.direction) {
        (LightKindName::Point, Some(position), None) => RigLightPlace::Point {
            position_mm: Point3::from(position),
            position_sigma_mm: table.position_sigma_mm.unwrap_or(RULER_SIGMA_MM),
        },
        (LightKindName::Directional, None, Some(direction))
            if table.position_sigma_mm.is_none() =>
        {
            RigLightPlace::Directional { direction: direction_above(document, key, direction)? }
        }
        (LightKindName::Point, ..) => {
            return Err(document.invalid(
                key,
                "needs position_mm, and direction only with kind = \"directional\"",
            ));
        }
        (LightKindName::Directional, ..) => {
            return Err(document
                .invalid(key, "is directional: it needs direction, and no position_mm or sigma"));
        }
    };
    Ok(RigLight { channel: table.channel, place })
}

fn direction_above(
    document: &Document,
    key: &str,
    direction: [f64; 3],
) -> Result<UnitVector3<f64>, FileError> {
    UnitVector3::try_new(Vector3::from(direction), 1e-9)
        .filter(|direction| direction.z > 0.0)
        .ok_or_else(|| {
            document.invalid(
                &format!("{key}.direction"),
                "points away from a light above the table; its z must be positive",
            )
        })
}

fn check_channels(document: &Document, lights: &[RigLight]) -> Result<(), FileError> {
    for light in 1..lights.len() {
        let channel = channel_of(lights, light);
        if let Some(other) = (0..light).find(|other| channel_of(lights, *other) == channel) {
            let what = format!(
                "is on channel {channel}, as light {other} is; every light has a channel of its own"
            );
            return Err(document.invalid(&format!("lights.{light}"), &what));
        }
    }
    Ok(())
}

fn file_from_rig(rig: &Rig) -> RigFile {
    RigFile {
        schema: SCHEMA,
        name: Some(rig.name.clone()),
        camera: table_from_camera(&rig.camera),
        controller: rig.controller.as_ref().map(|controller| match controller {
            Controller::Serial { port } => {
                ControllerTable { kind: ControllerKindName::Serial, port: port.clone() }
            }
            Controller::Simulated => {
                ControllerTable { kind: ControllerKindName::Simulated, port: None }
            }
        }),
        lights: rig.lights.iter().map(table_from_light).collect(),
    }
}

fn table_from_camera(camera: &RigCamera) -> CameraTable {
    let (kind, port, folder) = match &camera.kind {
        CameraKind::Tethered { port } => (CameraKindName::Tethered, port.clone(), None),
        CameraKind::Watched { folder } => {
            (CameraKindName::Watched, None, Some(folder.to_string_lossy().into_owned()))
        }
        CameraKind::Simulated => (CameraKindName::Simulated, None, None),
    };
    CameraTable {
        kind,
        port,
        folder,
        model: camera.model.clone(),
        width_px: camera.width_px,
        height_px: camera.height_px,
        focal_length_mm: camera.focal_length_mm,
        pixel_pitch_um: camera.pixel_pitch_um,
        height_mm: camera.height_mm,
    }
}

fn table_from_light(light: &RigLight) -> LightTable {
    let mut table = LightTable {
        channel: light.channel,
        kind: LightKindName::Point,
        position_mm: None,
        position_sigma_mm: None,
        direction: None,
    };
    match &light.place {
        RigLightPlace::Point { position_mm, position_sigma_mm } => {
            table.position_mm = Some((*position_mm).into());
            table.position_sigma_mm = Some(*position_sigma_mm);
        }
        RigLightPlace::Directional { direction } => {
            table.kind = LightKindName::Directional;
            table.direction = Some(direction.into_inner().into());
        }
    }
    table
}
