use super::{Options, Scene, SimulateError};
use crate::files::{Provenance, Setting, sha256_of_file};
use crate::instrument::{
    CalibratedLight, CameraKind, Color, Controller, MeasuredCamera, Noise, Optics, Rig, RigCamera,
    RigLight, RigLightPlace, write_camera, write_color, write_lights,
};
use crate::quantity::{self, PIXEL_PITCH_UM, Problem};
use nalgebra::{Point3, UnitVector3, Vector3};
use std::path::{Path, PathBuf};
use weavelight_calibration::description::{Cfa, DirectionalLight, Image, Light};
use weavelight_sim::color::{camera_from_xyz, camera_to_linear_srgb};
use weavelight_sim::random::Key;
use weavelight_sim::render::Stage;
use weavelight_sim::rig::{
    NominalCamera, REFERENCE_LIGHTS_MM, REFERENCE_SIZE_PX, leds_at, spread_intensity,
};
use weavelight_sim::sensor::Sensor;
use weavelight_sim::view::View;

/// The simulated instrument: what is true of it, and what its technician knows.
#[derive(Clone, Debug)]
pub struct Instrument {
    /// What the technician knows: `rig.toml`.
    pub rig: Rig,
    /// Camera, lights and ambient light as they are.
    pub stage: Stage,
    /// The sensor as it is.
    pub sensor: Sensor,
}

/// Ambient light per second at ISO 100 on white, as a fraction of the sensor's range, per channel: a darkened room's.
const AMBIENT: [f64; 3] = [0.0035, 0.005, 0.0027];
/// Smallest frame that shows anything.
const LEAST_PX: usize = 16;
/// Largest side of a frame.
const MOST_PX: usize = 32_768;
/// Nodes of the vignetting's gain map along its longer side: its square law bends by 1e-5 at most between them.
const GAIN_MAP_NODES: usize = 96;

impl Instrument {
    /// The instrument that the options ask for: the reference rig's or a rig file's, at the size wanted.
    ///
    /// # Errors
    /// Where the rig cannot be read or does not say enough.
    pub fn from_options(options: &Options) -> Result<Self, SimulateError> {
        let mut rig = match &options.rig {
            Some(path) => Rig::load(path)?,
            None => reference_rig(),
        };
        if let Some([width, height]) = options.size_px {
            resize(&mut rig.camera, width, height);
        }
        Self::of_rig(rig, options)
    }

    /// The instrument that `rig` is in truth; of the options count the seed, what is wrong, and names for messages.
    pub(super) fn of_rig(rig: Rig, options: &Options) -> Result<Self, SimulateError> {
        check_size(options, &rig.camera)?;
        let nominal = nominal_camera(&rig.camera);
        check_view(options, &nominal)?;
        let stage = Stage {
            view: View {
                camera: nominal.true_camera(options.seed),
                vignetting: options.flaws.vignetting,
                psf_px: options.flaws.psf_px,
            },
            lights: true_lights(&rig, options.seed),
            ambient: AMBIENT.map(|a| a * options.flaws.ambient),
            cfa: Cfa::RGGB,
        };
        check_lights(options, &stage)?;
        let rig = as_the_technician_knows_it(rig, nominal, options);
        Ok(Self { rig, stage, sensor: options.sensor() })
    }

    /// Width and height of a frame.
    pub fn size_px(&self) -> [usize; 2] {
        [self.stage.view.camera.width_px, self.stage.view.camera.height_px]
    }

    /// The camera's mean answer to white under the lights: R, G, B, green = 1.
    pub fn neutral(&self) -> [f64; 3] {
        let sum = |channel: usize| -> f64 {
            self.stage.lights.iter().map(|light| light.intensity()[channel]).sum()
        };
        [sum(0) / sum(1), 1.0, sum(2) / sum(1)]
    }

    /// What the frames' files say of camera and lens.
    pub fn optics(&self) -> Optics {
        let camera = &self.rig.camera;
        let model = camera.model.as_deref().unwrap_or("Weavelight Simulator");
        let focal_length_mm = camera.focal_length_mm;
        Optics {
            camera_model: Some(model.to_owned()),
            lens: focal_length_mm.map(|focal| format!("Simulated {focal} mm")),
            focal_length_mm,
        }
    }

    /// DNG's colour matrix.
    pub fn camera_from_xyz(&self) -> [[f64; 3]; 3] {
        let matrix = camera_from_xyz(self.neutral());
        std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
    }

    /// Writes `scene.toml` and `rig.toml`: with the second, the folder is a rig's.
    pub(super) fn write_rig(&self, options: &Options, folder: &Path) -> Result<(), SimulateError> {
        Scene::of(options, self).save(folder)?;
        Ok(self.rig.save(&folder.join("rig.toml"))?)
    }

