//! Scanning with real parts: the real firmware in a simulated processor behind a pseudo-terminal, the real serial port crate,
//! and cameras that look which of its pins are lit.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]
#![allow(clippy::print_stdout, reason = "tests say what was not run, and what was measured")]

#[allow(dead_code, reason = "the light board's tests use the rest")]
#[path = "../board/exchange.rs"]
mod exchange;
#[allow(dead_code, reason = "the light board's tests use the rest")]
#[path = "../board/simboard.rs"]
mod simboard;

mod command;
mod end_to_end;
mod faults;
mod kills;
mod laboratory;
mod table;
mod targets;
mod timing;
