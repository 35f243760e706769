//! Where the LEDs are, how they shine and how strongly, from pictures of white sheets.

mod basis;
mod emission;
mod fit;
mod foresee;
mod gain;
mod joint;
mod observation;
mod plan;
mod slow;
mod system;
mod uncertainty;
mod wiring;

pub use emission::{Emitter, Place};
pub use fit::{Error, Fit, FittedLight, Settings, fit};
pub use foresee::{Foreseen, foresee};
pub use gain::{Gains, gains, has_several_poses};
pub use joint::Prior;
#[cfg(test)]
use joint::median;
pub use observation::{Cell, PoseSigma, Sample, Sheet};
pub use plan::{PLAN_CELLS, Plan};
pub use wiring::{Mismatch, mismatches};

#[cfg(test)]
mod bench_scene;
#[cfg(test)]
mod tests;
