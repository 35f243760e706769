//! The same without a graphics processor: what cannot be opened is never used.

use super::{Adapter, Answer, GpuError, Tile};
use std::marker::PhantomData;

/// An opened graphics processor: there is none.
#[derive(Debug)]
pub enum Gpu {}

/// A tile under way.
pub struct Flight<'g>(Gpu, PhantomData<&'g Gpu>);

impl Gpu {
    /// Fails.
    ///
    /// # Errors
    /// [`GpuError::NotBuilt`].
    pub fn open() -> Result<Self, GpuError> {
        Err(GpuError::NotBuilt)
    }

    /// What was opened.
    pub fn adapter(&self) -> &Adapter {
        match *self {}
    }

    /// Rows of a tile.
    pub fn rows_at_once(&self, _width: usize, _lights: usize) -> usize {
        match *self {}
    }

    /// Sends a tile off.
    ///
    /// # Errors
    /// None.
    pub fn submit(&self, _tile: &Tile) -> Result<Flight<'_>, GpuError> {
        match *self {}
    }
}

impl Flight<'_> {
    /// Bytes sent to the device, and to be brought back.
    pub fn bytes(&self) -> [u64; 2] {
        match self.0 {}
    }

    /// Waits for the answer.
    ///
    /// # Errors
    /// None.
    pub fn land<T>(self, _read: impl FnOnce(&Answer) -> T) -> Result<T, GpuError> {
        match self.0 {}
    }
}
