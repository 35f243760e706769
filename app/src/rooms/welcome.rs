//! Where there is no rig yet: one way to try it, one way to open one's own.

use crate::jobs::messages::Request;
use crate::jobs::state::AppState;
use crate::model::paths;
use crate::texts::welcome as texts;
use crate::ui::browse::Browse;
use crate::ui::{theme, widgets};
use eframe::egui;
use eframe::egui::RichText;

/// Of the two cards, points.
const WIDTH: f32 = 560.0;

/// What it keeps.
#[derive(Debug, Default)]
pub struct Welcome {
    path: String,
    browse: Browse,
}

impl Welcome {
    /// Draws it in the middle of what there is.
    pub fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let above = (ui.available_height() * 0.18).max(theme::WIDE_GAP);
        // Where the window is small and something went wrong, there is not room for all.
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| self.cards(ui, above, app));
    }

    fn cards(&mut self, ui: &mut egui::Ui, above: f32, app: &mut AppState) {
        ui.vertical_centered(|ui| {
            ui.add_space(above);
            ui.label(RichText::new(texts::HEADING).size(28.0).strong());
            ui.label(RichText::new(texts::WHAT).size(16.0));
            ui.add_space(2.0 * theme::WIDE_GAP);
        });
        let side = (ui.available_width() - WIDTH).max(0.0) / 2.0;
        ui.horizontal_top(|ui| {
            ui.add_space(side);
            ui.vertical(|ui| {
                ui.set_max_width(WIDTH.min(ui.available_width()));
                card(ui, |ui| try_it(ui, app));
                ui.add_space(theme::GAP);
                card(ui, |ui| self.open(ui, app));
            });
        });
    }

    fn open(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        ui.label(RichText::new(texts::OPEN).strong());
        ui.label(texts::OPEN_WHAT);
        ui.horizontal(|ui| {
            let label = ui.label(texts::PATH);
            let width = ui.available_width() - 190.0;
            let field = widgets::path_field(ui, label.id, &mut self.path, width.max(80.0));
            let entered = widgets::entered(ui, &field);
            if let Some(folder) = self.browse.folder(ui) {
                self.path = folder.display().to_string();
            }
            let folder = paths::typed(&self.path);
            let open = egui::Button::new(texts::OPEN_IT);
            let clicked = ui.add_enabled(folder.is_some(), open).clicked();
            if let Some(folder) = folder.filter(|_| clicked || entered) {
                app.request(Request::Open(folder));
            }
        });
    }
}

fn try_it(ui: &mut egui::Ui, app: &mut AppState) {
    if widgets::primary(ui, texts::TRY, egui::vec2(320.0, theme::BIG), true).clicked() {
        app.request(Request::MakeSimulatedRig(app.settings.home.join(texts::SIMULATED)));
    }
    ui.label(texts::TRY_WHAT);
}

fn card(ui: &mut egui::Ui, contents: impl FnOnce(&mut egui::Ui)) {
    let frame = egui::Frame::group(ui.style()).inner_margin(theme::WIDE_GAP);
    frame.fill(ui.visuals().faint_bg_color).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.vertical_centered(contents);
    });
}
