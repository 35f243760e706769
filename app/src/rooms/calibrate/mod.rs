//! The Calibrate room, a wizard: one thing to do at a time, what the camera sees with what was found drawn over it, how good it
//! is so far, and what comes next.

mod coverage;
mod figures;
mod view;

use crate::jobs::calibrate::{Command, Event};
use crate::jobs::control::JobAction;
use crate::jobs::messages::{Request, Update};
use crate::jobs::state::AppState;
use crate::model::activity::Ended;
use crate::model::problem::Severity;
use crate::model::room::Room;
use crate::rooms::RoomPanel;
use crate::texts::calibrate as texts;
use crate::texts::rooms;
use crate::ui::browse::Browse;
use crate::ui::{theme, widgets};
use eframe::egui;
use std::path::PathBuf;
use weavelight::calibrate::wizard::{Pose, State, Step, Task};

/// What this room keeps.
#[derive(Debug, Default)]
pub struct Calibrate {
    state: Option<Box<State>>,
    asked: bool,
    /// The first look at what is there was ended.
    stopped: bool,
    /// Take the next picture without a click, on the simulated rig.
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

/// Test shots one after the other, while the board is moved.
#[derive(Debug, Default)]
struct Live {
    on: bool,
    /// A look was asked for and has not come yet.
    awaited: bool,
    /// So was a picture that is kept.
    taking: bool,
}

impl RoomPanel for Calibrate {
    fn title(&self) -> &'static str {
        rooms::CALIBRATE
    }

    fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        self.draw(ui, app);
    }

    fn hear(&mut self, update: Update, app: &mut AppState) {
        if let Update::Calibrate(event) = update {
            self.take_event(event, app);
        }
    }

    /// The live view ends with the room.
    fn leave(&mut self, app: &mut AppState) {
        self.live.on = false;
        // The first search of all the pictures takes long, and no other room should wait for it.
        let looking = app.activity.as_ref().is_some_and(|now| now.title == texts::LOOKING);
        if looking && self.state.is_none() {
            app.control(JobAction::Cancel);
            self.asked = false;
        }
    }

    fn rig_opened(&mut self, _app: &mut AppState) {
        *self = Self::default();
    }

    fn rig_released(&mut self, _app: &mut AppState) {
        *self = Self::default();
    }
}

