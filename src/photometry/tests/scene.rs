//! Rows with known truth: a reference rig over a table, Lambertian facets, shot and read noise.

use nalgebra::{Rotation3, Unit, Vector3};

use crate::photometry::{
    FieldRow, LightSet, Method, Outcome, RowInput, RowOutput, RowSolver, Support, VarianceModel,
    reference_row,
};

/// A small generator of random numbers (SplitMix64), so that tests depend on no crate's stream.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x1234_5678_9abc_def1))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `low..high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    /// Normal distribution, by Box and Muller.
    pub(crate) fn gauss(&mut self) -> f64 {
        let radius = (-2.0 * self.between(1e-300, 1.0).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.between(0.0, 1.0)).cos()
    }
}

/// The reference rig: six lights at 45 degrees elevation, four at 62, 560 mm from the middle; mm.
pub(crate) fn reference_lights() -> Vec<Vector3<f64>> {
    let ring = |count: usize, elevation_deg: f64, turn: f64| {
        (0..count).map(move |i| {
            let azimuth = std::f64::consts::TAU * (i as f64 + turn) / count as f64;
            let elevation = elevation_deg.to_radians();
            560.0
                * Vector3::new(
                    elevation.cos() * azimuth.cos(),
                    elevation.cos() * azimuth.sin(),
                    elevation.sin(),
                )
        })
    };
    ring(6, 45.0, 0.0).chain(ring(4, 62.0, 0.5)).collect()
}

/// Lights spread evenly over the upper hemisphere between 35 and 75 degrees of elevation (a golden spiral).
pub(crate) fn many_lights(count: usize) -> Vec<Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let light = |i: usize| {
        let share = (i as f64 + 0.5) / count as f64;
        let z = 35_f64.to_radians().sin() * (1.0 - share) + 75_f64.to_radians().sin() * share;
        let (radius, azimuth) = ((1.0 - z * z).sqrt(), golden * i as f64);
        560.0 * Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), z)
    };
    (0..count).map(light).collect()
}

/// Light vectors in one row of columns `pitch_mm` apart, relative to 1 at the reference distance.
pub(crate) fn near_field(
    positions_mm: &[Vector3<f64>],
    width: usize,
    step: usize,
    pitch_mm: f64,
) -> Vec<[f64; 3]> {
    let nodes = width.saturating_sub(1).div_ceil(step) + 1;
    let start = -0.5 * width as f64 * pitch_mm;
    let column = |node: usize| Vector3::new(start + (node * step) as f64 * pitch_mm, 40.0, 0.0);
    let vector = |p: &Vector3<f64>, at: Vector3<f64>| {
        let to_light = p - at;
        (to_light * 560.0_f64.powi(2) / to_light.norm().powi(3)).into()
    };
    (0..nodes).flat_map(|node| positions_mm.iter().map(move |p| vector(p, column(node)))).collect()
}

/// A row of input with its truth.
pub(crate) struct Scene {
    pub(crate) width: usize,
    pub(crate) lights: usize,
    pub(crate) step: usize,
    pub(crate) field: Vec<[f64; 3]>,
    pub(crate) signal: Vec<Vec<f32>>,
    pub(crate) variance: Vec<[VarianceModel; 2]>,
    pub(crate) normal: Vec<Vector3<f64>>,
    pub(crate) albedo: Vec<f64>,
}

/// The noise of ACCURACY.md: 40 ke- full well, 4 e- read noise, 14 bit, the brightest light at 50 % for albedo 1.
pub(crate) fn reference_noise() -> VarianceModel {
    let electrons = 20_000.0;
    let quantisation = 40_000.0_f64 / 16_384.0 / 12.0_f64.sqrt();
    VarianceModel {
        shot: (1.0 / electrons) as f32,
        floor: ((16.0 + quantisation * quantisation) / (electrons * electrons)) as f32,
        kappa: 0.0,
    }
}

impl Scene {
    /// Noise-free Lambertian facets; `facet(column)` gives normal and albedo.
    pub(crate) fn new(
        positions_mm: &[Vector3<f64>],
        width: usize,
        step: usize,
        mut facet: impl FnMut(usize) -> (Vector3<f64>, f64),
    ) -> Self {
        let pitch_mm = 0.085_f64.min(300.0 / width as f64); // rows of many samples stay on the table
        let field = near_field(positions_mm, width, step, pitch_mm);
        let lights = positions_mm.len();
        let (normal, albedo): (Vec<_>, Vec<_>) = (0..width).map(&mut facet).unzip();
        let mut scene = Self {
            width,
            lights,
            step,
            field,
            signal: vec![vec![0.0; width]; lights],
            variance: vec![[reference_noise(); 2]; lights],
            normal,
            albedo,
        };
        for column in 0..width {
            for light in 0..lights {
                scene.signal[light][column] = scene.clean(light, column) as f32;
            }
        }
        scene
    }

