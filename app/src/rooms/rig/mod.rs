//! The Rig room: board, camera, and the lights as a sketch seen from the side and from above; each can be lit.

mod sketch;

use crate::jobs::messages::{Request, Update};
use crate::jobs::rig::{Command, Event};
use crate::jobs::state::AppState;
use crate::rooms::RoomPanel;
use crate::rooms::rig::sketch::{Lamp, Side};
use crate::texts::rig as texts;
use crate::texts::rooms;
use crate::ui::widgets::Sign;
use crate::ui::{theme, widgets};
use eframe::egui;
use eframe::egui::RichText;
use weavelight::device::scan::CameraFinding;
use weavelight::doctor::LightBoard;
use weavelight::instrument::{CalibratedLight, RigLightPlace};
use weavelight_calibration::description::Light;

/// What this room keeps.
#[derive(Debug, Default)]
pub struct Rig {
    found: Option<(Vec<LightBoard>, Vec<CameraFinding>)>,
    lit: Option<usize>,
    calibrated: Vec<CalibratedLight>,
    asked: bool,
}

impl RoomPanel for Rig {
    fn title(&self) -> &'static str {
        rooms::RIG
    }

    fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        self.draw(ui, app);
    }

    fn hear(&mut self, update: Update, app: &mut AppState) {
        if let Update::Rig(event) = update {
            self.take_event(event, app);
        }
    }

    /// No light stays on.
    fn leave(&mut self, app: &mut AppState) {
        self.asked = false;
        if self.lit.is_some() {
            app.request(Request::Rig(Command::Light(None)));
        }
    }

    fn rig_opened(&mut self, _app: &mut AppState) {
        *self = Self::default();
    }

    fn rig_released(&mut self, _app: &mut AppState) {
        self.asked = false;
    }

    /// The lights may have been calibrated.
    fn job_ended(&mut self) {
        self.asked = false;
    }
}

impl Rig {
    fn draw(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        if let Some(place) = app.project.clone().filter(|_| !self.asked) {
            self.asked = true;
            app.request(Request::Rig(Command::ReadCalibration(Box::new(place))));
        }
        let pane = egui::Panel::left("rig parts").exact_size(320.0).resizable(false);
        pane.show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                self.parts(ui, app);
                widgets::reveal_focus(ui);
            });
        });
        egui::CentralPanel::default().show(ui, |ui| self.lights(ui, app));
    }

    fn parts(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let Some(place) = &app.project else { return };
        let name = place.rig.name.clone();
        let folder = place.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let path = place.folder.display().to_string();
        let camera = texts::camera(&place.rig.camera);
        widgets::heading(ui, &name, "");
        ui.label(RichText::new(texts::folder(&folder)).weak()).on_hover_text(path);
        ui.label(camera);
        ui.separator();
        let find = egui::Button::new(texts::FIND);
        if ui.add_enabled(app.can_change(), find).on_hover_text(texts::FIND_HINT).clicked() {
            app.request(Request::Rig(Command::Find));
        }
        match &self.found {
            None => {
                ui.label(RichText::new(texts::NOT_LOOKED).weak());
            }
            Some((boards, cameras)) => {
                boards
                    .iter()
                    .for_each(|board| finding(ui, &texts::board(board), board.problem.as_ref()));
                cameras
                    .iter()
                    .for_each(|camera| finding(ui, &camera.what, camera.problem.as_ref()));
            }
        }
        ui.separator();
        if ui.button(texts::OTHER_RIG).clicked() {
            app.project = None;
            app.held_by = None;
            app.request(Request::Close);
            app.settings.rig = None;
        }
    }

    fn lights(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let Some(place) = app.project.clone() else { return };
        let lamps = self.lamps(&place.rig);
        ui.horizontal(|ui| {
            ui.heading(texts::LIGHTS);
            let free = app.can_change();
            if ui.add_enabled(free, egui::Button::new(texts::TEST_EACH)).clicked() {
                app.request(Request::Rig(Command::TestEach));
            }
            if ui.add_enabled(self.lit.is_some(), egui::Button::new(texts::ALL_OFF)).clicked() {
                app.request(Request::Rig(Command::Light(None)));
            }
        });
        ui.label(RichText::new(texts::CLICK_A_LIGHT).weak());
        let height_mm = place.rig.camera.height_mm.unwrap_or(600.0);
        let room = ui.available_size();
        let half = egui::vec2((room.x - theme::GAP) / 2.0, (room.y * 0.58).max(200.0));
        let mut clicked = None;
        ui.horizontal(|ui| {
            for side in [Side::Front, Side::Above] {
                let hit = sketch::ui(ui, half, side, &lamps, height_mm, self.lit);
                clicked = clicked.or(hit);
            }
        });
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            clicked = clicked.or(self.table(ui, &lamps));
            widgets::reveal_focus(ui);
        });
        if let Some(light) = clicked.filter(|_| app.can_change()) {
            let wanted = (self.lit != Some(light)).then_some(light);
            app.request(Request::Rig(Command::Light(wanted)));
        }
    }

    fn lamps(&self, rig: &weavelight::instrument::Rig) -> Vec<Lamp> {
        let lamp = |(k, light): (usize, &weavelight::instrument::RigLight)| Lamp {
            channel: rig.channel(k),
            place_mm: match &light.place {
                RigLightPlace::Point { position_mm, .. } => Some(position_mm.coords.into()),
                RigLightPlace::Directional { .. } => None,
            },
            calibrated_mm: self.calibrated.get(k).and_then(|light| match &light.light {
                Light::Point(point) => Some(point.position_mm.coords.into()),
                Light::Directional(_) => None,
            }),
            sigma_mm: self.calibrated.get(k).and_then(|light| light.position_sigma_mm),
        };
        rig.lights.iter().enumerate().map(lamp).collect()
    }

    /// The same as a table. The light whose button was clicked.
    fn table(&self, ui: &mut egui::Ui, lamps: &[Lamp]) -> Option<usize> {
        let mut clicked = None;
        egui::Grid::new("lights").striped(true).num_columns(4).min_col_width(80.0).show(ui, |ui| {
            texts::COLUMNS.iter().for_each(|column| {
                ui.label(RichText::new(*column).strong());
            });
            ui.end_row();
            for (k, lamp) in lamps.iter().enumerate() {
                let text = texts::light(k, self.lit == Some(k));
                if ui.selectable_label(self.lit == Some(k), text).clicked() {
                    clicked = Some(k);
                }
                ui.label(lamp.channel.to_string());
                ui.label(lamp.place_mm.map_or(texts::FAR.to_owned(), texts::place));
                ui.label(texts::calibrated(lamp.calibrated_mm, lamp.sigma_mm));
                ui.end_row();
            }
        });
        clicked
    }

    fn take_event(&mut self, event: Event, _desk: &mut AppState) {
        match event {
            Event::Found { boards, cameras } => self.found = Some((boards, cameras)),
            Event::Lit(light) => self.lit = light,
            Event::Lights(lights) => self.calibrated = lights,
        }
    }
}

fn finding(ui: &mut egui::Ui, what: &str, problem: Option<&String>) {
    let sign = if problem.is_some() { Sign::Bad } else { Sign::Good };
    ui.horizontal_top(|ui| {
        sign.ui(ui);
        ui.vertical(|ui| {
            ui.add(egui::Label::new(RichText::new(what).strong()).wrap());
            if let Some(problem) = problem {
                ui.add(egui::Label::new(problem).wrap());
            }
        });
    });
}
