//! Names of the rooms.

/// The instrument.
pub const RIG: &str = "Rig";
/// The wizard.
pub const CALIBRATE: &str = "Calibrate";
/// The daily work.
pub const SCAN: &str = "Scan";
/// Maps under a light.
pub const LOOK: &str = "Look";
/// What was captured.
pub const SCANS: &str = "Scans";
