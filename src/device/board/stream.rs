//! The byte streams that a board can be behind: a serial port, or memory.

use super::error::BoardError;
use super::model::BoardModel;
use serialport::SerialPort;
use std::io;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

const BAUD: u32 = 115_200;
/// How long a read waits: how soon the reading thread notices that it should end.
const READ_TIMEOUT: Duration = Duration::from_millis(20);

/// Bytes to and from a board.
pub(super) trait Stream: Send {
    /// Reads what is there; 0 if nothing comes within a short while. An end of the stream is an error.
    fn read_some(&mut self, bytes: &mut [u8]) -> io::Result<usize>;
    /// Sends.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// The same stream, for the reading thread.
    fn try_clone(&self) -> io::Result<Box<dyn Stream>>;
}

/// Opens a serial port. On most boards that resets the processor.
pub(super) fn open_serial(port: &Path) -> Result<Box<dyn Stream>, BoardError> {
    // DTR resets an Uno; a pseudo-terminal has none, which does no harm.
    let serial = serialport::new(port.to_string_lossy(), BAUD)
        .timeout(READ_TIMEOUT)
        .dtr_on_open(true)
        .open();
    match serial {
        Ok(serial) => Ok(Box::new(Serial(serial))),
        Err(error) => Err(explain(port, &error)),
    }
}

fn explain(port: &Path, error: &serialport::Error) -> BoardError {
    use io::ErrorKind as Io;
    use serialport::ErrorKind as Kind;
    let port = port.to_owned();
    match error.kind() {
        Kind::Io(Io::NotFound) => BoardError::PortMissing { port },
        Kind::Io(Io::PermissionDenied) => BoardError::Permission { port },
        // The same for "locked by another" and, on Windows, "not there".
        Kind::NoDevice if port.exists() => BoardError::PortBusy { port },
        Kind::NoDevice => BoardError::PortMissing { port },
        _ => BoardError::PortUnusable { port, reason: error.to_string() },
    }
}

struct Serial(Box<dyn SerialPort>);

impl Stream for Serial {
    fn read_some(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.0.read(bytes) {
            Ok(0) => Err(io::ErrorKind::BrokenPipe.into()),
            Err(error)
                if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) =>
            {
                Ok(0)
            }
            other => other,
        }
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn try_clone(&self) -> io::Result<Box<dyn Stream>> {
        Ok(Box::new(Serial(self.0.try_clone()?)))
    }
}

/// A simulated board, without port and processor: for rigs whose controller is "simulated". Clones are the same board.
#[derive(Clone, Debug)]
pub struct SimulatedBoard {
    shared: Arc<(Mutex<BoardModel>, Condvar)>,
    origin: Instant,
}

impl SimulatedBoard {
    /// A board with so many lights.
    pub fn new(lights: u8) -> Self {
        let shared =
            Arc::new((Mutex::new(BoardModel::new(lights, Duration::ZERO)), Condvar::new()));
        Self { shared, origin: Instant::now() }
    }

    /// What its outputs are now: what a simulated camera sees.
    pub fn pins(&self) -> u32 {
        let mut board = self.lock();
        board.advance(self.origin.elapsed());
        board.pins()
    }

    fn lock(&self) -> MutexGuard<'_, BoardModel> {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn stream(&self) -> Box<dyn Stream> {
        Box::new(Memory { board: self.clone(), arrived: Vec::new() })
    }
}

struct Memory {
    board: SimulatedBoard,
    arrived: Vec<u8>,
}

impl Stream for Memory {
    fn read_some(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut board = self.board.lock();
        board.advance(self.board.origin.elapsed());
        self.arrived.extend(board.take_output());
        if self.arrived.is_empty() {
            let waited = self.board.shared.1.wait_timeout(board, READ_TIMEOUT);
            board = waited.unwrap_or_else(PoisonError::into_inner).0;
            self.arrived.extend(board.take_output());
        }
        let count = self.arrived.len().min(bytes.len());
        bytes[..count].copy_from_slice(&self.arrived[..count]);
        self.arrived.drain(..count);
        Ok(count)
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.board.lock().receive(bytes, self.board.origin.elapsed());
        self.board.shared.1.notify_all();
        Ok(())
    }

    fn try_clone(&self) -> io::Result<Box<dyn Stream>> {
        Ok(self.board.stream())
    }
}
