//! What is to be scanned: name, thickness, exposure.

use super::{Ask, Order};
use crate::desk::Desk;
use crate::settings::{MethodName, NormalYName, SolveSettings};
use crate::worker::Command;
use crate::{texts::scan as texts, theme, widgets};
use eframe::egui::{self, RichText};
use weavelight::device::camera::Settings;
use weavelight::device::scan::{Preview, Summary};
use weavelight::instrument::CameraKind;
use weavelight_sim::cloth::Preset;

/// What the technician writes and chooses.
#[derive(Debug)]
pub(super) struct Form {
    pub(super) name: String,
    thickness_mm: f64,
    find_exposure: bool,
    exposure_s: f64,
    iso: f64,
    test_light: usize,
    fabric: Preset,
}

impl Default for Form {
    fn default() -> Self {
        Self {
            name: texts::FIRST_NAME.to_owned(),
            thickness_mm: 0.0,
            find_exposure: true,
            exposure_s: 0.1,
            iso: 100.0,
            test_light: 0,
            fabric: Preset::Linen,
        }
    }
}

impl Form {
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        ui.add_space(theme::GAP);
        let label = ui.label(texts::NAME);
        let field = egui::TextEdit::singleline(&mut self.name).desired_width(f32::INFINITY);
        ui.add(field).labelled_by(label.id);
        egui::Grid::new("scan numbers").num_columns(2).show(ui, |ui| self.numbers(ui));
        self.table(ui, desk);
        ui.separator();
        self.test(ui, desk);
        ui.separator();
        ui.collapsing(texts::SOLVING, |ui| solving(ui, &mut desk.settings.solve));
    }

    fn numbers(&mut self, ui: &mut egui::Ui) {
        let label = ui.label(texts::THICKNESS);
        let thickness = egui::DragValue::new(&mut self.thickness_mm).range(0.0..=100.0).speed(0.05);
        ui.add(thickness.suffix(" mm").max_decimals(2)).labelled_by(label.id);
        ui.end_row();
        let label = ui.label(texts::EXPOSURE);
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.find_exposure, texts::FIND_EXPOSURE);
            let exposure = egui::DragValue::new(&mut self.exposure_s).range(1e-4..=30.0);
            let exposure = exposure.speed(0.005).suffix(" s").max_decimals(4);
            ui.add_enabled(!self.find_exposure, exposure).labelled_by(label.id);
        });
        ui.end_row();
        let label = ui.label(texts::ISO);
        let iso = egui::DragValue::new(&mut self.iso).range(25.0..=25_600.0).speed(10.0);
        ui.add(iso.max_decimals(0)).labelled_by(label.id);
        ui.end_row();
    }

    /// What lies on a simulated table can be chosen.
    fn table(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        let simulated =
            |place: &crate::place::Place| place.rig.camera.kind == CameraKind::Simulated;
        if !desk.place.as_ref().is_some_and(simulated) {
            return;
        }
        let before = self.fabric;
        ui.horizontal(|ui| {
            let label = ui.label(texts::ON_THE_TABLE);
            let choice = egui::ComboBox::from_id_salt("fabric").selected_text(before.name());
            let shown = choice.show_ui(ui, |ui| {
                for preset in Preset::ALL {
                    ui.selectable_value(&mut self.fabric, preset, preset.name());
                }
            });
            shown.response.labelled_by(label.id);
        });
        if self.fabric != before {
            desk.ask(Command::Scan(Ask::LayOut(self.fabric)));
            self.name = self.fabric.name().to_owned();
        }
    }

    fn test(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        let lights = desk.place.as_ref().map_or(0, |place| place.rig.lights.len());
        ui.horizontal(|ui| {
            let clicked = ui
                .add_enabled(!desk.is_busy(), egui::Button::new(texts::TEST_SHOT))
                .on_hover_text(texts::TEST_SHOT_HINT)
                .clicked();
            let label = ui.label(texts::LIGHT);
            let most = lights.saturating_sub(1);
            let light = egui::DragValue::new(&mut self.test_light).range(0..=most).speed(0.05);
            ui.add(light).labelled_by(label.id);
            if clicked {
                let settings = Settings { exposure_s: self.exposure_s, iso: self.iso };
                let light = self.test_light.min(most);
                desk.ask(Command::Scan(Ask::TestShot { light, settings }));
            }
        });
    }

    /// The big button. True when it is clicked.
    pub(super) fn button(&self, ui: &mut egui::Ui, desk: &Desk) -> bool {
        let size = egui::vec2(ui.available_width(), 1.3 * theme::BIG);
        let button = widgets::primary(ui, texts::SCAN, size, self.can_begin(desk));
        let clicked = button.on_hover_text(texts::SPACE).clicked();
        let hint = if self.is_taken(desk) { texts::TAKEN } else { texts::SPACE };
        ui.label(RichText::new(hint).small().weak());
        clicked
    }

    /// Whether a scan can begin.
    pub(super) fn can_begin(&self, desk: &Desk) -> bool {
        !desk.is_busy() && !self.name.trim().is_empty() && !self.is_taken(desk)
    }

    fn is_taken(&self, desk: &Desk) -> bool {
        desk.place.as_ref().is_some_and(|place| place.scan(&self.name).exists())
    }

    pub(super) fn order(&self, desk: &Desk, resume: bool) -> Order {
        Order {
            name: self.name.trim().to_owned(),
            thickness_mm: (self.thickness_mm > 0.0).then_some(self.thickness_mm),
            exposure_s: (!self.find_exposure && !resume).then_some(self.exposure_s),
            iso: self.iso,
            resume,
            solve: desk.settings.solve,
        }
    }

    /// A test shot's better exposure becomes the next one's.
    pub(super) fn hear(&mut self, shot: &Preview) {
        self.exposure_s = shot.better_exposure_s.unwrap_or(shot.settings.exposure_s);
    }

    pub(super) fn keep_exposure(&mut self, summary: &Summary) {
        if let Some(settings) = summary.settings {
            self.exposure_s = settings.exposure_s;
        }
    }

    /// The next swatch's name: the number at its end, counted on.
    pub(super) fn next_name(&mut self) {
        self.name = next_name(&self.name);
    }
}

fn solving(ui: &mut egui::Ui, settings: &mut SolveSettings) {
    let methods = [MethodName::Auto, MethodName::LeastSquares, MethodName::Robust];
    for (method, (name, hint)) in methods.into_iter().zip(texts::METHODS) {
        ui.radio_value(&mut settings.method, method, name).on_hover_text(hint);
    }
    ui.checkbox(&mut settings.undistort, texts::UNDISTORT);
    let mut down = settings.normal_y == NormalYName::Down;
    if ui.checkbox(&mut down, texts::NORMAL_Y_DOWN).changed() {
        settings.normal_y = if down { NormalYName::Down } else { NormalYName::Up };
    }
}

fn next_name(name: &str) -> String {
    let name = name.trim();
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    match name[stem.len()..].parse::<u64>() {
        Ok(number) => {
            let width = name.len() - stem.len();
            format!("{stem}{:0width$}", number.saturating_add(1))
        }
        Err(_) => format!("{name} 2"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_count_on() {
        let check = |name: &str, next: &str| assert_eq!(next_name(name), next);
        check("linen 4021", "linen 4022");
        check("linen", "linen 2");
        check("A-009", "A-010");
        check("99", "100");
        check("x 99999999999999999999999", "x 99999999999999999999999 2");
    }
}
