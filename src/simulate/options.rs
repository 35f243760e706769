use super::SimulateError;
use crate::files::Setting;
use std::path::PathBuf;
use weavelight_sim::cloth::{Preset, Print, Relief, Structure, Wrinkles, Yarn};
use weavelight_sim::render::{Bounce, Extent, Fabric};
use weavelight_sim::sensor::{Noise, Sensor};

/// What to simulate. The default is the reference rig with a piece of linen and every target.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The folder to write.
    pub out: PathBuf,
    /// The rig; the reference rig where absent. Its places are the truth.
    pub rig: Option<PathBuf>,
    /// Size of the frames; the rig's where absent. The field of view stays: the pitch of the photosites changes.
    pub size_px: Option<[usize; 2]>,
    /// Everything random follows from it.
    pub seed: u64,
    /// Which capture sessions; all where empty. Rig and calibration are always written.
    pub only: Vec<Part>,
    /// The fabric.
    pub material: Material,
    /// The calibration targets.
    pub targets: Targets,
    /// What is wrong with instrument and technician.
    pub flaws: Flaws,
}

/// A capture session that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Pictures of a chessboard.
    Board,
    /// The grey and colour chart.
    Grey,
    /// The white sheet on the table.
    WhiteFlat,
    /// The white sheet raised.
    WhiteRaised,
    /// The white sheet tilted, every way.
    WhiteTilt,
    /// The fabric, with the truth.
    Swatch,
}

/// The fabric.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// By name.
    pub preset: Preset,
    /// Another structure in place of the preset's.
    pub structure: Option<Structure>,
    /// Warp threads (or wales) per centimetre in place of the structure's usual count.
    pub threads_per_cm: Option<f64>,
    /// Half the width of a yarn in place of the structure's usual one, millimetres.
    pub yarn_radius_mm: Option<f64>,
    /// Diffuse reflectance of the warp's crowns (a knit's only yarn) in place of the preset's, linear sRGB.
    pub warp_color: Option<[f64; 3]>,
    /// Of the weft's crowns.
    pub weft_color: Option<[f64; 3]>,
    /// By which share yarns are darker between their crowns than on them, in place of the preset's: dye wears off crowns.
    pub wear: Option<f64>,
    /// A coloured print.
    pub print: bool,
    /// Height of wrinkles, millimetres.
    pub wrinkles_mm: f64,
    /// How thick the swatch is: its plane lies this far over the table, and the capture session says so, millimetres.
    pub thickness_mm: f64,
    /// Width and height of the swatch; it fills the picture where absent. Around it is the dark table.
    pub extent_mm: Option<[f64; 2]>,
    /// Light that one yarn throws onto the next (one bounce).
    pub bounce: bool,
    /// Samples along each side of a photosite; chosen by the size of the yarns where absent.
    pub samples: Option<usize>,
}

/// The calibration targets.
#[derive(Clone, Debug, PartialEq)]
pub struct Targets {
    /// Pictures of the chessboard.
    pub boards: usize,
    /// Side of its squares; as large as fits well, 25 mm at most, where absent.
    pub square_mm: Option<f64>,
    /// How thick the board is, millimetres; the capture session's plane says so.
    pub board_thickness_mm: f64,
    /// Height of the raised white sheet, millimetres.
    pub raised_mm: f64,
    /// How many ways the white sheet is tilted.
    pub tilts: usize,
    /// By how much, degrees.
    pub tilt_deg: f64,
    /// Whether `session.toml` states the plane of raised and tilted sheets. Where not, only the printed strip tells.
    pub state_planes: bool,
    /// Unevenness of the sheet, low frequency, peak to peak, relative.
    pub unevenness: f64,
    /// Low-frequency error of each light on the sheet, RMS, relative.
    pub kappa: f64,
    /// Specks of dust on the sheet per square decimetre.
    pub dust_per_dm2: f64,
    /// The light during whose exposures a hand shadows the sheet.
    pub hand: Option<usize>,
}

/// What is wrong with instrument and technician, beyond the reference sensor's noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Flaws {
    /// Error of the ruler: RMS per axis of what `rig.toml` says of the lights' places, millimetres.
    pub ruler_error_mm: f64,
    /// Share of the light that the lens loses in the farthest corner.
    pub vignetting: f64,
    /// Gaussian blur of lens and optical low-pass filter, standard deviation, photosites.
    pub psf_px: f64,
    /// Ambient light: what it adds on white, relative to a light of intensity 1, times 0.005.
    pub ambient: f64,
    /// How far every lamp has changed at the end of a capture session, relative.
    pub drift: f64,
    /// Two lights whose wires are swapped.
    pub swapped: Option<[usize; 2]>,
    /// A light that stays dark.
    pub dead: Option<usize>,
    /// Exposures relative to the advice (brightest light at half the range).
    pub exposure_factor: f64,
    /// Bend of the sensor's response: light = (1 - b) x + b x^2.
    pub bend: f64,
    /// Share of photosites that are stuck.
    pub defects: f64,
    /// Relative spread of the photosites' sensitivities.
    pub prnu: f64,
    /// Read noise, electrons.
    pub read_noise_e: f64,
    /// Whether there is noise at all.
    pub noise: bool,
}

