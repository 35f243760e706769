//! The desktop window: scan, calibrate, look.
//!
//! - [`app`]: the window as a whole: rooms, keys, the problems' panel
//! - [`rooms`]: one module each; a room draws, keeps what only it needs, and asks
//! - [`desk`]: what all rooms share, and where they leave what they want done
//! - [`worker`]: the one thread that owns devices and solver; nothing else waits for anything
//! - [`browse`]: the system's dialogue for folders and files
//! - [`place`]: the folders of a rig: its calibration, its scans, their solutions
//! - [`settings`]: what is remembered, [`keeper`]: and kept; [`theme`]: colours and sizes; [`texts`]: every word
//!
//! Panels only draw and ask (`desk.ask(Command::...)`); the worker acts and tells ([`worker::Update`]).

pub mod app;
pub mod browse;
pub mod desk;
pub mod keeper;
pub mod place;
pub mod rooms;
pub mod settings;
pub mod texts;
pub mod theme;
pub mod widgets;
pub mod worker;

pub use app::App;
