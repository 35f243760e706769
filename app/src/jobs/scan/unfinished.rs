//! Scans that were stopped before their end.

use crate::jobs::holder::holder;
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::scan::Event;
use crate::jobs::scans::list::incomplete;
use crate::jobs::tools::Tools;
use crate::model::project::Project;
use crate::model::scan_entry::UnfinishedScan;

pub(crate) fn look_for_unfinished(tools: &Tools, out: &Outbox) {
    let found = tools.project.as_ref().and_then(newest_unfinished);
    if let Some(project) = &tools.project {
        send_names(project, out);
    }
    out.send(Update::Scan(Event::Unfinished(found)));
}

pub(crate) fn send_names(project: &Project, out: &Outbox) {
    out.send(Update::Scan(Event::Names(project.folder.clone(), project.names())));
}

/// The newest scan that was stopped, by whatever.
fn newest_unfinished(project: &Project) -> Option<UnfinishedScan> {
    let entries = std::fs::read_dir(project.scans()).ok()?.flatten();
    let found = entries.filter_map(|entry| {
        // One that another program is taking is not stopped.
        let session =
            incomplete(&entry.path(), &project.rig).filter(|_| holder(&entry.path()).is_none())?;
        Some((entry.metadata().ok()?.modified().ok()?, session))
    });
    found.max_by_key(|(when, _)| *when).map(|(_, found)| found)
}
