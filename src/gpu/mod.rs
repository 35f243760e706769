//! The solve's first step on a graphics processor: neighbours with all their samples, by plain or weighted least squares.
//!
//! What comes back is finished by [`RowSolver::solve_rest`](crate::photometry::RowSolver::solve_rest), which also solves
//! everything that the shader left, so that the answers are those of the processor within 0.001 degrees. Without the feature
//! `gpu` everything here is the same, but there is never a device.

#[cfg(not(feature = "gpu"))]
mod absent;
mod adapter;
#[cfg(feature = "gpu")]
mod buffers;
mod choice;
#[cfg(feature = "gpu")]
mod device;
mod error;
#[cfg(feature = "gpu")]
mod pack;
#[cfg(test)]
#[cfg(feature = "gpu")]
pub(crate) mod tests;
mod tile;

#[cfg(not(feature = "gpu"))]
pub use absent::{Flight, Gpu};
pub use adapter::Adapter;
#[cfg(feature = "gpu")]
pub use buffers::Flight;
pub use choice::Device;
#[cfg(feature = "gpu")]
pub use device::Gpu;
pub use error::GpuError;

pub(crate) use choice::{Measured, Memory};
pub use tile::{Answer, Tile, TileRow};
