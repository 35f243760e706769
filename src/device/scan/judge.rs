//! Looks at frames while the next one is being taken.

use crate::device::look::Look;
use crate::files::{InputKind, read_input};
use crate::machine;
use crate::raw::{Hint, decode};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;

const UNREADABLE: &str = "the file makes the decoder fail";

/// What a frame turned out to be.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Seen {
    Look(Look),
    /// It is no usable picture; a sentence.
    Damaged(String),
    /// It is not as large as the rig says.
    Size {
        found: String,
        expected: String,
    },
}

/// A thread that decodes; it ends with this value.
#[derive(Debug)]
pub(super) struct Judge {
    work: Sender<(usize, PathBuf)>,
    results: Receiver<(usize, Seen)>,
}

impl Judge {
    /// For frames of this size.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(super) fn start(size_px: [usize; 2]) -> std::io::Result<Self> {
        let (work, inbox) = mpsc::channel::<(usize, PathBuf)>();
        let (outbox, results) = mpsc::channel();
        machine::spawn("frames", move || {
            for (step, path) in inbox {
                // A decoder that fails on a file must not end the scan.
                let seen = std::panic::catch_unwind(|| judge(&path, size_px));
                let seen = seen.unwrap_or_else(|_| Seen::Damaged(UNREADABLE.to_owned()));
                if outbox.send((step, seen)).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { work, results })
    }

    /// Looks at a frame's file.
    pub(super) fn look_at(&self, step: usize, path: Option<PathBuf>) {
        if let Some(path) = path {
            let _ = self.work.send((step, path));
        }
    }

    /// The next frame that has been looked at, if there is one within `wait`.
    pub(super) fn next(&self, wait: Duration) -> Option<(usize, Seen)> {
        self.results.recv_timeout(wait).ok()
    }
}

fn judge(path: &Path, size_px: [usize; 2]) -> Seen {
    let bytes = match read_input(path, InputKind::Picture) {
        Ok(bytes) => bytes,
        Err(error) => return Seen::Damaged(format!("{}: {error}", path.display())),
    };
    match decode(&bytes, &Hint::default()) {
        Err(error) => Seen::Damaged(error.to_string()),
        Ok(frame) if [frame.width, frame.height] != size_px => Seen::Size {
            found: format!("{} x {}", frame.width, frame.height),
            expected: format!("{} x {}", size_px[0], size_px[1]),
        },
        Ok(frame) => Seen::Look(Look::at(&frame)),
    }
}
