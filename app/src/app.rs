//! The window as a whole: the rooms' rail, the room that is open, what is going on, what went wrong, and the keys.

use crate::desk::{Activity, Area, Brake, Desk, Problem};
use crate::keeper::Keeper;
use crate::problems::Problems;
use crate::questions::{Answer, Question};
use crate::rooms::{
    Room, calibrate::Calibrate, look, look::Look, rig::Rig, scan, scan::Scan, scans::Scans,
    welcome::Welcome,
};
use crate::settings::{Settings, Theme};
use crate::window::Geometry;
use crate::worker::{Command, Update, Worker};
use crate::{texts, theme, widgets};
use eframe::egui::{self, Key, Modifiers, RichText};
use eframe::egui_wgpu::RenderState;

/// The window.
#[derive(Debug)]
pub struct App {
    desk: Desk,
    worker: Worker,
    keeper: Keeper,
    welcome: Welcome,
    rig: Rig,
    calibrate: Calibrate,
    scan: Scan,
    look: Look,
    scans: Scans,
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
        crate::clock::start();
        theme::apply(ctx, &settings);
        look::view::install(ctx, renderer);
        let worker = Worker::start(ctx.clone()).map_err(NoThreads)?;
        let mut desk = Desk::new(settings.clone());
        if let Some(aside) = settings.put_aside() {
            desk.tell(Problem::warning(texts::SETTINGS, texts::settings_put_aside(aside)));
        }
        match settings.rig.as_ref() {
            Some(rig) if rig.exists() => worker.ask(Command::Open(rig.clone())),
            Some(rig) => {
                let gone = Problem::warning(texts::rig::OPENING, texts::rig::gone(rig));
                desk.tell(gone.of(Area::Opening));
            }
            None => {}
        }
        Ok(Self {
            window: Geometry::new(&settings),
            problems: Problems::default(),
            question: None,
            escape_is_taken: false,
            closes: false,
            desk,
            worker,
            keeper: Keeper::start(settings),
            welcome: Welcome::default(),
            rig: Rig::default(),
            calibrate: Calibrate::default(),
            scan: Scan::default(),
            look: Look::default(),
            scans: Scans::default(),
            shown: None,
        })
    }

    /// What all rooms share.
    pub fn desk(&self) -> &Desk {
        &self.desk
    }

    /// The same, to be changed.
    pub fn desk_mut(&mut self) -> &mut Desk {
        &mut self.desk
    }

    /// Leaves something to be done, as rooms do.
    pub fn ask(&mut self, command: Command) {
        self.desk.ask(command);
    }

    /// What is being asked over everything else.
    pub fn question(&self) -> Option<&Question> {
        self.question.as_ref()
    }

    /// Opens a room.
    pub fn enter(&mut self, room: Room) {
        self.desk.go_to(room);
    }

    /// Whether nothing is going on and nothing is left to be done.
    pub fn is_idle(&self) -> bool {
        self.worker.is_idle() && !self.desk.is_busy() && !self.desk.has_asked()
    }

    /// Takes in what the worker tells.
    pub fn hear(&mut self, update: Update) {
        let desk = &mut self.desk;
        match update {
            Update::Began(title) => desk.activity = Some(Activity::new(title)),
            Update::Progress { share, step, left } => {
                if let Some(activity) = &mut desk.activity {
                    (activity.share, activity.step, activity.left) = (share, step, left);
                }
            }
            Update::Ended => {
                desk.activity = None;
                self.scans.is_stale();
                self.rig.is_stale();
            }
            Update::Problem(problem) => desk.tell(problem),
            Update::GoTo(room) => desk.go_to(room),
            Update::Opened(place) => {
                desk.settings.rig = Some(place.folder.clone());
                desk.place = Some(*place);
                (desk.held_by, desk.is_calibrated) = (None, false);
                desk.problems.retain(|problem| problem.area != Some(Area::Opening));
                self.scan.reset(desk);
                self.scans.reset(desk);
                self.rig.reset(desk);
                self.calibrate.reset();
            }
            Update::Held(folder, holder) => self.held(&folder, holder),
            Update::Calibrated(folder, is) => {
                if desk.place.as_ref().is_some_and(|place| place.folder == folder) {
                    desk.is_calibrated = is;
                }
            }
            Update::CalibrationAge(days) => desk.calibration_age_days = days,
            Update::Rig(told) => self.rig.hear(told, desk),
            Update::Calibrate(told) => self.calibrate.hear(told, desk),
            Update::Scan(told) => self.scan.hear(told, desk),
            Update::Look(told) => self.look.hear(told, desk),
            Update::Scans(told) => self.scans.hear(told, desk),
        }
    }

    /// Another program has taken the rig, or let it go: then what it left is looked at.
    fn held(&mut self, folder: &std::path::Path, holder: Option<String>) {
        let desk = &mut self.desk;
        if desk.place.as_ref().is_none_or(|place| place.folder != folder) {
            return;
        }
        let was_held = desk.held_by.is_some();
        desk.held_by = holder;
        if was_held && desk.held_by.is_none() {
            desk.ask(Command::Scan(scan::Ask::LookForUnfinished));
            self.scans.is_stale();
            self.rig.is_stale();
            self.calibrate.reset();
        }
    }

    fn hand_over(&mut self) {
        for brake in self.desk.take_brakes() {
            match brake {
                Brake::Cancel => self.worker.brake.cancel(),
                Brake::Pause => self.worker.brake.pause(),
                Brake::GoOn => self.worker.brake.go_on(),
            }
        }
        for command in self.desk.take_asked() {
            // What went wrong the last time is told again if it goes wrong again.
            if let Some(area) = command.tries() {
                self.desk.forget_errors(area);
            }
            self.worker.ask(command);
        }
    }

    fn keep_settings(&mut self) {
        self.keeper.look_at(&self.desk.settings);
        match self.keeper.news() {
            Some(Err(text)) => {
                let problem = Problem::error(texts::KEEPING_SETTINGS, text);
                self.desk.tell(problem.of(Area::Settings));
            }
            Some(Ok(())) => self.desk.forget_errors(Area::Settings),
            None => {}
        }
    }

    /// What a room does when it is left or entered.
    fn rooms_change(&mut self) {
        let open = self.desk.place.as_ref().map(|_| self.desk.settings.room);
        if open == self.shown {
            return;
        }
        if self.shown == Some(Room::Rig) {
            self.rig.leave(&mut self.desk);
        }
        if self.shown == Some(Room::Calibrate) {
            self.calibrate.leave(&mut self.desk);
        }
        if open == Some(Room::Look) {
            self.look.enter(&mut self.desk);
        }
        if open == Some(Room::Scans) {
            self.scans.is_stale();
        }
        self.shown = open;
    }

    fn room(&mut self, ui: &mut egui::Ui) {
        if self.desk.place.is_none() {
            return self.welcome.ui(ui, &mut self.desk);
        }
        let desk = &mut self.desk;
        if let Some(holder) = &desk.held_by {
            ui.horizontal_top(|ui| {
                widgets::Sign::Warning.ui(ui);
                ui.add(egui::Label::new(texts::rig::held(holder)).wrap());
            });
            ui.separator();
        }
        match desk.settings.room {
            Room::Rig => self.rig.ui(ui, desk),
            Room::Calibrate => self.calibrate.ui(ui, desk),
            Room::Scan => self.scan.ui(ui, desk),
            Room::Look => self.look.ui(ui, desk),
            Room::Scans => self.scans.ui(ui, desk),
        }
    }

    /// Control and a digit opens a room, Control and Q leaves, Escape ends work where it has nothing else to end; a folder that
    /// is dropped is opened.
    fn keys(&mut self, ctx: &egui::Context) {
        const DIGITS: [Key; 5] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5];
        for (room, digit) in Room::ALL.into_iter().zip(DIGITS) {
            if ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, digit)) {
                self.desk.go_to(room);
            }
        }
        if ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Q)) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        let escape = ctx.input(|input| input.key_pressed(Key::Escape));
        if escape && self.desk.is_busy() && !self.escape_is_taken {
            match self.worker.brake.is_capturing() {
                // Frames are hours of somebody's work: one key does not end them.
                true => self.question = Some(Question::StopScan),
                false => self.worker.brake.cancel(),
            }
        }
        let dropped = ctx.input(|input| input.raw.dropped_files.clone());
        if let Some(path) = dropped.into_iter().next().map(|file| file.path().to_owned()) {
            self.desk.ask(Command::Dropped(path));
        }
    }

    /// The window is to close, by Control and Q or its own button: what could be lost is asked about first, and work that is
    /// under way comes to its end.
    fn closing(&mut self, ctx: &egui::Context) {
        let wanted = ctx.input(|input| input.viewport().close_requested());
        if wanted && !self.closes && self.question != Some(Question::Ending) {
            if self.worker.brake.is_capturing() {
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
        self.worker.brake.close();
        self.question = Some(Question::Ending);
    }

    /// A question is drawn over everything else; one about a scan that has ended meanwhile is none any more.
    fn put_question(&mut self, ctx: &egui::Context) {
        let about_scan =
            matches!(self.question, Some(Question::StopScan | Question::QuitWhileScanning));
        if about_scan && !self.worker.brake.is_capturing() {
            self.question = None;
        }
        let Some(question) = self.question.clone() else { return };
        match (question.ui(ctx), question) {
            (None, _) => {}
            (Some(Answer::Stay), _) => self.question = None,
            (Some(Answer::Yes), Question::StopScan) => {
                self.worker.brake.cancel();
                self.question = None;
            }
            (Some(Answer::Yes), _) => self.end(),
        }
    }

    fn rail(&mut self, ui: &mut egui::Ui) {
        ui.add_space(theme::GAP);
        let open = self.desk.settings.room;
        ui.with_layout(egui::Layout::top_down_justified(egui::Align::Min), |ui| {
            for (k, room) in Room::ALL.into_iter().enumerate() {
                let text = RichText::new(room.name()).size(15.0);
                let button =
                    egui::Button::selectable(room == open, text).min_size(egui::vec2(0.0, 36.0));
                let enabled = self.desk.place.is_some();
                let hint = format!("Ctrl+{}", k + 1);
                if ui.add_enabled(enabled, button).on_hover_text(hint).clicked() {
                    self.desk.go_to(room);
                }
            }
        });
        ui.with_layout(egui::Layout::bottom_up(egui::Align::Min), |ui| {
            widgets::menu(ui, texts::VIEW, |ui| {
                // A small window has no room for all of it.
                let room = ui.ctx().content_rect().height() - 60.0;
                let settings = &mut self.desk.settings;
                egui::ScrollArea::vertical()
                    .max_height(room)
                    .show(ui, |ui| view_menu(ui, settings));
            });
        });
    }

    fn status(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_centered(|ui| {
            self.problems.button(ui, &self.desk.problems);
            match &self.desk.activity {
                Some(activity) => {
                    if widgets::activity(ui, activity) {
                        self.worker.brake.cancel();
                    }
                }
                None => {
                    ui.label(RichText::new(texts::READY).weak());
                }
            }
            if let Some(place) = &self.desk.place {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let folder = place.folder.display().to_string();
                    ui.label(RichText::new(&place.rig.name).weak()).on_hover_text(folder);
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
        self.problems.ui(&ctx, &mut self.desk.problems);
        self.put_question(&ctx);
        widgets::show_focus(&ctx);
        self.window.follow(&ctx, &mut self.desk.settings);
        // There may be no frame after this one for a long time.
        self.keeper.look_at(&self.desk.settings);
        self.escape_is_taken = self.question.is_some()
            || ctx.dragged_id().is_some()
            || egui::Popup::is_any_open(&ctx)
            || ctx.memory(|memory| memory.focused().is_some());
        self.hand_over();
    }

    fn on_exit(&mut self) {
        self.worker.brake.cancel();
        self.keep_settings();
    }
}
