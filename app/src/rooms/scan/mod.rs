//! The Scan room, the daily loop: name, one big button, a strip that fills light by light, maps while later lights still fire,
//! and a solution at the end.

mod buttons;
mod eyes;
mod form;
mod histogram;
pub mod picture;
mod strip;
mod view;
mod work;

pub use picture::Thumb;

use crate::desk::Desk;
use crate::place::Place;
use crate::rooms::{Room, look};
use crate::settings::SolveSettings;
use crate::worker::{Command, Outbox, Tools};
use crate::{texts::scan as texts, theme, widgets};
use buttons::Buttons;
use eframe::egui;
pub use form::FormSettings;
use form::{Form, order};
use std::path::{Path, PathBuf};
use strip::Strip;
use view::View;
use weavelight::device::camera::Settings;
use weavelight::device::scan::{Preview, Summary};
use weavelight::solution::Report;
use weavelight_sim::cloth::Preset;

/// What this room asks of the worker.
#[derive(Debug)]
pub enum Ask {
    /// A picture under one light.
    TestShot {
        /// The rig's light.
        light: usize,
        /// Exposure.
        settings: Settings,
    },
    /// A scan, and its solution.
    Scan(Order),
    /// A solution.
    Solve {
        /// The capture session's folder.
        scan: PathBuf,
        /// How.
        settings: SolveSettings,
    },
    /// Another fabric on the simulated table.
    LayOut(Preset),
    /// Whether there is a scan that was stopped.
    LookForUnfinished,
    /// A scan into the system's bin.
    ThrowAway(PathBuf),
}

/// What to scan and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// Of the swatch.
    pub name: String,
    /// Of the swatch, millimetres.
    pub thickness_mm: Option<f64>,
    /// `None`: to be found.
    pub exposure_s: Option<f64>,
    /// Sensitivity.
    pub iso: f64,
    /// Go on with what is there.
    pub resume: bool,
    /// How to solve it.
    pub solve: SolveSettings,
}

/// What the worker tells this room.
#[derive(Debug)]
pub enum Told {
    /// A test shot.
    TestShot(Box<Preview>),
    /// The frame that is being taken, as in "light 4".
    Taking(String),
    /// It rests.
    Paused,
    /// A frame that is safe.
    Frame(Box<Thumb>),
    /// Maps from the frames so far.
    Maps(Box<look::view::Maps>),
    /// All frames are there.
    Complete(Box<Summary>),
    /// The solution stands.
    Solved {
        /// Its folder.
        solution: PathBuf,
        /// What it says of itself.
        report: Box<Report>,
        /// Expected error of a normal, median, degrees; `None` where the maps were there already.
        expected_deg: Option<f64>,
    },
    /// The folder of a scan to solve.
    Dropped(PathBuf),
    /// Name and frames of a scan that was stopped, if there is one.
    Unfinished(Option<(String, usize)>),
}

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
    Scanned(Box<Summary>),
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
    unfinished: Option<(String, usize)>,
    /// Whether that was not drawn yet.
    offer_is_new: bool,
}

impl Scan {
    /// Draws the room.
    pub fn ui(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        self.keys(ui, desk);
        let pane = egui::Panel::left("scan form").exact_size(292.0).resizable(false);
        pane.show(ui, |ui| self.left(ui, desk));
        let lights = desk.place.as_ref().map_or(0, |place| place.rig.lights.len());
        egui::Panel::bottom("scan strip").exact_size(strip::HEIGHT).show(ui, |ui| {
            self.strip.ui(ui, lights);
        });
        egui::CentralPanel::default().show(ui, |ui| {
            self.result(ui, desk);
            let calibrated = desk.place.as_ref().is_some_and(Place::is_calibrated);
            match (self.is_running(), calibrated) {
                (false, false) => self.ask_to_calibrate(ui, desk),
                (true, true) => self.view.ui(ui, texts::MAPS_COME),
                (true, false) => self.view.ui(ui, texts::NO_MAPS),
                (false, true) => self.view.ui(ui, texts::NOTHING_YET),
            }
        });
    }

    /// Without a calibration frames can be taken, but no maps come of them.
    fn ask_to_calibrate(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        if self.view.has_test_shot() {
            return self.view.ui(ui, "");
        }
        if widgets::empty(ui, texts::NOT_CALIBRATED, texts::CALIBRATE) {
            desk.go_to(Room::Calibrate);
        }
    }

