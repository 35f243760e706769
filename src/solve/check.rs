//! Whether frames, lights and camera belong together and say enough.

use super::SolveError;
use super::field::LightField;
use super::scene::Scene;
use super::sensor::{Reading, intensity_of_places};
use crate::instrument::{CAMERA_FILE, LIGHTS_FILE};
use crate::raw::{Frame, Layout};
use nalgebra::{DMatrix, Vector3};

/// From here on the light vectors are taken to lie in a plane: noise grows by this factor.
const DEPENDENT_CONDITION: f64 = 5e3;
/// From here on a warning is due (a ring of lights at 80 degrees of elevation has 8).
const POOR_CONDITION: f64 = 50.0;

/// Sees that every frame has the same size, layout and a usable range, that they fit the camera and the mask, and that
/// every light has an intensity in every channel.
pub(crate) fn check_frames(scene: &Scene) -> Result<(), SolveError> {
    let mut exposures = scene.exposures();
    let Some(first) = exposures.next() else { return too_few(scene) };
    if let Some(other) = exposures.find(|e| shape(&e.frame) != shape(&first.frame)) {
        return Err(SolveError::DifferentFrames {
            a: first.path.clone(),
            a_is: describe(first.frame.width, first.frame.height, first.frame.layout),
            b: other.path.clone(),
            b_is: describe(other.frame.width, other.frame.height, other.frame.layout),
        });
    }
    for exposure in scene.exposures() {
        check_range(scene, exposure)?;
    }
    check_camera(scene, first)?;
    check_intensities(scene)
}

fn shape(frame: &Frame) -> (usize, usize, Layout) {
    (frame.width, frame.height, frame.layout)
}

/// "4928 x 3264 RGGB mosaic", for messages.
pub(crate) fn describe(width: usize, height: usize, layout: Layout) -> String {
    let layout = match layout {
        Layout::Mosaic(cfa) => format!("{} mosaic", cfa.name()),
        Layout::Grey => "grey".to_owned(),
        Layout::Rgb => "RGB".to_owned(),
    };
    format!("{width} x {height} {layout}")
}

fn too_few(scene: &Scene) -> Result<(), SolveError> {
    Err(SolveError::TooFewLights {
        session: scene.origin.session.clone(),
        found: scene.lights.len(),
    })
}

fn check_range(scene: &Scene, exposure: &super::Exposure) -> Result<(), SolveError> {
    let levels = Reading::new(&exposure.frame, &scene.color).levels();
    let wrong =
        levels.into_iter().find(|(black, saturation)| black.is_nan() || black >= saturation);
    let Some((black, saturation)) = wrong else { return Ok(()) };
    Err(SolveError::NoRange { path: exposure.path.clone(), black, saturation })
}

fn check_camera(scene: &Scene, first: &super::Exposure) -> Result<(), SolveError> {
    let size = |width, height| format!("{width} x {height}");
    match &scene.camera {
        Some(camera) if (camera.width_px, camera.height_px) != scene.size_px() => {
            Err(SolveError::OtherCamera {
                path: first.path.clone(),
                frame: size(scene.width, scene.height),
                calibration: scene.origin.calibration.join(CAMERA_FILE),
                camera: size(camera.width_px, camera.height_px),
            })
        }
        _ => Ok(()),
    }
}

fn check_intensities(scene: &Scene) -> Result<(), SolveError> {
    for light in &scene.lights {
        let intensity = light.calibrated.light.intensity();
        let usable = |channel| {
            intensity_of_places(scene.layout, channel, intensity).iter().all(|&i| i > 0.0)
        };
        if !(0..scene.layout.channels()).all(usable) {
            let channel = intensity.iter().position(|&i| i.is_nan() || i <= 0.0).unwrap_or(0);
            return Err(SolveError::DarkChannel {
                path: scene.origin.calibration.join(LIGHTS_FILE),
                light: light.index,
                channel: ['R', 'G', 'B'][channel],
            });
        }
    }
    Ok(())
}

