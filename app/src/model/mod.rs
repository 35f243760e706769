//! Plain data of the window, and names of things on the disk.

pub mod activity;
pub mod clock;
pub mod desktop;
pub mod names;
pub mod number;
pub mod paths;
pub mod problem;
pub mod project;
pub mod room;
pub mod scan_entry;
pub mod scan_form;
pub mod settings;
pub mod targets;
