use crate::description::{DirectionalLight, Light, PointLight};
use nalgebra::{Point3, UnitVector3, Vector3};

/// Parameters of one light in the fit: position x, y, z; two of the axis (or of the direction of a far light);
/// exponent; log intensity.
pub(super) const PER_LIGHT: usize = 7;

/// Emission exponents the fit may visit; a diffuse LED has 1, a lens of 10 degrees about 45.
const EXPONENTS: std::ops::RangeInclusive<f64> = 0.0..=80.0;

/// A light as the fit moves it.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Where the light is or comes from.
    pub place: Place,
    /// Natural logarithm of the intensity that the fit compares lights by.
    pub log_intensity: f64,
}

/// Where the light of an [`Emitter`] comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// An LED: ln E = mu ln cos(theta_e) + ln(n . l) - 2 ln(r / 1 m).
    Near {
        /// Rig frame, millimetres.
        position_mm: Point3<f64>,
        /// Along the beam, rig frame.
        axis: UnitVector3<f64>,
        /// mu.
        exponent: f64,
    },
    /// Far away: ln E = ln(n . l).
    Far {
        /// From the surface to the light, rig frame.
        direction: UnitVector3<f64>,
    },
}

/// ln E at one point of a sheet and how it answers to everything that may move.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogIrradiance {
    pub(super) value: f64,
    /// By the parameters of the light.
    pub(super) by_light: [f64; PER_LIGHT],
    /// By the point, rig frame, per millimetre.
    pub(super) by_point: Vector3<f64>,
    /// By the sheet's normal, rig frame.
    pub(super) by_normal: Vector3<f64>,
}

impl Emitter {
    /// As a description, with its intensity per channel.
    pub fn light(&self, intensity: [f64; 3]) -> Light {
        match &self.place {
            Place::Near { position_mm, axis, exponent } => {
                let (position_mm, axis, exponent) = (*position_mm, *axis, *exponent);
                Light::Point(PointLight { position_mm, axis, exponent, intensity })
            }
            Place::Far { direction } => {
                Light::Directional(DirectionalLight { direction: *direction, intensity })
            }
        }
    }

    /// ln E (of the emitter's own intensity) at `point` of a sheet with `normal`; `None` behind the LED and where the
    /// sheet faces away.
    pub fn log_irradiance(&self, point: &Point3<f64>, normal: &UnitVector3<f64>) -> Option<f64> {
        self.linearise(point, normal).map(|at| at.value)
    }

    pub(super) fn linearise(
        &self,
        point: &Point3<f64>,
        normal: &UnitVector3<f64>,
    ) -> Option<LogIrradiance> {
        match &self.place {
            Place::Near { position_mm, axis, exponent } => {
                let to_light = position_mm - point;
                near(self.log_intensity, &to_light, axis, *exponent, normal)
            }
            Place::Far { direction } => far(self.log_intensity, direction, normal),
        }
    }

    /// The emitter after a step of its parameters.
    pub(super) fn moved(&self, step: &[f64]) -> Self {
        let turned = |unit: &UnitVector3<f64>| {
            let [first, second] = tangents(unit);
            UnitVector3::new_normalize(unit.into_inner() + first * step[3] + second * step[4])
        };
        let place = match &self.place {
            Place::Near { position_mm, axis, exponent } => Place::Near {
                position_mm: position_mm + Vector3::new(step[0], step[1], step[2]),
                axis: turned(axis),
                exponent: (exponent + step[5]).clamp(*EXPONENTS.start(), *EXPONENTS.end()),
            },
            Place::Far { direction } => Place::Far { direction: turned(direction) },
        };
        Self { place, log_intensity: self.log_intensity + step[6] }
    }
}

fn near(
    log_intensity: f64,
    to_light: &Vector3<f64>,
    axis: &UnitVector3<f64>,
    exponent: f64,
    normal: &UnitVector3<f64>,
) -> Option<LogIrradiance> {
    let r = to_light.norm();
    let facing = normal.dot(to_light);
    let along = -axis.dot(to_light);
    if !(facing > 0.0 && along > 0.0 && r > 0.0) {
        return None;
    }
    let log_cos_emission = (along / r).ln();
    let inward = to_light / r.powi(2);
    let by_position = (-axis.into_inner() / along - inward) * exponent
        + normal.into_inner() / facing
        - inward * 3.0;
    let [first, second] = tangents(axis);
    let by_axis = -to_light * (exponent / along);
    Some(LogIrradiance {
        value: log_intensity + exponent * log_cos_emission + (facing / r).ln()
            - 2.0 * (r / 1000.0).ln(),
        by_light: [
            by_position.x,
            by_position.y,
            by_position.z,
            by_axis.dot(&first),
            by_axis.dot(&second),
            log_cos_emission,
            1.0,
        ],
        by_point: -by_position,
        by_normal: to_light / facing,
    })
}

