//! Rows of known truth, several to a tile.

use super::gpu;
use crate::gpu::{Tile, TileRow};
use crate::photometry::tests::scene::{
    Random, Scene, Solved, angle_deg, many_lights, reference_lights, reference_noise, tilted,
};
use crate::photometry::{CutRow, Method, Outcome, RowInput, RowSolver, VarianceModel};
use nalgebra::Vector3;

/// What the project asks.
const SAME_NORMAL_DEG: f64 = 1e-3;
/// float32 keeps seven digits; ten terms and a condition number of two lose one.
const SAME_ALBEDO: f32 = 1e-5;
/// Of figures that nobody reads to more than three digits.
const SAME_FIGURE: f32 = 1e-3;

const METHODS: [Method; 3] = [Method::LeastSquares, Method::Weighted, Method::Auto];

/// Rows, their noise models (two kinds of rows, two kinds of columns), and what their gain maps do to the noise.
struct Rows {
    scenes: Vec<Scene>,
    variance: [Vec<[VarianceModel; 2]>; 2],
    scale: Option<Vec<f32>>,
}

impl Rows {
    fn new(scenes: Vec<Scene>) -> Self {
        let model = |factor: f32| VarianceModel {
            shot: factor * reference_noise().shot,
            kappa: 0.001 * factor,
            ..reference_noise()
        };
        let cell = |row: f32| [model(row), model(1.3 * row)];
        let lights = scenes[0].lights;
        let variance = [vec![cell(1.0); lights], vec![cell(0.7); lights]];
        Self { scenes, variance, scale: None }
    }

    fn input<'a>(&'a self, row: usize, signal: &'a [&'a [f32]]) -> RowInput<'a> {
        let scene = &self.scenes[row];
        RowInput {
            signal,
            field: scene.field(),
            variance: &self.variance[row & 1],
            noise_scale: self.scale_of(row),
        }
    }

    fn scale_of(&self, row: usize) -> Option<&[f32]> {
        self.scale.as_ref().map(|scale| &scale[..self.scenes[row].width])
    }

    /// By the processor alone.
    fn here(&self, method: Method) -> Vec<Solved> {
        self.solve(|_, input, solved| {
            RowSolver::new()
                .solve(input, &mut solved.output(), method)
                .expect("rows that fit together");
        })
    }

    /// All rows as one tile, then the rest.
    fn there(&self, method: Method) -> Vec<Solved> {
        let mut cuts: Vec<CutRow> = self.scenes.iter().map(cut).collect();
        let tile_row = |(row, cut): (usize, _)| TileRow {
            signal: self.scenes[row].signal.iter().map(Vec::as_slice).collect(),
            noise_scale: self.scale_of(row),
            cut,
            parity: row,
        };
        let tile = Tile {
            rows: cuts.iter().enumerate().map(tile_row).collect(),
            lights: self.scenes[0].lights,
            variance: &self.variance,
            method,
        };
        let flight = gpu().submit(&tile).expect("rows that fit together");
        flight
            .land(|answer| {
                self.solve(|row, input, solved| {
                    let found = answer.row(row);
                    RowSolver::new()
                        .solve_rest(input, &mut solved.output(), method, (&mut cuts[row], &found))
                        .expect("rows that fit together");
                })
            })
            .expect("rows that fit together")
    }

    fn solve(&self, mut solve: impl FnMut(usize, &RowInput, &mut Solved)) -> Vec<Solved> {
        let one = |row: usize| {
            let scene = &self.scenes[row];
            let signal: Vec<&[f32]> = scene.signal.iter().map(Vec::as_slice).collect();
            let mut solved = Solved::new(scene.width);
            solve(row, &self.input(row, &signal), &mut solved);
            solved
        };
        (0..self.scenes.len()).map(one).collect()
    }
}

fn cut(scene: &Scene) -> CutRow {
    let mut cut = CutRow::default();
    cut.cut(&scene.field(), scene.width);
    cut
}

fn check_same(name: &str, rows: &Rows) {
    for method in METHODS {
        for (row, (there, here)) in rows.there(method).iter().zip(rows.here(method)).enumerate() {
            check_row(&format!("{name}, {method:?}, row {row}"), there, &here);
        }
    }
}

fn check_row(name: &str, there: &Solved, here: &Solved) {
    for column in 0..here.outcome.len() {
        let place = format!("{name}, column {column}");
        assert_eq!(there.outcome[column], here.outcome[column], "{place}");
        assert_eq!(there.support[column], here.support[column], "{place}: samples kept");
        let off = angle_deg(&there.normal(column), &here.normal(column));
        assert!(off <= SAME_NORMAL_DEG, "{place}: normal off by {off:e} degrees");
        for (what, a, b, tolerance) in [
            ("albedo", there.albedo[column], here.albedo[column], SAME_ALBEDO),
            (
                "expected error",
                there.expected_error_deg[column],
                here.expected_error_deg[column],
                SAME_FIGURE,
            ),
            ("residual", there.residual[column], here.residual[column], SAME_FIGURE),
        ] {
            // A residual of nothing but rounding has no digits.
            let floor = if what == "residual" { SAME_FIGURE * here.albedo[column] } else { 0.0 };
            let scale = b.abs().max(floor);
            assert!((a - b).abs() <= tolerance * scale, "{place}: {what} {a} against {b}");
        }
    }
}

