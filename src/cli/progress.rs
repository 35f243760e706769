//! A bar on standard error, and only on a terminal.

use crate::files::one_line;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::Write;

/// Steps of the bar: fine enough that it does not jump.
const STEPS: u64 = 1000;

/// Characters beside the bar.
const LONGEST: usize = 300;

/// How far a command is.
pub(super) struct Progress(ProgressBar);

impl Progress {
    pub(super) fn new() -> Self {
        // The draw target stays silent where standard error is no terminal.
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} % {msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// `share` of the work is done, 0 to 1; `what` is going on.
    pub(super) fn set(&self, share: f64, what: &str) {
        self.0.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
        let what = one_line(what, LONGEST);
        if self.0.message() != what {
            self.0.set_message(what);
        }
    }
}

impl Progress {
    /// A line that stays, over the bar; on a terminal only.
    pub(super) fn say(&self, line: &str) {
        self.0.println(one_line(line, LONGEST));
    }

    /// A line that stays, on a terminal or not: what the user has to do for the work to go on.
    pub(super) fn note(&self, line: &str) {
        if self.0.is_hidden() {
            // Nothing reads standard error any more: the work goes on.
            let _ = writeln!(std::io::stderr().lock(), "{line}");
        } else {
            self.0.println(line);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
