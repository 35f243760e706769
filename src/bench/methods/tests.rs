//! The estimators on photosites whose normal is known.

use super::photosite::{Estimator, Photosite};
use super::{cauchy, l1, sparse_bayesian, svd};
use crate::compare::angle_deg;
use nalgebra::Vector3;

/// What is wrong with the samples.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Clean,
    /// Shot and read noise of the reference sensor.
    Noisy,
    /// Noise, and so many samples in a shadow or a highlight.
    Spoilt(usize),
}

/// Uniform numbers (SplitMix64).
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Nearly normal: the sum of four.
    fn gauss(&mut self) -> f64 {
        (0..4).map(|_| self.between(-0.5, 0.5)).sum::<f64>() * 3.0_f64.sqrt()
    }

    /// A direction at most `most` from +z (measured as its sideways share).
    fn up(&mut self, most: f64) -> Vector3<f64> {
        let (x, y) = (self.between(-most, most), self.between(-most, most));
        Vector3::new(x, y, 1.0).normalize()
    }
}

/// Photosites of albedo 0.5 tilted up to 27 degrees, all lights in front of them, with their normals.
pub(super) fn photosites(
    count: usize,
    lights: usize,
    kind: Kind,
) -> Vec<(Photosite, Vector3<f64>)> {
    let mut random = Random(5);
    let mut one = || {
        let normal = random.up(0.35);
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let light = |i: usize| {
            let turn = golden * i as f64;
            let height = 0.75 + 0.2 * i as f64 / lights as f64;
            let side = (1.0 - height * height).sqrt();
            Vector3::new(side * turn.cos(), side * turn.sin(), height)
        };
        let mut site = Photosite {
            lights: (0..lights).map(light).collect(),
            y: Vec::new(),
            variance: vec![2e-5; lights],
        };
        for i in 0..lights {
            let clean = 0.5 * normal.dot(&site.lights[i]);
            let spoilt = matches!(kind, Kind::Spoilt(count) if (3 * i) % lights < count);
            let factor = match (spoilt, random.between(0.0, 1.0) < 0.5) {
                (false, _) => 1.0,
                (true, true) => random.between(0.0, 0.3),
                (true, false) => random.between(1.5, 4.0),
            };
            let noise = if matches!(kind, Kind::Clean) { 0.0 } else { random.gauss() };
            site.y.push(factor * clean + noise * (5e-5 * clean + 4e-8_f64).sqrt());
        }
        (site, normal)
    };
    (0..count).map(|_| one()).collect()
}

const ALL: [(&str, Estimator); 5] = [
    ("svd", svd::four_solves),
    ("l1", l1::least_absolute),
    ("cauchy", cauchy::cauchy),
    ("shadow test, cauchy", cauchy::shadow_test_then_cauchy),
    ("sparse Bayesian", sparse_bayesian::sparse_bayesian),
];

fn mean_error_deg(estimator: Estimator, lights: usize, kind: Kind) -> f64 {
    let sites = photosites(400, lights, kind);
    let error = |(site, normal): &(Photosite, Vector3<f64>)| {
        estimator(site).map_or(90.0, |g| angle_deg(g.into(), (*normal).into()))
    };
    sites.iter().map(error).sum::<f64>() / sites.len() as f64
}

#[test]
fn without_noise_the_normal_comes_back() {
    for (name, estimator) in ALL {
        for lights in [3, 4, 10, 33] {
            let error = mean_error_deg(estimator, lights, Kind::Clean);
            assert!(error < 1e-3, "{name}, {lights} lights: {error} degrees");
        }
    }
}

/// Who stands how many spoilt samples of ten, relative to least squares on clean ones;
/// bounds with room for the layout of the lights.
#[test]
fn robust_estimators_stand_what_they_should() {
    let check = |name: &str, kind: Kind, most: f64| {
        let estimator = ALL.iter().find(|(other, _)| *other == name).unwrap().1;
        let clean = mean_error_deg(svd::four_solves, 10, Kind::Noisy);
        let error = mean_error_deg(estimator, 10, kind);
        assert!(error <= most * clean, "{name}, {kind:?}: {error} against {clean} degrees");
    };
    for (name, _) in ALL {
        check(name, Kind::Noisy, 1.4);
    }
    check("l1", Kind::Spoilt(1), 2.0);
    check("cauchy", Kind::Spoilt(1), 2.0);
    check("sparse Bayesian", Kind::Spoilt(1), 2.0);
    check("sparse Bayesian", Kind::Spoilt(2), 2.0);
}

#[test]
fn least_squares_does_not_stand_a_shadow() {
    let (clean, spoilt) = [Kind::Noisy, Kind::Spoilt(1)]
        .map(|kind| mean_error_deg(svd::four_solves, 10, kind))
        .into();
    assert!(spoilt > 5.0 * clean, "{spoilt} against {clean} degrees");
}

#[test]
fn degenerate_photosites_give_nothing_or_something_finite() {
    let up = Vector3::new(0.0, 0.0, 1.0);
    let flat = |i: usize| Vector3::new((i as f64).cos(), 0.0, 1.0);
    let round = |i: usize| Vector3::new((2.0 * i as f64).cos(), (2.0 * i as f64).sin(), 1.0);
    let check = |what: &str, light: &dyn Fn(usize) -> Vector3<f64>, y: &dyn Fn(usize) -> f64| {
        for (name, estimator) in ALL {
            for n in [3, 4, 10, 64] {
                let site = Photosite {
                    lights: (0..n).map(light).collect(),
                    y: (0..n).map(y).collect(),
                    variance: vec![0.0; n],
                };
                let found = estimator(&site);
                let finite = found.is_none_or(|g| g.iter().all(|c| c.is_finite()));
                assert!(finite, "{name}, {what}, {n} lights: {found:?}");
            }
        }
    };
    check("one light again and again", &|_| up, &|_| 0.5);
    check("lights in a plane", &flat, &|_| 0.5);
    check("no light comes back", &round, &|_| 0.0);
    check("a single bright sample", &round, &|i| if i == 1 { 1.0 } else { 0.0 });
    check("negative samples", &round, &|_| -1e-3);
    check("huge samples", &round, &|i| 1e150 * (1 + i % 3) as f64);
}
