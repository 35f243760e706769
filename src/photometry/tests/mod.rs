//! What the kernels must do, on rows that a small forward model makes.

mod accuracy;
mod agreement;
pub(super) mod scene;
