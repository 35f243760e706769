//! What the machine has to give: threads and memory. Asked before the work, so that a machine or a limit too small for it ends
//! in a sentence, not in the middle of a picture.

mod environment;
mod folders;
mod memory;
mod quiet;
mod threads;

pub use environment::correct_environment;
pub use folders::{cache_folder, config_folder, state_folder};
pub use memory::{NoMemory, available_bytes, check_memory};
pub use quiet::Quiet;
pub use threads::{Pool, spawn, start, thread_count};
