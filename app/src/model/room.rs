//! The rooms of the window.

use serde::{Deserialize, Serialize};

/// A room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Room {
    /// The instrument.
    Rig,
    /// The wizard.
    Calibrate,
    /// The daily work.
    #[default]
    Scan,
    /// Maps under a light.
    Look,
    /// What was captured.
    Scans,
}
