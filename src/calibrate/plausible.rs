//! What no instrument measures: a calibration that says so is refused before it is written.

use super::CalibrateError;
use crate::instrument::CalibratedLight;
use nalgebra::Matrix3;
use std::path::Path;
use weavelight_calibration::board::CameraFit;
use weavelight_calibration::description::Light;
use weavelight_calibration::response::Response;

/// Black may be off from what the file states by this share of the range.
const BLACK_OFF: f64 = 0.1;
/// A sensor departs from proportionality by less than this; more is an exposure that is not what it says.
const BENT: f64 = 0.3;
/// A white LED gives no channel this many times more than another.
const UNBALANCED: f64 = 50.0;
/// No entry of a colour matrix is larger.
const LARGEST_ENTRY: f64 = 20.0;

/// A measured black level, which is no raw number below 0; `None` where it cannot be one.
pub(super) fn black(measured: f64, stated: f64, range: f64) -> Option<f64> {
    ((measured - stated).abs() <= BLACK_OFF * range).then_some(measured.max(0.0))
}

/// A response must rise, and about as the exposures do.
///
/// # Errors
/// Where it does not.
pub(super) fn check_response(place: &Path, response: &Response) -> Result<(), CalibrateError> {
    let slope = |x: f64| {
        let terms = response.coefficients.iter().enumerate().skip(1);
        terms.map(|(k, c)| k as f64 * c * x.powi(k as i32 - 1)).sum::<f64>()
    };
    let rises = (0..=50).all(|k| slope(f64::from(k) / 50.0) > 0.0);
    if rises && response.deviation <= BENT {
        return Ok(());
    }
    let what = format!(
        "the patches do not follow the exposures of their frames (they depart by {:.0} %)",
        100.0 * response.deviation
    );
    let remedy = "correct exposure_s and iso, and photograph again if a light flickered";
    Err(CalibrateError::target(place, what, remedy))
}

/// Gains R, G, B of one light.
///
/// # Errors
/// Where they are not those of a white light.
pub(super) fn check_white_balance(
    place: &Path,
    light: usize,
    gains: [f64; 3],
) -> Result<(), CalibrateError> {
    let good = |gain: &f64| (1.0 / UNBALANCED..=UNBALANCED).contains(gain);
    let Some(k) = gains.iter().position(|gain| !good(gain)) else { return Ok(()) };
    let what = format!(
        "light {light} gives {:.2e} times as much {} as green on the grey patches",
        gains[k].recip(),
        ["red", "green", "blue"][k]
    );
    let remedy = "check that the LED is white, that the patches are grey, and the frames' cfa";
    Err(CalibrateError::target(place, what, remedy))
}

/// Electrons per raw number, and read noise in electrons.
pub(super) fn is_noise((electrons_per_dn, read_noise_e): &(f64, f64)) -> bool {
    (1e-4..=1e5).contains(electrons_per_dn) && (0.0..=1e4).contains(read_noise_e)
}

/// Linear sRGB from camera RGB.
pub(super) fn is_matrix(matrix: &Matrix3<f64>) -> bool {
    matrix.iter().all(|entry| entry.abs() <= LARGEST_ENTRY)
}

/// A lens has a focal length of a twentieth to a hundred times the picture's longer side, and its axis meets the picture or
/// passes it by less than the picture's size.
///
/// # Errors
/// Where the fit says otherwise.
pub(super) fn check_camera(
    place: &Path,
    fit: &CameraFit,
    size: [usize; 2],
) -> Result<(), CalibrateError> {
    let [fx, fy, cx, cy] = fit.intrinsics;
    let [width, height] = size.map(|length| length as f64);
    let longer = width.max(height);
    let lens = [fx, fy].iter().all(|f| (0.05 * longer..=100.0 * longer).contains(f));
    let centre = (-width..=2.0 * width).contains(&cx) && (-height..=2.0 * height).contains(&cy);
    let bends = fit.distortion.iter().all(|c| c.abs() <= 1e4);
    let finite = fit.rms_px.is_finite() && fit.sigma.iter().all(|s| !s.is_infinite());
    if lens && centre && bends && finite && (fx / fy).ln().abs() < 0.5 {
        return Ok(());
    }
    let what = format!(
        "the camera fitted to these boards makes no sense (focal length {fx:.0} x {fy:.0} px, centre {cx:.0}, {cy:.0})"
    );
    let remedy = "photograph the board whole and sharp, tilted by 20 to 40 degrees in different directions, near the middle and the corners of the picture";
    Err(CalibrateError::target(place, what, remedy))
}

/// Intensities and gain maps must be positive numbers, positions numbers within a building.
///
/// # Errors
/// The first light of which they are not.
pub(super) fn check_lights(place: &Path, lights: &[CalibratedLight]) -> Result<(), CalibrateError> {
    let positive = |value: f64| (1e-9..=1e9).contains(&value);
    let good = |light: &CalibratedLight| {
        let gains = light.gain_map.iter().flat_map(|map| map.data.iter().flatten());
        let near = match &light.light {
            Light::Point(light) => {
                light.position_mm.iter().all(|c| c.abs() <= 1e5)
                    && light.exponent.is_finite()
                    && light.axis.iter().all(|c| c.is_finite())
            }
            Light::Directional(light) => light.direction.iter().all(|c| c.is_finite()),
        };
        light.light.intensity().iter().all(|i| positive(*i))
            && gains.into_iter().all(|gain| positive(f64::from(*gain)))
            && near
    };
    let Some(k) = lights.iter().position(|light| !good(light)) else { return Ok(()) };
    let what =
        format!("the fit of light {k} makes no sense: its strength or its place is no number");
    let remedy = "check its position in the rig file, and photograph the white sheets again";
    Err(CalibrateError::target(place, what, remedy))
}
