//! What the worker holds between requests.

use crate::jobs::look::frames::Frames;
use crate::jobs::watch::Watch;
use crate::model::project::Project;
use weavelight::calibrate::wizard::Memory;
use weavelight::device::scan::Instruments;

/// What the worker holds between commands.
#[derive(Debug, Default)]
pub struct Tools {
    /// The rig that is open.
    pub project: Option<Project>,
    /// Its board and camera, opened when first needed and closed with the rig or when they fail.
    pub instruments: Option<Instruments>,
    /// Looks whether another program holds it.
    pub watch: Option<Watch>,
    /// What was seen in pictures of targets.
    pub calibrate: Memory,
    /// The frames that the Look room asked about last.
    pub frames: Frames,
}
