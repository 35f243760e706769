//! The window as a whole: the rooms' rail, the room that is open, what is going on, what went wrong, and the keys.

use crate::jobs::messages::{Request, Update};
use crate::jobs::settings_saver::SettingsSaver;
use crate::jobs::state::AppState;
use crate::jobs::worker::Worker;
use crate::model::activity::Activity;
use crate::model::problem::{Area, Problem};
use crate::model::room::Room;
use crate::model::settings::{Settings, Theme};
use crate::rooms::RoomPanel;
use crate::rooms::calibrate::Calibrate;
use crate::rooms::look::Look;
use crate::rooms::rig::Rig;
use crate::rooms::scan::Scan;
use crate::rooms::scans::Scans;
use crate::rooms::welcome::Welcome;
use crate::texts;
use crate::ui::problems::Problems;
use crate::ui::questions::{Answer, Question};
use crate::ui::window::Geometry;
use crate::ui::{theme, widgets};
use eframe::egui;
use eframe::egui::{Key, Modifiers, RichText};
use eframe::egui_wgpu::RenderState;

/// The window.
#[derive(Debug)]
pub struct App {
    state: AppState,
    worker: Worker,
    saver: SettingsSaver,
    welcome: Welcome,
    rooms: Vec<(Room, Box<dyn RoomPanel>)>,
    /// The room that was drawn last.
    shown: Option<Room>,
    window: Geometry,
    problems: Problems,
    question: Option<Question>,
    /// Whether Escape has something to leave or close before it ends work: a field, a menu, a question, a drag.
    escape_is_taken: bool,
    /// The window may close.
    closes: bool,
}

/// The rooms in the order of the work. A new room is added here.
fn rooms() -> Vec<(Room, Box<dyn RoomPanel>)> {
    vec![
        (Room::Rig, Box::<Rig>::default()),
        (Room::Calibrate, Box::<Calibrate>::default()),
        (Room::Scan, Box::<Scan>::default()),
        (Room::Look, Box::<Look>::default()),
        (Room::Scans, Box::<Scans>::default()),
    ]
}

/// The window cannot work.
#[derive(Debug, thiserror::Error)]
#[error("{}", texts::shell::no_thread(texts::shell::threads::WINDOW, .0))]
pub struct NoThreads(std::io::Error);

impl App {
    /// A window as it was when it was closed. `renderer`: where the Look room puts its textures; the window works without.
    ///
    /// # Errors
    /// Where the system gives no threads; a sentence with the remedy.
    pub fn new(
        ctx: &egui::Context,
        renderer: Option<&RenderState>,
        settings: Settings,
    ) -> Result<Self, NoThreads> {
        crate::model::clock::start();
        theme::apply(ctx, &settings);
        crate::viewer::gpu::install(ctx, renderer);
        let worker = Worker::start(ctx.clone()).map_err(NoThreads)?;
        let mut state = AppState::new(settings.clone());
        if let Some(aside) = settings.put_aside() {
            state.report(Problem::warning(texts::SETTINGS, texts::settings_put_aside(aside)));
        }
        if let Some(rig) = &settings.rig {
            worker.request(Request::Reopen(rig.clone()));
        }
        Ok(Self {
            window: Geometry::new(&settings),
            problems: Problems::default(),
            question: None,
            escape_is_taken: false,
            closes: false,
            state,
            worker,
            saver: SettingsSaver::start(settings),
            welcome: Welcome::default(),
            rooms: rooms(),
            shown: None,
        })
    }

    /// What all rooms share.
    pub fn shared(&self) -> &AppState {
        &self.state
    }

    /// The same, to be changed.
    pub fn shared_mut(&mut self) -> &mut AppState {
        &mut self.state
    }

    /// Adds a request to the worker's queue, as rooms do.
    pub fn request(&mut self, request: Request) {
        self.state.request(request);
    }

    /// What is being asked over everything else.
    pub fn question(&self) -> Option<&Question> {
        self.question.as_ref()
    }

    /// Opens a room.
    pub fn enter(&mut self, room: Room) {
        self.state.go_to(room);
    }

    /// Whether nothing is going on and nothing is left to be done.
    pub fn is_idle(&self) -> bool {
        self.worker.is_idle() && !self.state.is_busy() && !self.state.has_requests()
    }

