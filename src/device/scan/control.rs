use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Pauses and stops a scan from another thread. Clones control the same scan.
#[derive(Clone, Debug, Default)]
pub struct Control(Arc<AtomicU8>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wish {
    GoOn,
    Pause,
    Stop,
}

impl Control {
    /// After the frame under way: lights off, and wait.
    pub fn pause(&self) {
        // A scan that was told to stop does not come back.
        let _ = self.0.compare_exchange(0, 1, Ordering::SeqCst, Ordering::SeqCst);
    }

    /// Goes on after a pause.
    pub fn go_on(&self) {
        let _ = self.0.compare_exchange(1, 0, Ordering::SeqCst, Ordering::SeqCst);
    }

    /// Ends the scan after the camera's call under way; what is finished stays.
    pub fn stop(&self) {
        self.0.store(2, Ordering::SeqCst);
    }

    /// Whether it was told to stop.
    pub fn is_stopped(&self) -> bool {
        self.wish() == Wish::Stop
    }

    pub(super) fn wish(&self) -> Wish {
        match self.0.load(Ordering::SeqCst) {
            0 => Wish::GoOn,
            1 => Wish::Pause,
            _ => Wish::Stop,
        }
    }
}
