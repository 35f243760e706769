//! The rooms. Each draws itself, keeps what only it needs, and leaves its requests in the [`AppState`]. No room uses another.

pub mod calibrate;
pub mod look;
pub mod rig;
pub mod scan;
pub mod scans;
pub mod welcome;

use crate::jobs::messages::Update;
use crate::jobs::state::AppState;
use eframe::egui;
use std::fmt::Debug;

/// What the window knows of a room.
pub trait RoomPanel: Debug {
    /// Its name, as the list of rooms shows it.
    fn title(&self) -> &'static str;

    /// Draws the room.
    fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState);

    /// An update for this room has come.
    fn hear(&mut self, update: Update, app: &mut AppState);

    /// The room is shown from now on.
    fn enter(&mut self, _app: &mut AppState) {}

    /// Another room is shown from now on.
    fn leave(&mut self, _app: &mut AppState) {}

    /// Another rig was opened: forget the last one.
    fn rig_opened(&mut self, _app: &mut AppState) {}

    /// Another program has released the rig and may have changed it.
    fn rig_released(&mut self, _app: &mut AppState) {}

    /// A job has ended: what is on the disk may have changed.
    fn job_ended(&mut self) {}
}
