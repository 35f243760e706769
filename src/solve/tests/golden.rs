//! What the solve made of small scenes when its revision was raised last. A change that moves a number here must raise
//! [`REVISION`](crate::solve::current::REVISION), or solutions made before it pass for up to date.
//!
//! Kernels do the same operations in the same order on every processor; the tolerance is for mathematical functions of
//! other libraries and for the last bits of float64 sums.

use super::add_noise;
use super::scenes::{Recipe, scene};
use super::with_warnings;
use crate::photometry::Method;
use crate::raw::{Layout, Samples};
use crate::solution::{AlbedoKind, Outputs};
use crate::solve::current::REVISION;
use crate::solve::output::finish::{finish, undistort};
use crate::solve::*;
use std::fmt::Write;

const GOLDEN: &str = include_str!("golden.txt");
/// Relative to the sum of the values' sizes.
const TOLERANCE: f64 = 2e-6;

/// A scene with noise, highlights and shadows.
fn spoilt(recipe: Recipe, noise_known: bool) -> Scene {
    let mut made = scene(Recipe { width: 90, height: 60, ..recipe });
    add_noise(&mut made, 40_000.0 / 64_400.0);
    let channels = made.layout.channels();
    for (k, light) in made.lights.iter_mut().enumerate() {
        let Samples::U16(samples) = &mut light.exposures[0].frame.samples else { panic!() };
        let patch = |at: usize| (at / channels + 37 * k) % 211 < 9;
        for (_, sample) in samples.iter_mut().enumerate().filter(|(at, _)| patch(*at)) {
            *sample = if k % 2 == 0 {
                600 + sample.saturating_sub(600).min(4000) / 8
            } else {
                *sample / 2 + 20_000
            };
        }
    }
    if !noise_known {
        made.color.noise = None;
    }
    made
}

/// A mosaic of which a window of the colours' method is a part, with noise.
fn wide() -> Scene {
    let mut made = scene(Recipe { width: 160, height: 150, ..Recipe::default() });
    add_noise(&mut made, 40_000.0 / 64_400.0);
    made
}

/// Sums in which every photosite has a weight of its own, so that nothing cancels.
fn sums(values: impl Iterator<Item = f32>) -> [f64; 2] {
    let weighted =
        values.enumerate().map(|(k, v)| f64::from(v) * (0.5 + (k * 7919 % 1009) as f64 / 1009.0));
    weighted.fold([0.0; 2], |[sum, size], v| [sum + v, size + v.abs()])
}

fn lines() -> Vec<String> {
    let all = Recipe { gain_maps: true, ambient: true, bent_response: true, ..Recipe::default() };
    let scenes = [
        ("mosaic", spoilt(all, true)),
        ("mosaic, noise unknown", spoilt(Recipe::default(), false)),
        ("mosaic with windows", wide()),
        ("colour", spoilt(Recipe { layout: Layout::Rgb, seed: 3, ..all }, true)),
        ("grey, two exposures", spoilt(Recipe { layout: Layout::Grey, exposures: 2, ..all }, true)),
    ];
    let mut lines = vec![format!("revision {REVISION}")];
    for (name, scene) in &scenes {
        for method in [Method::LeastSquares, Method::Weighted, Method::Robust, Method::Auto] {
            let (maps, _) = with_warnings(scene, method).unwrap();
            let outcomes = maps.counts.outcomes.map(|count| count.to_string()).join(" ");
            let finished = finish(maps, &scene.color, Outputs::ALL, AlbedoKind::Reflectance);
            let flat = undistort(&finished, scene.camera.as_ref().unwrap());
            let mut line = format!("{name}, {}: {outcomes};", method.name());
            for maps in [&finished, &flat] {
                for [sum, size] in [
                    sums(maps.normal.data.iter().flatten().copied()),
                    sums(maps.albedo.data.iter().flatten().copied()),
                    sums(maps.shade.data.iter().copied()),
                    sums(maps.confidence.data.iter().copied()),
                ] {
                    let _ = write!(line, " {sum:.6}/{size:.6}");
                }
            }
            lines.push(line);
        }
    }
    lines
}

/// Whether two lines say the same within the tolerance.
fn same(found: &str, expected: &str) -> bool {
    let numbers = |line: &str| -> Vec<[f64; 2]> {
        let words = line.split_whitespace().filter_map(|word| word.split_once('/'));
        words.map(|(a, b)| [a, b].map(|number| number.parse().unwrap())).collect()
    };
    let head =
        |line: &str| line.split_once(';').map_or(line.to_owned(), |(head, _)| head.to_owned());
    let (a, b) = (numbers(found), numbers(expected));
    head(found) == head(expected)
        && a.len() == b.len()
        && a.iter().zip(&b).all(|(a, b)| (0..2).all(|k| (a[k] - b[k]).abs() <= TOLERANCE * b[1]))
}

#[test]
fn maps_change_with_the_revision_only() {
    let found = lines();
    let expected: Vec<&str> = GOLDEN.lines().collect();
    let equal =
        found.len() == expected.len() && found.iter().zip(&expected).all(|(a, b)| same(a, b));
    assert!(
        equal,
        "maps have changed: raise REVISION in src/solve/current.rs if it was not raised, say so in CHANGELOG.md, and put \
         these lines into src/solve/tests/golden.txt:\n{}\n",
        found.join("\n")
    );
}
