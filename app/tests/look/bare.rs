//! A view and nothing else.

use eframe::egui;
use weavelight_app::viewer::appearance::Appearance;
use weavelight_app::viewer::canvas::Canvas;
use weavelight_app::viewer::map_view::MapView;
use weavelight_app::viewer::maps::Maps;

/// The view.
pub(crate) struct Bare {
    pub(crate) view: MapView,
    pub(crate) maps: Maps,
    pub(crate) appearance: Appearance,
}

impl eframe::App for Bare {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let canvas = Canvas {
            maps: &self.maps,
            appearance: &self.appearance,
            name: "cloth",
            drag_pans: true,
        };
        let bare = egui::CentralPanel::default().frame(egui::Frame::new());
        bare.show(ui, |ui| self.view.show(ui, &canvas));
    }
}
