//! Which port the board is at: the one that is named, or the one behind which a board of ours answers.

use super::connection::{Connection, connect};
use super::error::BoardError;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Where to look for the board.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PortChoice {
    /// Here, whatever kind of port it is.
    Path(PathBuf),
    /// At every USB serial port.
    Find,
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
        PortChoice::Path(port) => connect(port, origin),
        PortChoice::Find => find_among(&candidates(), origin),
    }
}

/// Asks at all ports at once: a port behind which nobody answers takes five seconds.
pub(super) fn find_among(ports: &[PathBuf], origin: Instant) -> Result<Connection, BoardError> {
    let tried: Vec<Result<Connection, BoardError>> = std::thread::scope(|scope| {
        let threads: Vec<_> =
            ports.iter().map(|port| scope.spawn(move || connect(port, origin))).collect();
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
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
