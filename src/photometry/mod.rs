//! The kernels, on one row of photosites at a time: data in, data out; no I/O, clock, thread or log.
//!
//! What enters is already normalised (see [`RowInput::signal`]), so that every method is about geometry and noise alone.

mod row;

pub use row::{FieldRow, Outcome, RowInput, RowOutput, VarianceModel};
