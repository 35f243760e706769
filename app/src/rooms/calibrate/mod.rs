//! The Calibrate room, a wizard: one thing to do at a time, what the camera sees with what was found drawn over it, how good it
//! is so far, and what comes next.

mod coverage;
mod figures;
mod foresee;
mod history;
mod picture;
mod task;
mod verdict;
mod view;
mod work;

pub use history::{Entry, Kept};
pub use picture::{Marks, Picture};
pub use task::{BOARDS, Pose, State, Step, TargetSettings, Task};
pub use verdict::Verdict;
pub use work::Memory;

use crate::browse::Browse;
use crate::desk::{Brake, Desk, Severity};
use crate::rooms::Room;
use crate::texts::calibrate as texts;
use crate::worker::{Command, Ended, Outbox, Tools};
use crate::{theme, widgets};
use eframe::egui;
use std::path::PathBuf;
use weavelight::calibrate::{CameraReport, CheckReport, ColorReport, LightsReport};

/// What this room asks of the worker.
#[derive(Debug)]
pub enum Ask {
    /// What is there.
    Refresh,
    /// The pictures of a task.
    Take(Task, TargetSettings),
    /// A test shot of what lies there, with what is found in it; nothing is kept.
    Look(Task, TargetSettings),
    /// The fit of a step.
    Fit(Step),
    /// The pictures of a step into the history, to take them again; the calibration stays until the new one is made.
    Again(Step),
    /// Everything into the history, and from the beginning.
    Anew,
    /// An earlier calibration, or a step's pictures, back.
    Restore(Entry),
}

/// What came of a fit.
#[derive(Debug)]
pub enum Report {
    /// Of the camera.
    Camera(Box<CameraReport>),
    /// Of levels and colour.
    Color(Box<ColorReport>),
    /// Of the lights.
    Lights(Box<LightsReport>),
    /// Of the sheet that the fit has not seen.
    Check(Box<CheckReport>),
}

/// What the worker tells this room.
#[derive(Debug)]
pub enum Told {
    /// What is there.
    State(Box<State>),
    /// What the camera saw.
    Picture(Box<Picture>),
    /// What came of a fit.
    Report(Report),
    /// What was there before is in this folder now.
    Kept(PathBuf),
    /// Something failed or was stopped: nothing goes on by itself.
    Halted(Ended),
}

/// What this room keeps.
#[derive(Debug, Default)]
pub struct Calibrate {
    state: Option<Box<State>>,
    asked: bool,
    /// The first look at what is there was ended.
    stopped: bool,
    /// Go on by itself, on the simulated rig.
    auto: bool,
    live: Live,
    browse: Browse,
    view: view::View,
    /// What came of camera, colour, lights and check.
    figures: [Option<String>; 4],
    /// A check of a calibration that is finished is wanted.
    checking: bool,
    /// What went wrong with what was asked for last, and what to do.
    trouble: Option<String>,
    /// Where the last thing went that was put away.
    kept: Option<PathBuf>,
}

/// One look after the other, while somebody moves a board about.
#[derive(Debug, Default)]
struct Live {
    on: bool,
    /// A look was asked for and has not come yet.
    awaited: bool,
    /// So was a picture that is kept.
    taking: bool,
}

