//! The desktop window: scan, calibrate, look.
//!
//! Floors, each of which uses only those before it:
//!
//! - [`model`]: plain data; [`texts`]: every word, one file a room
//! - [`ui`]: colours, widgets, fields, questions; [`viewer`]: maps on the graphics card
//! - [`jobs`]: threads that own devices and solver, and what each room asks of them
//! - [`rooms`]: the panels; none knows of another
//! - [`app`]: the window, with the table of rooms
//!
//! Panels draw and leave requests in the [`jobs::state::AppState`]; the worker does them and sends updates back. `tests/tidy.rs` of
//! the workspace checks the floors.

pub mod app;
pub mod jobs;
pub mod model;
pub mod rooms;
pub mod texts;
pub mod ui;
pub mod viewer;

pub use app::App;
