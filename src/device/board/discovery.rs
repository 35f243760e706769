//! Which port the board is at: the one that is named, or the one behind which a board of ours answers.

use super::connection::{Connection, connect};
use super::error::BoardError;
use super::stream::{SimulatedBoard, open_serial};
use super::wire::LIGHTS_MAX;
use crate::instrument::{Controller, Rig};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Where to look for the board.
#[derive(Clone, Debug)]
pub enum PortChoice {
    /// Here, whatever kind of port it is.
    Path(PathBuf),
    /// At every USB serial port.
    Find,
    /// Nowhere: this one in memory.
    Simulated(SimulatedBoard),
}

impl PortChoice {
    /// Where the rig says; at every USB serial port where it does not.
    pub fn of_rig(rig: &Rig) -> Self {
        match &rig.controller {
            Some(Controller::Serial { port: Some(port) }) => Self::Path(port.into()),
            Some(Controller::Serial { port: None }) | None => Self::Find,
            Some(Controller::Simulated) => {
                let lights = u8::try_from(rig.lights.len()).unwrap_or(LIGHTS_MAX);
                Self::Simulated(SimulatedBoard::new(lights))
            }
        }
    }
}

/// Opens a port and identifies what is behind it.
pub(super) fn connect_at(port: &Path, origin: Instant) -> Result<Connection, BoardError> {
    connect(port, open_serial(port)?, origin)
}

/// The ports that could be a board's, in order: USB serial ports, as the operating systems name them.
pub fn candidates() -> Vec<PathBuf> {
    let mut ports: Vec<PathBuf> =
        listed_ports().into_iter().filter(|name| is_usb(name)).map(PathBuf::from).collect();
    ports.sort();
    ports
}

fn listed_ports() -> Vec<String> {
    // Where this folder is missing (containers), the crate would panic.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Vec::new();
    }
    let ports = serialport::available_ports().unwrap_or_default();
    ports.into_iter().map(|port| port.port_name).collect()
}

fn is_usb(name: &str) -> bool {
    ["/dev/ttyACM", "/dev/ttyUSB", "/dev/cu.usb", "/dev/cuaU", "COM"]
        .iter()
        .any(|start| name.starts_with(start))
}

/// Connects to the board.
pub(super) fn find(choice: &PortChoice, origin: Instant) -> Result<Connection, BoardError> {
    match choice {
        PortChoice::Path(port) => connect_at(port, origin),
        PortChoice::Find => find_among(&candidates(), origin),
        PortChoice::Simulated(board) => connect(Path::new("simulated"), board.stream(), origin),
    }
}

/// Connects to a board that was lost at `last`: there, if that port exists, so that other devices are left alone.
pub(super) fn find_again(
    choice: &PortChoice,
    last: &Path,
    origin: Instant,
) -> Result<Connection, BoardError> {
    match choice {
        PortChoice::Find if last.exists() => connect_at(last, origin),
        _ => find(choice, origin),
    }
}

/// Asks at all ports at once: a port behind which nobody answers takes five seconds.
fn find_among(ports: &[PathBuf], origin: Instant) -> Result<Connection, BoardError> {
    let tried: Vec<Result<Connection, BoardError>> = std::thread::scope(|scope| {
        let threads: Vec<_> = ports
            .iter()
            .map(|port| {
                let ask = move || connect_at(port, origin);
                (port, std::thread::Builder::new().spawn_scoped(scope, ask))
            })
            .collect();
        threads
            .into_iter()
            .filter_map(|(port, thread)| match thread {
                Ok(thread) => thread.join().ok(),
                // Where no thread is to be had, one port is asked after the other.
                Err(_) => Some(connect_at(port, origin)),
            })
            .collect()
    });
    let mut errors = Vec::new();
    for result in tried {
        match result {
            Ok(connection) => return Ok(connection),
            Err(error) => errors.push(error),
        }
    }
    match errors.len() {
        0 => Err(BoardError::NoPort),
        1 => Err(errors.remove(0)),
        _ => {
            Err(BoardError::NoneAnswers { tried: errors.iter().map(ToString::to_string).collect() })
        }
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use crate::device::board::BoardModel;
    use serialport::{SerialPort, TTYPort};
    use std::io::{Read, Write};
    use std::time::Duration;

    /// A port with a board behind it, or with something that says nothing.
    fn port(mut board: Option<BoardModel>) -> PathBuf {
        let (mut ours, mut theirs) = TTYPort::pair().unwrap();
        theirs.set_exclusive(false).unwrap();
        let name = theirs.name().unwrap();
        std::thread::spawn(move || {
            let mut bytes = [0; 64];
            let start = Instant::now();
            loop {
                match (ours.read(&mut bytes), &mut board) {
                    (Ok(count), Some(board)) => {
                        board.receive(&bytes[..count], start.elapsed());
                        let _ = ours.write_all(&board.take_output());
                    }
                    (Ok(_), None) => {}
                    // Nobody has it open.
                    (Err(_), _) => std::thread::sleep(Duration::from_millis(5)),
                }
            }
        });
        name.into()
    }

    #[test]
    fn the_board_is_found_by_who_answers() {
        let board = port(Some(BoardModel::new(12, Duration::ZERO)));
        let ports = [port(None), board.clone(), PathBuf::from("/dev/ttyACM99")];
        let found = find_among(&ports, Instant::now()).unwrap();
        assert_eq!((found.port, found.identity.lights), (board, Some(12)));
    }

    #[test]
    fn where_none_answers_each_port_is_named() {
        let silent = port(None);
        let ports = [silent.clone(), PathBuf::from("/dev/ttyACM99")];
        let error = find_among(&ports, Instant::now()).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(&format!("{}: nothing answers", silent.display())), "{error}");
        assert!(error.contains("/dev/ttyACM99: there is no such port"), "{error}");
        let error = find_among(&[], Instant::now()).map(|_| ()).unwrap_err();
        assert_eq!(error, BoardError::NoPort);
    }
}
