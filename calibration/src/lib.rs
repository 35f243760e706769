//! What the instrument is (frames of reference, image planes, camera, light, rig) and how each part of it is estimated
//! from observations. Pure functions: no I/O, clock, thread or log.
//!
//! [`description`] holds plain data and conventions only; it is all that the simulator may use (a house rule checks
//! it). Everything that *computes* with a description ([`projection`], [`irradiance`], [`gain`]) lives beside it.

pub mod board;
#[cfg(feature = "opencv")]
pub mod chessboard;
pub mod color;
pub mod description;
pub mod gain;
pub mod irradiance;
pub mod lights;
pub mod projection;
pub mod response;
