//! Small things that several rooms draw.

use crate::model::activity::Activity;
use crate::texts;
use crate::ui::theme::meaning;
use eframe::egui;
use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{Color32, RichText, vec2};

/// A room's heading with a sentence below.
pub fn heading(ui: &mut egui::Ui, title: &str, what: &str) {
    ui.heading(title);
    if !what.is_empty() {
        ui.label(RichText::new(what).weak());
    }
}

/// The one button that a room is about.
pub fn primary(ui: &mut egui::Ui, text: &str, size: egui::Vec2, enabled: bool) -> egui::Response {
    let visuals = ui.visuals().selection;
    let text = RichText::new(text).size(17.0).strong().color(visuals.stroke.color);
    let button = egui::Button::new(text).fill(visuals.bg_fill);
    ui.add_enabled_ui(enabled, |ui| ui.add_sized(size, button)).inner
}

/// A button as large as the primary one, where another one is what the room is about.
pub fn large(ui: &mut egui::Ui, text: &str, size: egui::Vec2, enabled: bool) -> egui::Response {
    let button = egui::Button::new(RichText::new(text).size(17.0));
    ui.add_enabled_ui(enabled, |ui| ui.add_sized(size, button)).inner
}

/// What there is to see where there is nothing yet: what is missing, and one button that does something about it. True when
/// it is clicked.
pub fn empty(ui: &mut egui::Ui, what: &str, remedy: &str) -> bool {
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.3);
        ui.label(RichText::new(what).size(16.0).weak());
        ui.add_space(crate::ui::theme::GAP);
        primary(ui, remedy, vec2(220.0, crate::ui::theme::BIG), true).clicked()
    })
    .inner
}

/// A button with a menu below that holds more than commands: it stays until it is closed, or a click goes elsewhere.
pub fn menu<R>(
    ui: &mut egui::Ui,
    text: &str,
    contents: impl FnOnce(&mut egui::Ui) -> R,
) -> egui::Response {
    let stays = MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    MenuButton::new(text).config(stays).ui(ui, contents).0
}

/// Whether a key went down: once, however long it is held.
pub fn struck(ui: &egui::Ui, wanted: egui::Key) -> bool {
    let is_it = |event: &egui::Event| matches!(event, egui::Event::Key { key, pressed: true, repeat: false, .. } if *key == wanted);
    ui.input(|input| input.events.iter().any(is_it))
}

/// Whether Enter was pressed in a field of one line. Nothing else gets that key then.
pub fn entered(ui: &egui::Ui, field: &egui::Response) -> bool {
    let enter =
        |input: &mut egui::InputState| input.consume_key(egui::Modifiers::NONE, egui::Key::Enter);
    field.lost_focus() && ui.input_mut(enter)
}

/// A field for a path, `width` points wide. What was written or pasted becomes the path that it means once the field is left.
pub fn path_field(
    ui: &mut egui::Ui,
    label: egui::Id,
    text: &mut String,
    width: f32,
) -> egui::Response {
    let field = ui.add(egui::TextEdit::singleline(text).desired_width(width)).labelled_by(label);
    if field.lost_focus()
        && let Some(path) =
            crate::model::paths::typed(text).as_deref().and_then(std::path::Path::to_str)
    {
        path.clone_into(text);
    }
    field
}

/// At the end of what scrolls: what has just got the keyboard comes into sight.
pub fn reveal_focus(ui: &egui::Ui) {
    let focused = ui.ctx().memory(|memory| memory.focused());
    let Some(response) = focused.and_then(|id| ui.ctx().read_response(id)) else { return };
    let is_ours = response.layer_id == ui.layer_id() && ui.min_rect().contains_rect(response.rect);
    if is_ours && response.gained_focus() {
        ui.scroll_to_rect(response.rect.expand(crate::ui::theme::GAP), None);
    }
}

/// Draws a ring around what has the keyboard, whatever that is.
pub fn show_focus(ctx: &egui::Context) {
    let focused = ctx.memory(|memory| memory.focused());
    let Some(response) = focused.and_then(|id| ctx.read_response(id)) else { return };
    let ring = response.rect.expand(2.0);
    // What is scrolled out of sight has none.
    let seen = response.interact_rect.expand(4.0);
    let color = crate::ui::theme::focus(ctx.theme());
    let painter = ctx.layer_painter(response.layer_id).with_clip_rect(seen);
    painter.rect_stroke(ring, 6.0, egui::Stroke::new(2.0, color), egui::StrokeKind::Middle);
}

/// How far work is, with time left and the button that ends it. True when that is clicked.
pub fn activity(ui: &mut egui::Ui, activity: &Activity) -> bool {
    ui.label(RichText::new(&activity.title).strong());
    ui.label(RichText::new(&activity.step).weak());
    let bar = egui::ProgressBar::new(activity.share as f32).desired_width(180.0).show_percentage();
    ui.add(bar);
    if let Some(left) = activity.time_left() {
        ui.label(texts::time_left(left.as_secs_f64()));
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(500));
    }
    ui.button(texts::CANCEL).on_hover_text("Esc").clicked()
}

/// A shape that says the same as its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// A tick.
    Good,
    /// A cross.
    Bad,
    /// A triangle.
    Warning,
    /// A sun.
    Lit,
}

impl Sign {
    fn color(self) -> Color32 {
        match self {
            Sign::Good => meaning::GOOD,
            Sign::Bad => meaning::BAD,
            Sign::Warning => meaning::WARNING,
            Sign::Lit => meaning::LIT,
        }
    }

    /// Draws it around a place, `radius` points in size.
    pub fn paint(self, painter: &egui::Painter, centre: egui::Pos2, radius: f32) {
        let stroke = egui::Stroke::new(0.28 * radius + 0.6, self.color());
        let at = |x: f32, y: f32| centre + radius * vec2(x, y);
        match self {
            Sign::Good => {
                painter.line(vec![at(-0.8, 0.1), at(-0.2, 0.7), at(0.9, -0.7)], stroke);
            }
            Sign::Bad => {
                painter.line_segment([at(-0.7, -0.7), at(0.7, 0.7)], stroke);
                painter.line_segment([at(-0.7, 0.7), at(0.7, -0.7)], stroke);
            }
            Sign::Warning => {
                let corners = vec![at(0.0, -0.9), at(0.95, 0.8), at(-0.95, 0.8)];
                painter.add(egui::Shape::convex_polygon(corners, self.color(), egui::Stroke::NONE));
                let dark = egui::Stroke::new(0.25 * radius, Color32::BLACK);
                painter.line_segment([at(0.0, -0.3), at(0.0, 0.3)], dark);
            }
            Sign::Lit => {
                painter.circle_filled(centre, 0.5 * radius, self.color());
                for k in 0..8 {
                    let (sin, cos) = (k as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
                    let ray = [at(0.7 * cos, 0.7 * sin), at(1.05 * cos, 1.05 * sin)];
                    painter.line_segment(ray, egui::Stroke::new(1.2, self.color()));
                }
            }
        }
    }

    /// Draws it in the line.
    pub fn ui(self, ui: &mut egui::Ui) {
        let (rect, _) = ui.allocate_exact_size(egui::Vec2::splat(18.0), egui::Sense::hover());
        self.paint(ui.painter(), rect.center(), 7.0);
    }
}