impl Part {
    /// Every part, in the order in which a technician would take them.
    pub const ALL: [Part; 6] = [
        Part::Board,
        Part::Grey,
        Part::WhiteFlat,
        Part::WhiteRaised,
        Part::WhiteTilt,
        Part::Swatch,
    ];

    /// As the command line says it.
    pub fn name(self) -> &'static str {
        match self {
            Part::Board => "board",
            Part::Grey => "grey",
            Part::WhiteFlat => "white-flat",
            Part::WhiteRaised => "white-raised",
            Part::WhiteTilt => "white-tilt",
            Part::Swatch => "swatch",
        }
    }

    /// Reads [`Part::name`].
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|part| part.name() == name)
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            out: PathBuf::new(),
            rig: None,
            size_px: None,
            seed: 1,
            only: Vec::new(),
            material: Material::default(),
            targets: Targets::default(),
            flaws: Flaws::default(),
        }
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            preset: Preset::Linen,
            structure: None,
            threads_per_cm: None,
            yarn_radius_mm: None,
            warp_color: None,
            weft_color: None,
            wear: None,
            print: false,
            wrinkles_mm: 0.0,
            thickness_mm: 0.0,
            extent_mm: None,
            bounce: false,
            samples: None,
        }
    }
}

impl Default for Targets {
    fn default() -> Self {
        Self {
            boards: 16,
            square_mm: None,
            board_thickness_mm: 0.0,
            raised_mm: 100.0,
            tilts: 4,
            tilt_deg: 20.0,
            state_planes: true,
            unevenness: 0.0,
            kappa: 0.0,
            dust_per_dm2: 0.0,
            hand: None,
        }
    }
}

impl Default for Flaws {
    fn default() -> Self {
        let sensor = Sensor::default();
        Self {
            ruler_error_mm: 0.0,
            vignetting: 0.1,
            psf_px: 0.7,
            ambient: 1.0,
            drift: 0.0,
            swapped: None,
            dead: None,
            exposure_factor: 1.0,
            bend: 0.0,
            defects: 0.0,
            prnu: sensor.prnu,
            read_noise_e: sensor.read_noise_e,
            noise: true,
        }
    }
}

impl Flaws {
    /// The light that shines when `light` is switched on: another one where wires are swapped, `None` where it is dead.
    pub fn light_that_shines(&self, light: usize) -> Option<usize> {
        let wired = match self.swapped {
            Some([a, b]) if light == a => b,
            Some([a, b]) if light == b => a,
            _ => light,
        };
        Some(wired).filter(|light| self.dead != Some(*light))
    }
}

impl Options {
    /// Whether a part was asked for.
    pub fn wants(&self, part: Part) -> bool {
        self.only.is_empty() || self.only.contains(&part)
    }

    /// # Errors
    /// Names the first option out of its range.
    pub(super) fn check(&self) -> Result<(), SimulateError> {
        let (material, targets, flaws) = (&self.material, &self.targets, &self.flaws);
        let [width_mm, height_mm] = material.extent_mm.unwrap_or([100.0; 2]);
        let limits = [
            ("threads-per-cm", material.threads_per_cm.unwrap_or(10.0), 1.0, 200.0),
            ("yarn-radius-mm", material.yarn_radius_mm.unwrap_or(0.3), 0.01, 5.0),
            ("wear", material.wear.unwrap_or(0.0), 0.0, 1.0),
            ("wrinkles-mm", material.wrinkles_mm, 0.0, 10.0),
            ("thickness-mm", material.thickness_mm, 0.0, 100.0),
            ("swatch-mm", width_mm, 1.0, 1e4),
            ("swatch-mm", height_mm, 1.0, 1e4),
            ("samples", material.samples.unwrap_or(1) as f64, 1.0, 16.0),
            ("boards", targets.boards as f64, 1.0, 999.0),
            ("square-mm", targets.square_mm.unwrap_or(25.0), 0.5, 200.0),
            ("board-thickness-mm", targets.board_thickness_mm, 0.0, 50.0),
            ("raised-mm", targets.raised_mm, 0.0, 300.0),
            ("tilts", targets.tilts as f64, 0.0, 99.0),
            ("tilt-deg", targets.tilt_deg, 0.0, 45.0),
            ("unevenness", targets.unevenness, 0.0, 0.5),
            ("kappa", targets.kappa, 0.0, 0.5),
            ("dust", targets.dust_per_dm2, 0.0, 600.0),
            ("ruler-error-mm", flaws.ruler_error_mm, 0.0, 100.0),
            ("vignetting", flaws.vignetting, 0.0, 0.9),
            ("psf-px", flaws.psf_px, 0.0, 4.0),
            ("ambient", flaws.ambient, 0.0, 1000.0),
            ("drift", flaws.drift, -0.9, 9.0),
            ("exposure-factor", flaws.exposure_factor, 1e-3, 1e3),
            ("bend", flaws.bend, -0.3, 0.3),
            ("defects", flaws.defects, 0.0, 0.5),
            ("prnu", flaws.prnu, 0.0, 0.2),
            ("read-noise-e", flaws.read_noise_e, 0.0, 1000.0),
        ];
        limits.into_iter().try_for_each(|(name, value, least, most)| {
            in_range(Setting(name), value, least, most)
        })?;
        self.check_colors()
    }