fn facets(lights: &[Vector3<f64>], width: usize, step: usize, tilt_deg: f64, seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let mut scene = Scene::new(lights, width, step, |_| {
        let tilt = random.between(0.0, tilt_deg);
        (tilted(&mut random, tilt), 10_f64.powf(random.between(-2.0, 0.1)))
    });
    scene.add_noise(&mut random);
    scene
}

#[test]
fn rows_of_any_length_and_lights_give_the_same() {
    for lights in [3, 4, 10, 17, 64] {
        let positions = if lights == 10 { reference_lights() } else { many_lights(lights) };
        let sizes = [(700, 32), (97, 96), (65, 7), (1, 64), (2, 1), (33, 33), (300, 1)];
        let row = |(seed, (width, step))| facets(&positions, width, step, 75.0, seed);
        check_same(&format!("{lights} lights"), &Rows::new((1..).zip(sizes).map(row).collect()));
    }
    check_same("one row", &Rows::new(vec![facets(&reference_lights(), 131, 32, 60.0, 9)]));
}

#[test]
fn shadows_highlights_and_missing_samples_take_the_same_ways() {
    let mut random = Random::new(6);
    let spoilt = |count: usize| {
        let mut random = Random::new(count as u64);
        let mut scene = Scene::new(&reference_lights(), 400, 32, |_| {
            let tilt = random.between(0.0, 60.0);
            (tilted(&mut random, tilt), random.between(0.02, 1.0))
        });
        scene.spoil(count, &mut random);
        scene.add_noise(&mut random);
        scene
    };
    let mut scenes: Vec<Scene> = (0..4).map(spoilt).collect();
    for scene in &mut scenes[1..] {
        for column in (0..scene.width).step_by(3) {
            for _ in 0..random.below(10) {
                let light = random.below(scene.lights);
                scene.signal[light][column] =
                    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][column % 3];
            }
        }
    }
    check_same("spoilt", &Rows::new(scenes));
}

#[test]
fn gain_maps_scale_the_noise() {
    let scenes = (0..3).map(|seed| facets(&reference_lights(), 200, 32, 60.0, seed)).collect();
    let mut rows = Rows::new(scenes);
    let mut scale: Vec<f32> = (0..200).map(|x| 0.5 + 0.01 * x as f32).collect();
    [scale[3], scale[40], scale[77]] = [f32::NAN, -1.0, f32::INFINITY];
    rows.scale = Some(scale);
    check_same("scaled", &rows);
}

#[test]
fn what_is_no_number_or_no_surface_is_left_to_the_processor() {
    let mut scene = facets(&reference_lights(), 64, 32, 30.0, 1);
    let mut set = |column: usize, value: &dyn Fn(usize) -> f32| {
        (0..10).for_each(|light| scene.signal[light][column] = value(light));
    };
    set(0, &|_| 0.0);
    set(1, &|_| -0.0);
    set(2, &|_| f32::NAN);
    set(3, &|_| 1e-40);
    set(4, &|_| 3e38);
    set(5, &|light| if light == 4 { 1.0 } else { 0.0 });
    set(6, &|_| -0.3);
    set(7, &|light| if light < 2 { 0.5 } else { f32::NAN });
    set(8, &|_| 1e-15);
    set(9, &|_| 1e15);
    let rows = Rows::new(vec![scene]);
    check_same("odd", &rows);
    let outcomes = &rows.there(Method::Auto)[0].outcome;
    assert_eq!(outcomes[..3], [Outcome::NoSurface, Outcome::NoSurface, Outcome::TooFewLights]);
}

#[test]
fn lights_nearly_in_a_plane_go_to_float64() {
    for elevation_deg in [70.0_f64, 85.0, 89.9] {
        let ring = |p: &Vector3<f64>| {
            let flat = Vector3::new(p.x, p.y, 0.0).normalize() * elevation_deg.to_radians().cos();
            560.0 * (flat + Vector3::z() * elevation_deg.to_radians().sin())
        };
        let lights: Vec<Vector3<f64>> = reference_lights().iter().map(ring).collect();
        let scenes = (0..2).map(|seed| facets(&lights, 120, 32, 30.0, seed)).collect();
        check_same(&format!("{elevation_deg} degrees"), &Rows::new(scenes));
    }
}

#[test]
fn every_binding_of_a_tile_is_one_that_all_devices_offer() {
    const OFFERED: usize = 128 << 20;
    for lights in [3, 10, 64] {
        for width in [1, 640, 4928, 14_000, 65_535] {
            let rows = gpu().rows_at_once(width, lights);
            assert!(rows > 0);
            // A piece of one column each: twelve numbers and six a light; a plane a light and one for the noise; five come back.
            for numbers in [12 + 6 * lights, lights + 1, 5] {
                let bytes = 4 * numbers * width * rows;
                assert!(bytes <= OFFERED, "{lights} lights, {rows} rows of {width}: {bytes}");
            }
        }
    }
}
