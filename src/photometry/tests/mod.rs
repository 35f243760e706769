//! What the kernels must do, on rows that a small forward model makes.

mod accuracy;
mod agreement;
mod noise;
mod real;
pub(crate) mod scene;
mod stress;
