//! The light over the cloth: a lamp in the hand, a sun, or one of the rig's own.

use crate::jobs::look::opened::Opened;
use crate::viewer::appearance::{first_lamp, lamp_over, sun};
use crate::viewer::geometry::Geometry;
use nalgebra::Point3;
use weavelight_calibration::description::{DirectionalLight, Light, PointLight};
use weavelight_calibration::irradiance::light_vector_in_rig;

/// Which light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// A lamp that the mouse carries.
    #[default]
    Lamp,
    /// A far light.
    Sun,
    /// One of the rig's, as calibrated.
    Rig,
}

/// The light.
#[derive(Clone, Debug)]
pub(super) struct Lamp {
    pub(super) kind: Kind,
    /// Where the lamp hangs over the plane, rig frame, millimetres.
    pub(super) at_mm: [f64; 2],
    /// How high over the plane.
    pub(super) height_mm: f64,
    /// Of the sun, counter-clockwise from the picture's right, degrees.
    pub(super) azimuth_deg: f64,
    /// Of the sun, over the table, degrees.
    pub(super) elevation_deg: f64,
    /// Whether the sun goes round.
    pub(super) moves: bool,
    /// Which of the rig's.
    pub(super) light: usize,
    pub(super) stops: f32,
    /// Gloss, 0 for none.
    pub(super) gloss: f32,
}

/// A sun goes round in this time, seconds.
const ROUND_S: f64 = 8.0;

impl Default for Lamp {
    fn default() -> Self {
        Self {
            kind: Kind::Lamp,
            at_mm: [-80.0, 60.0],
            height_mm: 120.0,
            azimuth_deg: 135.0,
            elevation_deg: 30.0,
            moves: false,
            light: 0,
            stops: 0.0,
            gloss: 0.0,
        }
    }
}

impl Lamp {
    /// Hangs the lamp where it lights a picture from its upper left, at a height that fits it.
    pub(super) fn hang_over(&mut self, geometry: &Geometry) {
        (self.at_mm, self.height_mm) = first_lamp(geometry);
    }

    /// Where the lamp is.
    pub(super) fn position_mm(&self, geometry: &Geometry) -> Point3<f64> {
        Point3::new(self.at_mm[0], self.at_mm[1], geometry.plane().point_mm.z + self.height_mm)
    }

    /// The light that the shader works with. White under it is about white: the lamp right below, the sun where it falls
    /// straight, the rig's in the middle of the picture.
    pub(super) fn light(&self, opened: &Opened) -> Light {
        let geometry = &opened.maps.geometry;
        match (self.kind, opened.lights.get(self.light)) {
            (Kind::Rig, Some(of_rig)) => {
                let strength = 1.0 / in_the_middle(&of_rig.light, geometry);
                match &of_rig.light {
                    Light::Point(light) => {
                        Light::Point(PointLight { intensity: [strength; 3], ..light.clone() })
                    }
                    Light::Directional(light) => Light::Directional(DirectionalLight {
                        intensity: [strength; 3],
                        ..light.clone()
                    }),
                }
            }
            (Kind::Sun, _) => sun(self.azimuth_deg, self.elevation_deg),
            _ => lamp_over(geometry, self.at_mm, self.height_mm),
        }
    }

    /// What brings a frame of the rig's light to the same brightness as its relit cloth.
    pub(super) fn frame_gain(&self, opened: &Opened) -> f32 {
        let of_rig = opened.lights.get(self.light);
        of_rig.map_or(1.0, |l| 1.0 / in_the_middle(&l.light, &opened.maps.geometry) as f32)
    }

    /// Factor of the brightness.
    pub(super) fn gain(&self) -> f32 {
        self.stops.exp2()
    }

    /// Lets the sun go on for some seconds.
    pub(super) fn advance(&mut self, seconds: f64) {
        if self.kind == Kind::Sun && self.moves {
            self.azimuth_deg = (self.azimuth_deg - 360.0 * seconds / ROUND_S).rem_euclid(360.0);
        }
    }
}

/// Length of a light's vector in the middle of the picture.
fn in_the_middle(light: &Light, geometry: &Geometry) -> f64 {
    let middle = geometry.size().map(|length| (length as f64 - 1.0) / 2.0);
    light_vector_in_rig(light, &geometry.on_plane(middle)).norm().max(1e-9)
}
