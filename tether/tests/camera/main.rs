//! The tethered camera: the real helper process with the unmodified libgphoto2, against a camera that speaks PTP/IP.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]
#![allow(clippy::print_stdout, reason = "tests say what was not run, and what was measured")]

#[allow(dead_code, reason = "the light board's tests use the rest")]
#[path = "../../../tests/board/exchange.rs"]
mod exchange;
#[allow(dead_code, reason = "the light board's tests use the rest")]
#[path = "../../../tests/board/simboard.rs"]
mod simboard;

mod capture;
mod fake;
mod faults;
mod helper;
mod rigging;
mod scan;
mod settings;
