//! Small scenes with everything in them that a real one has, generated from a seed.

use super::super::{Origin, Scene};
use crate::instrument::{CalibratedLight, Color, Noise};
use crate::linear::{Exposure, PhotographedLight};
use crate::raw::{Frame, Layout, Metadata, Samples};
use nalgebra::{Point3, Rotation3, UnitVector3, Vector3};
use weavelight_calibration::description::{
    Camera, Cfa, DirectionalLight, Image, Light, Plane, PointLight,
};
use weavelight_calibration::gain::gain_at;
use weavelight_calibration::irradiance::light_vector_in_rig;
use weavelight_calibration::projection::Projector;

/// SplitMix64: the same numbers everywhere.
pub(super) struct Dice(pub(super) u64);

impl Dice {
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// What a generated scene has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Recipe {
    pub(super) seed: u64,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) lights: usize,
    pub(super) layout: Layout,
    pub(super) gain_maps: bool,
    pub(super) ambient: bool,
    pub(super) bent_response: bool,
    /// Exposures per light, each four times the one before.
    pub(super) exposures: usize,
    pub(super) directional: bool,
    /// Millimetres of table in a pixel.
    pub(super) mm_per_px: f64,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            seed: 1,
            width: 70,
            height: 50,
            lights: 10,
            layout: Layout::Mosaic(Cfa::RGGB),
            gain_maps: false,
            ambient: false,
            bent_response: false,
            exposures: 1,
            directional: false,
            mm_per_px: 3.0,
        }
    }
}

const BLACK: f64 = 600.0;
const SATURATION: f64 = 65000.0;
/// raw fraction x -> linear: c1 x + c2 x^2.
const BEND: [f64; 3] = [0.0, 0.97, 0.03];

/// Smooth, up to 40 degrees of tilt.
pub(super) fn normal_at(x: usize, y: usize) -> Vector3<f64> {
    normal_at_place(x as f64, y as f64)
}

/// The same between pixels.
pub(super) fn normal_at_place(x: f64, y: f64) -> Vector3<f64> {
    Vector3::new(0.8 * (0.13 * x + 0.05 * y).sin(), 0.7 * (0.11 * y - 0.02 * x).cos(), 1.0)
        .normalize()
}

/// Of a coloured weave.
pub(super) fn albedo_at(x: usize, y: usize) -> [f64; 3] {
    if (x / 9 + y / 7).is_multiple_of(2) { [0.6, 0.3, 0.15] } else { [0.2, 0.5, 0.7] }
}

/// The scene.
pub(super) fn scene(recipe: Recipe) -> Scene {
    let mut dice = Dice(recipe.seed);
    let camera = camera(&mut dice, &recipe);
    let tilt = Vector3::new(dice.between(-0.2, 0.2), dice.between(-0.2, 0.2), 1.0);
    let plane =
        Plane { point_mm: Point3::new(0.0, 0.0, 8.0), normal: UnitVector3::new_normalize(tilt) };
    let lights: Vec<CalibratedLight> =
        (0..recipe.lights).map(|i| light(&mut dice, &recipe, i)).collect();
    let color = Color {
        black_level: Some([BLACK; 4]),
        saturation_level: Some(SATURATION),
        response: if recipe.bent_response { BEND.to_vec() } else { vec![0.0, 1.0] },
        noise: Some(Noise {
            electrons_per_dn: 40_000.0 / 64_400.0,
            read_noise_e: 4.0,
            kappa: 0.002,
        }),
        ..Color::default()
    };
    let shutter = |exposure: usize| 0.5 * 4.0_f64.powi(exposure as i32);
    let photographed = |index: usize, calibrated: &CalibratedLight| PhotographedLight {
        index,
        calibrated: calibrated.clone(),
        exposures: (0..recipe.exposures)
            .map(|e| {
                expose(
                    &recipe,
                    &camera,
                    &plane,
                    Some(calibrated),
                    shutter(e),
                    &format!("light-{index:02}-{e}"),
                )
            })
            .collect(),
    };
    Scene {
        width: recipe.width,
        height: recipe.height,
        layout: recipe.layout,
        lights: lights.iter().enumerate().map(|(i, l)| photographed(i, l)).collect(),
        ambient: recipe
            .ambient
            .then(|| expose(&recipe, &camera, &plane, None, 2.0, "ambient"))
            .into_iter()
            .collect(),
        camera: Some(camera),
        plane,
        color,
        defects: Default::default(),
        mask: None,
        origin: Origin {
            session: "made/session.toml".into(),
            calibration: "made/calibration".into(),
        },
    }
}

