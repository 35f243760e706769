//! The state of the calibration wizard: a function of what lies in a rig's folder, without any window.
//!
//! - [`RigFolder`]: where a rig's calibration, pictures and history are
//! - [`Task`]: the one thing to do next; [`State`]: what is there, from which the task follows
//! - [`read`]: reads that state; [`Memory`] keeps what was found, so that no picture is searched twice
//! - [`history`]: earlier calibrations and pictures; [`Verdict`]: the result of the check

pub mod history;
mod read;
mod rig_folder;
mod sheets;
mod state;
mod task;
mod verdict;

pub use history::{Entry, Kept};
pub use read::{Memory, foresee, read};
pub use rig_folder::{RIG_FILE, RigFolder, age_days};
pub use sheets::Sheets;
pub use state::{BOARDS, State};
pub use task::{BOARD_SESSION, GREY_SESSION, Placement, Pose, REFUSED, Step, Task};
pub use verdict::Verdict;
