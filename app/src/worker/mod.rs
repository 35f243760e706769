//! The one thread that owns devices and solver. Commands come in, updates go out; the window never waits for it. A second one
//! reads what lies on the disk, so that scans are listed while another is taken.
//!
//! Work that the user no longer wants is ended by unwinding from its progress callback, as rust-analyzer ends its queries:
//! the library's outputs appear only when whole, so nothing half-written stays.

pub mod bin;
pub mod instruments;
mod job;
pub mod open;
pub(crate) mod watch;
pub(crate) mod what;

pub use job::{Ended, Outbox};

use crate::desk::{Area, Problem};
use crate::place::Place;
use crate::rooms::{Room, calibrate, look, rig, scan, scans};
use eframe::egui;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Duration;
use weavelight::device::scan::Instruments;
use weavelight::machine::spawn;

/// What is to be done.
#[derive(Debug)]
pub enum Command {
    /// Open the rig in this folder.
    Open(PathBuf),
    /// Let the rig go: others may use it.
    Close,
    /// Do what is meant by a folder that was dropped into the window: open the rig, solve the scan, look at the solution.
    Dropped(PathBuf),
    /// Make a simulated rig in this folder, and open it.
    MakeSimulatedRig(PathBuf),
    /// Of the Rig room.
    Rig(rig::Ask),
    /// Of the Calibrate room.
    Calibrate(calibrate::Ask),
    /// Of the Scan room.
    Scan(scan::Ask),
    /// Of the Look room.
    Look(look::Ask),
    /// Of the Scans room.
    Scans(scans::Ask),
}

impl Command {
    /// What it belongs to.
    fn area(&self) -> Area {
        match self {
            Command::Open(_)
            | Command::Close
            | Command::Dropped(_)
            | Command::MakeSimulatedRig(_) => Area::Opening,
            Command::Rig(_) => Area::Rig,
            Command::Calibrate(_) => Area::Calibrate,
            Command::Scan(_) => Area::Scan,
            Command::Look(_) => Area::Look,
            Command::Scans(_) => Area::Scans,
        }
    }

    /// Of which area it is a new try; `None` for what the program asks by itself.
    pub fn tries(&self) -> Option<Area> {
        let by_the_user = match self {
            Command::Close => false,
            Command::Open(_) | Command::Dropped(_) | Command::MakeSimulatedRig(_) => true,
            Command::Rig(ask) => {
                !matches!(ask, rig::Ask::ReadCalibration(_) | rig::Ask::Light(None))
            }
            Command::Calibrate(ask) => {
                !matches!(ask, calibrate::Ask::Refresh | calibrate::Ask::Look(..))
            }
            Command::Scan(ask) => !matches!(ask, scan::Ask::LookForUnfinished),
            Command::Look(ask) => {
                use look::Ask;
                !matches!(
                    ask,
                    Ask::Picture(..) | Ask::Residual(..) | Ask::Photosite(..) | Ask::Draft(_)
                )
            }
            Command::Scans(ask) => !matches!(ask, scans::Ask::List(_) | scans::Ask::Thumbnail(..)),
        };
        by_the_user.then(|| self.area())
    }

    /// Whether it needs neither devices nor the solver, and says itself of which rig it is.
    fn only_reads(&self) -> bool {
        match self {
            Command::Rig(ask) => matches!(ask, rig::Ask::ReadCalibration(_)),
            Command::Look(ask) => matches!(ask, look::Ask::Draft(_)),
            Command::Scans(ask) => {
                matches!(ask, scans::Ask::List(_) | scans::Ask::Thumbnail(..))
            }
            _ => false,
        }
    }
}

