//! Input aimed at the places where arithmetic breaks: degenerate lights, extreme scales, every kind of number that is not
//! one. Nothing may panic, nothing may come out as NaN, and errors grow as the condition number predicts.

use nalgebra::Vector3;
use num_rational::Ratio;
use proptest::prelude::*;

use super::scene::{
    Random, Scene, Solved, angle_deg, many_lights, reference_lights, reference_noise, tilted,
};
use crate::photometry::{
    FieldRow, Method, Outcome, RowInput, RowSolver, Support, VarianceModel, reference_row,
};

const METHODS: [Method; 4] = [Method::LeastSquares, Method::Weighted, Method::Robust, Method::Auto];

/// A row as it should never be.
#[derive(Clone, Debug)]
struct Nasty {
    width: usize,
    lights: usize,
    step: usize,
    signal: Vec<Vec<f32>>,
    field: Vec<[f64; 3]>,
    variance: Vec<[VarianceModel; 2]>,
    noise_scale: Option<Vec<f32>>,
}

const NASTY_NUMBERS: [f32; 16] = [
    0.0,
    -0.0,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MIN_POSITIVE,
    1e-45,
    -1e-40,
    1e-30,
    1e30,
    f32::MAX,
    f32::MIN,
    -1.0,
    1.0,
    1e-6,
    1e6,
];

/// Mostly plain numbers with a share of nasty ones in thousandths.
fn number(nasty_per_mille: u32) -> impl Strategy<Value = f32> {
    prop_oneof![
        1000 - nasty_per_mille => -0.1_f32..1.5,
        nasty_per_mille => prop::sample::select(NASTY_NUMBERS.to_vec()),
    ]
}

fn nasty_rows() -> impl Strategy<Value = Nasty> {
    let lights = prop_oneof![6 => 3_usize..13, 2 => 13_usize..18, 1 => Just(64_usize)];
    let shares = prop::sample::select(vec![0_u32, 20, 200, 1000]);
    (lights, 1_usize..70, 1_usize..90, shares.clone(), shares.clone(), shares)
        .prop_flat_map(nasty_row)
}

fn nasty_row(
    (lights, width, step, bad_signal, bad_field, bad_noise): (usize, usize, usize, u32, u32, u32),
) -> impl Strategy<Value = Nasty> {
    let nodes = (width - 1).div_ceil(step) + 1;
    let signal = prop::collection::vec(prop::collection::vec(number(bad_signal), width), lights);
    let vector = prop::array::uniform3(number(bad_field).prop_map(f64::from));
    let field = prop::collection::vec(vector, nodes * lights);
    let noise = number(bad_noise);
    let model = prop::array::uniform3(noise).prop_map(|[shot, floor, kappa]| VarianceModel {
        shot,
        floor,
        kappa,
    });
    let variance = prop::collection::vec(prop::array::uniform2(model), lights);
    let noise_scale = prop::option::of(prop::collection::vec(number(bad_noise), width));
    (signal, field, variance, noise_scale).prop_map(
        move |(signal, field, variance, noise_scale)| Nasty {
            width,
            lights,
            step,
            signal,
            field,
            variance,
            noise_scale,
        },
    )
}

impl Nasty {
    fn solve(&self, method: Method, fast: bool) -> Solved {
        let signal: Vec<&[f32]> = self.signal.iter().map(Vec::as_slice).collect();
        let field = FieldRow { step: self.step, vectors: &self.field, lights: self.lights };
        let noise_scale = self.noise_scale.as_deref();
        let input = RowInput { signal: &signal, field, variance: &self.variance, noise_scale };
        let mut solved = Solved::new(self.width);
        if fast {
            RowSolver::new().solve(&input, &mut solved.output(), method).unwrap();
        } else {
            reference_row(&input, &mut solved.output(), method);
        }
        solved
    }
}

