//! What `doctor` tells of the light board.

use super::discovery::{PortChoice, candidates};
use super::error::BoardError;
use super::link::identify_at;
use super::wire::Identity;
use std::path::PathBuf;

/// What was found at one port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortFinding {
    /// The port.
    pub port: PathBuf,
    /// The board there, or why there is none: a sentence that says what to do.
    pub result: Result<Identity, BoardError>,
}

/// Looks at the named port, or at every one that could be a board's. Opening a port restarts the board behind it, and a port
/// that does not answer takes five seconds (all at once). An empty list: there is no port.
///
/// `lights`: how many the rig has, if there is one.
pub fn diagnose(choice: &PortChoice, lights: Option<usize>) -> Vec<PortFinding> {
    let ports = match choice {
        PortChoice::Path(port) => vec![port.clone()],
        PortChoice::Find => candidates(),
        PortChoice::Simulated(_) => Vec::new(),
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = ports
            .into_iter()
            .map(|port| {
                let beside = port.clone();
                let look = move || look_at(beside, lights);
                (port, std::thread::Builder::new().spawn_scoped(scope, look))
            })
            .collect();
        threads
            .into_iter()
            .filter_map(|(port, thread)| match thread {
                Ok(thread) => thread.join().ok(),
                // Where no thread is to be had, one port is looked at after the other.
                Err(_) => Some(look_at(port, lights)),
            })
            .collect()
    })
}

fn look_at(port: PathBuf, lights: Option<usize>) -> PortFinding {
    let result = identify_at(&port).and_then(|identity| {
        let board = usize::from(identity.lights.unwrap_or_default());
        match lights {
            Some(rig) if rig != board => {
                Err(BoardError::LightCount { port: port.clone(), board, rig })
            }
            _ => Ok(identity),
        }
    });
    PortFinding { port, result }
}
