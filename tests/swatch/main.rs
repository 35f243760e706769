//! Small pieces of cloth as the simulated rig photographs them: swapped lights, the table around a swatch, and what a solve
//! leaves undone.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot set its scene up has failed; figures are to be seen"
)]

mod commands;
mod layouts;
mod outline;
mod photograph;
mod swapped_lights;
#[allow(unreachable_pub, reason = "test programs share it")]
#[path = "../support/thorough.rs"]
mod thorough;
