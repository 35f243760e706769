//! The run: a capture session and a calibration become a solution.
//!
//! [`run`] reads frames, checks that they and the calibration belong together, solves in bands of rows over threads,
//! finds the colour of the albedo and writes the folder. [`solve_scene`] is the middle of it, in memory.

mod bands;
mod check;
mod current;
mod device;
mod device_memory;
mod drift;
mod encode;
mod error;
mod estimate;
mod field;
mod field_grid;
mod finish;
mod gain;
mod in_memory;
mod load;
mod maps;
mod noise;
mod on_gpu;
mod options;
pub mod preview;
mod progress;
#[cfg(test)]
mod reference;
mod rows;
mod run;
mod scene;
mod sensor;
mod signal;
#[cfg(test)]
mod tests;
mod witness;

pub use device::Device;
pub use error::SolveError;
pub use finish::Finished;
pub use in_memory::{SolvedScene, leave_out_dark_lights, solve_scene, solve_scene_on};
pub use load::load_scene;
pub use maps::{Albedo, Counts, Maps, OUTCOMES, is_solved};
pub use options::{Grid, NormalY, Options, Reuse};
pub use progress::{Progress, Stage};
pub use rows::Rows;
pub use run::{Page, Shown, Solved, method_name, run, run_with_page};
pub use scene::{Exposure, Origin, PhotographedLight, Scene};
