//! Whether another program holds the rig: then this window only looks, and takes over when it is free.

use super::{Outbox, Update};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use weavelight::files::Lock;
use weavelight::machine::spawn;

/// Between two looks.
const INTERVAL: Duration = Duration::from_millis(500);

/// Looks until it is dropped.
#[derive(Debug)]
pub struct Watch {
    ended: Arc<AtomicBool>,
}

impl Watch {
    /// Looks at the lock of the rig in `folder`, and tells when its holder changes.
    pub(super) fn start(folder: PathBuf, rig_file: PathBuf, out: Outbox) -> Self {
        let ended = Arc::new(AtomicBool::new(false));
        let end = ended.clone();
        // Without a thread nothing is watched, and the lock itself still holds.
        let _ = spawn("watch", move || {
            let mut last = None;
            while !end.load(Ordering::SeqCst) {
                let holder = holder(&rig_file);
                if last != holder {
                    last.clone_from(&holder);
                    out.tell(Update::Held(folder.clone(), holder));
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

/// Which other program holds a path, in words.
pub(crate) fn holder(path: &Path) -> Option<String> {
    Lock::holder(path).filter(|holder| !holder.is_this_process()).map(|holder| holder.to_string())
}
