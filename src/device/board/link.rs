//! The board at its port: a thread that drives the state machine, so that keep-alives go on whatever the caller waits for,
//! another that reads, and, after the port has gone away, one that looks for it.

use super::connection::Connection;
use super::discovery::{PortChoice, connect_at, find, find_again};
use super::error::BoardError;
use super::machine::{Event, Interruption, LightBoard};
use super::stream::Stream;
use super::wire::{Answer, Identity, Outputs, Request, Setting};
use crate::machine;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often a lost board is looked for.
const SEARCH_INTERVAL: Duration = Duration::from_millis(200);
/// How long the thread sleeps when the state machine has nothing to do.
const IDLE: Duration = Duration::from_secs(1);

/// A light board behind a serial port. Its lights go off when this value is dropped.
#[derive(Debug)]
pub struct Board {
    messages: Sender<Message>,
    shared: Arc<Shared>,
    worker: Option<JoinHandle<()>>,
    identity: Identity,
}

/// A light was switched, and read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// As read back.
    pub outputs: Outputs,
    /// How often the request had to be sent.
    pub tries: u32,
}

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    lifetime: AtomicU64,
}

#[derive(Debug)]
struct State {
    port: PathBuf,
    connected: bool,
    interruptions: Vec<Interruption>,
}

#[derive(Debug)]
struct Done {
    answer: Answer,
    tries: u32,
}

type Reply = Sender<Result<Done, BoardError>>;

enum Message {
    Ask(Request, Reply),
    Arrived(Lifetime, Vec<u8>),
    Gone(Lifetime),
    Found(Box<Connection>),
    End,
}

/// Which opening of the port something belongs to: threads and bytes of the one before do not count.
type Lifetime = u64;
const ENDED: Lifetime = u64::MAX;

impl Board {
    /// Finds the board, identifies it and switches everything off.
    ///
    /// `lights`: how many the rig has; a board with another number is an error. `None`: any will do.
    pub fn open(choice: PortChoice, lights: Option<usize>) -> Result<Self, BoardError> {
        let origin = Instant::now();
        let connection = find(&choice, origin)?;
        check_lights(&connection, lights)?;
        let board = Self::start(choice, connection, origin)?;
        board.off()?;
        board.take_interruptions();
        Ok(board)
    }

    fn start(
        choice: PortChoice,
        connection: Connection,
        origin: Instant,
    ) -> Result<Self, BoardError> {
        let (messages, inbox) = mpsc::channel();
        let state =
            State { port: connection.port.clone(), connected: true, interruptions: Vec::new() };
        let shared = Arc::new(Shared {
            state: Mutex::new(state),
            changed: Condvar::new(),
            lifetime: AtomicU64::new(0),
        });
        let identity = connection.identity.clone();
        let worker = Worker {
            choice,
            origin,
            shared: Arc::clone(&shared),
            messages: messages.clone(),
            reader: None,
            link: None,
            expected: identity.clone(),
            asked: VecDeque::new(),
        };
        let worker = machine::spawn("light board", move || worker.run(connection, &inbox))
            .map_err(|error| BoardError::NoThread { reason: error.to_string() })?;
        Ok(Self { messages, shared, worker: Some(worker), identity })
    }

    /// Switches `light` (an output of the board, from 0) on and every other off; returns when it has settled. `level`: 1 to
    /// 255, `None` for full.
    pub fn light(&self, light: u8, level: Option<u8>) -> Result<Shown, BoardError> {
        self.show(Request::Light { light, level })
    }

    /// Switches the back light on and every other light off.
    pub fn back_light(&self, level: Option<u8>) -> Result<Shown, BoardError> {
        self.show(Request::BackLight { level })
    }

    /// Switches everything off.
    pub fn off(&self) -> Result<Shown, BoardError> {
        self.show(Request::Off)
    }

    /// What the outputs are now.
    pub fn outputs(&self) -> Result<Shown, BoardError> {
        self.show(Request::Ping)
    }

    /// Closes the camera's remote contact for 1 to 5000 ms; returns at once.
    pub fn trigger(&self, duration_ms: u16) -> Result<Shown, BoardError> {
        self.show(Request::Trigger { duration_ms })
    }

    /// A setting of the board.
    pub fn setting(&self, setting: Setting) -> Result<u16, BoardError> {
        self.value(Request::Get(setting))
    }

    /// Changes a setting of the board; it keeps it without power.
    pub fn set(&self, setting: Setting, value: u16) -> Result<u16, BoardError> {
        self.value(Request::Set(setting, value))
    }

    /// What the board says of itself.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Where it is; another port than before if it was found there after unplugging.
    pub fn port(&self) -> PathBuf {
        self.shared.lock().port.clone()
    }