    /// Takes in an update of the worker.
    pub fn hear(&mut self, update: Update) {
        if let Some(room) = update.room() {
            if let Some((_, panel)) = self.rooms.iter_mut().find(|(of, _)| *of == room) {
                panel.hear(update, &mut self.state);
            }
            return;
        }
        let state = &mut self.state;
        match update {
            Update::Began(title) => state.activity = Some(Activity::new(title)),
            Update::Progress { share, step, left } => {
                if let Some(activity) = &mut state.activity {
                    (activity.share, activity.step, activity.left) = (share, step, left);
                }
            }
            Update::Ended => {
                state.activity = None;
                self.rooms.iter_mut().for_each(|(_, panel)| panel.job_ended());
            }
            Update::Problem(problem) => state.report(problem),
            Update::GoTo(room) => state.go_to(room),
            Update::Opened(project) => {
                state.settings.rig = Some(project.folder.clone());
                state.project = Some(*project);
                (state.held_by, state.is_calibrated) = (None, false);
                state.problems.retain(|problem| problem.area != Some(Area::Opening));
                self.rooms.iter_mut().for_each(|(_, panel)| panel.rig_opened(state));
            }
            Update::Held(folder, holder) => self.held(&folder, holder),
            Update::Calibrated(folder, is) if state.is_open(&folder) => state.is_calibrated = is,
            Update::CalibrationAge(days) => state.calibration_age_days = days,
            _ => {}
        }
    }

    /// Another program has taken or released the rig. After the release its changes are read.
    fn held(&mut self, folder: &std::path::Path, holder: Option<String>) {
        let state = &mut self.state;
        if !state.is_open(folder) {
            return;
        }
        let was_held = state.held_by.is_some();
        state.held_by = holder;
        if was_held && state.held_by.is_none() {
            self.rooms.iter_mut().for_each(|(_, panel)| panel.rig_released(state));
        }
    }

    fn hand_over(&mut self) {
        for action in self.state.take_actions() {
            self.worker.control.act(action);
        }
        for request in self.state.take_requests() {
            // An error of the last try is reported again if it happens again.
            if let Some(area) = request.tries() {
                self.state.forget_errors(area);
            }
            self.worker.request(request);
        }
    }

    fn keep_settings(&mut self) {
        self.saver.update(&self.state.settings);
        match self.saver.outcome() {
            Some(Err(text)) => {
                let problem = Problem::error(texts::KEEPING_SETTINGS, text);
                self.state.report(problem.of(Area::Settings));
            }
            Some(Ok(())) => self.state.forget_errors(Area::Settings),
            None => {}
        }
    }

    /// Tells the rooms which of them is shown.
    fn rooms_change(&mut self) {
        let open = self.state.project.as_ref().map(|_| self.state.settings.room);
        if open == self.shown {
            return;
        }
        for (room, panel) in &mut self.rooms {
            if self.shown == Some(*room) {
                panel.leave(&mut self.state);
            }
        }
        for (room, panel) in &mut self.rooms {
            if open == Some(*room) {
                panel.enter(&mut self.state);
            }
        }
        self.shown = open;
    }

    fn room(&mut self, ui: &mut egui::Ui) {
        if self.state.project.is_none() {
            return self.welcome.ui(ui, &mut self.state);
        }
        let state = &mut self.state;
        if let Some(holder) = &state.held_by {
            ui.horizontal_top(|ui| {
                widgets::Sign::Warning.ui(ui);
                ui.add(egui::Label::new(texts::rig::held(holder)).wrap());
            });
            ui.separator();
        }
        let open = state.settings.room;
        if let Some((_, panel)) = self.rooms.iter_mut().find(|(room, _)| *room == open) {
            panel.ui(ui, state);
        }
    }