    /// The form, and below it, whatever else there is, what the room is about.
    fn left(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        let running = self.is_running();
        egui::Panel::bottom("scan buttons").exact_size(form::BUTTON_HEIGHT).show(ui, |ui| {
            ui.add_space(theme::GAP);
            let known = !self.buttons.are_new(ui, running);
            ui.add_enabled_ui(known, |ui| {
                if running {
                    self.running(ui, desk);
                } else if self.form.button(ui, desk, self.is_done(desk)) {
                    self.go(desk);
                }
            });
        });
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                ui.heading(crate::texts::rooms::SCAN);
                self.offer_unfinished(ui, desk);
                tell_expired(ui, desk);
                ui.add_enabled_ui(!running, |ui| self.form.ui(ui, desk));
                widgets::reveal_focus(ui);
            });
        });
    }

    fn is_running(&self) -> bool {
        matches!(self.stage, Stage::Scanning | Stage::Paused)
    }

    /// Whether the swatch on the table is scanned: what comes next is another one.
    fn is_done(&self, desk: &Desk) -> bool {
        let done = matches!(self.stage, Stage::Scanned(_) | Stage::Solved { .. });
        done && form::is_taken(&desk.settings.scan.name, desk.place.as_ref())
    }

    /// What the big button does.
    fn go(&mut self, desk: &mut Desk) {
        if !self.is_done(desk) {
            return self.begin(order(desk, false), desk);
        }
        desk.settings.scan.next_free_name(desk.place.as_ref());
        self.stage = Stage::Ready;
        self.strip = Strip::default();
        self.view.begin();
    }

    fn running(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        ui.horizontal(|ui| {
            let paused = self.stage == Stage::Paused;
            let size = egui::vec2(120.0, theme::BIG);
            let text = if paused { texts::GO_ON } else { texts::PAUSE };
            if ui.add_sized(size, egui::Button::new(text)).clicked() {
                desk.brake(if paused {
                    crate::desk::Brake::GoOn
                } else {
                    crate::desk::Brake::Pause
                });
                self.stage = Stage::Scanning;
            }
            if ui.add_sized(size, egui::Button::new(texts::STOP)).clicked() {
                desk.brake(crate::desk::Brake::Cancel);
            }
        });
        ui.label(egui::RichText::new(texts::STOP_HINT).small().weak());
    }

    /// A scan that was stopped by whatever, first thing to be seen.
    fn offer_unfinished(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        let Some((name, frames)) = self.unfinished.clone().filter(|_| !desk.is_busy()) else {
            return;
        };
        let frame = egui::Frame::group(ui.style()).fill(ui.visuals().faint_bg_color);
        frame.show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.label(egui::RichText::new(texts::unfinished(&name, frames)).strong());
            ui.horizontal(|ui| {
                let resume = ui.button(texts::RESUME);
                if std::mem::take(&mut self.offer_is_new) {
                    // One key goes on.
                    resume.request_focus();
                }
                if resume.clicked() {
                    desk.settings.scan.name = name.clone();
                    self.begin(order(desk, true), desk);
                }
                if ui.button(texts::LEAVE).clicked() {
                    self.unfinished = None;
                }
            });
        });
        ui.add_space(theme::GAP);
    }

    fn begin(&mut self, order: Order, desk: &mut Desk) {
        self.stage = Stage::Scanning;
        self.unfinished = None;
        if !order.resume {
            self.strip = Strip::default();
        }
        self.view.begin();
        desk.ask(Command::Scan(Ask::Scan(order)));
    }

    /// What came of the scan, and what to do with it.
    fn result(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        let (good, text) = match &self.stage {
            Stage::Scanned(summary) => (summary.warnings.is_empty(), texts::scanned(summary)),
            Stage::Solved { report, expected_deg, .. } => {
                (is_good(report), texts::solved(report, *expected_deg))
            }
            _ => return,
        };
        let sign = if good { widgets::Sign::Good } else { widgets::Sign::Warning };
        let name = desk.settings.scan.name.clone();
        ui.horizontal_wrapped(|ui| {
            sign.ui(ui);
            ui.label(egui::RichText::new(text).strong());
            if let Stage::Solved { solution, .. } = &self.stage
                && ui.button(texts::LOOK_CLOSER).on_hover_text(texts::ENTER).clicked()
            {
                look_closer(solution, desk);
            }
            if !desk.is_busy()
                && ui.button(texts::REPEAT).on_hover_text(texts::REPEAT_HINT).clicked()
            {
                if let Some(place) = &desk.place {
                    let scan = place.scan(&name);
                    desk.ask(Command::Scan(Ask::ThrowAway(scan)));
                }
                self.begin(order(desk, false), desk);
            }
        });
    }

    /// Space does what the big button does, Enter looks closer, wherever no text is being written.
    fn keys(&mut self, ui: &egui::Ui, desk: &mut Desk) {
        let free = !ui.ctx().egui_wants_keyboard_input();
        let pressed = |key| free && widgets::struck(ui, key);
        let space = pressed(egui::Key::Space);
        if let Stage::Solved { solution, .. } = &self.stage
            && pressed(egui::Key::Enter)
        {
            look_closer(solution, desk);
        }
        let can_go = !self.is_running() && self.form.can_go(desk, self.is_done(desk));
        if space && can_go && !self.buttons.are_new(ui, false) {
            self.go(desk);
        }
    }

    /// Takes in what the worker tells.
    pub fn hear(&mut self, told: Told, desk: &mut Desk) {
        match told {
            Told::TestShot(shot) => {
                // A test shot's better exposure becomes the next one's.
                let better = shot.better_exposure_s;
                desk.settings.scan.exposure_s = better.unwrap_or(shot.settings.exposure_s);
                self.view.show_test_shot(shot);
            }
            Told::Taking(frame) => {
                self.stage = Stage::Scanning;
                self.strip.taking(frame);
            }
            Told::Paused => self.stage = Stage::Paused,
            Told::Frame(thumb) => self.strip.add(*thumb),
            Told::Maps(maps) => self.view.show_maps(maps),
            Told::Complete(summary) => {
                if let Some(used) = summary.settings {
                    desk.settings.scan.exposure_s = used.exposure_s;
                }
                self.strip.done();
                self.stage = Stage::Scanned(summary);
            }
            Told::Solved { solution, report, expected_deg } => {
                self.stage = Stage::Solved { solution, report, expected_deg };
            }
            Told::Dropped(scan) => {
                let settings = desk.settings.solve;
                desk.ask(Command::Scan(Ask::Solve { scan, settings }));
            }
            Told::Unfinished(found) => {
                if matches!(self.stage, Stage::Scanning | Stage::Paused) {
                    self.stage = Stage::Ready;
                    self.strip.done();
                }
                self.offer_is_new = found.is_some();
                self.unfinished = found;
            }
        }
    }

    /// Another rig: nothing of the last one stays.
    pub fn reset(&mut self, desk: &mut Desk) {
        *self = Self::default();
        desk.settings.scan.next_free_name(desk.place.as_ref());
        desk.ask(Command::Scan(Ask::LookForUnfinished));
    }
}

fn look_closer(solution: &Path, desk: &mut Desk) {
    desk.ask(Command::Look(look::Ask::Open(solution.to_owned())));
    desk.go_to(Room::Look);
}

/// Whether a solution can be kept without looking twice: nothing was warned of, and hardly anything clips.
fn is_good(report: &Report) -> bool {
    const CLIPPED: f64 = 0.01;
    let clipped = report.saturated_pixels as f64;
    report.warnings.is_empty() && clipped <= CLIPPED * report.pixels as f64
}

/// An old calibration makes maps that nobody should trust blindly.
fn tell_expired(ui: &mut egui::Ui, desk: &mut Desk) {
    let Some(days) = desk.expired_days() else { return };
    ui.horizontal_top(|ui| {
        widgets::Sign::Warning.ui(ui);
        ui.vertical(|ui| {
            ui.add(egui::Label::new(crate::texts::calibrate::expired(days)).wrap());
            if ui.small_button(texts::TO_CALIBRATE).clicked() {
                desk.go_to(Room::Calibrate);
            }
        });
    });
    ui.add_space(theme::GAP);
}

/// The worker's part.
pub fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    work::act(ask, tools, out);
}
