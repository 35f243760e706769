//! Colours, small widgets, number fields, dialogues and questions that any room can use.

pub mod browse;
pub mod number;
pub mod problems;
pub mod questions;
pub mod theme;
pub mod widgets;
pub mod window;