fn camera(dice: &mut Dice, recipe: &Recipe) -> Camera {
    let mut pose = Camera::looking_down(610.0);
    pose.rotation =
        Rotation3::from_euler_angles(dice.between(-0.05, 0.05), dice.between(-0.05, 0.05), 0.1)
            * pose.rotation;
    let f = 610.0 / recipe.mm_per_px;
    Camera {
        width_px: recipe.width,
        height_px: recipe.height,
        fx: f,
        fy: f * 1.001,
        cx: (recipe.width - 1) as f64 / 2.0 + 1.3,
        cy: (recipe.height - 1) as f64 / 2.0 - 0.8,
        distortion: [dice.between(-0.15, 0.15), dice.between(-0.1, 0.1), 0.002, -0.001, 0.02],
        camera_from_rig: pose,
    }
}

fn light(dice: &mut Dice, recipe: &Recipe, index: usize) -> CalibratedLight {
    let azimuth = 2.4 * index as f64 + dice.between(-0.2, 0.2);
    let elevation = dice.between(0.6, 1.2);
    let direction = Vector3::new(
        elevation.cos() * azimuth.cos(),
        elevation.cos() * azimuth.sin(),
        elevation.sin(),
    );
    let position = direction * dice.between(480.0, 650.0);
    let intensity = [0.35, 0.55, 0.4].map(|i| i * dice.between(0.8, 1.2));
    let light = if recipe.directional {
        let intensity = intensity.map(|i| 1.8 * i);
        Light::Directional(DirectionalLight {
            direction: UnitVector3::new_normalize(direction),
            intensity,
        })
    } else {
        let aim = Vector3::new(dice.between(-30.0, 30.0), dice.between(-30.0, 30.0), 0.0);
        Light::Point(PointLight {
            position_mm: position.into(),
            axis: UnitVector3::new_normalize(aim - position),
            exponent: dice.between(0.8, 2.0),
            intensity,
        })
    };
    let gain_map = recipe.gain_maps.then(|| {
        let texel = |_| [0, 1, 2].map(|_| dice.between(0.8, 1.1) as f32);
        Image { width: 6, height: 5, data: (0..30).map(texel).collect() }
    });
    CalibratedLight {
        light,
        gain_map,
        position_sigma_mm: None,
        position_claimed: None,
        warnings: vec![],
    }
}

fn expose(
    recipe: &Recipe,
    camera: &Camera,
    plane: &Plane,
    lit_by: Option<&CalibratedLight>,
    exposure_s: f64,
    name: &str,
) -> Exposure {
    let projector = Projector::new(camera);
    let channels = recipe.layout.channels();
    let mut samples = vec![];
    for y in 0..recipe.height {
        for x in 0..recipe.width {
            let point = projector
                .on_plane([x as f64, y as f64], plane)
                .expect("every pixel sees the plane");
            for k in 0..channels {
                let channel = match recipe.layout {
                    Layout::Mosaic(cfa) => cfa.channel(x, y) as usize,
                    Layout::Grey => 1,
                    Layout::Rgb => k,
                };
                let mut rate = if recipe.ambient { [0.02, 0.015, 0.01][channel] } else { 0.0 };
                if let Some(light) = lit_by {
                    let shading =
                        light_vector_in_rig(&light.light, &point).dot(&normal_at(x, y)).max(0.0);
                    let gain = light.gain_map.as_ref().map_or([1.0; 3], |map| {
                        gain_at(map, (recipe.width, recipe.height), [x as f64, y as f64])
                    });
                    let intensity = match recipe.layout {
                        Layout::Grey => grey(light.light.intensity()),
                        _ => light.light.intensity()[channel],
                    };
                    rate += albedo_at(x, y)[channel] * shading * intensity * gain[channel];
                }
                samples.push(raw_number(recipe, rate * exposure_s));
            }
        }
    }
    let frame = Frame {
        width: recipe.width,
        height: recipe.height,
        layout: recipe.layout,
        samples: Samples::U16(samples),
        black: [0.0; 4],
        saturation: [65535.0; 4],
        metadata: Metadata::default(),
    };
    Exposure { frame, exposure_s, iso: 100.0, path: format!("made/{name}.png").into() }
}

fn grey(intensity: [f64; 3]) -> f64 {
    (0.2989 * intensity[0] + 0.587 * intensity[1] + 0.114 * intensity[2]) / 0.9999
}

fn raw_number(recipe: &Recipe, linear: f64) -> u16 {
    // The inverse of c1 x + c2 x^2.
    let [_, c1, c2] = BEND;
    let fraction = match recipe.bent_response {
        true => (-c1 + (c1 * c1 + 4.0 * c2 * linear).sqrt()) / (2.0 * c2),
        false => linear,
    };
    (BLACK + fraction * (SATURATION - BLACK)).round().min(SATURATION) as u16
}
