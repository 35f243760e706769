//! What a capture needs of the world outside: the light board and the camera, and the sequence that scans.

pub mod board;
pub mod camera;
mod look;
pub mod scan;
