//! Whether a light that was photographed twice stayed the same.

use crate::linear::{Exposure, Reading};
use crate::solve::scene::Scene;
use crate::solve::screen::copies::{is_same_picture, name};

/// Change of a light during the capture session that costs 0.1 degrees.
const TOLERATED: f64 = 0.003;
/// Samples darker than this share of full scale say nothing about a light.
const DARK: f64 = 0.02;
/// Compared photosites along each side of the frame.
const SAMPLES: usize = 200;

/// Compares every drift-check frame with the light's frame in the solve.
pub(crate) fn drift_warnings(scene: &Scene, drift: &[(Option<usize>, Exposure)]) -> Vec<String> {
    drift.iter().filter_map(|(light, repeated)| drift_warning(scene, *light, repeated)).collect()
}

fn drift_warning(scene: &Scene, light: Option<usize>, repeated: &Exposure) -> Option<String> {
    let original = scene.exposures().find(|taken| is_same_picture(&taken.frame, &repeated.frame));
    if let Some(original) = original {
        return Some(format!(
            "{} is a copy of {}, the same picture: it cannot show whether a light drifted; take it again.",
            name(repeated),
            name(original)
        ));
    }
    let light = light?;
    let first = scene.lights.iter().find(|photographed| photographed.index == light)?;
    let apart = |e: &&Exposure| (e.seconds_at_iso_100() / repeated.seconds_at_iso_100()).ln().abs();
    let first = first.exposures.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
    let change = median_ratio(scene, first, repeated)? - 1.0;
    (change.abs() > TOLERATED).then(|| {
        format!(
            "Light {light} changed by {:.1} % between {} and {}; let the LEDs warm up, or shorten the capture session.",
            100.0 * change,
            name(first),
            name(repeated)
        )
    })
}

/// Median over the frame of the second exposure's light relative to the first's; `None` where too little is bright.
fn median_ratio(scene: &Scene, first: &Exposure, second: &Exposure) -> Option<f64> {
    if (second.frame.width, second.frame.height, second.frame.layout)
        != (scene.width, scene.height, scene.layout)
    {
        return None;
    }
    let (a, b) =
        (Reading::new(&first.frame, &scene.color), Reading::new(&second.frame, &scene.color));
    let mut ratios = vec![];
    for y in places(scene.height) {
        for x in places(scene.width) {
            let (before, after) = (a.at(x, y, 0), b.at(x, y, 0));
            if before > DARK && after > DARK {
                ratios.push(
                    after / second.seconds_at_iso_100() / (before / first.seconds_at_iso_100()),
                );
            }
        }
    }
    if ratios.len() < 20 {
        return None;
    }
    let middle = ratios.len() / 2;
    Some(*ratios.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn places(length: usize) -> impl Iterator<Item = usize> {
    // An odd step visits every filter of the mosaic.
    (0..length).step_by((length / SAMPLES) | 1)
}
