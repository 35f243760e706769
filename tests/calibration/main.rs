//! Calibration from pictures of simulated targets: with effects that the fit does not know, with what goes wrong at the bench,
//! and the figures that docs/calibration.md states (on request: `--ignored`).

#![cfg(feature = "opencv")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    unreachable_pub,
    reason = "a test that cannot go on has failed and says so"
)]

mod bench;
mod boards;
mod ceilings;
mod chain;
mod effects;
mod figures;
mod inputs;
mod mismatches;
mod refusals;
#[allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "test programs share it")]
#[path = "../support/skip.rs"]
mod skip;
