//! Lights, camera and sheets, written afresh: angles by arctangent, distances by hand, nothing of the crate's own model.

use crate::errors::{Kind, SlowErrors};
use nalgebra::{Point3, UnitVector3, Vector3};
use weavelight_calibration::description::Plane;
use weavelight_calibration::lights::{Cell, Emitter, Place, PoseSigma, Prior, Sample, Sheet};

/// SplitMix64.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub(crate) fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn scatter(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Layout {
    /// Six at 45 degrees, four at 62: the reference rig.
    Reference,
    /// Two rings of five, at 32 and 55 degrees, farther away.
    Rings,
    /// Ten on an arc of 220 degrees, at three heights.
    Arc,
    /// Twelve wherever there was room.
    Irregular12,
    /// Sixteen of them.
    Irregular16,
}

pub(crate) const LAYOUTS: [Layout; 5] =
    [Layout::Reference, Layout::Rings, Layout::Arc, Layout::Irregular12, Layout::Irregular16];

pub(crate) struct Led {
    pub(crate) position: Point3<f64>,
    pub(crate) axis: UnitVector3<f64>,
    pub(crate) exponent: f64,
    strength: [f64; 3],
}

/// Which sheets were photographed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Sheets {
    Flat,
    FlatAndTilt,
    FlatRaisedTwoTilts,
    Six,
}

impl Sheets {
    pub(crate) fn planes(self) -> Vec<Plane> {
        let tilted = |azimuth_deg: f64| {
            let (sin, cos) = azimuth_deg.to_radians().sin_cos();
            let (st, ct) = 20f64.to_radians().sin_cos();
            let normal = UnitVector3::new_normalize(Vector3::new(st * cos, st * sin, ct));
            Plane { point_mm: Point3::new(0.0, 0.0, 50.0), normal }
        };
        let flat = Plane { point_mm: Point3::origin(), normal: Vector3::z_axis() };
        let raised = Plane { point_mm: Point3::new(0.0, 0.0, 100.0), normal: Vector3::z_axis() };
        match self {
            Self::Flat => vec![flat],
            Self::FlatAndTilt => vec![flat, tilted(30.0)],
            Self::FlatRaisedTwoTilts => vec![flat, raised, tilted(20.0), tilted(120.0)],
            Self::Six => {
                let tilts = [45.0, 135.0, 225.0, 315.0].map(tilted);
                [flat, raised].into_iter().chain(tilts).collect()
            }
        }
    }
}

pub(crate) struct Rig {
    pub(crate) leds: Vec<Led>,
    pub(crate) kind: Kind,
    /// RMS, relative.
    pub(crate) slow: f64,
    pub(crate) grid: [usize; 2],
    seed: u64,
}

const FRAME: [f64; 2] = [4000.0, 3000.0];
const FOCAL_PX: f64 = 6400.0;
/// Not over the middle, and not quite upright over it.
const CAMERA: [f64; 3] = [12.0, -9.0, 640.0];
const NOISE: f64 = 4e-4;

