//! The desktop window: scan, calibrate, look.
//!
//! - [`app`]: the window as a whole: rooms, keys; [`problems`]: what went wrong
//! - [`rooms`]: one module each; a room draws, keeps what only it needs, and asks
//! - [`desk`]: what all rooms share, and where they leave what they want done
//! - [`worker`]: the one thread that owns devices and solver; nothing else waits for anything
//! - [`questions`]: what is asked before a scan is stopped or the window closes; [`window`]: its size
//! - [`browse`]: the system's dialogue for folders and files
//! - [`number`]: fields for numbers, as people write them
//! - [`clock`]: when, as the clock on the wall has it
//! - [`paths`]: paths as users type and paste them
//! - [`place`]: the folders of a rig: its calibration, its scans, their solutions
//! - [`settings`]: what is remembered, [`keeper`]: and kept; [`theme`]: colours and sizes; [`texts`]: every word
//!
//! Panels only draw and ask (`desk.ask(Command::...)`); the worker acts and tells ([`worker::Update`]).

pub mod app;
pub mod browse;
pub mod clock;
pub mod desk;
pub mod keeper;
pub mod names;
pub mod number;
pub mod paths;
pub mod place;
pub mod problems;
pub mod questions;
pub mod rooms;
pub mod settings;
pub mod texts;
pub mod theme;
pub mod widgets;
pub mod window;
pub mod worker;

pub use app::App;