    /// What has happened since the last call that makes a frame void: taken before and after an exposure, the list after
    /// must be empty.
    pub fn take_interruptions(&self) -> Vec<Interruption> {
        std::mem::take(&mut self.shared.lock().interruptions)
    }

    /// Waits until an unplugged board is back.
    pub fn wait_until_connected(&self, timeout: Duration) -> Result<(), BoardError> {
        let state = self.shared.lock();
        let waited =
            self.shared.changed.wait_timeout_while(state, timeout, |state| !state.connected);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if state.connected {
            Ok(())
        } else {
            Err(BoardError::Unplugged { port: state.port.clone() })
        }
    }

    fn ask(&self, request: Request) -> Result<Done, BoardError> {
        let (reply, answer) = mpsc::channel();
        let unplugged = || BoardError::Unplugged { port: self.port() };
        self.messages.send(Message::Ask(request, reply)).map_err(|_| unplugged())?;
        answer.recv().map_err(|_| unplugged())?
    }

    fn show(&self, request: Request) -> Result<Shown, BoardError> {
        let done = self.ask(request)?;
        match done.answer {
            Answer::Outputs(outputs) => Ok(Shown { outputs, tries: done.tries }),
            // The state machine lets only an answer of the request's kind through.
            _ => Err(BoardError::Unplugged { port: self.port() }),
        }
    }

