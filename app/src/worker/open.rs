//! Opening a rig, and making a simulated one.

use super::watch::Watch;
use super::what::{What, is_open, rig_of};
use super::{Outbox, Tools, Update};
use crate::place::Place;
use crate::rooms::{Room, look, scan};
use crate::texts::rig as texts;
use std::path::Path;
use weavelight::simulate;

/// A quarter of the reference camera's size: the whole loop in minutes on a small computer.
const SIZE_PX: [usize; 2] = [1232, 816];

/// Opens the rig in `folder`. Board and camera of the one before are let go.
pub(crate) fn open(folder: &Path, tools: &mut Tools, out: &Outbox) {
    match Place::open(folder) {
        Ok(place) => {
            tools.instruments = None;
            tools.place = Some(place.clone());
            tools.watch = None;
            let folder = place.folder.clone();
            let (age_days, is_calibrated) = (place.calibration_age_days(), place.is_calibrated());
            out.tell(Update::Opened(Box::new(place.clone())));
            out.tell(Update::Calibrated(folder.clone(), is_calibrated));
            out.tell(Update::CalibrationAge(age_days));
            tools.watch = Some(Watch::start(&place, out.clone()));
        }
        Err(error) => out.fail(texts::OPENING, &error),
    }
}

/// Makes a simulated rig that knows what a technician knows: a rig file measured with a ruler, no calibration yet. One that is
/// there already is opened as it is.
pub(super) fn make_simulated(folder: &Path, tools: &mut Tools, out: &Outbox) {
    let made = match folder.join(crate::place::RIG_FILE).exists() {
        true => Ok(()),
        false => simulate::write_rig(&simulated(folder)),
    };
    match made {
        Ok(()) => open(folder, tools, out),
        Err(error) => out.fail(texts::MAKING_SIMULATED, &error),
    }
}

/// What was dropped is used for what it is.
pub(super) fn dropped(path: &Path, tools: &mut Tools, out: &Outbox) {
    match What::is(path) {
        // The room follows when it is there: entered before, it would ask for the last scan's.
        What::Solution(folder) => look::act(look::Ask::Open(folder), tools, out),
        What::Scan(scan) => {
            if let (None, Some(rig)) = (&tools.place, rig_of(&scan)) {
                open(&rig.folder, tools, out);
            }
            match tools.place {
                Some(_) => {
                    out.tell(Update::GoTo(Room::Scan));
                    out.tell(Update::Scan(scan::Told::Dropped(scan)));
                }
                None => out.fail(texts::OPENING, &texts::scan_without_rig(&scan)),
            }
        }
        What::Rig(folder) => open(&folder, tools, out),
        What::Calibration(_, Some(rig)) => {
            if !is_open(&rig, tools.place.as_ref()) {
                open(&rig, tools, out);
            }
            out.tell(Update::GoTo(Room::Calibrate));
        }
        What::Target(folder) => out.fail(texts::OPENING, &texts::target(&folder)),
        What::Calibration(folder, None) => out.fail(texts::OPENING, &texts::calibration(&folder)),
        What::Other(path) => out.fail(texts::OPENING, &texts::unknown(&path)),
    }
}

/// Opens what was chosen as a rig. Where it is something else that the program knows, that is used.
pub(super) fn open_path(path: &Path, tools: &mut Tools, out: &Outbox) {
    match What::is(path) {
        What::Rig(folder) => open(&folder, tools, out),
        // The rig's file is missed, by its path.
        What::Other(path) => open(&path, tools, out),
        _ => dropped(path, tools, out),
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
