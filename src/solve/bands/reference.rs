//! The plain solution of one pixel, in float64, with every quantity evaluated exactly where the pixel looks: what the fast
//! run is measured against.

use crate::linear::{Exposure, GREY, Reading, intensity_of_places};
use crate::photometry::{Pixel, Samples, VarianceModel, solve_pixel};
use crate::raw::Layout;
use crate::solve::bands::Run;
use crate::solve::scene::Scene;
use weavelight_calibration::gain::gain_at;

/// Solves pixel (x, y) of a run by the book: no grid, no float32, no shared work.
pub(crate) fn solve_exactly(run: &Run, x: usize, y: usize) -> Option<Pixel> {
    let scene = run.scene();
    let lights = run.field().exact([x as f64, y as f64])?;
    let place = (y & 1) * 2 + (x & 1);
    let signals: Vec<(f64, VarianceModel)> =
        (0..scene.lights.len()).map(|light| signal(run, light, x, y, place)).collect();
    let (y_of_lights, variance): (Vec<f64>, Vec<VarianceModel>) = signals.into_iter().unzip();
    let noise_scale = noise_scale(scene, x, y);
    Some(solve_pixel(
        &Samples { lights: &lights, y: &y_of_lights, variance: &variance, noise_scale },
        run.method(),
    ))
}

/// Normalised signal of one light, and its variance.
pub(crate) fn signal(
    run: &Run,
    light: usize,
    x: usize,
    y: usize,
    place: usize,
) -> (f64, VarianceModel) {
    let scene = run.scene();
    let channels = scene.layout.channels();
    let exposures = &scene.lights[light].exposures;
    let defective = scene.defects.columns(y, x).next() == Some(x);
    let usable = |e: &usize| {
        !defective
            && (0..channels)
                .all(|c| !Reading::new(&exposures[*e].frame, &scene.color).at(x, y, c).is_nan())
    };
    let used: Vec<usize> = (0..exposures.len()).filter(usable).collect();
    let bits = used.iter().fold(0_u64, |bits, e| bits | 1 << e);
    let value = |channel: usize| channel_signal(run, light, &used, (x, y, channel), place);
    let y_of_light = match scene.layout {
        Layout::Rgb => (0..3).map(|c| f64::from(GREY[c]) * value(c)).sum(),
        _ => value(0),
    };
    let variance = run.variance_of(light, place, if used.is_empty() { u64::MAX } else { bits });
    (y_of_light, variance)
}

fn channel_signal(
    run: &Run,
    light: usize,
    used: &[usize],
    (x, y, channel): (usize, usize, usize),
    place: usize,
) -> f64 {
    let scene = run.scene();
    let photographed = &scene.lights[light];
    let intensity =
        intensity_of_places(scene.layout, channel, photographed.calibrated.light.intensity())
            [place];
    let (mut sum, mut total) = (0.0, 0.0);
    for &e in used {
        let exposure = &photographed.exposures[e];
        let linear = Reading::new(&exposure.frame, &scene.color).at(x, y, channel);
        let weight = run.weight(light, e);
        sum += weight * linear / (exposure.seconds_at_iso_100() * intensity);
        total += weight;
    }
    let gain = photographed.calibrated.gain_map.as_ref().map_or(1.0, |map| {
        gain_at(map, (scene.width, scene.height), [x as f64, y as f64])
            [channel_of(scene.layout, channel, x, y)]
    });
    (sum / total - ambient_rate(scene, x, y, channel) / intensity) / gain
}

fn ambient_rate(scene: &Scene, x: usize, y: usize, channel: usize) -> f64 {
    let seconds: f64 = scene.ambient.iter().map(|e| e.seconds_at_iso_100()).sum();
    let light = |e: &Exposure| Reading::new(&e.frame, &scene.color).at(x, y, channel);
    if seconds > 0.0 { scene.ambient.iter().map(light).sum::<f64>() / seconds } else { 0.0 }
}

fn channel_of(layout: Layout, channel: usize, x: usize, y: usize) -> usize {
    match layout {
        Layout::Mosaic(cfa) => cfa.channel(x, y) as usize,
        Layout::Grey => 1,
        Layout::Rgb => channel,
    }
}

fn noise_scale(scene: &Scene, x: usize, y: usize) -> f64 {
    let channels = scene.layout.channels();
    let gains = scene.lights.iter().flat_map(|light| {
        (0..channels).map(move |channel| match &light.calibrated.gain_map {
            Some(map) => gain_at(map, (scene.width, scene.height), [x as f64, y as f64])
                [channel_of(scene.layout, channel, x, y)],
            None => 1.0,
        })
    });
    (scene.lights.len() * channels) as f64 / gains.sum::<f64>()
}
