//! What the kernels must do, on rows that a small forward model makes.

mod accuracy;
mod agreement;
mod noise;
mod real;
pub(crate) mod scene;
#[allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "test programs share it")]
#[path = "../../../tests/support/skip.rs"]
mod skip;
mod stress;
