//! `scene.toml`: what stands before the simulated camera, so that a scan of a simulated rig photographs the same swatch, or the
//! calibration target that lies in its place.

use super::table::{TableTable, lying_from_table, table_from_lying};
use super::{Flaws, Instrument, Lying, Material, Options, SimulateError};
use crate::files::{Document, FileError, Setting, write_toml};
use crate::instrument::{Rig, RigLightPlace};
use crate::quantity::{DIRECTION, check_light_place};
use nalgebra::{Point3, UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use weavelight_calibration::description::Light;
use weavelight_sim::cloth::{Preset, Structure};
use weavelight_sim::render::Fabric;

/// The schema of `scene.toml` that this version reads and writes.
const SCHEMA: i64 = 1;

/// Its name, beside `rig.toml`.
pub const SCENE_FILE: &str = "scene.toml";

/// The swatch, and what is true of instrument and room that the technician does not know.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The rig's file, for messages.
    pub rig: PathBuf,
    /// Everything random follows from it.
    pub seed: u64,
    /// The fabric.
    pub material: Material,
    /// What is wrong with the instrument. The ruler's error is in the rig already.
    pub flaws: Flaws,
    /// Where the lights are in truth; empty: where the rig says.
    pub places: Vec<RigLightPlace>,
    /// What lies on the table.
    pub table: Lying,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    schema: i64,
    #[serde(default = "first_seed")]
    seed: u64,
    table: Option<TableTable>,
    #[serde(default)]
    material: MaterialTable,
    #[serde(default)]
    flaws: FlawsTable,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lights: Vec<PlaceTable>,
}

fn first_seed() -> u64 {
    1
}

