//! Folders and files that were dropped into the window or chosen in a dialogue.

use crate::jobs::identify::{What, is_open, rig_of};
use crate::jobs::messages::Update;
use crate::jobs::open::open;
use crate::jobs::outbox::Outbox;
use crate::jobs::tools::Tools;
use crate::jobs::{look, scan};
use crate::model::room::Room;
use crate::texts::rig as texts;
use std::path::Path;

/// What was dropped is used for what it is.
pub(crate) fn dropped(path: &Path, tools: &mut Tools, out: &Outbox) {
    match What::is(path) {
        // The room follows when it is there: entered before, it would ask for the last scan's.
        What::Solution(folder) => look::act::act(look::Command::Open(folder), tools, out),
        What::Scan(scan) => {
            if let (None, Some(rig)) = (&tools.project, rig_of(&scan)) {
                open(&rig.folder, tools, out);
            }
            match tools.project {
                Some(_) => {
                    out.send(Update::GoTo(Room::Scan));
                    out.send(Update::Scan(scan::Event::Dropped(scan)));
                }
                None => out.fail(texts::OPENING, &texts::scan_without_rig(&scan)),
            }
        }
        What::Rig(folder) => open(&folder, tools, out),
        What::Calibration(_, Some(rig)) => {
            if !is_open(&rig, tools.project.as_ref()) {
                open(&rig, tools, out);
            }
            out.send(Update::GoTo(Room::Calibrate));
        }
        What::Target(folder) => out.fail(texts::OPENING, &texts::target(&folder)),
        What::Calibration(folder, None) => out.fail(texts::OPENING, &texts::calibration(&folder)),
        What::Other(path) => out.fail(texts::OPENING, &texts::unknown(&path)),
    }
}

/// Opens what was chosen as a rig. Where it is something else that the program knows, that is used.
pub(crate) fn open_path(path: &Path, tools: &mut Tools, out: &Outbox) {
    match What::is(path) {
        What::Rig(folder) => open(&folder, tools, out),
        // The rig's file is missed, by its path.
        What::Other(path) => open(&path, tools, out),
        _ => dropped(path, tools, out),
    }
}
