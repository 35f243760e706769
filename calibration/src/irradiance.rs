//! What a light does at a point: the vector whose scalar product with the surface normal is the irradiance, in units of
//! the light's own intensity.

use crate::description::{Light, PointLight};
use nalgebra::{Point3, Vector3};

/// The distance at which intensities are stated, millimetres.
const REFERENCE_MM: f64 = 1000.0;

/// Light vector l of a light at a point of the rig frame: a white diffuser there with unit normal n gives
/// `intensity * l . n` (where positive).
///
/// Unit direction from the point to the light, times cos^mu of the angle from the beam's axis, times (1 m / r)^2. Zero
/// behind the LED and at its very place; a directional light is the same everywhere.
pub fn light_vector_in_rig(light: &Light, point_in_rig_mm: &Point3<f64>) -> Vector3<f64> {
    match light {
        Light::Point(light) => point_light_vector(light, point_in_rig_mm),
        Light::Directional(light) => light.direction.into_inner(),
    }
}

fn point_light_vector(light: &PointLight, point_in_rig_mm: &Point3<f64>) -> Vector3<f64> {
    let to_light_mm = light.position_mm - point_in_rig_mm;
    let distance_mm = to_light_mm.norm();
    let cos_emission = -light.axis.dot(&to_light_mm) / distance_mm;
    // Not a number at the LED's own place.
    if cos_emission.is_nan() || cos_emission <= 0.0 {
        return Vector3::zeros();
    }
    let strength = cos_emission.powf(light.exponent) * (REFERENCE_MM / distance_mm).powi(2);
    to_light_mm * (strength / distance_mm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::DirectionalLight;
    use nalgebra::UnitVector3;

    fn led(position: [f64; 3], axis: [f64; 3], exponent: f64) -> Light {
        Light::Point(PointLight {
            position_mm: position.into(),
            axis: UnitVector3::new_normalize(axis.into()),
            exponent,
            intensity: [1.0; 3],
        })
    }

    fn check(light: &Light, point: [f64; 3], expected: [f64; 3]) {
        let found = light_vector_in_rig(light, &point.into());
        assert!(
            (found - Vector3::from(expected)).norm() < 1e-12,
            "{light:?} at {point:?}: {found:?}"
        );
    }

    #[test]
    fn a_metre_away_on_the_axis_is_the_unit_of_intensity() {
        check(&led([0.0, 0.0, 1000.0], [0.0, 0.0, -1.0], 1.3), [0.0; 3], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn twice_the_distance_is_a_quarter() {
        check(&led([0.0, 0.0, 2000.0], [0.0, 0.0, -1.0], 1.3), [0.0; 3], [0.0, 0.0, 0.25]);
    }

    #[test]
    fn emission_falls_with_the_cosine_from_the_axis() {
        // 60 degrees off the axis, exponent 3: an eighth; sqrt(3) m and 1 m away sideways: distance 2 m, a quarter.
        let side = 3.0_f64.sqrt() * 1000.0;
        let strength = 0.125 * 0.25;
        check(
            &led([0.0, 0.0, 1000.0], [0.0, 0.0, -1.0], 3.0),
            [side, 0.0, 0.0],
            [-strength * 3.0_f64.sqrt() / 2.0, 0.0, strength / 2.0],
        );
    }

    #[test]
    fn there_is_no_light_behind_the_led_nor_inside_it() {
        let light = led([0.0, 0.0, 500.0], [0.0, 0.0, -1.0], 1.0);
        check(&light, [0.0, 0.0, 600.0], [0.0; 3]);
        check(&light, [0.0, 0.0, 500.0], [0.0; 3]);
        // Exactly sideways, also for an LED that shines evenly into its half space.
        check(&led([0.0, 0.0, 500.0], [0.0, 0.0, -1.0], 0.0), [100.0, 0.0, 500.0], [0.0; 3]);
    }

    #[test]
    fn a_far_light_is_the_same_everywhere() {
        let direction = UnitVector3::new_normalize(Vector3::new(1.0, 2.0, 2.0));
        let light = Light::Directional(DirectionalLight { direction, intensity: [2.0; 3] });
        check(&light, [123.0, -45.0, 6.0], [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]);
    }
}