fn far(
    log_intensity: f64,
    direction: &UnitVector3<f64>,
    normal: &UnitVector3<f64>,
) -> Option<LogIrradiance> {
    let facing = normal.dot(direction);
    if facing <= 0.0 {
        return None;
    }
    let [first, second] = tangents(direction);
    Some(LogIrradiance {
        value: log_intensity + facing.ln(),
        by_light: [
            0.0,
            0.0,
            0.0,
            normal.dot(&first) / facing,
            normal.dot(&second) / facing,
            0.0,
            1.0,
        ],
        by_point: Vector3::zeros(),
        by_normal: direction.into_inner() / facing,
    })
}

/// Two unit vectors that span the plane across `unit`.
pub(super) fn tangents(unit: &UnitVector3<f64>) -> [Vector3<f64>; 2] {
    let helper = if unit.z.abs() < 0.7 { Vector3::z() } else { Vector3::x() };
    let first = unit.cross(&helper).normalize();
    [first, unit.cross(&first)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn led() -> Emitter {
        Emitter {
            place: Place::Near {
                position_mm: Point3::new(310.0, -220.0, 400.0),
                axis: UnitVector3::new_normalize(Vector3::new(-0.5, 0.45, -0.8)),
                exponent: 1.3,
            },
            log_intensity: -0.7,
        }
    }

    fn sun() -> Emitter {
        let direction = UnitVector3::new_normalize(Vector3::new(0.3, -0.4, 0.7));
        Emitter { place: Place::Far { direction }, log_intensity: 0.2 }
    }

    fn check_derivatives(emitter: &Emitter) {
        let point = Point3::new(40.0, 65.0, 12.0);
        let normal = UnitVector3::new_normalize(Vector3::new(0.2, 0.1, 0.95));
        let at = emitter.linearise(&point, &normal).unwrap();
        let steps = [1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6];
        for (k, h) in steps.into_iter().enumerate() {
            let value = |sign: f64| {
                let mut step = [0.0; PER_LIGHT];
                step[k] = sign * h;
                emitter.moved(&step).log_irradiance(&point, &normal).unwrap()
            };
            let slope = (value(1.0) - value(-1.0)) / (2.0 * h);
            assert!(
                (slope - at.by_light[k]).abs() < 1e-7,
                "parameter {k}: {slope} against {}",
                at.by_light[k]
            );
        }
        for k in 0..3 {
            let by_point =
                |h: f64| emitter.log_irradiance(&(point + Vector3::ith(k, h)), &normal).unwrap();
            let slope = (by_point(1e-3) - by_point(-1e-3)) / 2e-3;
            assert!((slope - at.by_point[k]).abs() < 1e-8, "point {k}");
            // Only the part across the normal can move: compare along the tangents.
            let tangent = tangents(&normal)[k.min(1)];
            let tilted = |h: f64| UnitVector3::new_normalize(normal.into_inner() + tangent * h);
            let by_normal = |h: f64| emitter.log_irradiance(&point, &tilted(h)).unwrap();
            let slope = (by_normal(1e-6) - by_normal(-1e-6)) / 2e-6;
            assert!((slope - at.by_normal.dot(&tangent)).abs() < 1e-7, "normal {k}");
        }
    }

    #[test]
    fn derivatives_equal_finite_differences() {
        check_derivatives(&led());
        check_derivatives(&sun());
    }

    #[test]
    fn one_metre_on_the_axis_reads_the_intensity() {
        let axis = UnitVector3::new_normalize(Vector3::new(0.0, 0.0, -1.0));
        let place = Place::Near { position_mm: Point3::new(0.0, 0.0, 1000.0), axis, exponent: 3.0 };
        let value = Emitter { place, log_intensity: 0.4 }
            .log_irradiance(&Point3::origin(), &Vector3::z_axis());
        assert!((value.unwrap() - 0.4).abs() < 1e-15);
    }

    #[test]
    fn no_light_behind_the_led_or_behind_the_sheet() {
        let emitter = led();
        assert!(
            emitter
                .log_irradiance(&Point3::new(800.0, -700.0, 900.0), &Vector3::z_axis())
                .is_none()
        );
        assert!(emitter.log_irradiance(&Point3::origin(), &-Vector3::z_axis()).is_none());
    }
}