impl Calibrate {
    /// Draws the room.
    pub fn ui(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        if !self.asked {
            self.asked = true;
            desk.ask(Command::Calibrate(Ask::Refresh));
        }
        if self.stopped {
            if widgets::empty(ui, texts::NOT_LOOKED, texts::LOOK_NOW) {
                self.reset();
            }
            return;
        }
        let pane = egui::Panel::left("calibration steps").exact_size(292.0).resizable(false);
        pane.show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                self.left(ui, desk);
                widgets::reveal_focus(ui);
            });
        });
        let task = self.wanted();
        if let (Some(task), Some(state)) = (task, &self.state)
            && let Some(draw) = coverage::of(task).filter(|_| can(task, state))
        {
            let panel = egui::Panel::bottom("coverage").exact_size(coverage::HEIGHT);
            panel.show(ui, |ui| draw(ui, state));
        }
        egui::CentralPanel::default().show(ui, |ui| {
            if let Some(task) = task {
                if !self.task(ui, task, desk) {
                    return;
                }
                let corners = self.state.as_ref().filter(|_| task == Task::Board);
                self.view.ui(ui, task, corners.map_or(&[], |state| &state.corners_px));
            }
        });
    }

    /// The one thing to do now.
    fn wanted(&self) -> Option<Task> {
        let next = self.state.as_ref()?.next();
        let check = self.checking && next == Task::Done;
        Some(if check { Task::Sheet(Pose::Check) } else { next })
    }

    /// Leaves something to the worker; what was told of the last thing is put away.
    fn ask(&mut self, ask: Ask, desk: &mut Desk) {
        (self.trouble, self.kept) = (None, None);
        desk.ask(Command::Calibrate(ask));
    }

    fn left(&mut self, ui: &mut egui::Ui, desk: &mut Desk) {
        ui.heading(crate::texts::rooms::CALIBRATE);
        let now = self.wanted().and_then(Task::step);
        let Some(state) = &self.state else { return };
        let free = desk.can_change();
        let mut wanted = None;
        for step in Step::ALL {
            let figures = self.figures[step as usize].as_deref();
            if view::step(ui, state, step, now, figures) && free {
                self.checking = step == Step::Check;
                wanted = (state.share(step) > 0.0).then_some(Ask::Again(step));
            }
        }
        ui.separator();
        view::age(ui, state, &mut desk.settings.targets);
        let anything = state.begun || state.age_days.is_some();
        let anew = egui::Button::new(texts::ANEW);
        if ui.add_enabled(free && anything, anew).on_hover_text(texts::ANEW_HINT).clicked() {
            wanted = Some(Ask::Anew);
        }
        ui.separator();
        let entry = view::history(ui, state, free);
        if let Some(ask) = entry.map(Ask::Restore).or(wanted) {
            self.ask(ask, desk);
        }
    }

    /// What to do now, and the button that does it. Whether there is a picture to come.
    fn task(&mut self, ui: &mut egui::Ui, task: Task, desk: &mut Desk) -> bool {
        let Some(state) = &self.state else { return false };
        let simulated = desk.place.as_ref().is_some_and(view::lays_by_itself);
        view::instructions(ui, task, state, simulated);
        view::told(ui, self.trouble.as_deref(), self.kept.as_deref());
        if task == Task::Done {
            let is_old = desk.expired_days().is_some();
            if view::verdict(ui, state, is_old) {
                desk.go_to(Room::Scan);
            }
            return self.view.has_picture();
        }
        if !can(task, state) {
            view::no_chessboards(ui);
            return false;
        }
        let mut is_read = true;
        if !simulated {
            let targets = &mut desk.settings.targets;
            is_read = view::targets(ui, task, targets, &mut self.browse, desk.place.as_ref());
        }
        ui.add_enabled_ui(is_read, |ui| self.buttons(ui, task, simulated, desk));
        ui.add_space(theme::GAP);
        true
    }

    fn buttons(&mut self, ui: &mut egui::Ui, task: Task, simulated: bool, desk: &mut Desk) {
        let busy = !desk.can_change();
        let is_fit = matches!(task, Task::Fit(_));
        ui.horizontal(|ui| {
            let text = if is_fit { texts::FIT } else { texts::TAKE };
            let size = egui::vec2(220.0, theme::BIG);
            // While it looks, the picture that is wanted comes right after.
            let looking = self.live.on && !self.live.taking && desk.held_by.is_none();
            let free_to_go = !busy || looking;
            let clicked = widgets::primary(ui, text, size, free_to_go).clicked();
            let free = ui.is_enabled() && !ui.ctx().egui_wants_keyboard_input();
            let space = free && widgets::struck(ui, egui::Key::Space);
            if (clicked || space) && free_to_go {
                self.go(task, desk);
            }
            let small = egui::vec2(0.0, theme::BIG);
            if !is_fit {
                let look = egui::Button::selectable(self.live.on, texts::LOOK).min_size(small);
                let look = look.frame_when_inactive(true);
                if ui.add_enabled(free_to_go, look).on_hover_text(texts::LOOK_HINT).clicked() {
                    self.live.on = !self.live.on;
                    self.look(desk);
                }
            }
            if self.checking && ui.add_enabled(!busy, not_now(small)).clicked() {
                self.checking = false;
            }
            if simulated && !self.auto && !self.checking {
                let auto = egui::Button::new(texts::AUTO).min_size(small);
                if ui.add_enabled(!busy, auto).on_hover_text(texts::AUTO_HINT).clicked() {
                    self.auto = true;
                    self.go(task, desk);
                }
            }
            if self.auto && ui.add(egui::Button::new(texts::STOP).min_size(small)).clicked() {
                self.auto = false;
                desk.brake(Brake::Cancel);
            }
        });
    }

    /// The next look, where they are wanted and none is on its way.
    fn look(&mut self, desk: &mut Desk) {
        let task = self.wanted().filter(|task| !matches!(task, Task::Fit(_) | Task::Done));
        if let Some(task) = task.filter(|_| self.live.on && !self.live.awaited) {
            self.live.awaited = true;
            desk.ask(Command::Calibrate(Ask::Look(task, desk.settings.targets.clone())));
        }
    }

    /// Nobody sees the pictures any more.
    pub fn leave(&mut self, desk: &mut Desk) {
        self.live.on = false;
        // The first look at all the pictures takes its time, and no other room wants to wait for it.
        let looking = desk.activity.as_ref().is_some_and(|now| now.title == texts::LOOKING);
        if looking && self.state.is_none() {
            desk.brake(Brake::Cancel);
            self.asked = false;
        }
    }

    fn go(&mut self, task: Task, desk: &mut Desk) {
        let ask = match task {
            Task::Done => return,
            Task::Fit(step) => Ask::Fit(step),
            task => Ask::Take(task, desk.settings.targets.clone()),
        };
        self.live.taking = true;
        self.ask(ask, desk);
    }

    /// Takes in what the worker tells.
    pub fn hear(&mut self, told: Told, desk: &mut Desk) {
        match told {
            Told::State(state) => {
                let task = state.next();
                desk.calibration_age_days = state.age_days;
                self.checking &= state.verdict.is_none() && task == Task::Done;
                self.state = Some(state);
                self.live.taking = false;
                self.stopped = false;
                match (self.auto, task) {
                    (true, Task::Done | Task::Fit(_)) => self.auto = false,
                    (true, task) => self.go(task, desk),
                    (false, _) => self.look(desk),
                }
            }
            Told::Picture(picture) => {
                let of = self.wanted();
                self.view.show(*picture, of);
                if std::mem::take(&mut self.live.awaited) {
                    self.look(desk);
                }
            }
            Told::Report(report) => {
                let (step, text) = figures::text(&report);
                self.figures[step as usize] = Some(text);
            }
            Told::Kept(folder) => self.kept = Some(folder),
            Told::Halted(ended) => {
                self.auto = false;
                self.live = Live::default();
                self.stopped = self.state.is_none();
                // The error was put up just before.
                let newest = desk.problems.iter().rev().find(|it| it.severity == Severity::Error);
                let newest = newest.filter(|_| ended == Ended::Failed);
                self.trouble = newest.map(|problem| problem.text.clone());
            }
        }
    }

    /// Another rig, or something may have changed.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

/// Whether this build can do it.
fn can(task: Task, state: &State) -> bool {
    state.sees_chessboards || task.step() != Some(Step::Camera)
}

fn not_now(size: egui::Vec2) -> egui::Button<'static> {
    egui::Button::new(texts::NOT_NOW).min_size(size)
}

/// The worker's part.
pub fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    work::act(ask, tools, out);
}
