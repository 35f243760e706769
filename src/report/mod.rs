//! What a command tells: pictures small enough to look at, distributions, and one self-contained HTML page.

mod distribution;
mod of_solve;
mod page;
pub mod picture;
mod solution;

pub use distribution::Distribution;
pub use of_solve::{Truth, expected_error, page_of_solve};
pub use picture::Thumbnail;
pub use solution::{Figure, SolutionPage, TruthErrors, Verdict};
