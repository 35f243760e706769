//! The Scan room, the daily loop: name, one big button, a strip that fills light by light, maps while later lights still fire,
//! and a solution at the end.

mod buttons;
mod form;
mod histogram;
mod result;
mod strip;
mod view;

use crate::jobs::messages::{Request, Update};
use crate::jobs::scan::{Command, Event, Order, What};
use crate::jobs::scans::Deleted;
use crate::jobs::state::AppState;
use crate::model::names::ScanNames;
use crate::model::room::Room;
use crate::model::scan_entry::UnfinishedScan;
use crate::rooms::RoomPanel;
use crate::rooms::scan::buttons::Buttons;
use crate::rooms::scan::form::{Form, order};
use crate::rooms::scan::strip::Strip;
use crate::rooms::scan::view::View;
use crate::texts::rooms;
use crate::texts::scan as texts;
use crate::ui::{theme, widgets};
use eframe::egui;
use std::path::{Path, PathBuf};
use weavelight::device::scan::Summary;
use weavelight::solution::Report;

/// Where a scan stands.
#[derive(Debug, Default, PartialEq)]
pub(crate) enum Stage {
    /// Nothing is going on.
    #[default]
    Ready,
    /// Frames are being taken.
    Scanning,
    /// It rests.
    Paused,
    /// Frames are there, maps not yet, or not to be had.
    Scanned(Option<Box<Summary>>),
    /// Maps are there.
    Solved { solution: PathBuf, report: Box<Report>, expected_deg: Option<f64> },
}

/// What this room keeps.
#[derive(Debug, Default)]
pub struct Scan {
    form: Form,
    buttons: Buttons,
    stage: Stage,
    strip: Strip,
    view: View,
    /// The scan that stage, strip and view are about, whatever the form says.
    about: Option<About>,
    unfinished: Option<UnfinishedScan>,
    /// Whether that was not drawn yet.
    offer_is_new: bool,
    /// Warnings of the scan that is shown, from taking its frames.
    scan_warnings: Vec<String>,
    /// What was scanned again, as it was before.
    replaced: Option<Deleted>,
    /// The name is to be counted on, once it is known which are taken.
    count_on: bool,
}

/// A scan.
#[derive(Clone, Debug, PartialEq)]
struct About {
    /// The swatch's name.
    name: String,
    /// Its folder; `None` until it is begun.
    folder: Option<PathBuf>,
    /// How it was taken; `None` where that was not here and now.
    order: Option<Order>,
}

impl RoomPanel for Scan {
    fn title(&self) -> &'static str {
        rooms::SCAN
    }

    fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        self.draw(ui, app);
    }

    fn hear(&mut self, update: Update, app: &mut AppState) {
        if let Update::Scan(event) = update {
            self.take_event(event, app);
        }
    }

    fn rig_opened(&mut self, app: &mut AppState) {
        *self = Self { count_on: true, ..Self::default() };
        app.names = ScanNames::default();
        app.request(Request::Scan(Command::LookForUnfinished));
    }

    fn rig_released(&mut self, app: &mut AppState) {
        app.request(Request::Scan(Command::LookForUnfinished));
    }
}

impl Scan {
    fn draw(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        self.keys(ui, app);
        let pane = egui::Panel::left("scan form").exact_size(292.0).resizable(false);
        pane.show(ui, |ui| self.left(ui, app));
        let lights = app.project.as_ref().map_or(0, |place| place.rig.lights.len());
        egui::Panel::bottom("scan strip").exact_size(strip::HEIGHT).show(ui, |ui| {
            self.strip.ui(ui, lights);
        });
        egui::CentralPanel::default().show(ui, |ui| {
            self.result(ui, app);
            match (self.is_running(), app.is_calibrated) {
                (false, false) => self.ask_to_calibrate(ui, app),
                (true, true) => self.view.ui(ui, texts::MAPS_COME),
                (true, false) => self.view.ui(ui, texts::NO_MAPS),
                (false, true) => self.view.ui(ui, texts::NOTHING_YET),
            }
        });
    }

    /// Without a calibration frames can be taken, but no maps come of them.
    fn ask_to_calibrate(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        if self.view.has_test_shot() {
            return self.view.ui(ui, "");
        }
        if widgets::empty(ui, texts::NOT_CALIBRATED, texts::CALIBRATE) {
            app.go_to(Room::Calibrate);
        }
    }

