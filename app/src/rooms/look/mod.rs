//! The Look room: a solution's maps under any light.
//!
//! - `viewer`: the widget that draws maps; other rooms embed it
//! - `opened`: a solution off the disk; `capture`: the frames that it was solved from; `work`: the worker's part
//! - `layer`: what can be shown; `lamp`: under which light
//! - `canvas`: the maps with what is drawn over them, and the mouse; `legend`: scales
//! - `follow`: which solution is looked at; `drafts`: strokes of a mask that were not saved yet
//! - `side`: the panel beside them; `loupe`: the numbers of a photosite; `plots`: histogram and profile
//! - `viewer::slopes`, [`profile`], `viewer::mask`: the sums behind

mod canvas;
mod edits;
mod follow;
mod lamp;
mod layer;
mod legend;
mod loupe;
mod plots;
mod side;

use crate::jobs::look::drafts::Drafts;
use crate::jobs::look::opened::Opened;
use crate::jobs::look::{Command, Event};
use crate::jobs::messages::{Request, Update};
use crate::jobs::state::AppState;
use crate::model::paths;
use crate::model::room::Room;
use crate::rooms::RoomPanel;
use crate::rooms::look::edits::Edits;
use crate::rooms::look::follow::Follow;
use crate::rooms::look::lamp::Lamp;
use crate::rooms::look::layer::Layers;
use crate::texts::look as texts;
use crate::texts::rooms;
use crate::ui::browse::Browse;
use crate::ui::{theme, widgets};
use crate::viewer::map_view::MapView;
use crate::viewer::mask::Painting;
use crate::viewer::profile;
use crate::viewer::pyramid::Pyramid;
use crate::viewer::slopes::Distribution;
use eframe::egui;
use eframe::egui::RichText;
use std::path::PathBuf;
use std::sync::Arc;
use weavelight::photometry::Photosite;

/// What the mouse does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tool {
    /// Moves the light, where one can be moved, or the picture; a click takes a photosite.
    #[default]
    Hand,
    /// Draws a line to measure along.
    Line,
    /// Paints the mask with a brush.
    Brush,
    /// Fills a line into the mask.
    Lasso,
}

/// What this room keeps.
#[derive(Debug, Default)]
pub struct Look {
    opened: Option<Box<Opened>>,
    view: MapView,
    layers: Layers,
    lamp: Lamp,
    tool: Tool,
    canvas: canvas::Canvas,
    other: Option<Other>,
    /// A light's frames and its residual: the last ones.
    picture: Option<(usize, Arc<Pyramid>)>,
    residual: Option<(usize, Arc<Pyramid>)>,
    /// What was asked of the worker and has not come yet.
    awaited: Option<Awaited>,
    taken: Option<PickedPhotosite>,
    line: Option<edits::Ends>,
    profile: Option<profile::Profile>,
    painting: Option<Painting>,
    edits: Edits,
    drafts: Drafts,
    /// Whether it is not known yet what an earlier window left.
    awaits_draft: bool,
    follow: Follow,
    path: String,
    /// A path is to be written next.
    path_is_next: bool,
    browse: Browse,
}

/// Another solution.
#[derive(Debug)]
struct Other {
    name: String,
    surface: Arc<Pyramid>,
    angles: Option<Distribution>,
}

/// Something that the worker makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Awaited {
    Picture(usize),
    Residual(usize),
}

/// The photosite that was clicked.
#[derive(Debug)]
struct PickedPhotosite {
    at: [usize; 2],
    /// `None` until it comes.
    found: Option<Option<Box<Photosite>>>,
}

impl RoomPanel for Look {
    fn title(&self) -> &'static str {
        rooms::LOOK
    }

    fn ui(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        self.draw(ui, app);
    }

    fn hear(&mut self, update: Update, app: &mut AppState) {
        if let Update::Look(event) = update {
            self.take_event(event, app);
        }
    }

    fn enter(&mut self, app: &mut AppState) {
        self.open_newest(app);
    }
}

