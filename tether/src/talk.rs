//! The helper's voice: lines on standard output.

use std::io::Write;
use weavelight::device::camera::tethered::protocol::{Answer, Fault, Line, Moment, Said};

/// Says what belongs to one request after the other.
pub(crate) struct Outlet {
    id: u64,
}

impl Outlet {
    pub(crate) fn new() -> Self {
        Self { id: 0 }
    }

    /// What follows belongs to this request.
    pub(crate) fn begin(&mut self, id: u64) {
        self.id = id;
    }

    /// Something has happened.
    pub(crate) fn moment(&mut self, moment: Moment) {
        self.say(Said::Moment(moment));
    }

    /// The request is over.
    pub(crate) fn end(&mut self, result: Result<Answer, Fault>) {
        self.say(result.map_or_else(Said::Failed, Said::Done));
    }

    fn say(&mut self, said: Said) {
        let Ok(mut line) = serde_json::to_string(&Line { id: self.id, said }) else { return };
        line.push('\n');
        let mut out = std::io::stdout().lock();
        // A parent that does not listen any more is gone, which standard input tells.
        let _unheard = out.write_all(line.as_bytes()).and_then(|()| out.flush());
    }
}
