//! From raw numbers to linear light, and the noise of that light: the only room that converts.
//!
//! Linear light is a fraction of full scale: 0 at the black level, 1 at the end of the range. `Levels` say how raw numbers
//! map to it, `Reading` applies them to a frame, `Normalizer` turns the frames of all lights into the signals that the
//! kernels fit.

mod estimate;
mod exposure;
mod gain;
mod levels;
mod noise;
mod preview;
mod reading;
mod signal;

pub use exposure::{Exposure, PhotographedLight, seconds_at_iso_100};
pub use preview::preview;

pub(crate) use estimate::{Surroundings, noise_of_residuals};
pub(crate) use exposure::Photographs;
pub(crate) use levels::{Levels, range_between, raw_at};
pub(crate) use noise::{
    AmbientNoise, LinearNoise, exposure_variances, full_scale, variance_of_row,
};
pub(crate) use reading::{GREY, Reading, intensity_of_places};
pub(crate) use signal::{Normalizer, SignalRows};
