//! The tethered camera: the real helper process with the unmodified libgphoto2, against a camera that speaks PTP/IP.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]
#![allow(clippy::print_stdout, reason = "tests say what was not run, and what was measured")]

mod capture;
mod fake;
mod faults;
mod helper;
mod rigging;
mod settings;