impl Rig {
    pub(crate) fn new(layout: Layout, kind: Kind, slow: f64, seed: u64) -> Self {
        let mut dice = Dice(seed.wrapping_mul(0x2545_f491) + layout as u64 * 977 + 3);
        let ring = |count: u32, from_deg: f64, elevation_deg: f64, distance: f64| {
            (0..count).map(move |k| {
                [from_deg + 360.0 * f64::from(k) / f64::from(count), elevation_deg, distance]
            })
        };
        let places: Vec<[f64; 3]> = match layout {
            Layout::Reference => {
                ring(6, 0.0, 45.0, 560.0).chain(ring(4, 45.0, 62.0, 560.0)).collect()
            }
            Layout::Rings => ring(5, 10.0, 32.0, 620.0).chain(ring(5, 46.0, 55.0, 640.0)).collect(),
            Layout::Arc => (0..10)
                .map(|k| {
                    let height = [35.0, 50.0, 65.0][k % 3];
                    [-110.0 + 220.0 / 9.0 * k as f64, height, 540.0]
                })
                .collect(),
            Layout::Irregular12 | Layout::Irregular16 => {
                let count = if layout == Layout::Irregular12 { 12 } else { 16 };
                (0..count)
                    .map(|k| {
                        let azimuth = 360.0 / f64::from(count) * (f64::from(k) + dice.uniform());
                        [azimuth, dice.between(30.0, 68.0), dice.between(460.0, 680.0)]
                    })
                    .collect()
            }
        };
        // Half of the benches have LEDs of one kind, half a mixture.
        let usual = dice.between(0.8, 3.0);
        let one_kind = seed.is_multiple_of(2);
        let led = |[azimuth, elevation, distance]: [f64; 3]| {
            let (sa, ca) = f64::to_radians(azimuth).sin_cos();
            let (se, ce) = f64::to_radians(elevation).sin_cos();
            let position = Point3::new(ce * ca, ce * sa, se) * distance;
            // Aimed by hand: 30 mm beside the middle, and the chip sits 3 degrees askew in its lens.
            let aim = Vector3::new(30.0 * dice.normal(), 30.0 * dice.normal(), 0.0);
            let axis = (aim - position.coords).normalize() + dice.scatter() * 0.05;
            let exponent = if one_kind {
                usual * (1.0 + 0.03 * dice.normal())
            } else {
                dice.between(0.8, 3.0)
            };
            let strength = dice.between(0.6, 1.6);
            let strength = [0.5, 1.0, 0.65].map(|c| c * strength * dice.between(0.97, 1.03));
            Led { position, axis: UnitVector3::new_normalize(axis), exponent, strength }
        };
        let leds = places.into_iter().map(led).collect();
        Self { leds, kind, slow, grid: [20, 15], seed }
    }

    /// A ruler that is off by 10 mm RMS an axis, LEDs thought to be diffuse and to point at the middle.
    pub(crate) fn priors(&self) -> Vec<Prior> {
        let mut dice = Dice(self.seed.wrapping_mul(48_271) + 17);
        let prior = |led: &Led| {
            let position_mm = led.position + dice.scatter() * 10.0;
            let axis = UnitVector3::new_normalize(-position_mm.coords);
            let place = Place::Near { position_mm, axis, exponent: 1.0 };
            Prior {
                emitter: Emitter { place, log_intensity: 0.0 },
                position_sigma_mm: 10.0,
                angle_sigma_rad: 0.26,
                exponent_sigma: 2.0,
            }
        };
        self.leds.iter().map(prior).collect()
    }

    pub(crate) fn sheets(&self, which: Sheets) -> Vec<Sheet> {
        let errors = SlowErrors::new(self.kind, self.leds.len(), self.seed);
        let planes = which.planes();
        planes.iter().enumerate().map(|(s, plane)| self.sheet(s, plane, &errors)).collect()
    }

    fn sheet(&self, s: usize, plane: &Plane, errors: &SlowErrors) -> Sheet {
        let mut dice = Dice(self.seed.wrapping_mul(7919) + s as u64 * 131 + 1);
        let cells: Vec<Cell> = (0..self.grid[0] * self.grid[1])
            .map(|k| self.cell([k % self.grid[0], k / self.grid[0]], plane))
            .collect();
        let of_light = |(i, led): (usize, &Led)| {
            let at = |cell: &Cell| errors.at(i, s, &seen(led, cell, plane));
            let raw: Vec<f64> = cells.iter().map(at).collect();
            scaled(raw, self.slow, errors.keeps_mean())
        };
        let slow: Vec<Vec<f64>> = self.leds.iter().enumerate().map(of_light).collect();
        let mut samples = Vec::new();
        for (c, cell) in cells.iter().enumerate() {
            let gain = vignetting(&cell.pixel) * 0.97 * paper(cell, plane, self.seed);
            for (led, slow) in self.leds.iter().zip(&slow) {
                let off = 1.0 + slow[c] + NOISE * dice.normal();
                let signal = shine(led, &cell.point_mm, &plane.normal) * gain * off;
                samples.push(Sample {
                    signal: led.strength.map(|strength| strength * signal),
                    relative_sigma: [NOISE; 3],
                });
            }
        }
        Sheet {
            name: format!("sheet {s}"),
            plane: plane.clone(),
            pose_sigma: PoseSigma::default(),
            reflectance: 0.97,
            grid: self.grid,
            cells,
            samples,
        }
    }