impl Look {
    fn draw(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        self.offers(ui, app);
        if self.opened.is_none() {
            return self.nothing_yet(ui, app);
        }
        self.keys(ui);
        egui::Panel::top("look head").show(ui, |ui| self.head(ui, app));
        egui::Panel::right("look side")
            .exact_size(side::WIDTH)
            .resizable(false)
            .show(ui, |ui| self.side(ui, app));
        if self.profile.is_some() || self.tool == Tool::Line {
            egui::Panel::bottom("look profile").exact_size(190.0).show(ui, |ui| self.plot(ui));
        }
        let frame = egui::Frame::new().inner_margin(0);
        egui::CentralPanel::default().frame(frame).show(ui, |ui| self.maps(ui, app));
        self.await_layers(app);
        self.keep_draft(app);
    }

    fn take_event(&mut self, event: Event, app: &mut AppState) {
        match event {
            Event::Opened(opened) => self.take(opened, app),
            Event::Other { name, surface, angles } => {
                self.other = Some(Other { name, surface, angles });
                self.layers.compare();
                self.path.clear();
            }
            Event::Picture { light, picture } => {
                self.awaited = None;
                self.picture = Some((light, picture));
            }
            Event::Residual { light, picture } => {
                self.awaited = None;
                self.residual = Some((light, picture));
            }
            Event::Photosite { at, found } => {
                if let Some(taken) = self.taken.as_mut().filter(|taken| taken.at == at) {
                    taken.found = Some(found);
                }
            }
            Event::MaskSaved(key, version) => self.mask_saved(&key, version, app),
            Event::Draft(file, draft) => self.take_draft(file, draft.map(|draft| *draft), app),
            Event::Newest(solution) => self.newest(solution),
            Event::Unsolved(scan) => self.unsolved(scan, app),
        }
    }

    /// The solution that is looked at.
    pub fn opened(&self) -> Option<&Opened> {
        self.opened.as_deref()
    }

    fn nothing_yet(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        widgets::heading(ui, texts::HEADING, texts::WHAT);
        ui.add_space((ui.available_height() * 0.22).max(theme::GAP));
        ui.vertical_centered(|ui| {
            ui.label(RichText::new(texts::NOTHING_YET).size(16.0).weak());
            ui.add_space(theme::GAP);
            let size = egui::vec2(180.0, theme::BIG);
            if widgets::primary(ui, texts::TO_SCANS, size, true).clicked() {
                app.go_to(Room::Scans);
            }
        });
        ui.add_space(2.0 * theme::WIDE_GAP);
        let (_, row) = ui.allocate_space(egui::vec2(ui.available_width(), 32.0));
        let size = egui::vec2(row.width().min(620.0), row.height());
        let field =
            egui::UiBuilder::new().max_rect(egui::Rect::from_center_size(row.center(), size));
        ui.scope_builder(field, |ui| {
            self.path_field(ui, texts::FOLDER, texts::OPEN, |folder| {
                app.request(Request::Look(Command::Open(folder)));
            });
        });
    }

    /// A field for a folder, with a dialogue beside it.
    fn path_field(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        action: &str,
        mut open: impl FnMut(PathBuf),
    ) {
        ui.horizontal(|ui| {
            let label = ui.label(name);
            let width = (ui.available_width() - 160.0).max(60.0);
            let field = widgets::path_field(ui, label.id, &mut self.path, width);
            if std::mem::take(&mut self.path_is_next) {
                field.request_focus();
            }
            let entered = widgets::entered(ui, &field);
            if let Some(folder) = self.browse.folder(ui) {
                self.path = folder.display().to_string();
            }
            let folder = paths::typed(&self.path);
            let clicked = ui.add_enabled(folder.is_some(), egui::Button::new(action)).clicked();
            if let Some(folder) = folder.filter(|_| clicked || entered) {
                open(folder);
                ui.close();
            }
        });
    }