    /// The form, and below it, whatever else there is, what the room is about.
    fn left(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let running = self.is_running();
        // The form first, so that Tab goes through it before it comes to the button.
        let mut above = ui.available_rect_before_wrap();
        above.max.y -= form::BUTTON_HEIGHT;
        let mut form = ui.new_child(egui::UiBuilder::new().id_salt("scan form").max_rect(above));
        egui::ScrollArea::vertical().show(&mut form, |ui| {
            ui.heading(crate::texts::rooms::SCAN);
            self.offer_unfinished(ui, app);
            self.offer_undo(ui, app);
            tell_expired(ui, app);
            ui.add_enabled_ui(!running, |ui| self.form.ui(ui, app));
            widgets::reveal_focus(ui);
        });
        egui::Panel::bottom("scan buttons").exact_size(form::BUTTON_HEIGHT).show(ui, |ui| {
            ui.add_space(theme::GAP);
            let known = !self.buttons.are_new(ui, running);
            ui.add_enabled_ui(known, |ui| {
                if running {
                    self.running(ui, app);
                } else if self.form.button(ui, app, self.is_done(app)) {
                    self.go(app);
                }
            });
        });
    }

    fn is_running(&self) -> bool {
        matches!(self.stage, Stage::Scanning | Stage::Paused)
    }

    /// Whether the swatch on the table is scanned: what comes next is another one.
    fn is_done(&self, app: &AppState) -> bool {
        let done = matches!(self.stage, Stage::Scanned(_) | Stage::Solved { .. });
        let name = app.settings.scan.name.trim();
        done && self.about.as_ref().is_some_and(|about| about.name == name)
    }

    /// What the big button does.
    fn go(&mut self, app: &mut AppState) {
        if !self.is_done(app) {
            return self.begin(order(app), app);
        }
        app.settings.scan.next_free_name(&app.names);
        self.clear();
        self.stage = Stage::Ready;
        (self.about, self.replaced) = (None, None);
    }

    /// Nothing of the last scan is to be seen.
    fn clear(&mut self) {
        self.strip = Strip::default();
        self.scan_warnings.clear();
        self.view.begin();
    }

    fn running(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        ui.horizontal(|ui| {
            let paused = self.stage == Stage::Paused;
            let size = egui::vec2(120.0, theme::BIG);
            let text = if paused { texts::GO_ON } else { texts::PAUSE };
            if ui.add_sized(size, egui::Button::new(text)).clicked() {
                app.control(if paused {
                    crate::jobs::control::JobAction::Resume
                } else {
                    crate::jobs::control::JobAction::Pause
                });
                self.stage = Stage::Scanning;
            }
            if ui.add_sized(size, egui::Button::new(texts::STOP)).clicked() {
                app.control(crate::jobs::control::JobAction::Cancel);
            }
        });
        ui.label(egui::RichText::new(texts::STOP_HINT).small().weak());
    }

