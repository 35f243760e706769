//! A simulated fabric-scanning rig: cloth with ground truth, reflectance, renderer, sensor, DNG writer.
//!
//! From `weavelight-calibration` it takes descriptions only. Projection, distortion, emission, falloff and reflectance
//! are its own code, so that what a recovery proves is more than consistency.
