//! The run: a capture session and a calibration become a solution.
//!
//! [`run`] reads frames, checks that they and the calibration belong together, solves in bands of rows over threads,
//! finds the colour of the albedo and writes the folder. [`solve_scene`] is the middle of it, in memory.

mod bands;
mod blocks;
mod brightness;
mod check;
mod colour;
mod copies;
mod current;
mod dark;
mod device;
mod device_memory;
mod drift;
mod encode;
mod error;
mod exposures;
mod field;
mod field_grid;
mod finish;
mod idle;
mod in_memory;
mod inspect;
mod load;
mod maps;
mod mask_file;
mod on_gpu;
mod options;
pub mod preview;
mod progress;
mod progressive;
mod reduce;
#[cfg(test)]
mod reference;
mod region;
mod residual;
mod rows;
mod run;
mod scene;
mod settings;
mod swatch;
#[cfg(test)]
mod tests;
mod witness;

pub use device::Device;
pub use error::SolveError;
pub use finish::Finished;
pub use in_memory::{
    SolvedScene, leave_out_what_adds_nothing, solve_scene, solve_scene_on,
    solve_scene_with_residuals,
};
pub use inspect::{Part, Photosite, Sample};
pub use load::load_scene;
pub use maps::{Albedo, Counts, Maps, OUTCOMES, is_solved};
pub use mask_file::{MASK_FILE, MaskMade, MaskOptions, make_mask};
pub use options::{AlbedoKind, Grid, MaskChoice, NormalY, Options, Outputs, Residuals, Reuse};
pub use preview::Scale;
pub use progress::{Progress, Stage};
pub use progressive::{Level, progressively};
pub use reduce::reduced_camera;
pub use residual::ResidualRows;
pub use rows::Rows;
pub use run::{Page, Shown, Solved, method_name, method_of, run, run_with_page};
pub use scene::{Origin, Scene};
pub use settings::{DeviceName, MethodName, NormalYName, Settings};
pub use swatch::{Swatch, find_swatch};
