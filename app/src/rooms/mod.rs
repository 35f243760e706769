//! The rooms. Each draws itself, keeps what only it needs, asks through the desk, and has its part of the worker beside it.

pub mod calibrate;
pub mod look;
pub mod rig;
pub mod scan;
pub mod scans;
pub mod welcome;

use crate::texts::rooms as texts;
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

impl Room {
    /// In the order of the work.
    pub const ALL: [Room; 5] = [Room::Rig, Room::Calibrate, Room::Scan, Room::Look, Room::Scans];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Room::Rig => texts::RIG,
            Room::Calibrate => texts::CALIBRATE,
            Room::Scan => texts::SCAN,
            Room::Look => texts::LOOK,
            Room::Scans => texts::SCANS,
        }
    }
}
