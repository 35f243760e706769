//! Requests to the worker, and what it reports back.

use crate::jobs::{calibrate, look, rig, scan, scans};
use crate::model::problem::{Area, Problem};
use crate::model::project::Project;
use crate::model::room::Room;
use std::path::PathBuf;
use std::time::Duration;

/// What is to be done.
#[derive(Debug)]
pub enum Request {
    /// Open the rig in this folder.
    Open(PathBuf),
    /// Open the rig that was open when the window was closed.
    Reopen(PathBuf),
    /// Close the rig: other programs may use it.
    Close,
    /// Do what is meant by a folder that was dropped into the window: open the rig, solve the scan, look at the solution.
    Dropped(PathBuf),
    /// Make a simulated rig in this folder, and open it.
    MakeSimulatedRig(PathBuf),
    /// Of the Rig room.
    Rig(rig::Command),
    /// Of the Calibrate room.
    Calibrate(calibrate::Command),
    /// Of the Scan room.
    Scan(scan::Command),
    /// Of the Look room.
    Look(look::Command),
    /// Of the Scans room.
    Scans(scans::Command),
}

impl Request {
    /// What it belongs to.
    pub(crate) fn area(&self) -> Area {
        match self {
            Request::Open(_)
            | Request::Reopen(_)
            | Request::Close
            | Request::Dropped(_)
            | Request::MakeSimulatedRig(_) => Area::Opening,
            Request::Rig(_) => Area::Rig,
            Request::Calibrate(_) => Area::Calibrate,
            Request::Scan(_) => Area::Scan,
            Request::Look(_) => Area::Look,
            Request::Scans(_) => Area::Scans,
        }
    }

    /// The area of which it is a new try; `None` for requests that the user did not make.
    pub fn tries(&self) -> Option<Area> {
        let by_the_user = match self {
            Request::Close => false,
            Request::Open(_)
            | Request::Reopen(_)
            | Request::Dropped(_)
            | Request::MakeSimulatedRig(_) => true,
            Request::Rig(command) => {
                !matches!(command, rig::Command::ReadCalibration(_) | rig::Command::Light(None))
            }
            Request::Calibrate(command) => {
                !matches!(command, calibrate::Command::Refresh | calibrate::Command::Look(..))
            }
            Request::Scan(command) => !matches!(command, scan::Command::LookForUnfinished),
            Request::Look(command) => {
                use look::Command;
                !matches!(
                    command,
                    Command::Picture(..)
                        | Command::Residual(..)
                        | Command::Photosite(..)
                        | Command::Draft(_)
                )
            }
            Request::Scans(command) => {
                !matches!(command, scans::Command::List(_) | scans::Command::Thumbnail(..))
            }
        };
        by_the_user.then(|| self.area())
    }

    /// Whether it needs neither devices nor the solver, and says itself of which rig it is.
    pub(crate) fn only_reads(&self) -> bool {
        match self {
            Request::Rig(command) => matches!(command, rig::Command::ReadCalibration(_)),
            Request::Look(command) => matches!(command, look::Command::Draft(_)),
            Request::Scans(command) => {
                matches!(command, scans::Command::List(_) | scans::Command::Thumbnail(..))
            }
            _ => false,
        }
    }
}

/// What has happened.
#[derive(Debug)]
pub enum Update {
    /// Work that takes its time has begun, as in "Solving linen 4021".
    Began(String),
    /// How far it is.
    Progress {
        /// 0 to 1.
        share: f64,
        /// As in "light 4".
        step: String,
        /// Time left where the work foresees it.
        left: Option<Duration>,
    },
    /// It has ended, one way or the other.
    Ended,
    /// Something went wrong.
    Problem(Problem),
    /// What was asked for is in this room.
    GoTo(Room),
    /// A rig is open.
    Opened(Box<Project>),
    /// Which other program holds the rig in a folder, in words.
    Held(PathBuf, Option<String>),
    /// Whether the lights of the rig in a folder are calibrated.
    Calibrated(PathBuf, bool),
    /// How old its calibration is, days.
    CalibrationAge(Option<i64>),
    /// For the Rig room.
    Rig(rig::Event),
    /// For the Calibrate room.
    Calibrate(calibrate::Event),
    /// For the Scan room.
    Scan(scan::Event),
    /// For the Look room.
    Look(look::Event),
    /// For the Scans room.
    Scans(scans::Event),
}

impl Update {
    /// The room that the update is for; `None` where it is for the window.
    pub fn room(&self) -> Option<Room> {
        match self {
            Update::Rig(_) => Some(Room::Rig),
            Update::Calibrate(_) => Some(Room::Calibrate),
            Update::Scan(_) => Some(Room::Scan),
            Update::Look(_) => Some(Room::Look),
            Update::Scans(_) => Some(Room::Scans),
            _ => None,
        }
    }
}
