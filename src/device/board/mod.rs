//! The light board: its protocol, and the serial link around it.
//!
//! [`wire`] is the lines, [`LightBoard`] the host's end of the protocol as a state machine without input and output.
//! `firmware/PROTOCOL.md` describes the protocol, `firmware/weavelight` is the other end.

mod machine;
pub mod wire;

pub use machine::{
    BUDGET, Busy, Event, Failure, IDENTIFY_BUDGET, IDENTIFY_RETRY, Interruption, KEEP_ALIVE,
    LightBoard, RETRY, RETRY_AT_ONCE,
};
