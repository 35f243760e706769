//! The window as a whole: the rooms' rail, the room that is open, what is going on, what went wrong, and the keys.

use crate::desk::{Activity, Brake, Desk, Problem};
use crate::keeper::Keeper;
use crate::rooms::{
    Room, calibrate::Calibrate, look, look::Look, rig::Rig, scan::Scan, scans::Scans,
    welcome::Welcome,
};
use crate::settings::{Settings, Theme};
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
}

impl App {
    /// A window as it was when it was closed. `renderer`: where the Look room puts its textures; the window works without.
    pub fn new(ctx: &egui::Context, renderer: Option<&RenderState>, settings: Settings) -> Self {
        theme::apply(ctx, &settings);
        look::view::install(ctx, renderer);
        let worker = Worker::start(ctx.clone());
        let mut desk = Desk::new(settings.clone());
        if let Some(aside) = settings.put_aside() {
            desk.tell(Problem::warning(texts::SETTINGS, texts::settings_put_aside(aside)));
        }
        match settings.rig.as_ref() {
            Some(rig) if rig.exists() => worker.ask(Command::Open(rig.clone())),
            Some(rig) => desk.tell(Problem::warning(texts::rig::OPENING, texts::rig::gone(rig))),
            None => {}
        }
        Self {
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
        }
    }

    /// What all rooms share.
    pub fn desk(&self) -> &Desk {
        &self.desk
    }

    /// Leaves something to be done, as rooms do.
    pub fn ask(&mut self, command: Command) {
        self.desk.ask(command);
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
                self.scan.reset(desk);
                self.scans.reset(desk);
                self.rig.reset(desk);
                self.calibrate.reset();
            }
            Update::CalibrationAge(days) => desk.calibration_age_days = days,
            Update::Rig(told) => self.rig.hear(told, desk),
            Update::Calibrate(told) => self.calibrate.hear(told, desk),
            Update::Scan(told) => self.scan.hear(told, desk),
            Update::Look(told) => self.look.hear(told, desk),
            Update::Scans(told) => self.scans.hear(told, desk),
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
            self.worker.ask(command);
        }
    }

    fn keep_settings(&mut self) {
        self.keeper.look_at(&self.desk.settings);
        if let Some(text) = self.keeper.trouble() {
            self.desk.tell(Problem::error(texts::KEEPING_SETTINGS, text));
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
        match desk.settings.room {
            Room::Rig => self.rig.ui(ui, desk),
            Room::Calibrate => self.calibrate.ui(ui, desk),
            Room::Scan => self.scan.ui(ui, desk),
            Room::Look => self.look.ui(ui, desk),
            Room::Scans => self.scans.ui(ui, desk),
        }
    }

    /// Control and a digit opens a room, Escape ends what is going on, Control and Q leaves; a folder that is dropped is opened.
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
        if self.desk.is_busy() && ctx.input(|input| input.key_pressed(Key::Escape)) {
            self.worker.brake.cancel();
        }
        let dropped = ctx.input(|input| input.raw.dropped_files.clone());
        if let Some(path) = dropped.into_iter().next().map(|file| file.path().to_owned()) {
            self.desk.ask(Command::Dropped(path));
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
            ui.menu_button(texts::VIEW, |ui| view_menu(ui, &mut self.desk.settings));
        });
    }

    fn status(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_centered(|ui| {
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

    fn problems(&mut self, ui: &mut egui::Ui) {
        ui.horizontal(|ui| {
            ui.label(RichText::new(texts::PROBLEMS).strong());
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.small_button(texts::DISMISS_ALL).clicked() {
                    self.desk.problems.clear();
                }
            });
        });
        egui::ScrollArea::vertical().show(ui, |ui| {
            ui.set_width(ui.available_width());
            // The newest first.
            let problems = std::mem::take(&mut self.desk.problems);
            let mut kept: Vec<_> = problems
                .into_iter()
                .rev()
                .filter(|problem| !widgets::problem(ui, problem))
                .collect();
            kept.reverse();
            self.desk.problems = kept;
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
        self.rooms_change();
        self.hand_over();
        self.keep_settings();
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        egui::Panel::bottom("status").exact_size(40.0).show(ui, |ui| self.status(ui));
        if !self.desk.problems.is_empty() {
            // As many as are there, up to three; more by scrolling.
            let height = 44.0 + 66.0 * self.desk.problems.len().min(3) as f32;
            let panel = egui::Panel::bottom("problems").exact_size(height);
            panel.show(ui, |ui| self.problems(ui));
        }
        egui::Panel::left("rail").exact_size(116.0).resizable(false).show(ui, |ui| self.rail(ui));
        egui::CentralPanel::default().show(ui, |ui| self.room(ui));
        let size = ui.ctx().content_rect().size();
        self.desk.settings.window_size = [size.x, size.y];
        self.hand_over();
    }

    fn on_exit(&mut self) {
        self.worker.brake.cancel();
        self.keep_settings();
    }
}