/// Every entry is a number, and what is solved is a surface.
fn check_sane(place: &str, solved: &Solved) {
    for column in 0..solved.outcome.len() {
        let outcome = solved.outcome[column];
        let normal = solved.normal(column);
        let values =
            [solved.albedo[column], solved.expected_error_deg[column], solved.residual[column]];
        let support = solved.support[column];
        let place =
            format!("{place}, column {column}: {outcome:?} {normal:?} {values:?} {support:?}");
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "{place}");
        if matches!(
            outcome,
            Outcome::Fitted | Outcome::Shadow | Outcome::Highlight | Outcome::Other
        ) {
            assert!((normal.norm() - 1.0).abs() < 1e-5 && normal.z >= 0.0, "{place}");
            assert!(values[0] > 0.0 && values[1] <= 90.0, "{place}");
            assert!(support.kept.len() >= 3, "{place}");
            assert!(support.kept.and(&support.dropped).is_empty(), "{place}");
            assert!(outcome != Outcome::Fitted || support.dropped.is_empty(), "{place}");
        } else {
            assert_ne!(outcome, Outcome::Masked, "{place}: left out");
            assert!(
                normal.norm() == 0.0 && values == [0.0; 3] && support == Support::default(),
                "{place}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_comes_in_numbers_come_out(row in nasty_rows()) {
        for method in METHODS {
            check_sane(&format!("{method:?}, fast"), &row.solve(method, true));
            if row.lights <= 10 {
                check_sane(&format!("{method:?}, reference"), &row.solve(method, false));
            }
        }
    }

    #[test]
    fn few_small_integers_come_out_as_in_exact_arithmetic(
        lights in prop::collection::vec(prop::array::uniform3(-9_i128..10), 3..7),
        y in prop::collection::vec(0_i128..100, 7),
    ) {
        check_exact(&lights, &y[..lights.len()]);
    }
}

/// Least squares over rational numbers by Cramer's rule, against the float64 reference and the float32 path.
fn check_exact(lights: &[[i128; 3]], y: &[i128]) {
    let mut matrix = [[0_i128; 3]; 3];
    let mut right = [0_i128; 3];
    for (l, y) in lights.iter().zip(y) {
        for a in 0..3 {
            right[a] += l[a] * y;
            for b in 0..3 {
                matrix[a][b] += l[a] * l[b];
            }
        }
    }
    let determinant = determinant(&matrix);
    let g: Vec<f64> = (0..3)
        .map(|axis| {
            let mut replaced = matrix;
            (0..3).for_each(|row| replaced[row][axis] = right[row]);
            let exact = if determinant == 0 {
                Ratio::from_integer(0)
            } else {
                Ratio::new(self::determinant(&replaced), determinant)
            };
            *exact.numer() as f64 / *exact.denom() as f64
        })
        .collect();
    let exact = Vector3::new(g[0], g[1], g[2]);
    let row = Nasty {
        width: 1,
        lights: lights.len(),
        step: 1,
        signal: y.iter().map(|&y| vec![y as f32]).collect(),
        field: lights.iter().map(|l| l.map(|c| c as f64)).collect(),
        variance: vec![[VarianceModel::default(); 2]; lights.len()],
        noise_scale: None,
    };
    for fast in [false, true] {
        let solved = row.solve(Method::LeastSquares, fast);
        let place =
            format!("fast {fast}: {:?} {:?}, exact {exact:?}", solved.outcome[0], solved.normal[0]);
        if determinant == 0 {
            assert!(
                matches!(solved.outcome[0], Outcome::CoplanarLights | Outcome::NoSurface),
                "{place}"
            );
        } else if exact.z <= 0.0 {
            assert_eq!(solved.outcome[0], Outcome::NoSurface, "{place}");
        } else {
            assert_eq!(solved.outcome[0], Outcome::Fitted, "{place}");
            assert!(angle_deg(&solved.normal(0), &exact) < 0.001, "{place}");
            assert!((f64::from(solved.albedo[0]) / exact.norm() - 1.0).abs() < 1e-5, "{place}");
        }
    }
}

fn determinant(m: &[[i128; 3]; 3]) -> i128 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
        - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}

fn facets(lights: &[Vector3<f64>], width: usize, seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let mut scene = Scene::new(lights, width, 64, |_| {
        let tilt = random.between(0.0, 50.0);
        (tilted(&mut random, tilt), random.between(0.02, 2.0))
    });
    scene.spoil(1, &mut random);
    scene.add_noise(&mut random);
    scene
}

