//! The light board: its protocol, and the serial link around it.
//!
//! [`wire`] is the lines, [`LightBoard`] the host's end of the protocol as a state machine without input and output, [`Board`]
//! the board at a serial port or in memory ([`SimulatedBoard`]). `firmware/PROTOCOL.md` describes the protocol, `firmware/weavelight` is the other end.

mod connection;
mod diagnose;
mod discovery;
mod error;
mod link;
mod machine;
mod model;
mod stream;
pub mod wire;

pub use diagnose::{PortFinding, diagnose};
pub use discovery::{PortChoice, candidates};
pub use error::BoardError;
pub use link::{Board, Shown, identify_at};
pub use machine::{
    BUDGET, Busy, Event, Failure, IDENTIFY_BUDGET, IDENTIFY_RETRY, Interruption, KEEP_ALIVE,
    LightBoard, RETRY, RETRY_AT_ONCE,
};
pub use model::BoardModel;
pub use stream::SimulatedBoard;
pub use wire::{Identity, Outputs, Setting};
