//! A simulated fabric-scanning rig: cloth with ground truth, reflectance, renderer, sensor, DNG writer.
//!
//! From `weavelight-calibration` it takes descriptions only. Projection, distortion, emission, falloff and reflectance
//! are its own code, so that what a recovery proves is more than consistency.
//!
//! A picture is made in two steps. A [`render::Subject`] (a cloth, a target) says which light reaches each photosite from
//! each lamp, per second at ISO 100, as a fraction of the sensor's range; [`render::shoot`] exposes the sensor to it, all
//! frames of a capture session at once, tile by tile. Everything random is keyed with a seed and the photosite, so
//! that the same seed gives the same bytes whatever the number of threads.

pub mod cloth;
pub mod color;
pub mod dng;
pub mod lamp;
pub mod random;
pub mod reflectance;
pub mod render;
pub mod rig;
pub mod sensor;
pub mod target;
pub mod view;