    fn cell(&self, place: [usize; 2], plane: &Plane) -> Cell {
        let pixel: [f64; 2] =
            std::array::from_fn(|k| (place[k] as f64 + 0.5) / self.grid[k] as f64 * FRAME[k] - 0.5);
        let [right, down] = [0, 1].map(|k| (pixel[k] - 0.5 * (FRAME[k] - 1.0)) / FOCAL_PX);
        let view = UnitVector3::new_normalize(Vector3::new(right, -down, -1.0));
        let eye = Point3::from(CAMERA);
        let far = plane.normal.dot(&(plane.point_mm - eye)) / plane.normal.dot(&view);
        Cell { place, pixel, point_mm: eye + view.into_inner() * far, view }
    }
}

/// What a kind of error may depend on.
pub(crate) struct Seen {
    /// Place in the frame, -1..1.
    pub(crate) place: [f64; 2],
    pub(crate) cos_in: f64,
    pub(crate) cos_out: f64,
    /// Between light and camera.
    pub(crate) cos_phase: f64,
    /// The light's own share here, in units of what it gives one metre away on its axis.
    pub(crate) level: f64,
    /// Angle from the LED's axis.
    pub(crate) emission_rad: f64,
}

fn seen(led: &Led, cell: &Cell, plane: &Plane) -> Seen {
    let to_light = (led.position - cell.point_mm).normalize();
    let to_camera = -cell.view.into_inner();
    Seen {
        place: [0, 1].map(|k| (cell.pixel[k] + 0.5) / FRAME[k] * 2.0 - 1.0),
        cos_in: to_light.dot(&plane.normal),
        cos_out: to_camera.dot(&plane.normal),
        cos_phase: to_light.dot(&to_camera),
        level: shine(led, &cell.point_mm, &plane.normal),
        emission_rad: (-to_light).cross(&led.axis).norm().atan2((-to_light).dot(&led.axis)),
    }
}

/// To an RMS; about its mean, unless the mean is what matters.
fn scaled(mut values: Vec<f64>, rms: f64, keeps_mean: bool) -> Vec<f64> {
    let count = values.len() as f64;
    let mean = if keeps_mean { 0.0 } else { values.iter().sum::<f64>() / count };
    values.iter_mut().for_each(|v| *v -= mean);
    // A constant is given in units of the RMS already.
    let own = if keeps_mean {
        1.0
    } else {
        (values.iter().map(|v| v * v).sum::<f64>() / count).sqrt().max(1e-12)
    };
    values.iter().map(|v| v / own * rms).collect()
}

fn shine(led: &Led, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
    let ray = point - led.position;
    let metres2 = ray.norm_squared() * 1e-6;
    let off_axis = ray.cross(&led.axis).norm().atan2(ray.dot(&led.axis));
    let incidence = (-ray).cross(normal).norm().atan2((-ray).dot(normal));
    off_axis.cos().max(0.0).powf(led.exponent) * incidence.cos().max(0.0) / metres2
}

/// Off centre and not quite round.
fn vignetting(pixel: &[f64; 2]) -> f64 {
    let [x, y] = [0, 1].map(|k| pixel[k] / FRAME[k] * 2.0 - 1.0);
    1.0 - 0.11 * ((x - 0.05).powi(2) + 0.8 * (y + 0.03).powi(2))
}

/// Two waves across the sheet, 1.5 % together.
fn paper(cell: &Cell, plane: &Plane, seed: u64) -> f64 {
    let at = cell.point_mm - plane.point_mm;
    let phase = seed as f64;
    1.0 + 0.004 * (at.x / 61.0 + phase).sin() + 0.0035 * (at.y / 83.0 - 2.0 * phase).cos()
}
