//! The helper process: started, asked, killed.

use super::protocol::{Answer, Call, Fault, Line, Moment, Request, Said};
use crate::machine;
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// How long it may take to let the camera go when it is no longer needed.
const GRACE: Duration = Duration::from_secs(1);
const POLL: Duration = Duration::from_millis(5);

/// Why a request to the helper brought nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum CallError {
    /// It said why.
    Fault(Fault),
    /// It did not answer in time and was killed.
    TimedOut(Duration),
    /// It ended, or says what cannot be understood.
    Ended,
}

/// A running helper. It ends with this value: by itself, or killed.
#[derive(Debug)]
pub(super) struct Helper {
    child: Child,
    requests: Option<ChildStdin>,
    lines: Receiver<Line>,
    last_id: u64,
}

impl Helper {
    /// Starts `program`. `home` takes the place of the user's folder: libgphoto2 keeps settings there, such as where pictures
    /// go, and the user's own must not change, however this ends.
    pub(super) fn start(program: &Path, home: &Path) -> io::Result<Self> {
        let mut command = Command::new(program);
        command.env("HOME", home).stdin(Stdio::piped()).stdout(Stdio::piped());
        command.stderr(Stdio::null());
        // An interrupt at the terminal is for this program to answer: it lets the frame be finished and the camera go.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn()?;
        let (sender, lines) = mpsc::channel();
        if let Some(output) = child.stdout.take() {
            let reader = machine::spawn("camera helper", move || {
                for line in BufReader::new(output).lines().map_while(Result::ok) {
                    let Ok(line) = serde_json::from_str(&line) else { return };
                    if sender.send(line).is_err() {
                        return;
                    }
                }
            });
            if let Err(error) = reader {
                let _ = child.kill();
                let _ = child.wait();
                return Err(error);
            }
        }
        let requests = child.stdin.take();
        Ok(Self { child, requests, lines, last_id: 0 })
    }

    /// Asks, and waits for the answer for at most `limit`; after an error other than a fault, this value is of no use any more.
    pub(super) fn call(
        &mut self,
        request: Request,
        limit: Duration,
        moment: &mut dyn FnMut(Moment),
    ) -> Result<Answer, CallError> {
        let deadline = Instant::now() + limit;
        self.last_id += 1;
        let call = Call { id: self.last_id, request };
        self.send(&call).map_err(|_| CallError::Ended)?;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                // What belongs to another request came too late.
                Ok(line) if line.id != self.last_id => {}
                Ok(Line { said: Said::Moment(what), .. }) => moment(what),
                Ok(Line { said: Said::Done(answer), .. }) => return Ok(answer),
                Ok(Line { said: Said::Failed(fault), .. }) => return Err(CallError::Fault(fault)),
                Err(RecvTimeoutError::Timeout) => {
                    self.kill();
                    return Err(CallError::TimedOut(limit));
                }
                Err(RecvTimeoutError::Disconnected) => return Err(CallError::Ended),
            }
        }
    }

    fn send(&mut self, call: &Call) -> io::Result<()> {
        let mut line = serde_json::to_string(call)?;
        line.push('\n');
        let requests = self.requests.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        requests.write_all(line.as_bytes())?;
        requests.flush()
    }

    fn kill(&mut self) {
        // It may have ended by itself, which is as good.
        let _ended = self.child.kill().and_then(|()| self.child.wait());
    }
}

impl Drop for Helper {
    fn drop(&mut self) {
        self.requests = None;
        let deadline = Instant::now() + GRACE;
        while Instant::now() < deadline {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(POLL);
        }
        self.kill();
    }
}
