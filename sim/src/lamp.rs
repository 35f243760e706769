//! How the lamps light a place.

use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::Light;

/// What one light sends to one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Unit vector from the place to the light, rig frame.
    pub towards: Vector3<f64>,
    /// Irradiance of a surface that faces the light, in units of the light's intensity.
    pub strength: f64,
}

/// Light at `place_mm`: inverse square of the distance in metres, emission by a power of the cosine from the LED's axis.
pub fn arrival(light: &Light, place_mm: &Point3<f64>) -> Arrival {
    match light {
        Light::Directional(light) => {
            Arrival { towards: light.direction.into_inner(), strength: 1.0 }
        }
        Light::Point(light) => {
            let offset = light.position_mm - place_mm;
            let distance_mm = offset.norm().max(1e-6);
            let towards = offset / distance_mm;
            let cos_emission = -towards.dot(&light.axis);
            let emission = if cos_emission > 0.0 { cos_emission.powf(light.exponent) } else { 0.0 };
            Arrival { towards, strength: emission * 1e6 / (distance_mm * distance_mm) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight_calibration::description::PointLight;

    #[test]
    fn irradiance_by_hand() {
        let light = Light::Point(PointLight {
            position_mm: Point3::new(0.0, 0.0, 500.0),
            axis: -Vector3::z_axis(),
            exponent: 2.0,
            intensity: [1.0; 3],
        });
        // Half a metre below: four times the irradiance at 1 m. Beside it at 45 degrees: twice the square of the distance,
        // half for cos^2.
        assert!((arrival(&light, &Point3::origin()).strength - 4.0).abs() < 1e-12);
        assert!((arrival(&light, &Point3::new(500.0, 0.0, 0.0)).strength - 1.0).abs() < 1e-12);
        assert_eq!(arrival(&light, &Point3::new(0.0, 0.0, 600.0)).strength, 0.0);
    }
}