/// Sees that the light vectors span a volume; a warning where they barely do.
///
/// Looks at nine places of the frame: near lights may lie in a plane through one of them by accident.
pub(crate) fn check_light_field(
    scene: &Scene,
    field: &LightField,
) -> Result<Vec<String>, SolveError> {
    if scene.lights.len() < 3 {
        return too_few(scene).map(|()| vec![]);
    }
    let places = nine_places(scene.size_px());
    let vectors: Vec<Vec<Vector3<f64>>> =
        places.iter().filter_map(|&pixel| field.exact(pixel)).collect();
    let mut warnings = behind_the_surface(scene, &vectors);
    let conditions: Vec<f64> = vectors.iter().map(|vectors| condition(vectors)).collect();
    let best = conditions.iter().copied().fold(f64::INFINITY, f64::min);
    let worst = conditions.iter().copied().fold(0.0, f64::max);
    if best >= DEPENDENT_CONDITION {
        let middle = field.exact(places[4]).unwrap_or_default();
        return Err(SolveError::DependentLights {
            calibration: scene.origin.calibration.clone(),
            what: name_dependence(scene, &middle),
        });
    }
    if worst > POOR_CONDITION {
        warnings.push(poor(worst));
    }
    Ok(warnings)
}

fn poor(worst: f64) -> String {
    format!(
        "The light vectors nearly lie in one plane (condition number {worst:.0}): expect normals with about {:.0} times the \
         noise across that plane; spread the lights out.",
        worst / 2.0
    )
}

/// Lights that shine on the back of the surface, wherever in the frame: a sheet is tilted away from them, or their place is
/// wrong.
fn behind_the_surface(scene: &Scene, places: &[Vec<Vector3<f64>>]) -> Vec<String> {
    let behind = |k: usize| places.iter().all(|vectors| scene.plane.normal.dot(&vectors[k]) <= 0.0);
    let lights = (0..scene.lights.len()).filter(|k| !places.is_empty() && behind(*k));
    let warn = |k: usize| {
        format!(
            "Light {} is behind the surface everywhere in the frame: correct its place in lights.toml, or [plane] in \
             session.toml.",
            scene.lights[k].index
        )
    };
    lights.map(warn).collect()
}

fn nine_places((width, height): (usize, usize)) -> Vec<[f64; 2]> {
    let part = |length: usize, share: f64| (length - 1) as f64 * share;
    let shares = [0.1, 0.5, 0.9];
    shares.iter().flat_map(|&y| shares.map(|x| [part(width, x), part(height, y)])).collect()
}

/// Largest over smallest singular value of the light vectors as rows of a matrix; infinite where they span less.
pub(crate) fn condition(vectors: &[Vector3<f64>]) -> f64 {
    let matrix = DMatrix::from_fn(vectors.len().max(3), 3, |row, axis| {
        vectors.get(row).map_or(0.0, |v| v[axis])
    });
    let values = matrix.singular_values();
    let (largest, smallest) = (values.max(), values.min());
    // Below the rounding of float64 there is nothing left.
    if smallest <= largest * 1e-15 || !largest.is_finite() {
        f64::INFINITY
    } else {
        largest / smallest
    }
}

/// "lights 1 and 3 are in the same direction" or "lights 0, 1 and 2 lie in one plane through the swatch".
fn name_dependence(scene: &Scene, vectors: &[Vector3<f64>]) -> String {
    let index = |k: usize| scene.lights[k].index;
    let same = |a: usize, b: usize| {
        let (a, b) = (vectors[a], vectors[b]);
        a.cross(&b).norm() <= 1e-6 * a.norm() * b.norm() && a.dot(&b) > 0.0
    };
    let pairs = (0..vectors.len()).flat_map(|a| (a + 1..vectors.len()).map(move |b| (a, b)));
    let twins: Vec<_> = pairs.filter(|&(a, b)| same(a, b)).collect();
    match twins.as_slice() {
        [] => {
            let names: Vec<String> = (0..vectors.len()).map(|k| index(k).to_string()).collect();
            format!("lights {} lie in one plane through the swatch", in_words(&names))
        }
        [(a, b), ..] => format!("lights {} and {} are in the same direction", index(*a), index(*b)),
    }
}

/// "1, 2 and 3".
pub(crate) fn in_words(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
