//! Frames to linear mosaics, samples as the sensor wrote them.

mod frame;

pub use frame::{Frame, Layout, Metadata, Samples};