/// Largest angle between two solutions of one scene, where both kept the same samples; these must be nearly all.
fn largest_angle(a: &Solved, b: &Solved) -> f64 {
    let width = a.outcome.len();
    let same: Vec<usize> = (0..width).filter(|&c| a.outcome[c] == b.outcome[c]).collect();
    assert!(same.len() * 100 >= width * 99, "{} of {width} went the same way", same.len());
    let angles =
        same.iter().filter(|&&c| a.albedo[c] > 0.0).map(|&c| angle_deg(&a.normal(c), &b.normal(c)));
    angles.fold(0.0, f64::max)
}

#[test]
fn brightness_has_no_scale() {
    let plain = facets(&reference_lights(), 200, 21);
    for exponent in [-6, -3, 3, 6] {
        let factor = 10_f32.powi(exponent);
        let mut scaled = facets(&reference_lights(), 200, 21);
        scaled.signal.iter_mut().flatten().for_each(|y| *y *= factor);
        for model in scaled.variance.iter_mut().flatten() {
            *model = VarianceModel {
                shot: model.shot * factor,
                floor: model.floor * factor * factor,
                ..*model
            };
        }
        for method in METHODS {
            let angle = largest_angle(&plain.fast(method), &scaled.fast(method));
            assert!(angle < 0.001, "{method:?} times {factor}: {angle} deg");
        }
    }
}

#[test]
fn lights_have_no_order() {
    let plain = facets(&reference_lights(), 200, 22);
    let mut turned = reference_lights();
    turned.rotate_left(3);
    turned.swap(0, 5);
    let mut other =
        Scene::new(&turned, 200, 64, |column| (plain.normal[column], plain.albedo[column]));
    other.signal = plain.signal.clone();
    other.signal.rotate_left(3);
    other.signal.swap(0, 5);
    for method in METHODS {
        let angle = largest_angle(&plain.fast(method), &other.fast(method));
        assert!(angle < 0.001, "{method:?}: {angle} deg");
    }
}

/// Whatever its neighbours are, a photosite comes out with the same bits.
#[test]
fn photosites_do_not_see_each_other() {
    let row = facets(&reference_lights(), 150, 23);
    let mut spoilt = facets(&reference_lights(), 150, 23);
    let mut random = Random::new(24);
    for column in (0..150).filter(|c| c % 3 != 0) {
        for signal in &mut spoilt.signal {
            signal[column] = NASTY_NUMBERS[random.below(NASTY_NUMBERS.len())];
        }
    }
    for method in METHODS {
        let (a, b) = (row.fast(method), spoilt.fast(method));
        for column in (0..150).step_by(3) {
            assert_eq!(a.normal[column], b.normal[column], "{method:?}, column {column}");
            assert_eq!(a.outcome[column], b.outcome[column], "{method:?}, column {column}");
        }
    }
}

/// Lights pressed towards a plane: condition 1 to infinity.
#[test]
fn errors_grow_with_the_condition_until_the_lights_are_flat() {
    let truth = Vector3::new(0.2, 0.1, 1.0).normalize();
    for exponent in 0..8 {
        let flat = 10_f64.powi(-exponent);
        // Pressed towards the plane y = 0, which holds the normal nearly.
        let lights: Vec<[f64; 3]> =
            many_lights(10).iter().map(|p| p / 560.0).map(|l| [l.x, l.y * flat, l.z]).collect();
        let y = |l: &[f64; 3]| vec![(0.5 * Vector3::from(*l).dot(&truth)) as f32];
        let row = Nasty {
            width: 1,
            lights: lights.len(),
            step: 1,
            signal: lights.iter().map(y).collect(),
            field: lights,
            variance: vec![[reference_noise(); 2]; 10],
            noise_scale: None,
        };
        for method in [Method::LeastSquares, Method::Weighted, Method::Auto] {
            let solved = row.solve(method, true);
            let condition = 3.0 / flat;
            let place = format!("{method:?}, condition {condition:.0}: {:?}", solved.outcome[0]);
            if condition < 3e4 {
                // The samples are rounded to float32: half a unit in the last place, times the condition.
                let allowed = (1e-7 * condition).to_degrees() + 1e-4;
                let error = angle_deg(&solved.normal(0), &truth);
                assert!(error <= allowed, "{place}: {error} deg, allowed {allowed}");
            } else if condition > 1e6 {
                assert_eq!(solved.outcome[0], Outcome::CoplanarLights, "{place}");
            }
        }
    }
}