    /// A scan that was stopped by whatever, first thing to be seen.
    fn offer_unfinished(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let Some(found) = self.unfinished.clone().filter(|_| app.can_change()) else { return };
        let frame = egui::Frame::group(ui.style()).fill(ui.visuals().faint_bg_color);
        frame.show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.label(egui::RichText::new(texts::unfinished(&found.name, found.frames)).strong());
            ui.horizontal(|ui| {
                let resume = ui.button(texts::RESUME);
                if std::mem::take(&mut self.offer_is_new) {
                    // One key goes on.
                    resume.request_focus();
                }
                if resume.clicked() {
                    app.settings.scan.name = found.name.clone();
                    let how = Order { exposure_s: None, thickness_mm: None, ..order(app) };
                    let (name, what) = (found.name, What::Resume(found.folder));
                    self.begin(Order { name, what, ..how }, app);
                }
                if ui.button(texts::LEAVE).clicked() {
                    self.unfinished = None;
                }
            });
        });
        ui.add_space(theme::GAP);
    }

    fn begin(&mut self, order: Order, app: &mut AppState) {
        self.stage = Stage::Scanning;
        (self.unfinished, self.replaced) = (None, None);
        self.clear();
        let folder = match &order.what {
            What::New => None,
            What::Resume(folder) | What::Again(folder) => Some(folder.clone()),
        };
        self.about = Some(About { name: order.name.clone(), folder, order: Some(order.clone()) });
        app.request(Request::Scan(Command::Scan(order)));
    }

    /// Space does what the big button does, Enter looks closer, wherever no text is being written.
    fn keys(&mut self, ui: &egui::Ui, app: &mut AppState) {
        let free = !ui.ctx().egui_wants_keyboard_input();
        let pressed = |key| free && widgets::struck(ui, key);
        let space = pressed(egui::Key::Space);
        if let Stage::Solved { solution, .. } = &self.stage
            && pressed(egui::Key::Enter)
        {
            app.look_at(solution.clone());
        }
        let can_go = !self.is_running() && self.form.can_go(app, self.is_done(app));
        if space && can_go && !self.buttons.are_new(ui, false) {
            self.go(app);
        }
    }

    fn take_event(&mut self, event: Event, app: &mut AppState) {
        match event {
            Event::TestShot(shot) => {
                // A test shot's better exposure becomes the next one's.
                let better = shot.better_exposure_s;
                app.settings.scan.exposure_s = better.unwrap_or(shot.settings.exposure_s);
                self.view.show_test_shot(shot);
            }
            Event::Taking(frame) => {
                self.stage = Stage::Scanning;
                self.strip.taking(frame);
            }
            Event::Paused => self.stage = Stage::Paused,
            Event::Frame(thumb) => self.strip.add(*thumb),
            Event::Maps(maps) => self.view.show_maps(maps),
            Event::Names(of, taken) => self.take_names(&of, taken, app),
            Event::Begun(folder) => {
                if let Some(about) = &mut self.about {
                    about.folder = Some(folder);
                }
            }
            Event::Replaced(replaced) => self.replaced = replaced,
            Event::Restored(restored) => self.show_restored(restored),
            Event::Complete(summary) => {
                if let Some(used) = summary.settings {
                    app.settings.scan.exposure_s = used.exposure_s;
                }
                self.strip.done();
                self.scan_warnings.clone_from(&summary.warnings);
                self.stage = Stage::Scanned(Some(summary));
            }
            Event::Solved { scan, solution, report, expected_deg } => {
                self.turn_to(&scan);
                self.stage = Stage::Solved { solution, report, expected_deg };
            }
            Event::Dropped(scan) => {
                let settings = app.settings.solve;
                app.request(Request::Scan(Command::Solve { scan, settings }));
            }
            Event::Ended(lights) => {
                if self.is_running() {
                    self.stage = Stage::Ready;
                }
                self.strip.done();
                self.strip.keep(&lights);
            }
            Event::Unfinished(found) => {
                self.offer_is_new = found.is_some();
                self.unfinished = found;
            }
        }
    }

    fn take_names(&mut self, of: &Path, names: ScanNames, app: &mut AppState) {
        if app.project.as_ref().is_none_or(|place| place.folder != of) {
            return;
        }
        app.names = names;
        if std::mem::take(&mut self.count_on) {
            app.settings.scan.next_free_name(&app.names);
        }
    }

    /// A scan that was solved is the one that is shown; nothing of another one stays beside it.
    fn turn_to(&mut self, scan: &Path) {
        let of = |about: &About| about.folder.as_ref().is_some_and(|folder| folder == scan);
        if self.about.as_ref().is_some_and(of) {
            return;
        }
        let name = scan.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.about = Some(About { name, folder: Some(scan.to_owned()), order: None });
        self.replaced = None;
        self.clear();
    }
}

/// Maps from an old calibration may be wrong.
fn tell_expired(ui: &mut egui::Ui, app: &mut AppState) {
    let Some(days) = app.expired_days() else { return };
    ui.horizontal_top(|ui| {
        widgets::Sign::Warning.ui(ui);
        ui.vertical(|ui| {
            ui.add(egui::Label::new(crate::texts::calibrate::expired(days)).wrap());
            if ui.small_button(texts::TO_CALIBRATE).clicked() {
                app.go_to(Room::Calibrate);
            }
        });
    });
    ui.add_space(theme::GAP);
}
