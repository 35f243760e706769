//! The kernels, on one row of photosites at a time: data in, data out; no I/O, clock, thread or log.
//!
//! What enters is already normalised (see [`RowInput::signal`]), so that every method is about geometry and noise alone.
//!
//! - [`solve_pixel`] and [`reference_row`]: plain float64, the definition of every method
//! - [`normalise_row`]: raw numbers to input
//! - [`estimate_noise`]: the noise model where the calibration has none
//! - [`RowSolver`]: the same answers, fast
//! - [`CutRow`] and [`Found`]: the fast path's first step, for whoever does it elsewhere

#![allow(
    clippy::needless_range_loop,
    reason = "kernels walk several arrays lane by lane; zips of six hide the formula"
)]

mod block;
mod complete;
mod elsewhere;
mod least_squares;
mod light_set;
mod maps;
mod method;
mod noise;
mod normal_equations;
mod normalise;
mod photosite;
mod pieces;
mod reference;
mod reference_robust;
mod robust;
mod row;
mod solve_row;
mod subset;
mod surface;
mod tighten;
mod weighted;
mod wide;

#[cfg(test)]
pub(crate) mod tests;

pub use elsewhere::{CutPiece, CutRow, Found};
pub use light_set::LightSet;
pub use maps::{Albedo, Counts, Maps, OUTCOMES, is_solved};
#[cfg(feature = "gpu")]
pub(crate) use method::chi_square_limit;
pub use method::{MAX_LIGHTS, Method};
pub use noise::{NoiseEvidence, NoiseSample, estimate_noise};
pub use normalise::{Normalisation, normalise_row};
pub use photosite::{Part, Photosite, Sample};
pub use reference::{Fit, Pixel, Samples, reference_row, solve_pixel};
pub(crate) use reference::{inverse_if_conditioned, variance};
pub use row::{FieldRow, Outcome, RowError, RowInput, RowOutput, Support, VarianceModel};
pub use solve_row::RowSolver;
