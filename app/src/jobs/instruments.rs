//! Board and camera: opened when first needed, let go when they fail.

use crate::jobs::tools::Tools;
use crate::model::project::Project;
use crate::texts::rig as texts;
use weavelight::device::scan::{Instruments, open};

/// Runs `work` with the rig's board and camera. Where it fails they are closed, so that the next try opens them again: unplugged
/// and plugged in again, or switched on by then.
///
/// # Errors
/// Where there is no rig, they cannot be opened, or `work` fails; a sentence with the remedy.
pub fn with_instruments<T, E: std::fmt::Display>(
    tools: &mut Tools,
    work: impl FnOnce(&Project, &mut Instruments) -> Result<T, E>,
) -> Result<T, String> {
    let Tools { project, instruments, .. } = tools;
    let project = project.as_ref().ok_or(texts::NONE_OPEN)?;
    let opened = instruments.take().map_or_else(|| open(&project.rig, &project.rig_file()), Ok);
    let mut opened = opened.map_err(|error| error.to_string())?;
    let result = work(project, &mut opened);
    if result.is_ok() {
        *instruments = Some(opened);
    }
    result.map_err(|error| error.to_string())
}
