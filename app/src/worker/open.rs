//! Opening a rig, and making a simulated one.

use super::{Outbox, Tools, Update};
use crate::place::Place;
use crate::rooms::{Room, look, scan};
use crate::texts::rig as texts;
use std::path::{Path, PathBuf};
use weavelight::simulate;

/// A quarter of the reference camera's size: the whole loop in minutes on a small computer.
const SIZE_PX: [usize; 2] = [1232, 816];

/// Opens the rig in `folder`. Board and camera of the one before are let go.
pub(super) fn open(folder: &Path, tools: &mut Tools, out: &Outbox) {
    match Place::open(folder) {
        Ok(place) => {
            tools.instruments = None;
            tools.place = Some(place.clone());
            let age_days = place.calibration_age_days();
            out.tell(Update::Opened(Box::new(place)));
            out.tell(Update::CalibrationAge(age_days));
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

/// What a folder that was dropped is for is seen by what lies in it.
pub(super) fn dropped(path: PathBuf, tools: &mut Tools, out: &Outbox) {
    let has = |file: &str| path.join(file).exists();
    if has(weavelight::solution::REPORT_JSON) {
        out.tell(Update::GoTo(Room::Look));
        look::act(look::Ask::Open(path), tools, out);
    } else if has(weavelight::session::MANIFEST) {
        out.tell(Update::GoTo(Room::Scan));
        out.tell(Update::Scan(scan::Told::Dropped(path)));
    } else {
        open(&path, tools, out);
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
