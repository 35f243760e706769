//! What others do to the rig: whether another program holds it - then this window only looks, and takes over when it is free -
//! and whether it is calibrated.

use crate::jobs::holder::holder;
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::model::project::Project;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use weavelight::machine::spawn;

const INTERVAL: Duration = Duration::from_millis(500);

/// Looks until it is dropped.
#[derive(Debug)]
pub struct Watch {
    ended: Arc<AtomicBool>,
}

impl Watch {
    /// Watches the lock and the calibration of a rig, and reports when either changes.
    pub(crate) fn start(project: &Project, out: Outbox) -> Self {
        let (project, rig_file, folder) =
            (project.clone(), project.rig_file(), project.folder.clone());
        let ended = Arc::new(AtomicBool::new(false));
        let end = ended.clone();
        // Without a thread nothing is watched, and the lock itself still holds.
        let _ = spawn("watch", move || {
            let (mut last, mut was_calibrated) = (None, None);
            while !end.load(Ordering::SeqCst) {
                let holder = holder(&rig_file);
                if last != holder {
                    last.clone_from(&holder);
                    out.send(Update::Held(folder.clone(), holder));
                }
                let is_calibrated = project.is_calibrated();
                if was_calibrated.replace(is_calibrated) != Some(is_calibrated) {
                    out.send(Update::Calibrated(folder.clone(), is_calibrated));
                }
                std::thread::sleep(INTERVAL);
            }
        });
        Self { ended }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::SeqCst);
    }
}