    /// Writes `rig.toml`, `scene.toml` and the true calibration.
    pub(super) fn write(&self, options: &Options, folder: &Path) -> Result<(), SimulateError> {
        let rig_path = folder.join("rig.toml");
        self.write_rig(options, folder)?;
        let input =
            crate::files::Input { name: "rig.toml".to_owned(), sha256: sha256_of_file(&rig_path)? };
        let mut quality = toml::Table::new();
        quality.insert("simulated_truth".to_owned(), true.into());
        quality.insert("seed".to_owned(), i64::try_from(options.seed).unwrap_or(i64::MAX).into());
        let provenance = Provenance::of_this_program(None, vec![input], quality);
        let calibration = folder.join("calibration");
        let measured = MeasuredCamera {
            rms_reprojection_px: Some(0.0),
            optics: self.optics(),
            ..MeasuredCamera::new(self.stage.view.camera.clone())
        };
        write_camera(&calibration, &measured, &provenance)?;
        write_color(&calibration, &self.color(), &provenance)?;
        write_lights(&calibration, &self.calibrated_lights(), &provenance)?;
        Ok(())
    }

    fn color(&self) -> Color {
        let sensor = &self.sensor;
        let noise = Noise {
            electrons_per_dn: sensor.electrons_per_dn(),
            read_noise_e: sensor.read_noise_e,
            kappa: 0.0,
        };
        let balance = |light: &Light| {
            let [r, g, b] = light.intensity();
            [g / r, 1.0, g / b]
        };
        Color {
            black_level: Some(sensor.black.map(f64::from)),
            saturation_level: Some(f64::from(sensor.saturation)),
            clip_level: None,
            response: if sensor.bend == 0.0 {
                vec![0.0, 1.0]
            } else {
                vec![0.0, 1.0 - sensor.bend, sensor.bend]
            },
            camera_to_linear_srgb: Some(camera_to_linear_srgb()),
            white_balance: self.stage.lights.iter().map(balance).collect(),
            noise: Some(noise),
        }
    }

    fn calibrated_lights(&self) -> Vec<CalibratedLight> {
        let gain_map = (self.stage.view.vignetting > 0.0).then(|| vignetting_map(&self.stage.view));
        let exact = |light: &Light| {
            let near = matches!(light, Light::Point(_));
            CalibratedLight {
                gain_map: gain_map.clone(),
                position_sigma_mm: near.then_some(EXACT_SIGMA_MM),
                position_claimed: near.then_some(true),
                ..CalibratedLight::new(light.clone())
            }
        };
        self.stage.lights.iter().map(exact).collect()
    }
}

/// A truth has no error, but the format wants a positive one.
const EXACT_SIGMA_MM: f64 = 1e-6;

/// The lens's transmission as a gain map: each texel stands at the middle of its share of the frame.
fn vignetting_map(view: &View) -> Image<[f32; 3]> {
    let (width, height) = (view.camera.width_px, view.camera.height_px);
    let longer = width.max(height);
    let nodes = |length: usize| (GAIN_MAP_NODES * length).div_ceil(longer).max(2);
    let (columns, rows) = (nodes(width), nodes(height));
    let at = |k: usize, nodes: usize, length: usize| {
        (k as f64 + 0.5) * length as f64 / nodes as f64 - 0.5
    };
    let texel = |k: usize| {
        let (u, v) = (at(k % columns, columns, width), at(k / columns, rows, height));
        [view.transmission(u, v) as f32; 3]
    };
    Image { width: columns, height: rows, data: (0..columns * rows).map(texel).collect() }
}

/// The ten-light rig of the reference design.
fn reference_rig() -> Rig {
    let nominal = NominalCamera::reference(REFERENCE_SIZE_PX[0], REFERENCE_SIZE_PX[1]);
    let lights = REFERENCE_LIGHTS_MM.iter().enumerate().map(|(k, &position)| RigLight {
        channel: u32::try_from(k).ok(),
        place: RigLightPlace::Point {
            position_mm: Point3::from(position),
            position_sigma_mm: 10.0,
        },
    });
    Rig {
        name: "simulated rig".to_owned(),
        camera: RigCamera {
            kind: CameraKind::Simulated,
            model: Some("Weavelight Simulator".to_owned()),
            width_px: nominal.size_px[0],
            height_px: nominal.size_px[1],
            focal_length_mm: Some(nominal.focal_length_mm),
            pixel_pitch_um: Some(nominal.pitch_um),
            height_mm: Some(nominal.height_mm),
        },
        controller: Some(Controller::Simulated),
        lights: lights.collect(),
    }
}

/// The same field of view on another number of photosites.
fn resize(camera: &mut RigCamera, width: usize, height: usize) {
    let scale = camera.width_px as f64 / width.max(1) as f64;
    camera.pixel_pitch_um = camera.pixel_pitch_um.map(|pitch| pitch * scale);
    (camera.width_px, camera.height_px) = (width, height);
}

fn check_size(options: &Options, camera: &RigCamera) -> Result<(), SimulateError> {
    let sides = [camera.width_px, camera.height_px];
    if sides.iter().all(|side| (LEAST_PX..=MOST_PX).contains(side)) {
        return Ok(());
    }
    let value = format!("{}x{}", camera.width_px, camera.height_px);
    match &options.rig {
        Some(path) if options.size_px.is_none() => {
            let what =
                format!("the camera is {value}; sides of 16 to 32768 pixels can be simulated");
            Err(SimulateError::Rig { path: path.clone(), what })
        }
        _ => Err(SimulateError::Option {
            option: Setting("size"),
            value,
            remedy: format!(
                "sides of 16 to 32768 pixels can be simulated, as in {} 1232x816",
                Setting("size")
            ),
        }),
    }
}

