//! The run: a capture session and a calibration become a solution.
//!
//! [`run`] reads frames, checks that they and the calibration belong together, solves in bands of rows over threads,
//! finds the colour of the albedo and writes the folder. [`CheckedScene::solve`] is the middle of it, in memory.

mod bands;
pub(crate) mod current;
mod error;
pub(crate) mod light_field;
mod mask;
mod options;
mod output;
mod progress;
mod run;
pub(crate) mod scene;
mod screen;
#[cfg(test)]
mod tests;
mod words;

pub use bands::{Rows, SolvedScene};
pub use error::SolveError;
pub use mask::{MaskMade, MaskOptions, make_mask};
pub use options::Options;
pub(crate) use output::finish::finish;
pub use progress::{Progress, Stage};
pub use run::{Shown, Solved, run};
pub use scene::{CheckedScene, Origin, Scene};
