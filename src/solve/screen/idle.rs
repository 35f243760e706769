//! Frames that add nothing: the same picture twice, pictures without light, and pictures that clip wherever anybody looks.

use crate::linear::{Exposure, Reading};
use crate::solve::error::SolveError;
use crate::solve::scene::Scene;
use crate::solve::screen::copies::{leave_out_copies, name};
use crate::solve::screen::dark::leave_out_dark_lights;
use crate::solve::words::few;
use weavelight_calibration::description::Image;

/// The fewest lights that can be solved.
const LEAST_LIGHTS: usize = 3;

/// Leaves out copies, dark lights and wholly clipped frames, and lights of which nothing remains; a sentence for each.
///
/// # Errors
/// Where fewer than three lights remain.
pub(crate) fn leave_out_idle_frames(scene: &mut Scene) -> Result<Vec<String>, SolveError> {
    let mut warnings = leave_out_copies(scene)?;
    warnings.extend(leave_out_dark_lights(scene)?);
    warnings.extend(leave_out_clipped(scene)?);
    Ok(warnings)
}

fn leave_out_clipped(scene: &mut Scene) -> Result<Vec<String>, SolveError> {
    let mut warnings = vec![];
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
    warnings.extend(forget_lights(scene, &whole)?);
    Ok(warnings)
}

fn clipped_sentence(light: usize, exposure: &Exposure) -> String {
    format!("Light {light}: {} is clipped everywhere and was left out.", name(exposure))
}

/// Whether no photosite of the swatch has a usable sample. Stops at the first that has one.
fn clips_everywhere(scene: &Scene, exposure: &Exposure) -> bool {
    let reading = Reading::new(&exposure.frame, &scene.color);
    let usable = |x: usize, y: usize| {
        (0..scene.layout.channels()).all(|channel| reading.at(x, y, channel).is_finite())
    };
    let inside =
        |x: usize, y: usize| scene.mask.as_ref().is_none_or(|mask: &Image<bool>| *mask.at(x, y));
    !(0..scene.height).any(|y| (0..scene.width).any(|x| inside(x, y) && usable(x, y)))
}

fn forget_lights(scene: &mut Scene, idle: &[bool]) -> Result<Vec<String>, SolveError> {
    let lights = scene.lights.iter().zip(idle).filter(|(_, idle)| **idle);
    let clipped: Vec<String> = lights.map(|(light, _)| light.index.to_string()).collect();
    if !clipped.is_empty() && scene.lights.len() - clipped.len() < LEAST_LIGHTS {
        let are = if clipped.len() == 1 { ("light", "is") } else { ("lights", "are") };
        return Err(SolveError::Clipped {
            session: scene.origin.session.clone(),
            what: format!("{} {} {}", are.0, few(clipped), are.1),
        });
    }
    let mut idle = idle.iter();
    scene.lights.retain(|_| idle.next() != Some(&true));
    Ok(clipped
        .iter()
        .map(|light| format!("Light {light} is clipped everywhere and was left out."))
        .collect())
}
