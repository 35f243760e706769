//! Scanning: one light after the other, a picture of each, every frame safe before the next light.
//!
//! [`Sequencer`] is the order of a scan as a state machine without input and output; [`scan`] drives it with a light board, a
//! camera and a folder. Frames are looked at while the next is being taken: a light that stays dark is tried again. A
//! scan that is killed at any moment resumes from its folder. Calibration targets are photographed in the same way ([`Subject`]).

mod assess;
mod control;
mod error;
mod exposure;
mod judge;
mod open;
mod plan;
mod run;
mod sequencer;
mod shoot;
mod store;
mod subject;
mod summary;

pub use super::look::{BINS, Channel, Look};
pub use assess::Assessor;
pub use control::Control;
pub use error::ScanError;
pub use exposure::{Preview, preview};
pub use open::{CameraFinding, Instruments, diagnose_camera, open};
pub use plan::{Plan, Step};
pub use run::{Options, scan};
pub use sequencer::{
    Action, Ending, Input, Judgement, MOST_ATTEMPTS, MOST_DARK, Sequencer, Trouble,
};
pub use store::{About, Begin, survey};
pub use subject::{Pose, Sheet, Subject};
pub use summary::{Event, Seconds, Summary};