/// Where `scene.toml` says what a setting is.
fn key_of(setting: Setting) -> String {
    let table = match setting.0 {
        "threads-per-cm" | "yarn-radius-mm" | "wrinkles-mm" | "thickness-mm" | "swatch-mm"
        | "samples" | "warp-color" | "weft-color" | "wear" => "material",
        _ => "flaws",
    };
    format!("{table}.{}", setting.0.replace('-', "_"))
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct MaterialTable {
    preset: Option<String>,
    structure: Option<String>,
    threads_per_cm: Option<f64>,
    yarn_radius_mm: Option<f64>,
    warp_color: Option<[f64; 3]>,
    weft_color: Option<[f64; 3]>,
    wear: Option<f64>,
    print: bool,
    wrinkles_mm: f64,
    thickness_mm: f64,
    swatch_mm: Option<[f64; 2]>,
    bounce: bool,
    samples: Option<usize>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct FlawsTable {
    vignetting: f64,
    psf_px: f64,
    ambient: f64,
    drift: f64,
    swapped: Option<[usize; 2]>,
    dead: Option<usize>,
    bend: f64,
    defects: f64,
    prnu: f64,
    read_noise_e: f64,
    noise: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceTable {
    position_mm: Option<[f64; 3]>,
    direction: Option<[f64; 3]>,
}

impl Scene {
    /// What `simulate` photographs with these options and this instrument.
    pub fn of(options: &Options, instrument: &Instrument) -> Self {
        let place = |light: &Light| match light {
            Light::Point(light) => RigLightPlace::Point {
                position_mm: light.position_mm,
                position_sigma_mm: EXACT_SIGMA_MM,
            },
            Light::Directional(light) => RigLightPlace::Directional { direction: light.direction },
        };
        Self {
            rig: options.rig.clone().unwrap_or_else(|| "rig.toml".into()),
            seed: options.seed,
            material: options.material.clone(),
            flaws: Flaws { ruler_error_mm: 0.0, exposure_factor: 1.0, ..options.flaws.clone() },
            places: instrument.stage.lights.iter().map(place).collect(),
            table: Lying::Swatch,
        }
    }

    /// The scene beside a rig's file; linen on a rig that is as its file says, where there is none.
    ///
    /// # Errors
    /// Where it cannot be read or says something impossible.
    pub fn beside(rig: &Path) -> Result<Self, SimulateError> {
        let path = rig.with_file_name(SCENE_FILE);
        if !path.exists() {
            let Options { seed, material, flaws, .. } = Options::default();
            let (rig, places) = (rig.to_owned(), Vec::new());
            return Ok(Self { rig, seed, material, flaws, places, table: Lying::Swatch });
        }
        let document = Document::read(&path)?;
        let scene = scene_from_document(&document, rig)?;
        match scene.options().check() {
            Err(SimulateError::Option { option, value, remedy }) => {
                let what = format!("is {value}; {remedy}");
                Err(document.invalid(&key_of(option), &what).into())
            }
            checked => checked.map(|()| scene),
        }
    }

    /// Writes it beside `rig.toml` in `folder`.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn save(&self, folder: &Path) -> Result<(), FileError> {
        write_toml(&folder.join(SCENE_FILE), &file_from_scene(self))
    }

    /// The instrument that `rig` is in truth.
    ///
    /// # Errors
    /// Where the rig does not say what a simulation needs, or has another number of lights than the scene.
    pub fn instrument(&self, rig: &Rig) -> Result<Instrument, SimulateError> {
        let (mut rig, count) = (rig.clone(), self.places.len());
        if count != 0 && count != rig.lights.len() {
            let what = format!(
                "the rig has {} lights, {SCENE_FILE} beside it {count}; remove {SCENE_FILE}, or simulate again",
                rig.lights.len()
            );
            return Err(SimulateError::Rig { path: self.rig.clone(), what });
        }
        for (light, place) in rig.lights.iter_mut().zip(&self.places) {
            light.place = place.clone();
        }
        Instrument::of_rig(rig, &self.options())
    }

    /// The fabric on the table.
    pub fn fabric(&self) -> Fabric {
        self.options().fabric()
    }

    /// What the simulation makes of it.
    pub(super) fn options(&self) -> Options {
        Options {
            rig: Some(self.rig.clone()),
            seed: self.seed,
            material: self.material.clone(),
            flaws: self.flaws.clone(),
            ..Options::default()
        }
    }
}

/// A truth has no error, but the type wants one.
const EXACT_SIGMA_MM: f64 = 1e-6;

fn scene_from_document(document: &Document, rig: &Path) -> Result<Scene, FileError> {
    let file: SceneFile = document.parse(SCHEMA)?;
    let places = file.lights.iter().enumerate().map(|(k, table)| place(document, k, table));
    Ok(Scene {
        rig: rig.to_owned(),
        seed: file.seed,
        material: material(document, &file.material)?,
        flaws: flaws(&file.flaws),
        places: places.collect::<Result<_, _>>()?,
        table: lying_from_table(document, file.table.as_ref())?,
    })
}

fn place(document: &Document, k: usize, table: &PlaceTable) -> Result<RigLightPlace, FileError> {
    let key = |name: &str| format!("lights.{k}.{name}");
    let position =
        table.position_mm.map_or(Ok(()), |at| check_light_place(&key("position_mm"), at));
    let entries = table.direction.as_ref().map_or(&[][..], |direction| direction);
    position
        .and_then(|()| DIRECTION.all_at(&key("direction"), entries))
        .map_err(|problem| document.problem(&problem))?;
    let direction = |d: [f64; 3]| UnitVector3::try_new(Vector3::from(d), 1e-9);
    match (table.position_mm, table.direction.and_then(direction)) {
        (Some(position), None) => Ok(RigLightPlace::Point {
            position_mm: Point3::from(position),
            position_sigma_mm: EXACT_SIGMA_MM,
        }),
        (None, Some(direction)) => Ok(RigLightPlace::Directional { direction }),
        _ => Err(document.invalid(
            &format!("lights.{k}"),
            "needs position_mm, or else a direction that is not 0",
        )),
    }
}

fn material(document: &Document, table: &MaterialTable) -> Result<Material, FileError> {
    let unknown = |key: &str, name: &str, known: Vec<&str>| {
        document.invalid(key, &format!("is \"{name}\"; choose one of {}", known.join(", ")))
    };
    let preset = table.preset.as_deref().unwrap_or("linen");
    let structure = table.structure.as_deref().map(|name| {
        let known = || Structure::ALL.map(Structure::name).to_vec();
        Structure::parse(name).ok_or_else(|| unknown("material.structure", name, known()))
    });
    Ok(Material {
        preset: Preset::parse(preset).ok_or_else(|| {
            unknown("material.preset", preset, Preset::ALL.map(Preset::name).to_vec())
        })?,
        structure: structure.transpose()?,
        threads_per_cm: table.threads_per_cm,
        yarn_radius_mm: table.yarn_radius_mm,
        warp_color: table.warp_color,
        weft_color: table.weft_color,
        wear: table.wear,
        print: table.print,
        wrinkles_mm: table.wrinkles_mm,
        thickness_mm: table.thickness_mm,
        extent_mm: table.swatch_mm,
        bounce: table.bounce,
        samples: table.samples,
    })
}

fn flaws(table: &FlawsTable) -> Flaws {
    Flaws {
        ruler_error_mm: 0.0,
        vignetting: table.vignetting,
        psf_px: table.psf_px,
        ambient: table.ambient,
        drift: table.drift,
        swapped: table.swapped,
        dead: table.dead,
        exposure_factor: 1.0,
        bend: table.bend,
        defects: table.defects,
        prnu: table.prnu,
        read_noise_e: table.read_noise_e,
        noise: table.noise,
    }
}

impl Default for FlawsTable {
    fn default() -> Self {
        // A file from before lenses blurred says nothing of it.
        table_from_flaws(&Flaws { psf_px: 0.0, ..Flaws::default() })
    }
}

fn table_from_flaws(flaws: &Flaws) -> FlawsTable {
    FlawsTable {
        vignetting: flaws.vignetting,
        psf_px: flaws.psf_px,
        ambient: flaws.ambient,
        drift: flaws.drift,
        swapped: flaws.swapped,
        dead: flaws.dead,
        bend: flaws.bend,
        defects: flaws.defects,
        prnu: flaws.prnu,
        read_noise_e: flaws.read_noise_e,
        noise: flaws.noise,
    }
}

fn file_from_scene(scene: &Scene) -> SceneFile {
    let material = &scene.material;
    let place = |place: &RigLightPlace| match place {
        RigLightPlace::Point { position_mm, .. } => {
            PlaceTable { position_mm: Some((*position_mm).into()), direction: None }
        }
        RigLightPlace::Directional { direction } => {
            PlaceTable { position_mm: None, direction: Some(direction.into_inner().into()) }
        }
    };
    SceneFile {
        schema: SCHEMA,
        seed: scene.seed,
        table: table_from_lying(scene.table),
        material: MaterialTable {
            preset: Some(material.preset.name().to_owned()),
            structure: material.structure.map(|structure| structure.name().to_owned()),
            threads_per_cm: material.threads_per_cm,
            yarn_radius_mm: material.yarn_radius_mm,
            warp_color: material.warp_color,
            weft_color: material.weft_color,
            wear: material.wear,
            print: material.print,
            wrinkles_mm: material.wrinkles_mm,
            thickness_mm: material.thickness_mm,
            swatch_mm: material.extent_mm,
            bounce: material.bounce,
            samples: material.samples,
        },
        flaws: table_from_flaws(&scene.flaws),
        lights: scene.places.iter().map(place).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let mut options = Options { seed: 7, size_px: Some([64, 48]), ..Options::default() };
        options.material.preset = Preset::Denim;
        options.material.structure = Some(Structure::Rib);
        options.material.warp_color = Some([0.5, 0.25, 0.125]);
        options.material.wear = Some(0.4);
        options.flaws.psf_px = 1.25;
        options.material.extent_mm = Some([90.0, 60.0]);
        options.flaws.swapped = Some([1, 2]);
        options.flaws.ruler_error_mm = 8.0;
        let instrument = Instrument::from_options(&options).unwrap();
        let mut scene = Scene::of(&options, &instrument);
        scene.table = Lying::Board { pose: 3 };
        scene.save(folder.path()).unwrap();
        let rig = folder.path().join("rig.toml");
        let read = Scene::beside(&rig).unwrap();
        assert_eq!(read, Scene { rig, ..scene });
        let again = read.instrument(&instrument.rig).unwrap();
        assert_eq!(format!("{:?}", again.stage), format!("{:?}", instrument.stage));
        assert_eq!(again.sensor, instrument.sensor);
    }

    #[test]
    fn what_is_wrong_is_told() {
        let check = |text: &str, expected: &str| {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join(SCENE_FILE), text).unwrap();
            let error = Scene::beside(&folder.path().join("rig.toml")).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        check("schema = 1\n[material]\npreset = \"felt\"\n", "choose one of linen");
        check("schema = 1\n[[lights]]\n", "needs position_mm");
        check(
            "schema = 1\n[flaws]\nprnu = 3.0\n",
            ":3: `flaws.prnu` is 3; give a number from 0 to 0.2",
        );
        check(
            "schema = 1\n[flaws]\npsf_px = -1.0\n",
            ":3: `flaws.psf_px` is -1; give a number from 0 to 4",
        );
        check(
            "schema = 1\n[material]\npreset = \"velvet\"\nwear = 0.4\n",
            ":4: `material.wear` is no use; this cloth has no yarns",
        );
        check("schema = 2\n", "schema 2");
        check("schema = 1\n[table]\nlies = \"cat\"\n", "swatch, board, grey or white");
        check("schema = 1\n[table]\nlies = \"board\"\npose = 99\n", "poses 0 to 15");
        check("schema = 1\n[table]\nlies = \"white\"\ntilt_deg = 80.0\n", "0 to 45");
    }
}