    fn value(&self, request: Request) -> Result<u16, BoardError> {
        match self.ask(request)?.answer {
            Answer::Value(value) => Ok(value),
            _ => Err(BoardError::Unplugged { port: self.port() }),
        }
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.messages.send(Message::End);
        if let Some(worker) = self.worker.take() {
            let _ = worker.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lifetime(&self) -> Lifetime {
        self.lifetime.load(Ordering::SeqCst)
    }

    fn start_lifetime(&self) -> Lifetime {
        self.lifetime.fetch_add(1, Ordering::SeqCst) + 1
    }
}

pub(super) fn check_lights(
    connection: &Connection,
    lights: Option<usize>,
) -> Result<(), BoardError> {
    let board = usize::from(connection.identity.lights.unwrap_or_default());
    match lights {
        Some(rig) if rig != board => {
            Err(BoardError::LightCount { port: connection.port.clone(), board, rig })
        }
        _ => Ok(()),
    }
}

struct Worker {
    choice: PortChoice,
    origin: Instant,
    shared: Arc<Shared>,
    messages: Sender<Message>,
    reader: Option<JoinHandle<()>>,
    link: Option<Link>,
    expected: Identity,
    /// The caller's requests; the state machine works on the first.
    asked: VecDeque<(Request, Reply)>,
}

/// While the port is open.
struct Link {
    stream: Box<dyn Stream>,
    board: LightBoard,
}

impl Worker {
    fn run(mut self, connection: Connection, inbox: &Receiver<Message>) {
        self.take_connection(connection);
        loop {
            self.move_on();
            let first = inbox.recv_timeout(self.pause()).ok();
            // Everything that is there comes before the clock: after a pause of this process, an answer that has long
            // arrived is not asked for again.
            for message in first.into_iter().chain(inbox.try_iter()) {
                if matches!(message, Message::End) {
                    return self.say_goodbye();
                }
                self.take_message(message);
            }
        }
    }

    fn now(&self) -> Duration {
        self.origin.elapsed()
    }

    fn pause(&self) -> Duration {
        let wakeup = self.link.as_ref().and_then(|link| link.board.wakeup());
        wakeup.map_or(IDLE, |wakeup| wakeup.saturating_sub(self.now()))
    }

    fn take_message(&mut self, message: Message) {
        let now = self.now();
        match message {
            Message::Ask(request, reply) => self.asked.push_back((request, reply)),
            Message::Arrived(lifetime, bytes) if lifetime == self.shared.lifetime() => {
                if let Some(link) = &mut self.link {
                    link.board.receive(&bytes, now);
                }
            }
            Message::Gone(lifetime) if lifetime == self.shared.lifetime() => self.lose(),
            Message::Found(connection) => self.take_connection(*connection),
            Message::Arrived(..) | Message::Gone(_) | Message::End => {}
        }
    }

    /// Everything that can be done without waiting.
    fn move_on(&mut self) {
        let now = self.now();
        if let Some(link) = &mut self.link {
            link.board.expire(now);
        }
        self.settle_events();
        self.ask_next();
        self.write();
    }

    fn ask_next(&mut self) {
        let now = self.now();
        match (&mut self.link, self.asked.front()) {
            (Some(link), Some((request, _))) if !link.board.is_busy() => {
                let _ = link.board.ask(*request, now);
            }
            (None, Some(_)) => self.refuse_all(),
            _ => {}
        }
    }

    fn refuse_all(&mut self) {
        let port = self.shared.lock().port.clone();
        for (_, reply) in self.asked.drain(..) {
            let _ = reply.send(Err(BoardError::Unplugged { port: port.clone() }));
        }
    }

    fn write(&mut self) {
        let Some(link) = &mut self.link else { return };
        let output = link.board.take_output();
        if !output.is_empty() && link.stream.send(&output).is_err() {
            self.lose();
        }
    }

    fn settle_events(&mut self) {
        while let Some(event) = self.link.as_mut().and_then(|link| link.board.next_event()) {
            match event {
                Event::Done { answer, tries, .. } => self.answer(Ok(Done { answer, tries })),
                Event::Failed { request, why } => {
                    self.answer(Err(BoardError::GivenUp { request, why }));
                }
                Event::Interrupted(Interruption::Silent) => {
                    // The port may be there and the board behind it not: open it anew.
                    self.shared.lock().interruptions.push(Interruption::Silent);
                    self.write();
                    self.lose();
                }
                Event::Interrupted(interruption) => {
                    self.shared.lock().interruptions.push(interruption);
                }
            }
        }
    }

    fn answer(&mut self, result: Result<Done, BoardError>) {
        if let Some((_, reply)) = self.asked.pop_front() {
            let _ = reply.send(result);
        }
    }

    fn take_connection(&mut self, connection: Connection) {
        match connection.stream.try_clone() {
            Ok(stream) => self.start_reading(stream),
            Err(_) => return self.search(),
        }
        {
            let mut state = self.shared.lock();
            state.port = connection.port;
            state.connected = true;
            self.shared.changed.notify_all();
        }
        self.link = Some(Link { stream: connection.stream, board: connection.board });
    }

    fn start_reading(&mut self, mut stream: Box<dyn Stream>) {
        let lifetime = self.shared.start_lifetime();
        let (messages, shared) = (self.messages.clone(), Arc::clone(&self.shared));
        let alone = self.messages.clone();
        let reader = machine::spawn("light board's port", move || {
            let mut bytes = [0; 256];
            while shared.lifetime() == lifetime {
                let message = match stream.read_some(&mut bytes) {
                    Ok(0) => continue,
                    Ok(count) => Message::Arrived(lifetime, bytes[..count].to_vec()),
                    Err(_) => Message::Gone(lifetime),
                };
                let gone = matches!(message, Message::Gone(_));
                if messages.send(message).is_err() || gone {
                    return;
                }
            }
        });
        if reader.is_err() {
            // A board that nobody listens to is as good as gone; it is looked for again.
            let _ = alone.send(Message::Gone(lifetime));
        }
        self.reader = reader.ok();
    }

    /// The port is gone, or nobody is behind it.
    fn lose(&mut self) {
        if self.link.take().is_none() {
            return;
        }
        {
            let mut state = self.shared.lock();
            state.connected = false;
            state.interruptions.push(Interruption::Unplugged);
        }
        self.refuse_all();
        self.search();
    }

    /// Until the reading thread has let go of the port, it cannot be opened again.
    fn stop_reading(&mut self) {
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }

    /// Looks for the board until it is there again, or this ends.
    fn search(&mut self) {
        let lifetime = self.shared.start_lifetime();
        self.stop_reading();
        let (choice, expected, origin) = (self.choice.clone(), self.expected.clone(), self.origin);
        let last = self.shared.lock().port.clone();
        let (messages, shared) = (self.messages.clone(), Arc::clone(&self.shared));
        // Without a thread it is not found again, and the scan says that it is gone.
        let _ = machine::spawn("light board's return", move || {
            while shared.lifetime() == lifetime {
                std::thread::sleep(SEARCH_INTERVAL);
                match find_again(&choice, &last, origin) {
                    Ok(connection) if connection.identity == expected => {
                        let _ = messages.send(Message::Found(Box::new(connection)));
                        return;
                    }
                    _ => {}
                }
            }
        });
    }

    /// The board goes dark at once instead of after its own half second.
    fn say_goodbye(mut self) {
        self.shared.lifetime.store(ENDED, Ordering::SeqCst);
        if let Some(link) = &mut self.link {
            let off = format!("\n{}", Request::Off.line(0));
            let _ = link.stream.send(off.as_bytes());
        }
        self.stop_reading();
    }
}

/// One look at a port, for `doctor`: who is there, or why nobody can be reached. The port is opened, which restarts the board.
pub fn identify_at(port: &Path) -> Result<Identity, BoardError> {
    connect_at(port, Instant::now()).map(|connection| connection.identity)
}
