//! What the window does besides drawing: the worker's threads and the jobs of each room.
//!
//! Rooms leave requests in the [`state::AppState`]; the [`worker`] does them and reports with [`messages::Update`]. Each room's
//! folder owns its `Command` and `Event`.
//!
//! - [`messages`]: all requests and updates; [`outbox`]: where jobs report; [`control`]: cancel and pause
//! - [`tools`]: what the worker holds; [`instruments`]: board and camera; [`watch`], [`holder`]: other programs
//! - [`open`], [`dropped`], [`identify`]: rigs and other folders; [`bin`]: the system's bin
//! - [`settings_saver`]: saves the settings

pub mod bin;
pub mod calibrate;
pub mod control;
pub mod dropped;
pub mod holder;
pub mod identify;
pub mod instruments;
pub mod look;
pub mod messages;
pub mod open;
pub mod outbox;
pub mod rig;
pub mod scan;
pub mod scans;
pub mod settings_saver;
pub mod state;
pub mod tools;
pub mod watch;
pub mod worker;
