//! What is to be scanned: name, thickness, exposure.

use crate::jobs::messages::Request;
use crate::jobs::scan::{Command, Order, What};
use crate::jobs::state::AppState;
use crate::model::number::Unit;
use crate::model::scan_form::ScanForm;
use crate::model::settings::{DeviceName, MethodName, NormalYName, SolveSettings};
use crate::texts::scan as texts;
use crate::ui::number::Number;
use crate::ui::{theme, widgets};
use eframe::egui;
use eframe::egui::RichText;
use weavelight::device::camera::Settings;
use weavelight::instrument::CameraKind;
use weavelight_sim::cloth::Preset;

/// Of the panel with the big button, points.
pub(super) const BUTTON_HEIGHT: f32 = 104.0;

/// What else can be chosen.
#[derive(Debug)]
pub(super) struct Form {
    test_light: usize,
    fabric: Preset,
    /// A number cannot be read: nothing is scanned with another one in its place.
    unread: bool,
    /// So it is with the test shot's light.
    unread_light: bool,
}

impl Default for Form {
    fn default() -> Self {
        Self { test_light: 0, fabric: Preset::Linen, unread: false, unread_light: false }
    }
}

impl Form {
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        ui.add_space(theme::GAP);
        let label = ui.label(texts::NAME);
        let form = &mut app.settings.scan;
        let field = egui::TextEdit::singleline(&mut form.name).desired_width(f32::INFINITY);
        ui.add(field).labelled_by(label.id);
        let grid = egui::Grid::new("scan numbers").num_columns(2);
        self.unread = !grid.show(ui, |ui| numbers(form, ui)).inner;
        self.table(ui, app);
        ui.separator();
        self.test(ui, app);
        ui.separator();
        ui.collapsing(texts::SOLVING, |ui| solving(ui, &mut app.settings.solve));
    }

    /// What lies on a simulated table can be chosen.
    fn table(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let simulated =
            |place: &crate::model::project::Project| place.rig.camera.kind == CameraKind::Simulated;
        if !app.project.as_ref().is_some_and(simulated) {
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
            app.request(Request::Scan(Command::LayOut(self.fabric)));
            app.settings.scan.name = self.fabric.name().to_owned();
            app.settings.scan.next_free_name(&app.names);
        }
    }

    fn test(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let lights = app.project.as_ref().map_or(0, |place| place.rig.lights.len());
        ui.horizontal(|ui| {
            let can = app.can_change() && !self.unread && !self.unread_light;
            let clicked = ui
                .add_enabled(can, egui::Button::new(texts::TEST_SHOT))
                .on_hover_text(texts::TEST_SHOT_HINT)
                .clicked();
            let label = ui.label(texts::LIGHT);
            let most = lights.saturating_sub(1);
            let light = Number::of(Unit::Count, 0.0..=most as f64).speed(0.05);
            let light = light.show(ui, texts::LIGHT, &mut self.test_light);
            light.response.labelled_by(label.id);
            self.unread_light = !light.is_read;
            if clicked {
                let ScanForm { exposure_s, iso, .. } = app.settings.scan;
                let settings = Settings { exposure_s, iso };
                let light = self.test_light.min(most);
                app.request(Request::Scan(Command::TestShot { light, settings }));
            }
        });
    }

    /// The big button: scans, or, where that is `done`, clears the table for the next swatch. True when it is clicked.
    pub(super) fn button(&self, ui: &mut egui::Ui, app: &AppState, done: bool) -> bool {
        let size = egui::vec2(ui.available_width(), 1.3 * theme::BIG);
        let text = if done { texts::NEXT } else { texts::SCAN };
        // Without a calibration the room is about getting one.
        let button = match app.is_calibrated {
            true => widgets::primary(ui, text, size, self.can_go(app, done)),
            false => widgets::large(ui, text, size, self.can_go(app, done)),
        };
        let clicked = button.clicked();
        let taken = !done && app.names.has(app.settings.scan.name.trim());
        let hint = match (!app.can_change(), taken, self.unread && !done) {
            (true, ..) => texts::BUSY,
            (_, true, _) => texts::TAKEN,
            (.., true) => texts::UNREAD,
            _ => texts::SPACE,
        };
        ui.label(RichText::new(hint).small().weak());
        clicked
    }

    /// Whether the big button can be pressed.
    pub(super) fn can_go(&self, app: &AppState, done: bool) -> bool {
        let name = app.settings.scan.name.trim();
        let free = !name.is_empty() && !app.names.has(name);
        app.can_change() && (done || (free && !self.unread))
    }
}

/// What to scan as the form says.
pub(super) fn order(app: &AppState) -> Order {
    let form = &app.settings.scan;
    Order {
        name: form.name.trim().to_owned(),
        thickness_mm: (form.thickness_mm > 0.0).then_some(form.thickness_mm),
        exposure_s: (!form.find_exposure).then_some(form.exposure_s),
        iso: form.iso,
        what: What::New,
        solve: app.settings.solve,
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
    let devices = [DeviceName::Auto, DeviceName::Cpu, DeviceName::Gpu];
    let name = |device: DeviceName| texts::DEVICES[device as usize];
    ui.horizontal(|ui| {
        let label = ui.label(texts::DEVICE);
        let choice = egui::ComboBox::from_id_salt("device").selected_text(name(settings.device));
        let shown = choice.show_ui(ui, |ui| {
            for device in devices {
                ui.selectable_value(&mut settings.device, device, name(device));
            }
        });
        shown.response.labelled_by(label.id);
    });
}

/// The fields for numbers. Whether all of them can be read.
fn numbers(form: &mut ScanForm, ui: &mut egui::Ui) -> bool {
    let label = ui.label(texts::THICKNESS);
    let thickness = Number::of(Unit::Millimetres, 0.0..=100.0).speed(0.05).decimals(2..=3);
    let thickness = thickness.unset(texts::NOT_MEASURED);
    let thickness = thickness.show(ui, texts::THICKNESS, &mut form.thickness_mm);
    thickness.response.labelled_by(label.id);
    ui.end_row();
    let label = ui.label(texts::EXPOSURE);
    let exposure = ui.horizontal(|ui| {
        ui.checkbox(&mut form.find_exposure, texts::FIND_EXPOSURE);
        let exposure = Number::of(Unit::Seconds, 1e-4..=30.0).speed(0.005).decimals(0..=4);
        let shown = |ui: &mut egui::Ui| exposure.show(ui, texts::EXPOSURE, &mut form.exposure_s);
        ui.add_enabled_ui(!form.find_exposure, shown).inner
    });
    let exposure = exposure.inner;
    exposure.response.labelled_by(label.id);
    ui.end_row();
    let label = ui.label(texts::ISO);
    let iso =
        Number::of(Unit::Iso, 25.0..=25_600.0).speed(10.0).show(ui, texts::ISO, &mut form.iso);
    iso.response.labelled_by(label.id);
    ui.end_row();
    thickness.is_read && exposure.is_read && iso.is_read
}