    /// Control and a digit opens a room, Control and Q leaves, Escape ends work where it has nothing else to end; a folder that
    /// is dropped is opened.
    fn keys(&mut self, ctx: &egui::Context) {
        const DIGITS: [Key; 9] = [
            Key::Num1,
            Key::Num2,
            Key::Num3,
            Key::Num4,
            Key::Num5,
            Key::Num6,
            Key::Num7,
            Key::Num8,
            Key::Num9,
        ];
        for ((room, _), digit) in self.rooms.iter().zip(DIGITS) {
            if ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, digit)) {
                self.state.go_to(*room);
            }
        }
        if ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Q)) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        let escape = ctx.input(|input| input.key_pressed(Key::Escape));
        if escape && self.state.is_busy() && !self.escape_is_taken {
            match self.worker.control.is_capturing() {
                // A scan takes long: one key does not end it.
                true => self.question = Some(Question::StopScan),
                false => self.worker.control.cancel(),
            }
        }
        let dropped = ctx.input(|input| input.raw.dropped_files.clone());
        if let Some(path) = dropped.into_iter().next().map(|file| file.path().to_owned()) {
            self.state.request(Request::Dropped(path));
        }
    }

    /// The window is to close, by Control and Q or its own button: what could be lost is asked about first, and work that is
    /// under way comes to its end.
    fn closing(&mut self, ctx: &egui::Context) {
        let wanted = ctx.input(|input| input.viewport().close_requested());
        if wanted && !self.closes && self.question != Some(Question::Ending) {
            if self.worker.control.is_capturing() {
                self.question = Some(Question::QuitWhileScanning);
            } else if self.worker.is_idle() {
                return;
            } else {
                self.end();
            }
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
        }
        if self.question == Some(Question::Ending) && self.worker.is_idle() {
            self.closes = true;
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    /// Ends all work; then the window closes.
    fn end(&mut self) {
        self.worker.control.close();
        self.question = Some(Question::Ending);
    }

    /// A question is drawn over everything else; one about a scan that has ended meanwhile is none any more.
    fn put_question(&mut self, ctx: &egui::Context) {
        let about_scan =
            matches!(self.question, Some(Question::StopScan | Question::QuitWhileScanning));
        if about_scan && !self.worker.control.is_capturing() {
            self.question = None;
        }
        let Some(question) = self.question.clone() else { return };
        match (question.ui(ctx), question) {
            (None, _) => {}
            (Some(Answer::Stay), _) => self.question = None,
            (Some(Answer::Yes), Question::StopScan) => {
                self.worker.control.cancel();
                self.question = None;
            }
            (Some(Answer::Yes), _) => self.end(),
        }
    }

    fn rail(&mut self, ui: &mut egui::Ui) {
        ui.add_space(theme::GAP);
        let open = self.state.settings.room;
        ui.with_layout(egui::Layout::top_down_justified(egui::Align::Min), |ui| {
            for (k, (room, panel)) in self.rooms.iter().enumerate() {
                let text = RichText::new(panel.title()).size(15.0);
                let button =
                    egui::Button::selectable(*room == open, text).min_size(egui::vec2(0.0, 36.0));
                let enabled = self.state.project.is_some();
                let hint = format!("Ctrl+{}", k + 1);
                if ui.add_enabled(enabled, button).on_hover_text(hint).clicked() {
                    self.state.go_to(*room);
                }
            }
        });
        ui.with_layout(egui::Layout::bottom_up(egui::Align::Min), |ui| {
            widgets::menu(ui, texts::VIEW, |ui| {
                // A small window has no room for all of it.
                let room = ui.ctx().content_rect().height() - 60.0;
                let settings = &mut self.state.settings;
                egui::ScrollArea::vertical()
                    .max_height(room)
                    .show(ui, |ui| view_menu(ui, settings));
            });
        });
    }

    fn status(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_centered(|ui| {
            self.problems.button(ui, &self.state.problems);
            match &self.state.activity {
                Some(activity) => {
                    if widgets::activity(ui, activity) {
                        self.worker.control.cancel();
                    }
                }
                None => {
                    ui.label(RichText::new(texts::READY).weak());
                }
            }
            if let Some(project) = &self.state.project {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let folder = project.folder.display().to_string();
                    ui.label(RichText::new(&project.rig.name).weak()).on_hover_text(folder);
                });
            }
        });
    }
}

fn view_menu(ui: &mut egui::Ui, settings: &mut Settings) {
    let before = settings.clone();
    for (theme, name) in [Theme::System, Theme::Light, Theme::Dark].into_iter().zip(texts::THEMES) {
        ui.radio_value(&mut settings.theme, theme, name);
    }
    ui.separator();
    ui.label(texts::SCALE);
    for scale in [0.8, 1.0, 1.25, 1.5, 2.0] {
        ui.radio_value(&mut settings.scale, scale, format!("{:.0} %", 100.0 * scale));
    }
    ui.separator();
    for (keys, what) in texts::KEYS {
        ui.horizontal(|ui| {
            ui.monospace(keys);
            ui.label(what);
        });
    }
    if *settings != before {
        theme::apply(ui.ctx(), settings);
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        let updates: Vec<Update> = self.worker.updates().collect();
        updates.into_iter().for_each(|update| self.hear(update));
        self.keys(ctx);
        self.closing(ctx);
        self.rooms_change();
        self.hand_over();
        self.keep_settings();
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        egui::Panel::bottom("status").exact_size(40.0).show(ui, |ui| self.status(ui));
        egui::Panel::left("rail").exact_size(116.0).resizable(false).show(ui, |ui| self.rail(ui));
        egui::CentralPanel::default().show(ui, |ui| self.room(ui));
        let ctx = ui.ctx().clone();
        self.problems.ui(&ctx, &mut self.state.problems);
        self.put_question(&ctx);
        widgets::show_focus(&ctx);
        self.window.follow(&ctx, &mut self.state.settings);
        // There may be no frame after this one for a long time.
        self.saver.update(&self.state.settings);
        self.escape_is_taken = self.question.is_some()
            || ctx.dragged_id().is_some()
            || egui::Popup::is_any_open(&ctx)
            || ctx.memory(|memory| memory.focused().is_some());
        self.hand_over();
    }

    fn on_exit(&mut self) {
        self.worker.control.cancel();
        self.keep_settings();
    }
}
