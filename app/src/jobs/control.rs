//! Cancels or pauses the work under way.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use weavelight::device::scan::Control;

/// Ends or pauses the work under way. Clones act on the same worker.
#[derive(Clone, Debug, Default)]
pub struct JobControl(Arc<State>);

#[derive(Debug, Default)]
struct State {
    cancelled: AtomicBool,
    closing: AtomicBool,
    scan: Mutex<Option<Control>>,
}

impl JobControl {
    /// Ends the work under way.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::SeqCst);
        self.with_scan(Control::stop);
    }

    /// Pauses a scan.
    pub fn pause(&self) {
        self.with_scan(Control::pause);
    }

    /// Resumes a scan.
    pub fn resume(&self) {
        self.with_scan(Control::go_on);
    }

    fn with_scan(&self, act: impl Fn(&Control)) {
        if let Ok(scan) = self.0.scan.lock() {
            scan.iter().for_each(act);
        }
    }

    /// Ends the work under way, and begins no other.
    pub fn close(&self) {
        self.0.closing.store(true, Ordering::SeqCst);
        self.cancel();
    }

    /// Whether frames are being taken.
    pub fn is_capturing(&self) -> bool {
        self.0.scan.lock().is_ok_and(|scan| scan.is_some())
    }

    /// Begins a request: what cancelled the last one does not count for it.
    pub(crate) fn begin(&self) {
        self.0.cancelled.store(self.is_closing(), Ordering::SeqCst);
    }

    /// The scan that [`JobControl::pause`] and [`JobControl::cancel`] act on, while there is one.
    pub(crate) fn set_scan(&self, control: Option<Control>) {
        if let Ok(mut scan) = self.0.scan.lock() {
            *scan = control;
        }
    }

    /// Acts as a room asked.
    pub fn act(&self, action: JobAction) {
        match action {
            JobAction::Cancel => self.cancel(),
            JobAction::Pause => self.pause(),
            JobAction::Resume => self.resume(),
        }
    }

    /// Whether no work is to begin any more.
    pub(crate) fn is_closing(&self) -> bool {
        self.0.closing.load(Ordering::SeqCst)
    }

    /// Whether the work under way is no longer wanted.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Ordering::SeqCst)
    }
}

/// What a room asks of the work under way; it does not wait for the requests before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JobAction {
    /// End it.
    Cancel,
    /// Pause a scan.
    Pause,
    /// Resume a scan.
    Resume,
}