    /// The signal without noise.
    pub(crate) fn clean(&self, light: usize, column: usize) -> f64 {
        let l = self.field().at(column, light);
        self.albedo[column] * self.normal[column].dot(&l).max(0.0)
    }

    /// Adds noise as the variance model says.
    pub(crate) fn add_noise(&mut self, random: &mut Random) {
        for (light, signal) in self.signal.iter_mut().enumerate() {
            for (column, y) in signal.iter_mut().enumerate() {
                let model = self.variance[light][column & 1];
                let variance = model.shot * *y + model.floor + (model.kappa * *y).powi(2);
                *y += (f64::from(variance).sqrt() * random.gauss()) as f32;
            }
        }
    }

    /// Spoils `count` lit samples of every photosite before the noise comes: shadow of 0 to 30 % or highlight of 150 to 400 %.
    /// Returns which.
    pub(crate) fn spoil(&mut self, count: usize, random: &mut Random) -> Vec<LightSet> {
        let mut spoilt = vec![LightSet::NONE; self.width];
        for column in 0..self.width {
            let brightest = (0..self.lights).map(|i| self.clean(i, column)).fold(0.0, f64::max);
            let lit: Vec<usize> =
                (0..self.lights).filter(|&i| self.clean(i, column) > 0.02 * brightest).collect();
            let spare = lit.len().saturating_sub(4);
            while spoilt[column].len() < count.min(spare) {
                let light = lit[random.below(lit.len())];
                if !spoilt[column].contains(light) {
                    spoilt[column].insert(light);
                    let shadow = random.below(2) == 0;
                    let factor =
                        if shadow { random.between(0.0, 0.3) } else { random.between(1.5, 4.0) };
                    self.signal[light][column] *= factor as f32;
                }
            }
        }
        spoilt
    }

    pub(crate) fn field(&self) -> FieldRow<'_> {
        FieldRow { step: self.step, vectors: &self.field, lights: self.lights }
    }

    /// Runs `solve` on this row.
    pub(crate) fn run(&self, solve: impl FnOnce(&RowInput, &mut RowOutput)) -> Solved {
        let signal: Vec<&[f32]> = self.signal.iter().map(Vec::as_slice).collect();
        let input = RowInput {
            signal: &signal,
            field: self.field(),
            variance: &self.variance,
            noise_scale: None,
        };
        let mut solved = Solved::new(self.width);
        solve(&input, &mut solved.output());
        solved
    }

    pub(crate) fn fast(&self, method: Method) -> Solved {
        self.run(|input, output| RowSolver::new().solve(input, output, method).unwrap())
    }

    pub(crate) fn reference(&self, method: Method) -> Solved {
        self.run(|input, output| reference_row(input, output, method))
    }
}

/// The result of a row, filled with nonsense before, so that an entry left out shows.
pub(crate) struct Solved {
    pub(crate) normal: Vec<[f32; 3]>,
    pub(crate) albedo: Vec<f32>,
    pub(crate) expected_error_deg: Vec<f32>,
    pub(crate) residual: Vec<f32>,
    pub(crate) outcome: Vec<Outcome>,
    pub(crate) support: Vec<Support>,
}

impl Solved {
    pub(crate) fn new(width: usize) -> Self {
        Self {
            normal: vec![[f32::NAN; 3]; width],
            albedo: vec![f32::NAN; width],
            expected_error_deg: vec![f32::NAN; width],
            residual: vec![f32::NAN; width],
            outcome: vec![Outcome::Masked; width],
            support: vec![Support { kept: LightSet::first(9), dropped: LightSet::first(9) }; width],
        }
    }

    pub(crate) fn output(&mut self) -> RowOutput<'_> {
        RowOutput {
            normal: &mut self.normal,
            albedo: &mut self.albedo,
            expected_error_deg: &mut self.expected_error_deg,
            residual: &mut self.residual,
            outcome: &mut self.outcome,
            support: Some(&mut self.support),
        }
    }

    pub(crate) fn normal(&self, column: usize) -> Vector3<f64> {
        Vector3::from(self.normal[column]).cast()
    }
}

/// Angle between two directions, degrees, without the floor that acos has.
pub(crate) fn angle_deg(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}

/// A direction at `tilt` from +z, any azimuth.
pub(crate) fn tilted(random: &mut Random, tilt_deg: f64) -> Vector3<f64> {
    let axis = Unit::new_normalize(Vector3::new(1.0, 0.0, 0.0));
    let spin =
        Rotation3::from_axis_angle(&Vector3::z_axis(), random.between(0.0, std::f64::consts::TAU));
    spin * Rotation3::from_axis_angle(&axis, tilt_deg.to_radians()) * Vector3::z()
}
