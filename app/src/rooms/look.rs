//! The Look room.

use crate::desk::Desk;
use crate::worker::{Outbox, Tools};
use eframe::egui;

/// What this room asks of the worker.
#[derive(Debug)]
pub enum Ask {
    /// A solution's folder.
    Open(std::path::PathBuf),
}

/// What the worker tells this room.
#[derive(Debug)]
pub enum Told {}

/// What this room keeps.
#[derive(Debug, Default)]
pub struct Look {}

impl Look {
    /// Draws the room.
    pub fn ui(&mut self, ui: &mut egui::Ui, _desk: &mut Desk) {
        ui.heading("Look");
    }

    /// Takes in what the worker tells.
    pub fn hear(&mut self, told: Told, _desk: &mut Desk) {
        match told {}
    }
}

/// The worker's part.
pub fn act(ask: Ask, _tools: &mut Tools, _out: &Outbox) {
    let Ask::Open(_) = ask;
}
