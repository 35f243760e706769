//! The Scans room: what was captured, newest first; search, open, solve again, export, delete to the bin.

use crate::jobs::messages::{Request, Update};
use crate::jobs::scans::{Command, Deleted, Event};
use crate::jobs::state::AppState;
use crate::model::names::folder_name;
use crate::model::paths;
use crate::model::room::Room;
use crate::model::scan_entry::ScanEntry;
use crate::rooms::RoomPanel;
use crate::texts::rooms;
use crate::texts::scans as texts;
use crate::ui::browse::Browse;
use crate::ui::{theme, widgets};
use eframe::egui;
use eframe::egui::{
    ColorImage, Key, Modifiers, RichText, Sense, TextureHandle, TextureOptions, vec2,
};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use weavelight::solution::Reuse;

/// Width of a card, points.
const CARD: f32 = 208.0;
/// Height of a card's picture, points.
const PICTURE: f32 = 128.0;

/// What this room keeps.
#[derive(Default)]
pub struct Scans {
    /// `None` until they come.
    entries: Option<Vec<ScanEntry>>,
    search: String,
    chosen: Option<PathBuf>,
    /// It may be out of sight.
    show_chosen: bool,
    /// A scan whose solution was up to date when it was to be solved again.
    up_to_date: Option<PathBuf>,
    pictures: HashMap<PathBuf, Picture>,
    export_to: String,
    browse: Browse,
    /// Of which solution something was said, and what.
    said: Option<(PathBuf, String)>,
    /// What was deleted and can be brought back, the last one last.
    deleted: Vec<Deleted>,
    /// Whether the list is as the folder was when the room was entered.
    fresh: bool,
}

enum Picture {
    Asked,
    Here(ColorImage),
    Loaded(TextureHandle),
}

impl std::fmt::Debug for Scans {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let entries = self.entries.as_ref().map(Vec::len);
        f.debug_struct("Scans").field("entries", &entries).finish_non_exhaustive()
    }
}

impl RoomPanel for Scans {
    fn title(&self) -> &'static str {
        rooms::SCANS
    }

    fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        self.draw(ui, app);
    }

    fn hear(&mut self, update: Update, app: &mut AppState) {
        if let Update::Scans(event) = update {
            self.take_event(event, app);
        }
    }

    fn enter(&mut self, _app: &mut AppState) {
        self.fresh = false;
    }

    fn rig_opened(&mut self, _app: &mut AppState) {
        *self = Self::default();
    }

    fn rig_released(&mut self, _app: &mut AppState) {
        self.fresh = false;
    }

    fn job_ended(&mut self) {
        self.fresh = false;
    }
}

impl Scans {
    fn draw(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        if let Some(place) = app.project.clone().filter(|_| !self.fresh) {
            self.fresh = true;
            app.request(Request::Scans(Command::List(Box::new(place))));
        }
        if let Some(entry) = self.chosen() {
            let pane = egui::Panel::right("scan details").exact_size(280.0).resizable(false);
            pane.show(ui, |ui| self.details(ui, &entry, app));
        }
        egui::CentralPanel::default().show(ui, |ui| self.gallery(ui, app));
    }

    /// What was chosen, as long as the search does not hide it.
    fn chosen(&self) -> Option<ScanEntry> {
        let chosen = self.chosen.as_ref()?;
        self.found().into_iter().find(|entry| entry.folder == *chosen)
    }