impl Calibrate {
    fn draw(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        if !self.asked {
            self.asked = true;
            app.request(Request::Calibrate(Command::Refresh));
        }
        if self.stopped {
            if widgets::empty(ui, texts::NOT_LOOKED, texts::LOOK_NOW) {
                *self = Self::default();
            }
            return;
        }
        let pane = egui::Panel::left("calibration steps").exact_size(292.0).resizable(false);
        pane.show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                self.left(ui, app);
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
                if !self.task(ui, task, app) {
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

    /// Makes a request; the outcome of the last one is no longer shown.
    fn ask(&mut self, ask: Command, app: &mut AppState) {
        (self.trouble, self.kept) = (None, None);
        app.request(Request::Calibrate(ask));
    }

    fn left(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        ui.heading(crate::texts::rooms::CALIBRATE);
        let now = self.wanted().and_then(Task::step);
        let Some(state) = &self.state else { return };
        let free = app.can_change();
        let mut wanted = None;
        for step in Step::ALL {
            let figures = self.figures[step as usize].as_deref();
            if view::step(ui, state, step, now, figures) && free {
                self.checking = step == Step::Check;
                wanted = (state.share(step) > 0.0).then_some(Command::Again(step));
            }
        }
        ui.separator();
        view::age(ui, state, &mut app.settings.targets);
        let anything = state.begun || state.age_days.is_some();
        let start_over = egui::Button::new(texts::START_OVER);
        if ui
            .add_enabled(free && anything, start_over)
            .on_hover_text(texts::START_OVER_HINT)
            .clicked()
        {
            wanted = Some(Command::StartOver);
        }
        ui.separator();
        let entry = view::history(ui, state, free);
        if let Some(ask) = entry.map(Command::Restore).or(wanted) {
            self.ask(ask, app);
        }
    }

    /// What to do now, and the button that does it. Whether there is a picture to come.
    fn task(&mut self, ui: &mut egui::Ui, task: Task, app: &mut AppState) -> bool {
        let Some(state) = &self.state else { return false };
        let simulated = app.project.as_ref().is_some_and(view::places_targets);
        view::instructions(ui, task, state, simulated);
        view::outcome(ui, self.trouble.as_deref(), self.kept.as_deref());
        if task == Task::Done {
            let is_old = app.expired_days().is_some();
            if view::verdict(ui, state, is_old) {
                app.go_to(Room::Scan);
            }
            return self.view.has_picture();
        }
        if !can(task, state) {
            view::no_chessboards(ui);
            return false;
        }
        let mut is_read = true;
        if !simulated {
            let targets = &mut app.settings.targets;
            is_read = view::targets(ui, task, targets, &mut self.browse, app.project.as_ref());
        }
        ui.add_enabled_ui(is_read, |ui| self.buttons(ui, task, simulated, app));
        ui.add_space(theme::GAP);
        true
    }

    fn buttons(&mut self, ui: &mut egui::Ui, task: Task, simulated: bool, app: &mut AppState) {
        let busy = !app.can_change();
        let is_fit = matches!(task, Task::Fit(_));
        ui.horizontal(|ui| {
            let text = if is_fit { texts::FIT } else { texts::TAKE };
            let size = egui::vec2(220.0, theme::BIG);
            // While it looks, the picture that is wanted comes right after.
            let looking = self.live.on && !self.live.taking && app.held_by.is_none();
            let free_to_go = !busy || looking;
            let clicked = widgets::primary(ui, text, size, free_to_go).clicked();
            let free = ui.is_enabled() && !ui.ctx().egui_wants_keyboard_input();
            let space = free && widgets::struck(ui, egui::Key::Space);
            if (clicked || space) && free_to_go {
                self.go(task, app);
            }
            let small = egui::vec2(0.0, theme::BIG);
            if !is_fit {
                let look = egui::Button::selectable(self.live.on, texts::LOOK).min_size(small);
                let look = look.frame_when_inactive(true);
                if ui.add_enabled(free_to_go, look).on_hover_text(texts::LOOK_HINT).clicked() {
                    self.live.on = !self.live.on;
                    self.look(app);
                }
            }
            if self.checking && ui.add_enabled(!busy, not_now(small)).clicked() {
                self.checking = false;
            }
            if simulated && !self.auto && !self.checking {
                let auto = egui::Button::new(texts::AUTO).min_size(small);
                if ui.add_enabled(!busy, auto).on_hover_text(texts::AUTO_HINT).clicked() {
                    self.auto = true;
                    self.go(task, app);
                }
            }
            if self.auto && ui.add(egui::Button::new(texts::STOP).min_size(small)).clicked() {
                self.auto = false;
                app.control(JobAction::Cancel);
            }
        });
    }

    /// The next look, where they are wanted and none is on its way.
    fn look(&mut self, app: &mut AppState) {
        let task = self.wanted().filter(|task| !matches!(task, Task::Fit(_) | Task::Done));
        if let Some(task) = task.filter(|_| self.live.on && !self.live.awaited) {
            self.live.awaited = true;
            app.request(Request::Calibrate(Command::Look(task, app.settings.targets.clone())));
        }
    }

    fn go(&mut self, task: Task, app: &mut AppState) {
        let ask = match task {
            Task::Done => return,
            Task::Fit(step) => Command::Fit(step),
            task => Command::Take(task, app.settings.targets.clone()),
        };
        self.live.taking = true;
        self.ask(ask, app);
    }

    fn take_event(&mut self, event: Event, app: &mut AppState) {
        match event {
            Event::State(state) => {
                let task = state.next();
                app.calibration_age_days = state.age_days;
                self.checking &= state.verdict.is_none() && task == Task::Done;
                self.state = Some(state);
                self.live.taking = false;
                self.stopped = false;
                match (self.auto, task) {
                    (true, Task::Done | Task::Fit(_)) => self.auto = false,
                    (true, task) => self.go(task, app),
                    (false, _) => self.look(app),
                }
            }
            Event::Picture(picture) => {
                let of = self.wanted();
                self.view.show(*picture, of);
                if std::mem::take(&mut self.live.awaited) {
                    self.look(app);
                }
            }
            Event::Report(report) => {
                let (step, text) = figures::text(&report);
                self.figures[step as usize] = Some(text);
            }
            Event::Kept(folder) => self.kept = Some(folder),
            Event::Halted(ended) => {
                self.auto = false;
                self.live = Live::default();
                self.stopped = self.state.is_none();
                // The error was put up just before.
                let newest = app.problems.iter().rev().find(|it| it.severity == Severity::Error);
                let newest = newest.filter(|_| ended == Ended::Failed);
                self.trouble = newest.map(|problem| problem.text.clone());
            }
        }
    }
}

/// Whether this build can do it.
fn can(task: Task, state: &State) -> bool {
    state.sees_chessboards || task.step() != Some(Step::Camera)
}

fn not_now(size: egui::Vec2) -> egui::Button<'static> {
    egui::Button::new(texts::NOT_NOW).min_size(size)
}
