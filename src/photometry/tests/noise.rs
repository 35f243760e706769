//! The noise model from residuals.

use super::scene::{Random, Scene, reference_lights, reference_noise, tilted};
use crate::photometry::{NoiseEvidence, NoiseSample, VarianceModel, estimate_noise};
use nalgebra::Vector3;

const UNIT: VarianceModel = VarianceModel { shot: 1.0, floor: 1.0, kappa: 1.0 };

/// The row's next and next but one photosites of a colour stand for the four neighbours of a picture.
fn evidence(scene: &Scene) -> Vec<NoiseEvidence> {
    let variance = vec![UNIT; scene.lights];
    let width = scene.signal[0].len();
    let of_column = |column: usize| {
        let at = |column: usize| {
            scene.signal.iter().map(|row| f64::from(row[column])).collect::<Vec<_>>()
        };
        let (signal, mut difference) = (at(column), at(column));
        difference.iter_mut().for_each(|y| *y *= 4.0);
        for neighbour in [column - 4, column - 2, column + 2, column + 4] {
            difference.iter_mut().zip(at(neighbour)).for_each(|(sum, y)| *sum -= y);
        }
        let field = scene.field();
        let vectors: Vec<Vector3<f64>> = (0..scene.lights).map(|i| field.at(column, i)).collect();
        NoiseEvidence::of(&NoiseSample {
            vectors: &vectors,
            signal: &signal,
            difference: &difference,
            variance: &variance,
            noise_scale: 1.0,
        })
    };
    (4..width - 4).filter_map(of_column).collect()
}

fn estimate(scene: &Scene) -> Option<VarianceModel> {
    estimate_noise(evidence(scene), scene.lights)
}

/// However the photosites come, the answer is the same to the last bit.
#[test]
fn the_order_of_the_photosites_does_not_matter() {
    let scene = scene(reference_noise(), 0.3);
    let mut evidence = evidence(&scene);
    let expected = estimate_noise(evidence.clone(), scene.lights);
    evidence.reverse();
    assert_eq!(estimate_noise(evidence.clone(), scene.lights), expected);
    evidence.rotate_left(1234);
    assert_eq!(estimate_noise(evidence, scene.lights), expected);
}

/// Facets 40 columns wide, with `noise`; the surface is glossy where `gloss` says so.
fn scene(noise: VarianceModel, gloss: f64) -> Scene {
    let mut random = Random::new(11);
    let mut facet = (tilted(&mut random, 0.0), 0.5);
    let mut scene = Scene::new(&reference_lights(), 8000, 64, |column| {
        if column % 40 == 0 {
            let tilt = random.between(0.0, 30.0);
            facet = (tilted(&mut random, tilt), 10_f64.powf(random.between(-1.7, 0.0)));
        }
        facet
    });
    for signal in &mut scene.signal {
        for facet in signal.chunks_mut(40) {
            let factor = 1.0 + gloss * random.between(0.0, 1.0).powi(4);
            facet.iter_mut().for_each(|y| *y *= factor as f32);
        }
    }
    scene.variance = vec![[noise; 2]; scene.lights];
    scene.add_noise(&mut random);
    scene
}

#[test]
fn noise_is_found_again() {
    let reference = reference_noise();
    let coarse =
        VarianceModel { shot: 10.0 * reference.shot, floor: 100.0 * reference.floor, kappa: 0.0 };
    for (name, truth) in [("reference", reference), ("coarse", coarse)] {
        for gloss in [0.0, 0.5] {
            let found = estimate(&scene(truth, gloss)).unwrap();
            let place = format!("{name}, gloss {gloss}: {found:?}, truth {truth:?}");
            println!("{place}");
            for level in [0.02, 0.1, 0.5] {
                let deviation = |m: &VarianceModel| (m.shot * level + m.floor).sqrt();
                let ratio = deviation(&found) / deviation(&truth);
                assert!((0.9..1.15).contains(&ratio), "{place}: {ratio} at {level}");
            }
            // Without gloss kappa is only what the estimate of the noise misses: a twentieth of its variance.
            let variance = f64::from(truth.shot) * 0.5 + f64::from(truth.floor);
            let most_kappa = if gloss == 0.0 { (variance / 20.0).sqrt() / 0.5 } else { 0.02 };
            assert!(f64::from(found.kappa) <= 1.0001 * most_kappa, "{place}");
        }
    }
}

#[test]
fn what_neighbours_share_is_kappa() {
    let mut shared = scene(VarianceModel::default(), 0.0);
    let mut random = Random::new(12);
    for signal in &mut shared.signal {
        for facet in signal.chunks_mut(40) {
            let factor = 1.0 + 0.01 * random.gauss();
            facet.iter_mut().for_each(|y| *y *= factor as f32);
        }
    }
    let found = estimate(&shared).unwrap();
    assert!((0.008..0.012).contains(&found.kappa), "{found:?}");
}

#[test]
fn too_little_tells_nothing() {
    let mut few = scene(reference_noise(), 0.0);
    for signal in &mut few.signal {
        signal[100..].fill(f32::NAN);
    }
    assert_eq!(estimate(&few), None);
    let three = Scene::new(&reference_lights()[..3], 2000, 64, |_| (nalgebra::Vector3::z(), 0.5));
    assert_eq!(estimate(&three), None);
}