/// What has happened.
#[derive(Debug)]
pub enum Update {
    /// Work that takes its time has begun, as in "Solving linen 4021".
    Began(String),
    /// How far it is.
    Progress {
        /// 0 to 1.
        share: f64,
        /// As in "light 4".
        step: String,
        /// Time left where the work foresees it.
        left: Option<Duration>,
    },
    /// It has ended, one way or the other.
    Ended,
    /// Something went wrong.
    Problem(Problem),
    /// What was asked for is in this room.
    GoTo(Room),
    /// A rig is open.
    Opened(Box<Place>),
    /// Which other program holds the rig in a folder, in words.
    Held(PathBuf, Option<String>),
    /// Whether the lights of the rig in a folder are calibrated.
    Calibrated(PathBuf, bool),
    /// How old its calibration is, days.
    CalibrationAge(Option<i64>),
    /// For the Rig room.
    Rig(rig::Told),
    /// For the Calibrate room.
    Calibrate(calibrate::Told),
    /// For the Scan room.
    Scan(scan::Told),
    /// For the Look room.
    Look(look::Told),
    /// For the Scans room.
    Scans(scans::Told),
}

/// What the worker holds between commands.
#[derive(Debug, Default)]
pub struct Tools {
    /// The rig that is open.
    pub place: Option<Place>,
    /// Its board and camera, opened when first needed and closed with the rig or when they fail.
    pub instruments: Option<Instruments>,
    /// Looks whether another program holds it.
    pub watch: Option<watch::Watch>,
    /// What was seen in pictures of targets.
    pub calibrate: calibrate::Memory,
    /// The frames that the Look room asked about last.
    pub frames: look::Frames,
}

/// How a thread is started.
type Spawn<'a> = dyn Fn(&str, Box<dyn FnOnce() + Send>) -> io::Result<JoinHandle<()>> + 'a;

/// The worker as the window sees it.
#[derive(Debug)]
pub struct Worker {
    commands: Sender<Command>,
    /// Those that only read.
    readings: Sender<Command>,
    updates: Receiver<Update>,
    /// Commands that are not done yet.
    open: Arc<AtomicUsize>,
    /// Ends or pauses what is going on.
    pub brake: job::Brake,
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
        let (commands, inbox) = mpsc::channel();
        let (readings, to_read) = mpsc::channel();
        let (outbox, updates) = mpsc::channel();
        let brake = job::Brake::default();
        let out = Outbox::new(outbox, ctx, brake.clone());
        let open = Arc::new(AtomicUsize::new(0));
        let (reader, read) = (out.clone(), open.clone());
        let reads = move || {
            for command in to_read {
                act(command, &mut Tools::default(), &reader);
                read.fetch_sub(1, Ordering::SeqCst);
            }
        };
        spawn("reader", Box::new(reads))?;
        let done = open.clone();
        let works = move || {
            let mut tools = Tools::default();
            for command in inbox {
                if !out.is_closing() {
                    out.begin();
                    act(command, &mut tools, &out);
                }
                done.fetch_sub(1, Ordering::SeqCst);
            }
        };
        spawn("worker", Box::new(works))?;
        Ok(Self { commands, readings, updates, open, brake })
    }

    /// Hands over a command.
    pub fn ask(&self, command: Command) {
        self.open.fetch_add(1, Ordering::SeqCst);
        let to = if command.only_reads() { &self.readings } else { &self.commands };
        // The threads live as long as this value.
        let _ = to.send(command);
    }

    /// Whether every command is done.
    pub fn is_idle(&self) -> bool {
        self.open.load(Ordering::SeqCst) == 0
    }

    /// What has happened since.
    pub fn updates(&self) -> impl Iterator<Item = Update> {
        self.updates.try_iter()
    }
}

fn act(command: Command, tools: &mut Tools, out: &Outbox) {
    let out = &out.of(command.area());
    match command {
        Command::Open(path) => open::open_path(&path, tools, out),
        Command::Close => *tools = Tools::default(),
        Command::Dropped(path) => open::dropped(&path, tools, out),
        Command::MakeSimulatedRig(folder) => open::make_simulated(&folder, tools, out),
        Command::Rig(ask) => rig::act(ask, tools, out),
        Command::Calibrate(ask) => calibrate::act(ask, tools, out),
        Command::Scan(ask) => scan::act(ask, tools, out),
        Command::Look(ask) => look::act(ask, tools, out),
        Command::Scans(ask) => scans::act(ask, tools, out),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

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
