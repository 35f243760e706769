use nalgebra::{Point3, UnitVector3};

/// One light of the rig, calibrated.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// An LED near the scene.
    Point(PointLight),
    /// A light far away: the same direction and strength everywhere.
    Directional(DirectionalLight),
}

/// An LED: E = I cos^mu(theta_e) (n . l) / r^2.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLight {
    /// Where it is, rig frame, millimetres.
    pub position_mm: Point3<f64>,
    /// Unit vector from the LED along its beam, rig frame.
    pub axis: UnitVector3<f64>,
    /// Emission falls as cos^exponent of the angle from the axis.
    pub exponent: f64,
    /// What a perfect white diffuser 1 m away on the axis, facing it, gives per second at ISO 100, black subtracted,
    /// as a fraction of the range from black to saturation; per camera channel R, G, B.
    pub intensity: [f64; 3],
}

/// A light without distance.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionalLight {
    /// Unit vector from the surface to the light, rig frame.
    pub direction: UnitVector3<f64>,
    /// As [`PointLight::intensity`], at the surface, facing the light.
    pub intensity: [f64; 3],
}

impl Light {
    /// Signal of a perfect white diffuser per second at ISO 100, fraction of full scale, R, G, B.
    pub fn intensity(&self) -> [f64; 3] {
        match self {
            Light::Point(light) => light.intensity,
            Light::Directional(light) => light.intensity,
        }
    }
}
