//! From solved rows to the maps and files of a solution.

mod colour;
pub(crate) mod encode;
pub(crate) mod finish;
pub(crate) mod level;
