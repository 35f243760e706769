//! The one thread that owns devices and solver. Requests come in, updates go out; the window never waits for it. A second one
//! reads what lies on the disk, so that scans are listed while another is taken.
//!
//! Work that the user no longer wants is ended by unwinding from its progress callback, as rust-analyzer ends its queries:
//! the library's outputs appear only when whole, so nothing half-written stays.

use crate::jobs::control::JobControl;
use crate::jobs::messages::{Request, Update};
use crate::jobs::outbox::Outbox;
use crate::jobs::tools::Tools;
use crate::jobs::{calibrate, dropped, look, open, rig, scan, scans};
use eframe::egui;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use weavelight::machine::spawn;

/// How a thread is started.
type Spawn<'a> = dyn Fn(&str, Box<dyn FnOnce() + Send>) -> io::Result<JoinHandle<()>> + 'a;

/// The worker as the window sees it.
#[derive(Debug)]
pub struct Worker {
    requests: Sender<Request>,
    /// Those that only read.
    readings: Sender<Request>,
    updates: Receiver<Update>,
    /// Requests that are not done yet.
    open: Arc<AtomicUsize>,
    /// Ends or pauses what is going on.
    pub control: JobControl,
}

impl Worker {
    /// Starts the threads; they end with this value, after what they are doing. `ctx` is woken for every update.
    ///
    /// # Errors
    /// Where the system gives no thread: nothing works without.
    pub fn start(ctx: egui::Context) -> io::Result<Self> {
        Self::start_with(ctx, &|name, work| spawn(name, work))
    }

    fn start_with(ctx: egui::Context, spawn: &Spawn<'_>) -> io::Result<Self> {
        let (requests, inbox) = mpsc::channel();
        let (readings, to_read) = mpsc::channel();
        let (outbox, updates) = mpsc::channel();
        let control = JobControl::default();
        let out = Outbox::new(outbox, ctx, control.clone());
        let open = Arc::new(AtomicUsize::new(0));
        let (reader, read) = (out.clone(), open.clone());
        let reads = move || {
            for request in to_read {
                act(request, &mut Tools::default(), &reader);
                read.fetch_sub(1, Ordering::SeqCst);
            }
        };
        spawn("reader", Box::new(reads))?;
        let done = open.clone();
        let works = move || {
            let mut tools = Tools::default();
            for request in inbox {
                if !out.is_closing() {
                    out.begin();
                    act(request, &mut tools, &out);
                }
                done.fetch_sub(1, Ordering::SeqCst);
            }
        };
        spawn("worker", Box::new(works))?;
        Ok(Self { requests, readings, updates, open, control })
    }

    /// Hands over a request.
    pub fn request(&self, request: Request) {
        self.open.fetch_add(1, Ordering::SeqCst);
        let to = if request.only_reads() { &self.readings } else { &self.requests };
        // The threads live as long as this value.
        let _ = to.send(request);
    }

    /// Whether every request is done.
    pub fn is_idle(&self) -> bool {
        self.open.load(Ordering::SeqCst) == 0
    }

    /// What has happened since.
    pub fn updates(&self) -> impl Iterator<Item = Update> {
        self.updates.try_iter()
    }
}

fn act(request: Request, tools: &mut Tools, out: &Outbox) {
    let out = &out.of(request.area());
    match request {
        Request::Open(path) => dropped::open_path(&path, tools, out),
        Request::Reopen(folder) => open::reopen(&folder, tools, out),
        Request::Close => *tools = Tools::default(),
        Request::Dropped(path) => dropped::dropped(&path, tools, out),
        Request::MakeSimulatedRig(folder) => open::make_simulated(&folder, tools, out),
        Request::Rig(command) => rig::act::act(command, tools, out),
        Request::Calibrate(command) => calibrate::act::act(command, tools, out),
        Request::Scan(command) => scan::act::act(command, tools, out),
        Request::Look(command) => look::act::act(command, tools, out),
        Request::Scans(command) => scans::act::act(command, tools, out),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::time::Duration;

    /// Whichever thread is refused, that is an error, and the other one ends.
    #[test]
    fn a_window_without_threads_is_an_error() {
        for refused in 0..2 {
            let (asked, started) = (Cell::new(0), Cell::new(None));
            let give = |name: &str, work: Box<dyn FnOnce() + Send>| {
                if asked.replace(asked.get() + 1) == refused {
                    return Err(io::ErrorKind::WouldBlock.into());
                }
                let thread = spawn(name, work)?;
                let (ended, end) = mpsc::channel();
                let waits = spawn("waits", move || ended.send(thread.join().is_ok()).unwrap_or(()));
                started.set(Some(end));
                waits
            };
            let error = Worker::start_with(egui::Context::default(), &give).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::WouldBlock);
            if let Some(end) = started.take() {
                assert_eq!(end.recv_timeout(Duration::from_secs(60)), Ok(true));
            }
        }
    }
}
