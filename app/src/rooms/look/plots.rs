//! Histogram of slopes and the profile along a line.

use crate::rooms::look::{Look, Tool};
use crate::texts::look as texts;
use crate::ui::theme::meaning;
use crate::viewer::slopes::Distribution;
use eframe::egui;
use eframe::egui::{Align2, FontId, Rect, RichText, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use egui_plot::{HLine, Line, Plot, PlotPoints};

/// Height of a histogram, points.
const HISTOGRAM: f32 = 56.0;

/// A histogram with its figures.
pub(super) fn histogram(ui: &mut Ui, name: &str, of: &Distribution) {
    let size = vec2(ui.available_width(), HISTOGRAM + 14.0);
    let (all, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    let rect = Rect::from_min_size(all.min, vec2(all.width(), HISTOGRAM));
    let painter = ui.painter();
    painter.rect_filled(rect, 3.0, ui.visuals().extreme_bg_color);
    // The whole range where it is needed, else as far as there is something to see.
    let last = of.counts.iter().rposition(|count| *count > 0).unwrap_or(0);
    let shown = (last + 1).next_multiple_of(10).min(of.counts.len());
    let most = of.counts.iter().copied().max().unwrap_or(1).max(1) as f32;
    let width = rect.width() / shown as f32;
    for (k, count) in of.counts[..shown].iter().enumerate() {
        let height = (rect.height() - 4.0) * *count as f32 / most;
        let left = rect.left() + k as f32 * width;
        let bar = Rect::from_min_max(
            pos2(left, rect.bottom() - height),
            pos2(left + (width - 1.0).max(1.0), rect.bottom()),
        );
        painter.rect_filled(bar, 0.0, meaning::ACTIVE);
    }
    let (font, color) = (FontId::proportional(11.0), ui.visuals().weak_text_color());
    let below = |share: f32| pos2(rect.left() + share * rect.width(), rect.bottom() + 1.0);
    painter.text(below(0.0), Align2::LEFT_TOP, "0°", font.clone(), color);
    painter.text(below(0.5), Align2::CENTER_TOP, format!("{}°", shown / 2), font.clone(), color);
    painter.text(below(1.0), Align2::RIGHT_TOP, format!("{shown}°"), font, color);
    ui.label(RichText::new(texts::figures(of.mean_deg, of.median_deg, of.p95_deg)).small());
}

impl Look {
    /// What lies along the line that was drawn.
    pub(super) fn plot(&mut self, ui: &mut Ui) {
        let Some(profile) = &self.profile else {
            ui.label(RichText::new(texts::PROFILE).strong());
            ui.label(RichText::new(texts::DRAW_A_LINE).weak());
            return;
        };
        let mut put_away = false;
        ui.horizontal(|ui| {
            ui.label(RichText::new(texts::PROFILE).strong());
            let rise = profile.height.last().map_or(0.0, |last| last[1]);
            ui.label(RichText::new(texts::line_figures(profile.length_mm, rise)).weak());
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                put_away = ui.button(texts::CLOSE).clicked();
            });
        });
        let (slope, height) = (profile.slope.clone(), profile.height.clone());
        let half = (ui.available_width() - ui.spacing().item_spacing.x) / 2.0;
        // A line of text above each.
        let size = vec2(half, ui.available_height() - 24.0);
        ui.horizontal_top(|ui| {
            curve(ui, size, texts::SLOPE_ALONG, slope);
            curve(ui, size, texts::HEIGHT_ALONG, height);
        });
        if put_away {
            self.set_line(None);
            self.tool = Tool::Hand;
        }
    }
}

fn curve(ui: &mut Ui, size: egui::Vec2, name: &'static str, points: Vec<[f64; 2]>) {
    ui.vertical(|ui| {
        ui.set_width(size.x);
        ui.label(RichText::new(name).small().weak());
        let plot = Plot::new(name)
            .width(size.x)
            .height(size.y)
            .allow_scroll(false)
            .allow_zoom(false)
            .allow_drag(false)
            .allow_boxed_zoom(false)
            .allow_axis_zoom_drag(false);
        plot.show(ui, |plot| {
            let level = egui::Color32::from_gray(128);
            plot.hline(HLine::new("", 0.0).color(level).width(1.0));
            let line = Line::new(name, PlotPoints::from(points));
            plot.line(line.color(meaning::ACTIVE).width(1.5));
        });
    });
}
