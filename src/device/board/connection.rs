//! Opening a port and finding out who is behind it.

use super::error::BoardError;
use super::machine::{Event, Failure, LightBoard};
use super::stream::Stream;
use super::wire::{Answer, Identity, PROTOCOL, Request};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

/// An open port with a board of ours behind it, which speaks our protocol.
pub(super) struct Connection {
    pub(super) port: PathBuf,
    pub(super) stream: Box<dyn Stream>,
    pub(super) board: LightBoard,
    pub(super) identity: Identity,
}

/// Identifies what is behind `stream`; takes up to five seconds. `port` is its name in messages, `origin` is where the board's
/// time starts.
pub(super) fn connect(
    port: &Path,
    mut stream: Box<dyn Stream>,
    origin: Instant,
) -> Result<Connection, BoardError> {
    let mut board = LightBoard::new(first_seq());
    let identity = identify(port, stream.as_mut(), &mut board, origin)?;
    if identity.protocol != PROTOCOL {
        let Identity { firmware, protocol: found, .. } = identity;
        return Err(BoardError::Protocol { port: port.to_owned(), firmware, found });
    }
    Ok(Connection { port: port.to_owned(), stream, board, identity })
}

/// Another one in each run; see [`LightBoard::new`].
fn first_seq() -> u16 {
    let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    (since_epoch.subsec_micros() & 0xFFFF) as u16
}

fn identify(
    port: &Path,
    stream: &mut dyn Stream,
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
        stream.send(&board.take_output()).map_err(gone)?;
        let mut bytes = [0; 256];
        let count = stream.read_some(&mut bytes).map_err(gone)?;
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

fn explain_failure(port: &Path, why: Failure, heard: Option<&str>) -> BoardError {
    let port = port.to_owned();
    match (why, heard) {
        (Failure::NoAnswer, _) | (_, None) => BoardError::Silent { port },
        (_, Some(said)) => BoardError::Foreign { port, said: said.chars().take(40).collect() },
    }
}