    fn gallery(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        ui.horizontal(|ui| {
            ui.heading(crate::texts::rooms::SCANS);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                self.search_field(ui);
            });
        });
        self.offer_undo(ui, app);
        let Some(entries) = &self.entries else {
            ui.label(RichText::new(texts::LISTING).weak());
            return;
        };
        if entries.is_empty() {
            if widgets::empty(ui, texts::NONE, texts::GO_SCAN) {
                app.go_to(Room::Scan);
            }
            return;
        }
        let found = self.found();
        self.keys(ui, &found, app);
        if found.is_empty() {
            ui.label(texts::nothing_found(&self.search));
        }
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing = vec2(theme::WIDE_GAP, theme::WIDE_GAP);
                found.iter().for_each(|entry| self.card(ui, entry, app));
            });
            widgets::reveal_focus(ui);
        });
    }

    /// Escape empties it, Enter chooses the first scan that is found.
    fn search_field(&mut self, ui: &mut egui::Ui) {
        let id = ui.make_persistent_id("search");
        // The field itself gives the keyboard back with these keys.
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        let written = ui.memory(|memory| memory.has_focus(id) || memory.had_focus_last_frame(id));
        let (clear, choose) = (written && pressed(Key::Escape), written && pressed(Key::Enter));
        if clear {
            self.search.clear();
        }
        let field = egui::TextEdit::singleline(&mut self.search).hint_text(texts::SEARCH).id(id);
        ui.add(field.desired_width(220.0)).on_hover_text(texts::SEARCH);
        if choose {
            // It is not to open the scan, too.
            ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Enter));
            if let Some(entry) = self.found().first() {
                self.choose(entry);
            }
        }
    }

    /// What was deleted last can be had again: with the button, or Control and Z.
    fn offer_undo(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let Some(last) = self.deleted.last().cloned() else { return };
        let idle = app.can_change();
        let clicked = ui.horizontal(|ui| {
            ui.label(texts::in_the_bin(&last.name));
            let undo = egui::Button::new(texts::UNDO);
            ui.add_enabled(idle, undo).on_hover_text("Ctrl+Z").clicked()
        });
        let free = idle && !ui.ctx().egui_wants_keyboard_input();
        let key = free && ui.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Z));
        if clicked.inner || key {
            app.request(Request::Scans(Command::BringBack(last)));
        }
    }

    fn found(&self) -> Vec<ScanEntry> {
        let wanted = self.search.to_lowercase();
        let fits = |entry: &&ScanEntry| entry.name.to_lowercase().contains(&wanted);
        self.entries.iter().flatten().filter(fits).cloned().collect()
    }

    /// Arrows choose, Enter opens, Control and E exports, Delete deletes.
    fn keys(&mut self, ui: &egui::Ui, found: &[ScanEntry], app: &mut AppState) {
        if ui.ctx().egui_wants_keyboard_input() || found.is_empty() {
            return;
        }
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        let at = found.iter().position(|entry| self.chosen.as_ref() == Some(&entry.folder));
        if pressed(Key::ArrowRight) || pressed(Key::ArrowDown) {
            self.choose(&found[at.map_or(0, |k| (k + 1).min(found.len() - 1))]);
            self.show_chosen = true;
        } else if pressed(Key::ArrowLeft) || pressed(Key::ArrowUp) {
            self.choose(&found[at.map_or(0, |k| k.saturating_sub(1))]);
            self.show_chosen = true;
        }
        let Some(entry) = at.map(|k| found[k].clone()) else { return };
        let export = ui.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::E));
        if pressed(Key::Enter) {
            open(&entry, app);
        } else if let Some(solution) = entry.solution.clone().filter(|_| export) {
            let to = export_folder(&entry, app);
            app.request(Request::Scans(Command::Export { solution, to }));
        } else if pressed(Key::Delete) && app.can_change() {
            self.chosen = None;
            app.request(Request::Scans(Command::Delete(entry)));
        }
    }

    fn choose(&mut self, entry: &ScanEntry) {
        self.chosen = Some(entry.folder.clone());
        self.export_to.clear();
        self.said = None;
        self.up_to_date = None;
    }

    fn card(&mut self, ui: &mut egui::Ui, entry: &ScanEntry, app: &mut AppState) {
        let (rect, response) = ui.allocate_exact_size(vec2(CARD, PICTURE + 44.0), Sense::click());
        let label = format!("{}, {}", entry.name, texts::state(entry));
        let info = || egui::WidgetInfo::labeled(egui::Role::Button, true, label.clone());
        response.widget_info(info);
        let chosen = self.chosen.as_ref() == Some(&entry.folder);
        if chosen && std::mem::take(&mut self.show_chosen) {
            response.scroll_to_me(None);
        }
        if !ui.is_rect_visible(rect) {
            return;
        }
        let visuals = ui.visuals().clone();
        let fill = if chosen { visuals.selection.bg_fill } else { visuals.faint_bg_color };
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 6.0, fill);
        let picture = egui::Rect::from_min_size(rect.min, vec2(CARD, PICTURE)).shrink(4.0);
        painter.rect_filled(picture, 4.0, visuals.extreme_bg_color);
        if let Some(texture) = self.texture(ui.ctx(), entry, app) {
            let scale = (picture.size() / texture.size_vec2()).min_elem();
            let place = egui::Rect::from_center_size(picture.center(), texture.size_vec2() * scale);
            let all = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
            painter.image(texture.id(), place, all, egui::Color32::WHITE);
        }
        let at = |dy: f32| egui::pos2(rect.left() + 8.0, picture.bottom() + dy);
        let text = |at, text: &str, size: f32, color| {
            painter.text(at, egui::Align2::LEFT_TOP, text, egui::FontId::proportional(size), color)
        };
        text(at(4.0), &entry.name, 14.0, visuals.text_color());
        text(at(23.0), &texts::state(entry), 12.0, visuals.weak_text_color());
        if response.double_clicked() {
            open(entry, app);
        } else if response.clicked() {
            self.choose(entry);
        }
    }

    fn texture(
        &mut self,
        ctx: &egui::Context,
        entry: &ScanEntry,
        app: &mut AppState,
    ) -> Option<TextureHandle> {
        let picture = self.pictures.entry(entry.folder.clone()).or_insert_with(|| {
            let place = app.project.clone().map(Box::new);
            if let Some(place) = place {
                app.request(Request::Scans(Command::Thumbnail(place, entry.folder.clone())));
            }
            Picture::Asked
        });
        if let Picture::Here(image) = picture {
            let texture = ctx.load_texture(&entry.name, image.clone(), TextureOptions::LINEAR);
            *picture = Picture::Loaded(texture);
        }
        match picture {
            Picture::Loaded(texture) => Some(texture.clone()),
            _ => None,
        }
    }

    fn details(&mut self, ui: &mut egui::Ui, entry: &ScanEntry, app: &mut AppState) {
        ui.heading(&entry.name);
        egui::Grid::new("details").num_columns(2).show(ui, |ui| {
            for (what, value) in texts::details(entry) {
                ui.label(RichText::new(what).weak());
                ui.add(egui::Label::new(value).wrap());
                ui.end_row();
            }
        });
        ui.separator();
        ui.with_layout(egui::Layout::top_down_justified(egui::Align::Min), |ui| {
            let idle = app.can_change();
            if ui.add_enabled(entry.solution.is_some(), egui::Button::new(texts::OPEN)).clicked() {
                open(entry, app);
            }
            self.solve(ui, entry, app);
            let delete = egui::Button::new(texts::delete(&entry.name)).truncate();
            if ui.add_enabled(idle, delete).on_hover_text(texts::DELETE_HINT).clicked() {
                app.request(Request::Scans(Command::Delete(entry.clone())));
                self.chosen = None;
            }
        });
        if let Some(solution) = &entry.solution {
            ui.separator();
            self.export(ui, solution, entry, app);
        }
    }

    fn solve(&mut self, ui: &mut egui::Ui, entry: &ScanEntry, app: &mut AppState) {
        let again = if entry.solution.is_some() { texts::SOLVE_AGAIN } else { texts::SOLVE };
        let can = app.can_change() && entry.frames[0] > 0;
        let mut reuse = None;
        if ui.add_enabled(can, egui::Button::new(again)).clicked() {
            reuse = Some(Reuse::IfCurrent);
        }
        if self.up_to_date.as_ref() == Some(&entry.folder) {
            ui.add(egui::Label::new(texts::UP_TO_DATE).wrap());
            if ui.add_enabled(can, egui::Button::new(texts::SOLVE_ALL_THE_SAME)).clicked() {
                reuse = Some(Reuse::Never);
            }
        }
        if let Some(reuse) = reuse {
            let (scan, settings) = (entry.folder.clone(), app.settings.solve);
            self.up_to_date = None;
            app.request(Request::Scans(Command::Solve { scan, settings, reuse }));
        }
    }

    fn export(
        &mut self,
        ui: &mut egui::Ui,
        solution: &Path,
        entry: &ScanEntry,
        app: &mut AppState,
    ) {
        if self.export_to.is_empty() {
            self.export_to = export_folder(entry, app).display().to_string();
        }
        let label = ui.label(texts::EXPORT_TO);
        let width = ui.available_width();
        let field = widgets::path_field(ui, label.id, &mut self.export_to, width);
        let entered = widgets::entered(ui, &field);
        ui.horizontal(|ui| {
            if let Some(folder) = self.browse.folder(ui) {
                self.export_to = folder.join(export_name(entry)).display().to_string();
            }
            let free = !app.is_busy();
            let clicked = ui.add_enabled(free, egui::Button::new(texts::EXPORT)).clicked();
            let to = paths::typed(&self.export_to).filter(|_| clicked || (entered && free));
            if let Some(to) = to {
                let solution = solution.to_owned();
                app.request(Request::Scans(Command::Export { solution, to }));
            }
        });
        if let Some((_, said)) = self.said.as_ref().filter(|(of, _)| of == solution) {
            ui.add(egui::Label::new(said).wrap());
        }
    }

    fn take_event(&mut self, event: Event, app: &mut AppState) {
        match event {
            Event::List(of, entries) => {
                if app.project.as_ref().is_some_and(|place| place.folder == of) {
                    self.take(entries);
                }
            }
            Event::Thumbnail(folder, picture) => {
                self.pictures.insert(folder, Picture::Here(picture));
            }
            Event::Deleted(entry) => self.deleted.push(entry),
            Event::BroughtBack(deleted) => {
                self.deleted.retain(|other| *other != deleted);
                self.chosen = Some(deleted.folder);
                (self.said, self.up_to_date) = (None, None);
                self.export_to.clear();
            }
            Event::Solved(scan, up_to_date) => self.up_to_date = up_to_date.then_some(scan),
            Event::Exported { solution, to } => self.said = Some((solution, texts::exported(&to))),
        }
    }

    /// A scan that was taken again has another picture.
    fn take(&mut self, entries: Vec<ScanEntry>) {
        for entry in self.entries.iter().flatten() {
            let same =
                |new: &ScanEntry| new.folder == entry.folder && new.captured == entry.captured;
            if !entries.iter().any(same) {
                self.pictures.remove(&entry.folder);
            }
        }
        self.entries = Some(entries);
    }
}

/// The default folder of an export.
fn export_folder(entry: &ScanEntry, app: &AppState) -> PathBuf {
    app.settings.home.join("exports").join(export_name(entry))
}

fn export_name(entry: &ScanEntry) -> String {
    format!("{} maps", folder_name(&entry.name))
}

fn open(entry: &ScanEntry, app: &mut AppState) {
    if let Some(solution) = &entry.solution {
        app.look_at(solution.clone());
    }
}
