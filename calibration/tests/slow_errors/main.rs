//! How far slow errors of 0.1 % move the lights: a bench that knows nothing of the estimator, over layouts, kinds of error and
//! seeds. The figures of docs/calibration.md run on request:
//!
//! `cargo test -p weavelight-calibration --test slow_errors -- --ignored --nocapture`

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed and says so"
)]

mod errors;
mod figures;
mod rig;
