//! Opening a rig, and making a simulated one.

use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::tools::Tools;
use crate::jobs::watch::Watch;
use crate::model::project::Project;
use crate::texts::rig as texts;
use std::path::Path;
use weavelight::simulate;

/// A quarter of the reference camera's size: the whole loop in minutes on a small computer.
const SIZE_PX: [usize; 2] = [1232, 816];

/// Opens the rig in `folder`. Board and camera of the one before are let go.
pub(crate) fn open(folder: &Path, tools: &mut Tools, out: &Outbox) {
    match Project::open(folder) {
        Ok(project) => {
            tools.instruments = None;
            tools.project = Some(project.clone());
            tools.watch = None;
            let folder = project.folder.clone();
            let (age_days, is_calibrated) =
                (project.calibration_age_days(), project.is_calibrated());
            out.send(Update::Opened(Box::new(project.clone())));
            out.send(Update::Calibrated(folder.clone(), is_calibrated));
            out.send(Update::CalibrationAge(age_days));
            tools.watch = Some(Watch::start(&project, out.clone()));
        }
        Err(error) => out.fail(texts::OPENING, &error),
    }
}

/// Opens the rig that was open when the window was closed; where its folder is gone, says so.
pub(crate) fn reopen(folder: &Path, tools: &mut Tools, out: &Outbox) {
    match folder.exists() {
        true => open(folder, tools, out),
        false => out.warn(texts::OPENING, &[texts::gone(folder)]),
    }
}

/// Makes a simulated rig that knows what a technician knows: a rig file measured with a ruler, no calibration yet. One that is
/// there already is opened as it is.
pub(crate) fn make_simulated(folder: &Path, tools: &mut Tools, out: &Outbox) {
    let made = match folder.join(weavelight::calibrate::wizard::RIG_FILE).exists() {
        true => Ok(()),
        false => simulate::write_rig(&simulated(folder)),
    };
    match made {
        Ok(()) => open(folder, tools, out),
        Err(error) => out.fail(texts::MAKING_SIMULATED, &error),
    }
}

/// With what real rigs have: a ruler that errs, a lens that darkens towards the corners, some light in the room.
fn simulated(folder: &Path) -> simulate::Options {
    let flaws = simulate::Flaws {
        ruler_error_mm: 8.0,
        vignetting: 0.2,
        ambient: 1.0,
        ..simulate::Flaws::default()
    };
    simulate::Options {
        out: folder.to_owned(),
        size_px: Some(SIZE_PX),
        flaws,
        ..simulate::Options::default()
    }
}
