//! *Scan* becomes *Stop* under the mouse, and *Stop* becomes *Next swatch*: a click that was meant for the one must not hit the
//! other.

use eframe::egui;
use std::time::Duration;

/// A click so soon after a button appeared was not meant for it, seconds: the second click of a double one, or a click on
/// what stood there before.
const NEW_S: f64 = 0.6;

/// Which buttons stand there.
#[derive(Debug, Default)]
pub(super) struct Buttons {
    running: bool,
    /// Since when; `None`: from the beginning.
    since_s: Option<f64>,
}

impl Buttons {
    /// Whether the buttons, those of a running scan or the others, have only just appeared.
    pub(super) fn are_new(&mut self, ui: &egui::Ui, running: bool) -> bool {
        let now_s = ui.input(|input| input.time);
        if self.running != running {
            (self.running, self.since_s) = (running, Some(now_s));
        }
        let left_s = self.since_s.map_or(0.0, |since_s| since_s + NEW_S - now_s);
        if left_s > 0.0 {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(left_s));
        }
        left_s > 0.0
    }
}