/// The figures of camera and table must fit each other: those that the rig does not give are the reference camera's.
fn check_view(options: &Options, camera: &NominalCamera) -> Result<(), SimulateError> {
    let NominalCamera { size_px: [width_px, _], focal_length_mm, pitch_um, height_mm } = *camera;
    let key = "camera.pixel_pitch_um";
    PIXEL_PITCH_UM
        .at(key, pitch_um)
        .and_then(|()| quantity::check_view(key, width_px, pitch_um, focal_length_mm, height_mm))
        .map_err(|Problem { key, what }| SimulateError::Rig {
            path: options.rig.clone().unwrap_or_else(|| PathBuf::from("rig.toml")),
            what: format!("`{key}` {what}"),
        })
}

/// What the rig says of its camera; where it says nothing, the reference camera's field of view.
fn nominal_camera(camera: &RigCamera) -> NominalCamera {
    let reference = NominalCamera::reference(camera.width_px, camera.height_px);
    NominalCamera {
        size_px: [camera.width_px, camera.height_px],
        focal_length_mm: camera.focal_length_mm.unwrap_or(reference.focal_length_mm),
        pitch_um: camera.pixel_pitch_um.unwrap_or(reference.pitch_um),
        height_mm: camera.height_mm.unwrap_or(reference.height_mm),
    }
}

fn true_lights(rig: &Rig, seed: u64) -> Vec<Light> {
    let places: Vec<Point3<f64>> = rig
        .lights
        .iter()
        .map(|light| match light.place {
            RigLightPlace::Point { position_mm, .. } => position_mm,
            RigLightPlace::Directional { .. } => Point3::origin(),
        })
        .collect();
    let leds = leds_at(&places, seed);
    rig.lights
        .iter()
        .zip(leds)
        .enumerate()
        .map(|(k, (light, led))| match light.place {
            RigLightPlace::Point { .. } => Light::Point(led),
            RigLightPlace::Directional { direction } => {
                let key = Key::new(seed).with(0xd17).with(k as u64);
                // A far light as strong on the table as the reference rig's LEDs are.
                let intensity = spread_intensity(key).map(|i| 2.6 * i);
                Light::Directional(DirectionalLight { direction, intensity })
            }
        })
        .collect()
}

/// Lights named by an option must exist, and each light must stand over the table.
fn check_lights(options: &Options, stage: &Stage) -> Result<(), SimulateError> {
    let count = stage.lights.len();
    let named = [
        (Setting("hand"), options.targets.hand.map(|k| vec![k])),
        (Setting("dead"), options.flaws.dead.map(|k| vec![k])),
        (Setting("swapped"), options.flaws.swapped.map(|pair| pair.to_vec())),
    ];
    for (option, lights) in named {
        if let Some(light) = lights.into_iter().flatten().find(|&light| light >= count) {
            let remedy = "name one of the rig's lights; they count from 0".to_owned();
            return Err(SimulateError::Option { option, value: light.to_string(), remedy });
        }
    }
    let path = options.rig.clone().unwrap_or_else(|| PathBuf::from("rig.toml"));
    let below = |light: &Light| match light {
        Light::Point(light) => light.position_mm.z <= 0.0,
        Light::Directional(light) => light.direction.z <= 0.0,
    };
    match stage.lights.iter().position(below) {
        Some(k) => {
            let what = format!("light {k} is not above the table; z must be positive");
            Err(SimulateError::Rig { path, what })
        }
        None => Ok(()),
    }
}

/// `rig.toml` as it is written: complete figures of the camera, and lights as far as the ruler told.
fn as_the_technician_knows_it(mut rig: Rig, nominal: NominalCamera, options: &Options) -> Rig {
    rig.camera.kind = CameraKind::Simulated;
    rig.controller = Some(Controller::Simulated);
    rig.camera.focal_length_mm = Some(nominal.focal_length_mm);
    rig.camera.pixel_pitch_um = Some(nominal.pitch_um);
    rig.camera.height_mm = Some(nominal.height_mm);
    let error_mm = options.flaws.ruler_error_mm;
    if error_mm > 0.0 {
        for (k, light) in rig.lights.iter_mut().enumerate() {
            misplace(&mut light.place, error_mm, Key::new(options.seed).with(0x7e1).with(k as u64));
        }
    }
    rig
}

fn misplace(place: &mut RigLightPlace, error_mm: f64, key: Key) {
    let error = Vector3::from_fn(|axis, _| error_mm * f64::from(key.with(axis as u64).gaussian()));
    match place {
        RigLightPlace::Point { position_mm, position_sigma_mm } => {
            *position_mm += error;
            *position_sigma_mm = error_mm;
        }
        RigLightPlace::Directional { direction } => {
            // The angle that the error makes at the reference rig's distance.
            *direction = UnitVector3::new_normalize(direction.into_inner() + error / 560.0);
        }
    }
}