#[test]
fn each_failure_has_its_name() {
    let lights = reference_lights().iter().map(|p| p / 560.0).collect::<Vec<_>>();
    let coplanar: Vec<_> = lights.iter().map(|l| Vector3::new(l.x, 0.0, l.z)).collect();
    let duplicates: Vec<_> = lights.iter().enumerate().map(|(i, _)| lights[i % 2]).collect();
    let bright = |l: &[Vector3<f64>]| l.iter().map(|l| l.z as f32).collect::<Vec<_>>();
    let one = |value: f32| (0..10).map(|i| if i == 4 { value } else { 0.0 }).collect::<Vec<_>>();
    let usable = |count: usize| {
        (0..10).map(|i| if i < count { lights[i].z as f32 } else { f32::NAN }).collect()
    };
    type Case<'a> = (&'a str, &'a [Vector3<f64>], Vec<f32>, &'a [Outcome]);
    let cases: [Case; 9] = [
        ("all black", &lights, vec![0.0; 10], &[Outcome::NoSurface]),
        ("all negative zero", &lights, vec![-0.0; 10], &[Outcome::NoSurface]),
        ("all saturated", &lights, vec![f32::NAN; 10], &[Outcome::TooFewLights]),
        ("two usable", &lights, usable(2), &[Outcome::TooFewLights]),
        ("three usable", &lights, usable(3), &[Outcome::Fitted]),
        ("coplanar", &coplanar, bright(&coplanar), &[Outcome::CoplanarLights]),
        ("two lights five times", &duplicates, bright(&duplicates), &[Outcome::CoplanarLights]),
        (
            "single bright sample",
            &lights,
            one(0.5),
            &[Outcome::NoSurface, Outcome::Fitted, Outcome::Other, Outcome::Highlight],
        ),
        ("all negative", &lights, vec![-0.5; 10], &[Outcome::NoSurface]),
    ];
    for (name, vectors, y, expected) in cases {
        let row = Nasty {
            width: 1,
            lights: 10,
            step: 1,
            signal: y.iter().map(|&y| vec![y]).collect(),
            field: vectors.iter().map(|l| (*l).into()).collect(),
            variance: vec![[reference_noise(); 2]; 10],
            noise_scale: None,
        };
        for method in METHODS {
            for fast in [false, true] {
                let solved = row.solve(method, fast);
                let place = format!("{name}, {method:?}, fast {fast}");
                check_sane(&place, &solved);
                assert!(expected.contains(&solved.outcome[0]), "{place}: {:?}", solved.outcome[0]);
            }
        }
    }
}

#[test]
fn rows_that_do_not_fit_are_errors() {
    let row = facets(&reference_lights(), 10, 25);
    let signal: Vec<&[f32]> = row.signal.iter().map(Vec::as_slice).collect();
    let good = || RowInput {
        signal: &signal,
        field: row.field(),
        variance: &row.variance,
        noise_scale: None,
    };
    let check = |input: RowInput, width: usize, expected: &str| {
        let mut solved = Solved::new(width);
        let error = RowSolver::new().solve(&input, &mut solved.output(), Method::Auto).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert!(solved.outcome.iter().all(|&o| o == Outcome::Masked), "the output was touched");
    };
    check(good(), 9, "signal has 10 entries where 9");
    check(RowInput { signal: &signal[1..], ..good() }, 10, "list of signals has 9");
    check(RowInput { variance: &row.variance[1..], ..good() }, 10, "list of variances has 9");
    check(RowInput { noise_scale: Some(&[1.0]), ..good() }, 10, "noise scale has 1");
    check(
        RowInput { field: FieldRow { vectors: &row.field[1..], ..row.field() }, ..good() },
        10,
        "light field",
    );
    check(RowInput { field: FieldRow { lights: 2, ..row.field() }, ..good() }, 10, "2 lights");
    let mut nothing = Solved::new(0);
    let empty: Vec<&[f32]> = vec![&[]; 10];
    let input =
        RowInput { signal: &empty, field: FieldRow { vectors: &[], ..row.field() }, ..good() };
    assert_eq!(RowSolver::new().solve(&input, &mut nothing.output(), Method::Auto), Ok(()));
}
