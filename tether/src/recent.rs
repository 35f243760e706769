//! What libgphoto2 logged during the current request: its results say "unspecified error" where its log says which.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// More lines than one operation leaves behind its cause.
const KEPT: usize = 64;

struct Recent(Mutex<Option<Log>>);

/// What was logged since a request began, and the longest time without a word.
#[derive(Clone, Debug)]
pub(crate) struct Log {
    /// What tells something, oldest first.
    pub(crate) lines: VecDeque<String>,
    /// While the library talks to the camera, it logs every word; so the camera did not answer for this long.
    pub(crate) silence: Duration,
    /// When it last spoke.
    pub(crate) last: Instant,
}

impl Log {
    pub(crate) fn new() -> Self {
        Self { lines: VecDeque::new(), silence: Duration::ZERO, last: Instant::now() }
    }

    fn hear(&mut self) {
        let now = Instant::now();
        self.silence = self.silence.max(now - self.last);
        self.last = now;
    }

    fn keep(&mut self, line: String) {
        self.lines.push_back(line);
        if self.lines.len() > KEPT {
            self.lines.pop_front();
        }
    }
}

// The log of a process is one by nature.
static RECENT: Recent = Recent(Mutex::new(None));

/// Starts keeping the log.
pub(crate) fn listen() {
    if log::set_logger(&RECENT).is_ok() {
        log::set_max_level(log::LevelFilter::Debug);
    }
}

/// Drops what was kept: another request begins.
pub(crate) fn forget() {
    *locked() = Some(Log::new());
}

/// What was kept.
pub(crate) fn log() -> Log {
    locked().clone().unwrap_or_else(Log::new)
}

fn locked() -> MutexGuard<'static, Option<Log>> {
    RECENT.0.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Errors, and answers of the camera that are more than "OK" or "busy".
fn telling(level: log::Level, text: &str) -> bool {
    level == log::Level::Error
        || (text.contains("(result=0x")
            && !text.contains("(result=0x2001")
            && !text.contains("(result=0x2019"))
}

impl log::Log for Recent {
    fn enabled(&self, _metadata: &log::Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &log::Record<'_>) {
        let text = record.args().to_string();
        if let Some(log) = locked().as_mut() {
            log.hear();
            if telling(record.level(), &text) {
                log.keep(text);
            }
        }
    }

    fn flush(&self) {}
}
