//! The Scan room, the daily loop: name, one big button, a strip that fills light by light, maps while later lights still fire,
//! and a solution at the end.

mod again;
mod buttons;
mod eyes;
mod form;
mod histogram;
pub mod picture;
mod result;
mod strip;
mod view;
mod work;

pub use again::Swapped;
pub use picture::Thumb;
pub use work::SolvedScan;

use crate::desk::Desk;
use crate::names::Taken;
use crate::rooms::scans::{Deleted, Unfinished};
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
use weavelight::solution::Reuse;
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
    /// What was scanned again back out of the bin, and what took its place there.
    Undo(Deleted),
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
    /// Whether something is there.
    pub what: What,
    /// How to solve it.
    pub solve: SolveSettings,
}

/// What is scanned: the form says how, but not whether it is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum What {
    /// Another swatch.
    New,
    /// What is in this folder, from where it stood.
    Resume(PathBuf),
    /// What is in this folder once more; that goes to the bin.
    Again(PathBuf),
}

/// What the worker tells this room.
#[derive(Debug)]
pub enum Told {
    /// A test shot.
    TestShot(Box<Preview>),
    /// The names that the scans of the rig in a folder have.
    Taken(PathBuf, Taken),
    /// The scan's folder.
    Begun(PathBuf),
    /// What is scanned again is in the bin.
    Replaced(Option<Deleted>),
    /// Another scan is in the place of the one that was shown.
    Swapped(Swapped),
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
        /// The capture session's folder.
        scan: PathBuf,
        /// Its folder.
        solution: PathBuf,
        /// What it says of itself.
        report: Box<Report>,
        /// Expected error of a normal, median, degrees; `None` where the maps were there already.
        expected_deg: Option<f64>,
    },
    /// The folder of a scan to solve.
    Dropped(PathBuf),
    /// The scan under way was stopped or failed; these lights have a frame (`None`: no light).
    Ended(Vec<Option<usize>>),
    /// A scan that was stopped, if there is one.
    Unfinished(Option<Unfinished>),
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
    unfinished: Option<Unfinished>,
    /// Whether that was not drawn yet.
    offer_is_new: bool,
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
            match (self.is_running(), desk.is_calibrated) {
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
        // The form first, so that Tab goes through it before it comes to the button.
        let mut above = ui.available_rect_before_wrap();
        above.max.y -= form::BUTTON_HEIGHT;
        let mut form = ui.new_child(egui::UiBuilder::new().id_salt("scan form").max_rect(above));
        egui::ScrollArea::vertical().show(&mut form, |ui| {
            ui.heading(crate::texts::rooms::SCAN);
            self.offer_unfinished(ui, desk);
            self.offer_undo(ui, desk);
            tell_expired(ui, desk);
            ui.add_enabled_ui(!running, |ui| self.form.ui(ui, desk));
            widgets::reveal_focus(ui);
        });
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
    }

    fn is_running(&self) -> bool {
        matches!(self.stage, Stage::Scanning | Stage::Paused)
    }

    /// Whether the swatch on the table is scanned: what comes next is another one.
    fn is_done(&self, desk: &Desk) -> bool {
        let done = matches!(self.stage, Stage::Scanned(_) | Stage::Solved { .. });
        let name = desk.settings.scan.name.trim();
        done && self.about.as_ref().is_some_and(|about| about.name == name)
    }

    /// What the big button does.
    fn go(&mut self, desk: &mut Desk) {
        if !self.is_done(desk) {
            return self.begin(order(desk), desk);
        }
        desk.settings.scan.next_free_name(&desk.taken);
        self.clear();
        self.stage = Stage::Ready;
        (self.about, self.replaced) = (None, None);
    }

    /// Nothing of the last scan is to be seen.
    fn clear(&mut self) {
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
        let Some(found) = self.unfinished.clone().filter(|_| desk.can_change()) else { return };
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
                    desk.settings.scan.name = found.name.clone();
                    let how = Order { exposure_s: None, thickness_mm: None, ..order(desk) };
                    let (name, what) = (found.name, What::Resume(found.folder));
                    self.begin(Order { name, what, ..how }, desk);
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
        (self.unfinished, self.replaced) = (None, None);
        self.clear();
        let folder = match &order.what {
            What::New => None,
            What::Resume(folder) | What::Again(folder) => Some(folder.clone()),
        };
        self.about = Some(About { name: order.name.clone(), folder, order: Some(order.clone()) });
        desk.ask(Command::Scan(Ask::Scan(order)));
    }

    /// Space does what the big button does, Enter looks closer, wherever no text is being written.
    fn keys(&mut self, ui: &egui::Ui, desk: &mut Desk) {
        let free = !ui.ctx().egui_wants_keyboard_input();
        let pressed = |key| free && widgets::struck(ui, key);
        let space = pressed(egui::Key::Space);
        if let Stage::Solved { solution, .. } = &self.stage
            && pressed(egui::Key::Enter)
        {
            desk.look_at(solution.clone());
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
            Told::Taken(of, taken) => self.hear_taken(&of, taken, desk),
            Told::Begun(folder) => {
                if let Some(about) = &mut self.about {
                    about.folder = Some(folder);
                }
            }
            Told::Replaced(replaced) => self.replaced = replaced,
            Told::Swapped(swapped) => self.swap(swapped),
            Told::Complete(summary) => {
                if let Some(used) = summary.settings {
                    desk.settings.scan.exposure_s = used.exposure_s;
                }
                self.strip.done();
                self.stage = Stage::Scanned(Some(summary));
            }
            Told::Solved { scan, solution, report, expected_deg } => {
                self.turn_to(&scan);
                self.stage = Stage::Solved { solution, report, expected_deg };
            }
            Told::Dropped(scan) => {
                let settings = desk.settings.solve;
                desk.ask(Command::Scan(Ask::Solve { scan, settings }));
            }
            Told::Ended(lights) => {
                if self.is_running() {
                    self.stage = Stage::Ready;
                }
                self.strip.done();
                self.strip.keep(&lights);
            }
            Told::Unfinished(found) => {
                self.offer_is_new = found.is_some();
                self.unfinished = found;
            }
        }
    }

    fn hear_taken(&mut self, of: &Path, taken: Taken, desk: &mut Desk) {
        if desk.place.as_ref().is_none_or(|place| place.folder != of) {
            return;
        }
        desk.taken = taken;
        if std::mem::take(&mut self.count_on) {
            desk.settings.scan.next_free_name(&desk.taken);
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

    /// Another rig: nothing of the last one stays.
    pub fn reset(&mut self, desk: &mut Desk) {
        *self = Self { count_on: true, ..Self::default() };
        desk.taken = Taken::default();
        desk.ask(Command::Scan(Ask::LookForUnfinished));
    }
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

/// The solution of a scan, the way every room makes it: `None` where it failed, and the user knows.
pub fn solve(
    scan: &Path,
    how: (SolveSettings, Reuse),
    tools: &mut Tools,
    out: &Outbox,
) -> Option<SolvedScan> {
    work::solve(scan, how, tools, out)
}

/// The worker's part.
pub fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    work::act(ask, tools, out);
}
