//! Frames that add nothing: the same picture twice, and pictures that clip wherever anybody looks.

use super::scene::{Exposure, PhotographedLight, Scene};
use super::sensor::Reading;
use weavelight_calibration::description::Image;

/// The fewest lights that can be solved.
const LEAST_LIGHTS: usize = 3;

/// Leaves out repeated and wholly clipped frames, and lights of which nothing remains as long as three do; a sentence for
/// each. Maps do not change by it, but that a picture counted twice would seem to be calmer than it is.
pub(crate) fn leave_out_idle_frames(scene: &mut Scene) -> Vec<String> {
    let mut warnings = vec![];
    for light in &mut scene.lights {
        warnings.extend(forget_repeated(light));
    }
    let idle: Vec<Vec<bool>> = scene
        .lights
        .iter()
        .map(|light| light.exposures.iter().map(|e| clips_everywhere(scene, e)).collect())
        .collect();
    for (light, idle) in scene.lights.iter_mut().zip(&idle) {
        // A light of which nothing would remain goes as a whole, or not at all.
        if idle.contains(&false) {
            let mut clipped = idle.iter();
            light.exposures.retain(|exposure| {
                let clips = clipped.next() == Some(&true);
                warnings.extend(clips.then(|| clipped_sentence(light.index, exposure)));
                !clips
            });
        }
    }
    let whole: Vec<bool> = idle.iter().map(|idle| !idle.contains(&false)).collect();
    forget_lights(scene, &whole, &mut warnings);
    warnings
}

fn name(exposure: &Exposure) -> String {
    exposure.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn clipped_sentence(light: usize, exposure: &Exposure) -> String {
    format!("Light {light}: {} is clipped everywhere and was left out.", name(exposure))
}

/// Frames of one light with the same samples at the same exposure: copies, as no two pictures have the same noise.
fn forget_repeated(light: &mut PhotographedLight) -> Vec<String> {
    let mut warnings = vec![];
    let mut kept: Vec<Exposure> = Vec::with_capacity(light.exposures.len());
    for exposure in light.exposures.drain(..) {
        let same = |other: &&Exposure| {
            other.seconds_at_iso_100() == exposure.seconds_at_iso_100()
                && other.frame.samples == exposure.frame.samples
        };
        match kept.iter().find(same) {
            Some(other) => warnings.push(format!(
                "Light {}: {} is a copy of {} and was left out.",
                light.index,
                name(&exposure),
                name(other)
            )),
            None => kept.push(exposure),
        }
    }
    light.exposures = kept;
    warnings
}

/// Whether no photosite of the swatch has a usable sample. Stops at the first that has one.
fn clips_everywhere(scene: &Scene, exposure: &Exposure) -> bool {
    let reading = Reading::new(&exposure.frame, &scene.color);
    let usable = |x: usize, y: usize| {
        (0..scene.layout.channels()).all(|channel| reading.exact(x, y, channel).is_finite())
    };
    let inside =
        |x: usize, y: usize| scene.mask.as_ref().is_none_or(|mask: &Image<bool>| *mask.at(x, y));
    !(0..scene.height).any(|y| (0..scene.width).any(|x| inside(x, y) && usable(x, y)))
}

fn forget_lights(scene: &mut Scene, idle: &[bool], warnings: &mut Vec<String>) {
    let mut left = scene.lights.len();
    let mut idle = idle.iter();
    scene.lights.retain(|light| {
        if idle.next() != Some(&true) {
            return true;
        }
        let needed = left <= LEAST_LIGHTS;
        left -= usize::from(!needed);
        let fate = if needed { "; expose it shorter" } else { " and was left out" };
        warnings.push(format!("Light {} is clipped everywhere{fate}.", light.index));
        needed
    });
}
