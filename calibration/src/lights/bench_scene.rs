//! A simulated bench for tests: its forward model is written out afresh here, with effects that the fit does not know.

use super::{Cell, Emitter, Place, PoseSigma, Prior, Sample, Sheet};
use crate::description::{Camera, Plane};
use nalgebra::{Point3, Rotation3, UnitVector3, Vector3};

pub(crate) struct Bench {
    pub(crate) noise: f64,
    /// RMS of a light-dependent low-frequency error.
    pub(crate) kappa: f64,
    pub(crate) ruler_error_mm: f64,
    pub(crate) ruler_sigma_mm: f64,
    pub(crate) grid: [usize; 2],
    pub(crate) unevenness: Unevenness,
    pub(crate) seed: u64,
}

/// 2 % peak to peak, fixed to the sheet.
#[derive(Clone, Copy)]
pub(crate) enum Unevenness {
    /// Two long crossed waves.
    Crossed,
    /// One wave: length, direction (radians), phase (radians).
    Wave { length_mm: f64, direction: f64, phase: f64 },
}

impl Default for Bench {
    fn default() -> Self {
        let ruler_error_mm = 17.0;
        Self {
            noise: 5e-4,
            kappa: 0.0,
            ruler_error_mm,
            ruler_sigma_mm: 10.0,
            grid: [30, 20],
            unevenness: Unevenness::Crossed,
            seed: 1,
        }
    }
}

pub(crate) struct Led {
    pub(crate) position: Point3<f64>,
    pub(crate) axis: UnitVector3<f64>,
    pub(crate) exponent: f64,
    pub(crate) intensity: [f64; 3],
}

/// SplitMix64: enough randomness for tests, the same everywhere.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal()).normalize()
    }
}

/// Flat, z + 100 mm, four tilts of 20 degrees.
pub(crate) fn poses() -> Vec<Plane> {
    let tilted = |azimuth_deg: f64| {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let (st, ct) = 20f64.to_radians().sin_cos();
        let normal = UnitVector3::new_normalize(Vector3::new(st * cos, st * sin, ct));
        Plane { point_mm: Point3::new(0.0, 0.0, 50.0), normal }
    };
    let raised = Plane { point_mm: Point3::new(0.0, 0.0, 100.0), normal: Vector3::z_axis() };
    let tilts = [45.0, 135.0, 225.0, 315.0].map(tilted);
    [Plane::table(), raised].into_iter().chain(tilts).collect()
}

impl Bench {
    /// Six LEDs at 45 degrees, four at 62, with spread in axis, exponent and colour.
    pub(crate) fn leds(&self) -> Vec<Led> {
        let mut dice = Dice(self.seed.wrapping_mul(77) + 5);
        let mut led = |azimuth_deg: f64, elevation_deg: f64| {
            let (sa, ca) = azimuth_deg.to_radians().sin_cos();
            let (se, ce) = elevation_deg.to_radians().sin_cos();
            let position = Point3::new(ce * ca, ce * sa, se) * 560.0;
            let axis =
                UnitVector3::new_normalize(-position.coords.normalize() + dice.direction() * 0.06);
            let strength = 0.5 * (1.0 + 0.1 * dice.normal());
            let intensity = [0.55, 1.0, 0.7].map(|c| c * strength * (1.0 + 0.02 * dice.normal()));
            Led { position, axis, exponent: 1.2 + 0.1 * dice.normal(), intensity }
        };
        let low = (0..6).map(|k| (f64::from(k) * 60.0, 45.0));
        let high = (0..4).map(|k| (45.0 + f64::from(k) * 90.0, 62.0));
        low.chain(high).map(|(azimuth, elevation)| led(azimuth, elevation)).collect()
    }

    pub(crate) fn priors(&self, leds: &[Led]) -> Vec<Prior> {
        let mut dice = Dice(self.seed.wrapping_mul(31) + 9);
        leds.iter()
            .map(|led| {
                let position_mm = led.position + dice.direction() * self.ruler_error_mm;
                let axis = UnitVector3::new_normalize(-position_mm.coords);
                Prior {
                    emitter: Emitter {
                        place: Place::Near { position_mm, axis, exponent: 1.0 },
                        log_intensity: 0.0,
                    },
                    position_sigma_mm: self.ruler_sigma_mm,
                    angle_sigma_rad: 0.26,
                    exponent_sigma: 2.0,
                }
            })
            .collect()
    }

    pub(crate) fn sheets(&self, leds: &[Led], poses: &[Plane]) -> Vec<Sheet> {
        poses.iter().enumerate().map(|(s, plane)| self.sheet(s, leds, plane)).collect()
    }