    /// Colours are reflectances, of yarns that the cloth has.
    fn check_colors(&self) -> Result<(), SimulateError> {
        let material = &self.material;
        let colors = [("warp-color", material.warp_color), ("weft-color", material.weft_color)];
        for (name, color) in colors {
            color.iter().flatten().try_for_each(|c| in_range(Setting(name), *c, 0.0, 1.0))?;
        }
        let relief = self.fabric().cloth.relief;
        let refused = |name, remedy: &str| {
            Err(SimulateError::Option {
                option: Setting(name),
                value: "no use".to_owned(),
                remedy: remedy.to_owned(),
            })
        };
        match relief {
            Relief::Woven(_) => Ok(()),
            Relief::Knit(_) if material.weft_color.is_none() => Ok(()),
            Relief::Knit(_) => refused("weft-color", "a knit has one yarn: give the warp's colour"),
            _ if material.warp_color.is_some() => refused("warp-color", NO_YARNS),
            _ if material.weft_color.is_some() => refused("weft-color", NO_YARNS),
            _ if material.wear.is_some() => refused("wear", NO_YARNS),
            _ => Ok(()),
        }
    }

    /// The fabric on the table.
    pub fn fabric(&self) -> Fabric {
        let material = &self.material;
        let mut cloth = material.preset.cloth(self.seed);
        let own_threads = material.threads_per_cm.is_some() || material.yarn_radius_mm.is_some();
        if let Some(structure) =
            material.structure.or(own_threads.then(|| preset_structure(material.preset)))
        {
            cloth.relief =
                structure.relief(material.threads_per_cm, material.yarn_radius_mm, self.seed);
        }
        match &mut cloth.relief {
            Relief::Woven(woven) => {
                dye(&mut woven.warp, material.warp_color, material.wear);
                dye(&mut woven.weft, material.weft_color, material.wear);
            }
            Relief::Knit(knit) => dye(&mut knit.yarn, material.warp_color, material.wear),
            Relief::Flat(_) | Relief::Facets(_) | Relief::Pile(_) => {}
        }
        cloth.print = material.print.then(|| Print::new(self.seed));
        cloth.wrinkles =
            (material.wrinkles_mm > 0.0).then(|| Wrinkles::new(material.wrinkles_mm, self.seed));
        Fabric {
            cloth,
            thickness_mm: material.thickness_mm,
            extent: material.extent_mm.map(|[width_mm, height_mm]| Extent { width_mm, height_mm }),
            bounce: if material.bounce { Bounce::Once } else { Bounce::None },
            samples: material.samples,
        }
    }

    pub(super) fn sensor(&self) -> Sensor {
        let flaws = &self.flaws;
        Sensor {
            bend: flaws.bend,
            defects: flaws.defects,
            prnu: flaws.prnu,
            read_noise_e: flaws.read_noise_e,
            noise: if flaws.noise { Noise::On } else { Noise::Off },
            seed: self.seed,
            ..Sensor::default()
        }
    }
}

const NO_YARNS: &str = "this cloth has no yarns; choose a woven or knitted one";

/// Changes the dye of a yarn; where only its colour is given, its wear stays.
fn dye(yarn: &mut Yarn, color: Option<[f64; 3]>, wear: Option<f64>) {
    if let Some(color) = color {
        let kept: [f32; 3] = std::array::from_fn(|c| yarn.color_low[c] / yarn.color[c].max(1e-6));
        yarn.color = color.map(|c| c as f32);
        yarn.color_low = std::array::from_fn(|c| yarn.color[c] * kept[c]);
    }
    if let Some(wear) = wear {
        yarn.color_low = yarn.color.map(|c| c * (1.0 - wear as f32));
    }
}

/// The structure whose thread count and yarn radius a preset's can be replaced with.
fn preset_structure(preset: Preset) -> Structure {
    match preset {
        Preset::Linen => Structure::Plain,
        Preset::Denim => Structure::Twill,
        Preset::Satin => Structure::Satin,
        Preset::Velvet => Structure::Flat,
        Preset::Knit => Structure::Knit,
        Preset::Facets => Structure::Facets,
    }
}

fn in_range(option: Setting, value: f64, least: f64, most: f64) -> Result<(), SimulateError> {
    // Written so that NaN is out of any range.
    if value >= least && value <= most {
        return Ok(());
    }
    let remedy = format!("give a number from {least} to {most}");
    Err(SimulateError::Option { option, value: value.to_string(), remedy })
}
