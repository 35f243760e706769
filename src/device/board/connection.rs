//! Opening a port and finding out who is behind it.

use super::error::BoardError;
use super::machine::{Event, Failure, LightBoard};
use super::wire::{Answer, Identity, PROTOCOL, Request};
use serialport::SerialPort;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

const BAUD: u32 = 115_200;
/// How long a read waits: how soon the reading thread notices that it should end.
const READ_TIMEOUT: Duration = Duration::from_millis(20);

/// An open port with a board of ours behind it, which speaks our protocol.
pub(super) struct Connection {
    pub(super) port: PathBuf,
    pub(super) serial: Box<dyn SerialPort>,
    pub(super) board: LightBoard,
    pub(super) identity: Identity,
}

/// Opens `port` and identifies what is behind it; takes up to five seconds. `origin` is where the board's time starts.
pub(super) fn connect(port: &Path, origin: Instant) -> Result<Connection, BoardError> {
    let mut serial = open(port)?;
    let mut board = LightBoard::new(first_seq());
    let identity = identify(port, serial.as_mut(), &mut board, origin)?;
    if identity.protocol != PROTOCOL {
        let Identity { firmware, protocol: found, .. } = identity;
        return Err(BoardError::Protocol { port: port.to_owned(), firmware, found });
    }
    Ok(Connection { port: port.to_owned(), serial, board, identity })
}

/// Another one in each run; see [`LightBoard::new`].
fn first_seq() -> u16 {
    let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    (since_epoch.subsec_micros() & 0xFFFF) as u16
}

fn open(port: &Path) -> Result<Box<dyn SerialPort>, BoardError> {
    // DTR resets an Uno; a pseudo-terminal has none, which does no harm.
    serialport::new(port.to_string_lossy(), BAUD)
        .timeout(READ_TIMEOUT)
        .dtr_on_open(true)
        .open()
        .map_err(|error| explain_open(port, &error))
}

fn explain_open(port: &Path, error: &serialport::Error) -> BoardError {
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

fn identify(
    port: &Path,
    serial: &mut dyn SerialPort,
    board: &mut LightBoard,
    origin: Instant,
) -> Result<Identity, BoardError> {
    let gone = |error: io::Error| BoardError::PortUnusable {
        port: port.to_owned(),
        reason: error.to_string(),
    };
    // Nobody else asks, so it cannot be busy.
    let _ = board.ask(Request::Identify, origin.elapsed());
    loop {
        serial.write_all(&board.take_output()).map_err(gone)?;
        let mut bytes = [0; 256];
        let count = read_some(serial, &mut bytes).map_err(gone)?;
        board.receive(&bytes[..count], origin.elapsed());
        board.expire(origin.elapsed());
        match board.next_event() {
            Some(Event::Done { answer: Answer::Identity(identity), .. }) => return Ok(identity),
            Some(Event::Failed { why, .. }) => {
                return Err(explain_failure(port, why, board.heard()));
            }
            // It restarts because the port was opened.
            _ => {}
        }
    }
}

/// Reads what is there; 0 if nothing comes in time. An end of the stream is an error.
pub(super) fn read_some(serial: &mut dyn SerialPort, bytes: &mut [u8]) -> io::Result<usize> {
    match serial.read(bytes) {
        Ok(0) => Err(io::ErrorKind::BrokenPipe.into()),
        Err(error)
            if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) =>
        {
            Ok(0)
        }
        other => other,
    }
}

fn explain_failure(port: &Path, why: Failure, heard: Option<&str>) -> BoardError {
    let port = port.to_owned();
    match (why, heard) {
        (Failure::NoAnswer, _) | (_, None) => BoardError::Silent { port },
        (_, Some(said)) => BoardError::Foreign { port, said: said.chars().take(40).collect() },
    }
}
