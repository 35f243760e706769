//! Capture sessions with their true normals: simulated, or from folders.

use super::BenchError;
use crate::compare::read_map;
use crate::files::FileError;
use crate::simulate::{self, Flaws, Instrument, Material, Part, SimulateError};
use crate::solution::NORMAL_EXR;
use crate::solve::Scene;
use std::path::{Path, PathBuf};
use weavelight_calibration::description::Image;
use weavelight_sim::cloth::{Preset, Structure};

/// A scene and its truth, in memory.
pub(crate) struct Set {
    pub(crate) name: String,
    pub(crate) about: String,
    pub(crate) scene: Scene,
    /// Unit normals, rig frame; zero where unknown and outside the mask.
    pub(crate) truth: Image<[f32; 3]>,
    pub(crate) warnings: Vec<String>,
}

/// A picture set from outside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetFolders {
    /// What to call it.
    pub name: String,
    /// The capture session.
    pub session: PathBuf,
    /// Its calibration.
    pub calibration: PathBuf,
    /// True normals: EXR with R, G, B = nx, ny, nz, rig frame, on the frames' grid; 0 where unknown.
    pub truth: PathBuf,
}

/// A simulated fabric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fabric {
    /// Matt grey cloth without yarns, wrinkled: neither shadows nor highlights.
    Smooth,
    /// Linen, whose yarns throw light onto each other: what no residual shows.
    Bounce,
    /// A cloth of the simulator.
    Preset(Preset),
}

/// Everything random in a simulated set follows from it.
const SEED: u64 = 1;
/// Height of the smooth cloth's wrinkles.
const WRINKLES_MM: f64 = 1.0;

impl Fabric {
    /// Every fabric.
    pub const ALL: [Fabric; 8] = [
        Fabric::Smooth,
        Fabric::Preset(Preset::Facets),
        Fabric::Preset(Preset::Linen),
        Fabric::Preset(Preset::Denim),
        Fabric::Preset(Preset::Knit),
        Fabric::Preset(Preset::Satin),
        Fabric::Preset(Preset::Velvet),
        Fabric::Bounce,
    ];
    /// One of each kind: nothing to drop, shadows, highlights.
    pub const FEW: [Fabric; 3] =
        [Fabric::Smooth, Fabric::Preset(Preset::Linen), Fabric::Preset(Preset::Satin)];

    /// As tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Smooth => "smooth",
            Self::Bounce => "linen-bounce",
            Self::Preset(preset) => preset.name(),
        }
    }

    fn about(self) -> &'static str {
        match self {
            Self::Smooth => "matt, wrinkled, no yarns: neither shadows nor highlights",
            Self::Bounce => "linen, light thrown from yarn to yarn",
            Self::Preset(Preset::Linen) => "plain weave: shadows",
            Self::Preset(Preset::Denim) => "twill, two colours: shadows",
            Self::Preset(Preset::Satin) => "glossy: highlights",
            Self::Preset(Preset::Velvet) => "pile with sheen: no Lambertian surface",
            Self::Preset(Preset::Knit) => "deep loops: shadows",
            Self::Preset(Preset::Facets) => "planes of known tilt: lights behind the surface",
        }
    }

    fn material(self) -> Material {
        let plain = Material::default();
        match self {
            Self::Smooth => Material {
                preset: Preset::Facets,
                structure: Some(Structure::Flat),
                wrinkles_mm: WRINKLES_MM,
                ..plain
            },
            Self::Bounce => Material { bounce: true, ..plain },
            Self::Preset(preset) => Material { preset, ..plain },
        }
    }

    /// Photographs the fabric with the middle of the reference sensor, at its full resolution.
    pub(crate) fn simulate(self, size_px: [usize; 2]) -> Result<Set, BenchError> {
        let folder = tempfile::tempdir()
            .map_err(|source| FileError::write(&std::env::temp_dir(), source))?;
        let rig = folder.path().join("cut.toml");
        write_rig(&rig, size_px)?;
        let out = folder.path().join("rig");
        let options = simulate::Options {
            out: out.clone(),
            rig: Some(rig),
            seed: SEED,
            only: vec![Part::Swatch],
            material: self.material(),
            // Sharp shadows of single yarns are the hardest case for a method.
            flaws: Flaws { psf_px: 0.0, ..Flaws::default() },
            ..simulate::Options::default()
        };
        simulate::run(&options, &|_, _| {})?;
        let folders = SetFolders {
            name: self.name().to_owned(),
            session: out.join("swatch"),
            calibration: out.join("calibration"),
            truth: out.join("truth").join(NORMAL_EXR),
        };
        Ok(Set { about: format!("simulated; {}", self.about()), ..folders.load()? })
    }
}

/// The reference rig with a sensor that has only the middle photosites.
fn write_rig(path: &Path, [width, height]: [usize; 2]) -> Result<(), SimulateError> {
    let mut rig = Instrument::from_options(&simulate::Options::default())?.rig;
    (rig.camera.width_px, rig.camera.height_px) = (width, height);
    Ok(rig.save(path)?)
}

impl SetFolders {
    pub(crate) fn load(&self) -> Result<Set, BenchError> {
        let (scene, warnings) = Scene::load(&self.session, &self.calibration)?;
        let mut truth = read_map(&self.truth)?;
        let frames = [scene.width, scene.height];
        if [truth.width, truth.height] != frames {
            return Err(BenchError::Size {
                path: self.truth.clone(),
                truth: [truth.width, truth.height],
                frames,
            });
        }
        if let Some(mask) = &scene.mask {
            let outside = truth.data.iter_mut().zip(&mask.data).filter(|(_, inside)| !**inside);
            outside.for_each(|(normal, _)| *normal = [0.0; 3]);
        }
        let about = self.session.display().to_string();
        Ok(Set { name: self.name.clone(), about, scene, truth, warnings })
    }
}
