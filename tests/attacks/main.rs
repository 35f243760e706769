//! The executable under attack: mutated files, kills and failing system calls at chosen moments, two processes on every output.
//!
//! `make attacks` runs all of it for some minutes; a few tries of each kind run with every test run.

#![allow(clippy::unwrap_used, reason = "an attack that cannot be set up has failed")]
#![allow(clippy::print_stdout, reason = "the number of tries is the result")]

mod bench;
mod mutate;
mod pairs;
mod system_calls;

/// How many tries: a few with every test run, as many as `variable` says in `make attacks`.
fn tries(variable: &str, usual: usize) -> usize {
    std::env::var(variable).map_or(usual, |text| text.parse().unwrap())
}
