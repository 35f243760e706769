//! The histogram of a frame per channel, with what clips and how sharp it is.

use crate::texts::scan as texts;
use crate::ui::theme::meaning;
use eframe::egui;
use eframe::egui::{Sense, Shape, Stroke, pos2, vec2};
use weavelight::device::scan::{Channel, Look};

/// Of the whole, points.
pub(super) const HEIGHT: f32 = 132.0;

pub(super) fn ui(ui: &mut egui::Ui, look: &Look) {
    ui.horizontal(|ui| {
        let size = vec2((ui.available_width() - 270.0).max(160.0), HEIGHT - 28.0);
        let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
        let name = texts::HISTOGRAM;
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
        for (channel, color) in look.channels.iter().zip(meaning::CHANNELS) {
            painter.add(Shape::line(line(channel, rect), Stroke::new(1.8, color)));
        }
        ui.vertical(|ui| {
            for (channel, color) in look.channels.iter().zip(meaning::CHANNELS) {
                ui.horizontal(|ui| {
                    let (swatch, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
                    ui.painter().rect_filled(swatch, 2.0, color);
                    ui.label(texts::channel(channel));
                });
            }
            ui.label(texts::focus(look.sharpness)).on_hover_text(texts::FOCUS_HINT);
        });
    });
}

/// Roots, so that a few bright samples are seen beside many dark ones.
fn line(channel: &Channel, rect: egui::Rect) -> Vec<egui::Pos2> {
    let most = channel.histogram.iter().copied().fold(1e-9, f64::max);
    let bins = channel.histogram.len().max(2) - 1;
    let point = |(bin, share): (usize, &f64)| {
        let x = rect.left() + rect.width() * bin as f32 / bins as f32;
        pos2(x, rect.bottom() - rect.height() * 0.95 * (share / most).sqrt() as f32)
    };
    channel.histogram.iter().enumerate().map(point).collect()
}
