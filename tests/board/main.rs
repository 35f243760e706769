//! The light board: its protocol at both ends, and the real firmware in a simulated processor.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]
#![allow(clippy::print_stdout, reason = "tests say what was not run, and what was measured")]

mod exchange;
mod firmware;
mod link;
mod machine;
mod protocol;
mod simboard;
mod soak;
