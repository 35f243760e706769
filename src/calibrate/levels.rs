//! How bright pictures of targets must be before anything else is asked of them.

use super::CalibrateError;
use std::path::{Path, PathBuf};

/// Share of full scale that the brightest part of the brightest picture must reach: ten times a sensor's read noise.
const DARK: f64 = 3e-3;
/// A signal below this share of full scale says little about an exposure.
pub(super) const LEAST_SIGNAL: f64 = 5e-3;
/// Frames of one light at several exposures may disagree about its strength by this factor: drift, a bent response.
const AGREE: f64 = 1.3;

/// The pictures must not all be dark.
///
/// `brightest`: the brightest light's share of full scale, ambient light removed; `ambient`: that of the ambient frame.
///
/// # Errors
/// Where they are.
pub(super) fn check_lit(place: &Path, brightest: f64, ambient: f64) -> Result<(), CalibrateError> {
    // Also where nothing is a number.
    if brightest > DARK {
        return Ok(());
    }
    let percent = 100.0 * brightest.max(0.0);
    if ambient > DARK {
        let what = format!(
            "the ambient frame reaches {:.1} % of full scale, and the lights add {percent:.1} % at most",
            100.0 * ambient
        );
        let remedy = "check that the lights switch on, darken the room, and photograph it again";
        return Err(CalibrateError::target(place, what, remedy));
    }
    let what = format!("all pictures are dark: the brightest reaches {percent:.2} % of full scale");
    let remedy = "take the lens cap off, check that the lights switch on, expose to 50-90 % of full scale, and photograph it again";
    Err(CalibrateError::target(place, what, remedy))
}

/// Two frames of one light: `stated` is how many times longer the second was exposed, `rate` how many times brighter the
/// light then seems per second.
///
/// # Errors
/// Where the exposures cannot be true.
pub(super) fn check_agree(
    place: &Path,
    [first, second]: [&PathBuf; 2],
    stated: f64,
    rate: f64,
) -> Result<(), CalibrateError> {
    if (1.0 / AGREE..AGREE).contains(&rate) {
        return Ok(());
    }
    let what = format!(
        "{} is stated to be exposed {stated:.3} times as long as {}, and is {:.3} times as bright",
        second.display(),
        first.display(),
        stated * rate
    );
    let remedy = "correct exposure_s and iso of these frames, or leave out the one that clips";
    Err(CalibrateError::target(place, what, remedy))
}