    fn keys(&mut self, ui: &egui::Ui) {
        use egui::{Key, Modifiers};
        let pressed = |modifiers, key| ui.input_mut(|input| input.consume_key(modifiers, key));
        // A text that is being written has its own.
        if ui.ctx().text_edit_focused() {
            return;
        }
        // The one with more modifiers first: the other would take it too.
        if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) {
            self.redo();
        } else if pressed(Modifiers::COMMAND, Key::Z) {
            self.undo();
        }
        if pressed(Modifiers::NONE, Key::F) {
            self.view.fit();
        }
        if pressed(Modifiers::NONE, Key::Num1) {
            self.view.one_to_one(ui.ctx());
        }
    }

    fn head(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let Some(opened) = &self.opened else { return };
        let (name, about) = (opened.name.clone(), about(opened));
        let warnings = opened.warnings.join("\n");
        let surface = opened.maps.surface.clone();
        ui.add_space(theme::GAP / 2.0);
        ui.horizontal(|ui| {
            ui.add(egui::Label::new(RichText::new(name).heading()).truncate());
            ui.label(RichText::new(about).weak()).on_hover_text(&warnings);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let open = widgets::menu(ui, texts::OPEN_MENU, |ui| {
                    ui.set_min_width(menu_width(ui));
                    self.path_field(ui, texts::FOLDER, texts::OPEN, |folder| {
                        app.request(Request::Look(Command::Open(folder)));
                    });
                    ui.checkbox(&mut self.follow.pinned, texts::PIN).on_hover_text(texts::PIN_HINT);
                });
                let compare = widgets::menu(ui, texts::COMPARE_MENU, |ui| {
                    ui.set_min_width(menu_width(ui));
                    self.path_field(ui, texts::FOLDER, texts::COMPARE, |folder| {
                        app.request(Request::Look(Command::Compare(folder, surface.clone())));
                    });
                });
                // The field is what they are about.
                if open.clicked() || compare.clicked() {
                    self.path_is_next = true;
                    ui.ctx().request_repaint();
                }
            });
        });
        ui.horizontal(|ui| self.tools(ui));
        ui.add_space(theme::GAP / 2.0);
    }

    fn tools(&mut self, ui: &mut egui::Ui) {
        let can_mask = self.can_mask();
        for (tool, (name, hint)) in
            [Tool::Hand, Tool::Line, Tool::Brush, Tool::Lasso].into_iter().zip(texts::TOOLS)
        {
            let masks = matches!(tool, Tool::Brush | Tool::Lasso);
            let button = egui::Button::selectable(self.tool == tool, name);
            let hint = if masks && !can_mask { texts::NO_MASK } else { hint };
            if ui
                .add_enabled(!masks || can_mask, button)
                .on_hover_text(hint)
                .on_disabled_hover_text(hint)
                .clicked()
            {
                self.tool = tool;
            }
        }
        ui.separator();
        if ui.button(texts::FIT).on_hover_text(texts::FIT_HINT).clicked() {
            self.view.fit();
        }
        if ui.button(texts::ONE_TO_ONE).on_hover_text(texts::ONE_TO_ONE_HINT).clicked() {
            self.view.one_to_one(ui.ctx());
        }
        ui.separator();
        let [undo, redo] = self.edits.steps();
        let button = |name| egui::Button::new(name);
        if ui.add_enabled(undo, button(texts::UNDO)).on_hover_text(texts::UNDO_HINT).clicked() {
            self.undo();
        }
        if ui.add_enabled(redo, button(texts::REDO)).on_hover_text(texts::REDO_HINT).clicked() {
            self.redo();
        }
    }

    /// A mask belongs to the frames: it needs a capture session whose grid the maps share.
    fn can_mask(&self) -> bool {
        self.opened.as_ref().is_some_and(|opened| opened.capture().is_some())
    }

    /// Asks for a light's picture or residual where one is shown that is not there.
    fn await_layers(&mut self, app: &mut AppState) {
        let Some(capture) = self.opened.as_ref().and_then(|opened| opened.capture()) else {
            return;
        };
        let light = self.lamp.light;
        if self.awaited.is_some() || app.is_busy() || !capture.lights.contains(&light) {
            return;
        }
        let there =
            |of: &Option<(usize, Arc<Pyramid>)>| of.as_ref().is_some_and(|of| of.0 == light);
        let sources = capture.sources.clone();
        if self.layers.shows_frame() && !there(&self.picture) {
            self.awaited = Some(Awaited::Picture(light));
            app.request(Request::Look(Command::Picture(sources, light)));
        } else if self.layers.shows_residual() && !there(&self.residual) {
            self.awaited = Some(Awaited::Residual(light));
            app.request(Request::Look(Command::Residual(sources, light)));
        }
    }
}

/// Of the menus with a path, points.
fn menu_width(ui: &egui::Ui) -> f32 {
    460.0_f32.min(ui.ctx().content_rect().width() - 40.0)
}

/// Size, scale and method in words.
fn about(opened: &Opened) -> String {
    let size = texts::size(opened.maps.size());
    let scale = opened.mm_per_px.map_or_else(String::new, texts::scale);
    format!("{size}{scale} · {}", opened.method)
}
