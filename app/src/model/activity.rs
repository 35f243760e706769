//! Work under way.

use std::time::{Duration, Instant};

/// Work under way.
#[derive(Clone, Debug)]
pub struct Activity {
    /// As in "Solving linen 4021".
    pub title: String,
    /// The step it is at, as in "light 4".
    pub step: String,
    /// Share done, 0 to 1.
    pub share: f64,
    /// When it began.
    pub since: Instant,
    /// Time left as the work itself foresees it.
    pub left: Option<Duration>,
}

impl Activity {
    /// As it begins.
    pub fn new(title: String) -> Self {
        Self { title, step: String::new(), share: 0.0, since: Instant::now(), left: None }
    }

    /// Time left, once it can be foreseen: as the work says, else from the share done.
    pub fn time_left(&self) -> Option<Duration> {
        const FORESEEABLE: f64 = 0.05;
        let by_share = || {
            let spent = self.since.elapsed().as_secs_f64();
            (self.share > FORESEEABLE && spent > 1.0)
                .then(|| Duration::from_secs_f64(spent * (1.0 - self.share).max(0.0) / self.share))
        };
        self.left.or_else(by_share)
    }
}

/// Why work has no result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ended {
    /// It was cancelled.
    Cancelled,
    /// It failed; the error is reported.
    Failed,
}
