//! Whether frames, lights and camera belong together and say enough.

use crate::instrument::{CAMERA_FILE, LIGHTS_FILE};
use crate::linear::{Exposure, Reading, intensity_of_places};
use crate::raw::{Frame, Layout};
use crate::solve::SolveError;
use crate::solve::light_field::LightField;
use crate::solve::scene::Scene;
use crate::solve::words::{few, in_words};
use nalgebra::{DMatrix, Vector3};

/// From here on the light vectors are taken to lie in a plane: noise grows by this factor.
const DEPENDENT_CONDITION: f64 = 5e3;
/// Places along each side of the frame at which lights are seen to stand above the plane.
const PLACES: usize = 9;
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

fn check_range(scene: &Scene, exposure: &Exposure) -> Result<(), SolveError> {
    let levels = Reading::new(&exposure.frame, &scene.color).levels();
    let wrong =
        levels.into_iter().find(|(black, saturation)| black.is_nan() || black >= saturation);
    let Some((black, saturation)) = wrong else { return Ok(()) };
    Err(SolveError::NoRange { path: exposure.path.clone(), black, saturation })
}

fn check_camera(scene: &Scene, first: &Exposure) -> Result<(), SolveError> {
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
    let mut warnings = lights_below(scene, field)?;
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
        let names: Vec<String> = scene.lights.iter().map(|light| light.index.to_string()).collect();
        warnings.push(format!(
            "The vectors of lights {} nearly lie in one plane (condition number {worst:.0}): expect normals with about {:.0} \
             times the noise across that plane; spread the lights out.",
            few(names),
            worst / 2.0
        ));
    }
    Ok(warnings)
}

/// Lights that stand at or below the plane at part of the frame; these and spots that point away give no light there.
///
/// # Errors
/// Where three lights that stand above it are nowhere to be found.
fn lights_below(scene: &Scene, field: &LightField) -> Result<Vec<String>, SolveError> {
    let (width, height) = scene.size_px();
    let shares = (0..PLACES).map(|k| k as f64 / (PLACES - 1) as f64);
    let places = shares.clone().flat_map(|y| {
        shares.clone().map(move |x| [x * (width - 1) as f64, y * (height - 1) as f64])
    });
    let (mut below, mut all, mut most_above) = (vec![0; scene.lights.len()], 0, 0);
    for vectors in places.filter_map(|pixel| field.exact(pixel)) {
        let above = |vector: &Vector3<f64>| vector.dot(scene.plane.normal.as_ref()) > 0.0;
        below.iter_mut().zip(&vectors).for_each(|(count, v)| *count += usize::from(!above(v)));
        most_above = most_above.max(vectors.iter().filter(|v| above(v)).count());
        all += 1;
    }
    let name = |k: usize| scene.lights[k].index.to_string();
    let low: Vec<usize> = (0..below.len()).filter(|&k| below[k] > 0).collect();
    if most_above < 3 && all > 0 {
        let names = few(low.iter().map(|&k| name(k)).collect());
        return Err(SolveError::DependentLights {
            calibration: scene.origin.calibration.clone(),
            what: format!("lights {names} stand at or below the plane of the swatch"),
        });
    }
    let sentence = |&k: &usize| {
        let (percent, light) = (100.0 * below[k] as f64 / all as f64, name(k));
        if below[k] == all {
            return format!(
                "Light {light} is behind the surface everywhere in the frame: correct its place in lights.toml, or [plane] in session.toml."
            );
        }
        format!(
            "Light {light} stands at or below the plane of the swatch, or points away from it, over {percent:.0} % of the frame, where it adds nothing; check lights.toml and [plane]."
        )
    };
    Ok(low.iter().map(sentence).collect())
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