    fn sheet(&self, s: usize, leds: &[Led], plane: &Plane) -> Sheet {
        let mut dice = Dice(self.seed.wrapping_mul(1009) + s as u64);
        let ripples: Vec<[f64; 4]> = leds
            .iter()
            .map(|_| std::array::from_fn(|_| dice.uniform() * std::f64::consts::TAU))
            .collect();
        let [columns, rows] = self.grid;
        let (mut cells, mut samples) = (Vec::new(), Vec::new());
        for row in 0..rows {
            for column in 0..columns {
                let cell = cell_at([column, row], self.grid, plane);
                let gain =
                    vignetting(&cell.pixel) * 0.99 * self.unevenness.at(&cell.point_mm, plane);
                for (led, ripple) in leds.iter().zip(&ripples) {
                    let error = self.kappa * wave(&cell.pixel, ripple) + self.noise * dice.normal();
                    let exact =
                        irradiance(led, &cell.point_mm, &plane.normal) * gain * (1.0 + error);
                    samples.push(Sample {
                        signal: led.intensity.map(|i| i * exact),
                        relative_sigma: [self.noise; 3],
                    });
                }
                cells.push(cell);
            }
        }
        let pose_sigma = PoseSigma::default();
        let name = format!("sheet {s}");
        Sheet {
            name,
            plane: plane.clone(),
            pose_sigma,
            reflectance: 0.99,
            grid: self.grid,
            cells,
            samples,
        }
    }
}

/// What a Lambert sheet sends back, by the textbook.
pub(crate) fn irradiance(led: &Led, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
    let ray = point - led.position;
    let metres = ray.norm() / 1000.0;
    let out = ray.normalize();
    out.dot(&led.axis).powf(led.exponent) * (-out.dot(normal)).max(0.0) / (metres * metres)
}

const FRAME: [f64; 2] = [4928.0, 3264.0];
const FOCAL_PX: f64 = 7322.0;
const HEIGHT_MM: f64 = 610.0;

/// The camera that sees the cells.
pub(crate) fn camera() -> Camera {
    Camera {
        width_px: FRAME[0] as usize,
        height_px: FRAME[1] as usize,
        fx: FOCAL_PX,
        fy: FOCAL_PX,
        cx: (FRAME[0] - 1.0) / 2.0,
        cy: (FRAME[1] - 1.0) / 2.0,
        distortion: [0.0; 5],
        camera_from_rig: Camera::looking_down(HEIGHT_MM),
    }
}

fn cell_at(place: [usize; 2], grid: [usize; 2], plane: &Plane) -> Cell {
    let pixel: [f64; 2] =
        std::array::from_fn(|k| (place[k] as f64 + 0.5) / grid[k] as f64 * FRAME[k] - 0.5);
    let x = (pixel[0] - (FRAME[0] - 1.0) / 2.0) / FOCAL_PX;
    let y = (pixel[1] - (FRAME[1] - 1.0) / 2.0) / FOCAL_PX;
    let camera = Point3::new(0.0, 0.0, HEIGHT_MM);
    let view = UnitVector3::new_normalize(Vector3::new(x, -y, -1.0));
    let far = plane.normal.dot(&(plane.point_mm - camera)) / plane.normal.dot(&view);
    Cell { place, pixel, point_mm: camera + view.into_inner() * far, view }
}

/// 20 % less in the corners.
pub(crate) fn vignetting(pixel: &[f64; 2]) -> f64 {
    let x = (pixel[0] / FRAME[0] - 0.5) * 2.0;
    let y = (pixel[1] / FRAME[1] - 0.5) * 2.0;
    1.0 - 0.2 * (x * x + y * y) / 2.0
}

impl Unevenness {
    fn at(self, point: &Point3<f64>, plane: &Plane) -> f64 {
        // As if the sheet had been tilted out of the table about its stated point.
        let tilt = Rotation3::rotation_between(&Vector3::z(), &plane.normal).unwrap();
        let at = tilt.inverse() * (point - plane.point_mm);
        match self {
            Self::Crossed => {
                1.0 + 0.005 * (at.x / 70.0 + 0.4).sin() + 0.005 * (at.y / 55.0 - 0.8).cos()
            }
            Self::Wave { length_mm, direction, phase } => {
                let along = at.x * direction.cos() + at.y * direction.sin();
                1.0 + 0.01 * (std::f64::consts::TAU * along / length_mm + phase).sin()
            }
        }
    }
}

/// Unit RMS, about one wave across the frame.
fn wave(pixel: &[f64; 2], phases: &[f64; 4]) -> f64 {
    let x = pixel[0] / FRAME[0] * std::f64::consts::TAU;
    let y = pixel[1] / FRAME[1] * std::f64::consts::TAU;
    (x + phases[0]).sin() * (0.7 * y + phases[1]).sin()
        + (0.6 * x + phases[2]).cos() * (y + phases[3]).cos()
}
