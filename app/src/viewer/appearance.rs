//! What of the maps is shown, and under which light.

use crate::viewer::geometry::Geometry;
use crate::viewer::pyramid::Pyramid;
use nalgebra::{Point3, UnitVector3, Vector3};
use std::sync::Arc;
use weavelight_calibration::description::{DirectionalLight, Light, PointLight};

/// What one side shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Normals as colours.
    Normal = 0,
    /// Albedo.
    Albedo = 1,
    /// Expected error of the normals.
    Error = 2,
    /// The cloth under [`Appearance::light`].
    #[default]
    Relit = 3,
    /// Angle from straight up.
    Slope = 4,
    /// The side's picture, linear RGB.
    Picture = 5,
    /// The side's picture, one signed value.
    Residual = 6,
    /// The angle between the normals and those of the side's picture.
    Angle = 7,
    /// The side's picture, which holds normals, as colours.
    OtherNormal = 8,
}

/// How two sides share the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compose {
    /// The first one alone.
    #[default]
    Single = 0,
    /// The first one left of the divider, the second one right of it.
    Split = 1,
    /// How much they differ.
    Difference = 2,
}

/// One side.
#[derive(Clone, Debug, Default)]
pub struct Side {
    /// What it shows.
    pub mode: Mode,
    /// A picture of the maps' size, where the mode asks for one.
    pub picture: Option<Arc<Pyramid>>,
}

/// All that is shown.
#[derive(Clone, Debug)]
pub struct Appearance {
    /// Both sides.
    pub sides: [Side; 2],
    /// How they share the screen.
    pub compose: Compose,
    /// Where the divider stands, 0 left to 1 right.
    pub divider: f32,
    /// The light.
    pub light: Light,
    /// Factor on everything that is a colour.
    pub gain: f32,
    /// Further factor on the sides' pictures.
    pub picture_gain: f32,
    /// Strength of a simple gloss, 0 for none.
    pub gloss: f32,
    /// How narrow it is, a Blinn-Phong exponent.
    pub shininess: f32,
    /// Upper ends of the scales.
    pub scales: Scales,
}

/// Upper ends of the scales; each begins at 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Expected error, degrees.
    pub error_deg: f32,
    /// Slope, degrees.
    pub slope_deg: f32,
    /// Angle between two solutions' normals, degrees.
    pub angle_deg: f32,
    /// Residual, units of albedo, both signs.
    pub residual: f32,
    /// Difference of two sides, share of white.
    pub difference: f32,
}

impl Default for Scales {
    fn default() -> Self {
        Self { error_deg: 5.0, slope_deg: 60.0, angle_deg: 5.0, residual: 0.05, difference: 0.2 }
    }
}

impl Default for Appearance {
    fn default() -> Self {
        Self {
            sides: Default::default(),
            compose: Compose::Single,
            divider: 0.5,
            light: lamp_at(Point3::new(-120.0, 120.0, 200.0)),
            gain: 1.0,
            picture_gain: 1.0,
            gloss: 0.0,
            shininess: 30.0,
            scales: Scales::default(),
        }
    }
}

impl Appearance {
    /// One side, one mode.
    pub fn of(mode: Mode) -> Self {
        Self { sides: [Side { mode, picture: None }, Side::default()], ..Self::default() }
    }
}

/// A small lamp that shines evenly downwards, as strong as it takes for white right under it to be white.
pub fn lamp_at(position_mm: Point3<f64>) -> Light {
    let height_m = position_mm.z / 1000.0;
    Light::Point(PointLight {
        position_mm,
        axis: UnitVector3::new_unchecked(-Vector3::z()),
        exponent: 0.0,
        intensity: [height_m * height_m; 3],
    })
}

/// A lamp in the hand: over a place of the plane (rig frame, millimetres), so high; white right under it is white.
pub fn lamp_over(geometry: &Geometry, at_mm: [f64; 2], height_mm: f64) -> Light {
    let plane = geometry.plane();
    let mut light = lamp_at(Point3::new(at_mm[0], at_mm[1], plane.point_mm.z + height_mm));
    if let Light::Point(light) = &mut light {
        light.intensity = [(height_mm / 1000.0).powi(2); 3];
        light.axis = UnitVector3::new_unchecked(-plane.normal.into_inner());
    }
    light
}

/// Where a lamp hangs that lights a picture from its upper left, and at which height: one that fits its size, millimetres.
pub fn first_lamp(geometry: &Geometry) -> ([f64; 2], f64) {
    let [width, height] = geometry.size().map(|length| length as f64);
    let at = geometry.on_plane([0.25 * width, 0.25 * height]);
    let across = geometry.on_plane([width, 0.0]) - geometry.on_plane([0.0, 0.0]);
    ([at.x, at.y], 0.35 * across.norm())
}

/// The sun: `azimuth_deg` counter-clockwise from the picture's right, `elevation_deg` over the table.
pub fn sun(azimuth_deg: f64, elevation_deg: f64) -> Light {
    let (azimuth, elevation) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let across = elevation.cos();
    let direction = Vector3::new(across * azimuth.cos(), across * azimuth.sin(), elevation.sin());
    Light::Directional(DirectionalLight {
        direction: UnitVector3::new_normalize(direction),
        intensity: [1.0; 3],
    })
}
