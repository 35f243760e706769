//! Names of the rooms.

#![allow(missing_docs, reason = "a text says what it is")]

pub const RIG: &str = "Rig";
pub const CALIBRATE: &str = "Calibrate";
pub const SCAN: &str = "Scan";
/// Maps under a light.
pub const LOOK: &str = "Look";
pub const SCANS: &str = "Scans";
