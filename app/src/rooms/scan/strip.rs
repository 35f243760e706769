//! The strip of frames, filling as light after light fires.

use crate::texts::scan as texts;
use crate::ui::theme;
use crate::ui::theme::meaning;
use crate::ui::widgets::Sign;
use crate::viewer::picture::Thumb;
use eframe::egui;
use eframe::egui::{Rect, Sense, Stroke, StrokeKind, TextureHandle, TextureOptions, vec2};

/// Of the strip, points.
pub(super) const HEIGHT: f32 = 104.0;

/// What it shows.
#[derive(Default)]
pub(super) struct Strip {
    frames: Vec<(Option<usize>, TextureHandle)>,
    waiting: Vec<Thumb>,
    taking: Option<String>,
}

impl std::fmt::Debug for Strip {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Strip").field("frames", &self.frames.len()).finish_non_exhaustive()
    }
}

impl Strip {
    pub(super) fn taking(&mut self, frame: String) {
        self.taking = Some(frame);
    }

    pub(super) fn add(&mut self, thumb: Thumb) {
        if !thumb.drift_check {
            self.waiting.push(thumb);
        }
    }

    pub(super) fn done(&mut self) {
        self.taking = None;
    }

    /// Only the frames of these lights are there.
    pub(super) fn keep(&mut self, lights: &[Option<usize>]) {
        self.waiting.retain(|thumb| lights.contains(&thumb.light));
        self.frames.retain(|(light, _)| lights.contains(light));
    }

    pub(super) fn ui(&mut self, ui: &mut egui::Ui, lights: usize) {
        for thumb in self.waiting.drain(..) {
            let name = format!("frame {:?}", thumb.light);
            let texture = ui.ctx().load_texture(name, thumb.picture, TextureOptions::LINEAR);
            self.frames.retain(|(light, _)| *light != thumb.light);
            self.frames.push((thumb.light, texture));
        }
        let cells = std::iter::once(None).chain((0..lights).map(Some));
        egui::ScrollArea::horizontal().auto_shrink(false).show(ui, |ui| {
            ui.horizontal_centered(|ui| {
                ui.spacing_mut().item_spacing.x = 0.5 * theme::GAP;
                let room = ui.available_width() / (lights + 1).max(1) as f32 - 0.5 * theme::GAP;
                let width = room.clamp(30.0, 116.0);
                cells.for_each(|light| self.cell(ui, light, width));
            });
        });
    }

    fn cell(&self, ui: &mut egui::Ui, light: Option<usize>, width: f32) {
        let name = light
            .map_or(texts::AMBIENT.to_owned(), |light| format!("{} {light}", texts::LIGHT_NAME));
        let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT - 20.0), Sense::hover());
        let picture = Rect::from_min_max(rect.min, rect.max - vec2(0.0, 18.0));
        let visuals = ui.visuals();
        let painter = ui.painter();
        painter.rect_filled(picture, 4.0, visuals.extreme_bg_color);
        let frame = self.frames.iter().find(|(of, _)| *of == light);
        if let Some((_, texture)) = frame {
            let uv = cover(texture.size_vec2(), picture.size());
            painter.image(texture.id(), picture, uv, egui::Color32::WHITE);
        }
        let taking = self.taking.as_deref() == Some(&frame_name(light));
        let stroke = match (taking, frame) {
            (true, _) => Stroke::new(2.5, meaning::LIT),
            (_, Some(_)) => Stroke::new(1.5, meaning::GOOD),
            _ => Stroke::new(1.0, visuals.weak_text_color()),
        };
        painter.rect_stroke(picture, 4.0, stroke, StrokeKind::Inside);
        // Narrow cells have room for the number alone.
        let number = light.filter(|_| width < 64.0).map(|light| light.to_string());
        let sign = if taking { Some(Sign::Lit) } else { frame.map(|_| Sign::Good) };
        // The sign stands before the text: both together are in the middle.
        let beside = if sign.is_some() { 6.0 } else { 0.0 };
        let below = egui::pos2(rect.center().x + beside, picture.bottom() + 2.0);
        let font = egui::FontId::proportional(12.0);
        let text = painter.text(
            below,
            egui::Align2::CENTER_TOP,
            number.as_ref().unwrap_or(&name),
            font,
            visuals.text_color(),
        );
        // The frame's colour and weight say the same.
        if let Some(sign) = sign.filter(|_| text.width() + 22.0 <= width) {
            sign.paint(painter, text.left_center() - vec2(9.0, 0.0), 5.0);
        }
        let name = texts::frame(&name, taking, frame.is_some());
        let info = move || egui::WidgetInfo::labeled(egui::Role::Image, true, name.clone());
        response.widget_info(info);
    }
}

/// As scans call it.
fn frame_name(light: Option<usize>) -> String {
    light.map_or("the ambient frame".to_owned(), |light| format!("light {light}"))
}

/// The part of a picture that fills a rectangle of another shape.
fn cover(picture: egui::Vec2, rect: egui::Vec2) -> Rect {
    let scale = (rect.x / picture.x).max(rect.y / picture.y);
    let part = rect / (picture * scale);
    Rect::from_center_size(egui::pos2(0.5, 0.5), part)
}
