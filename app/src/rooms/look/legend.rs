//! What the colours stand for, and how long a millimetre is.

use crate::rooms::look::Look;
use crate::rooms::look::layer::Layer;
use crate::texts::look as texts;
use crate::ui::theme;
use crate::viewer::appearance::Compose;
use crate::viewer::geometry::Geometry;
use crate::viewer::map_view::MapArea;
use crate::viewer::scales;
use eframe::egui;
use eframe::egui::{Align2, Color32, FontId, Pos2, Rect, Stroke, Ui, Vec2, pos2, vec2};

/// Size of a scale, points.
const SCALE: Vec2 = vec2(160.0, 10.0);
const INSET: f32 = 12.0;
/// Height of what stands on one line.
const LINE: f32 = 16.0;

/// A scale of colours.
struct Scale {
    title: &'static str,
    from: String,
    to: String,
    color: fn(f32) -> Color32,
}

impl Look {
    pub(super) fn legend(&self, ui: &Ui, shown: &MapArea) {
        let scales: Vec<Scale> = match self.layers.compose {
            Compose::Difference => vec![self.difference()],
            _ => self.layers.seen().iter().filter_map(|layer| self.scale(*layer)).collect(),
        };
        let mut at = shown.rect.left_bottom() + vec2(INSET, -INSET);
        for scale in scales.iter().rev() {
            draw_scale(ui, at, scale);
            at.y -= SCALE.y + 2.0 * LINE + 2.0 * INSET;
        }
        if let Some(opened) = self.opened.as_ref().filter(|o| o.maps.geometry.is_physical()) {
            draw_ruler(ui, shown, &opened.maps.geometry);
        }
    }

    fn scale(&self, layer: Layer) -> Option<Scale> {
        let s = &self.layers.scales;
        let degrees = |title, top: f32| Scale {
            title,
            from: "0°".to_owned(),
            to: format!("{top:.0}°"),
            color: scales::heat,
        };
        Some(match layer {
            Layer::Error => degrees(texts::EXPECTED_ERROR, s.error_deg),
            Layer::Slope => degrees(texts::SLOPE, s.slope_deg),
            Layer::Angle => degrees(texts::ANGLE, s.angle_deg),
            Layer::Residual => Scale {
                title: texts::RESIDUAL,
                from: format!("−{:.2}", s.residual),
                to: format!("+{:.2}", s.residual),
                color: scales::signed,
            },
            _ => return None,
        })
    }

    fn difference(&self) -> Scale {
        let to = format!("{:.0} %", 100.0 * self.layers.scales.difference);
        Scale { title: texts::DIFFERENCE, from: "0 %".to_owned(), to, color: scales::heat }
    }
}

/// A card whose lower left corner is at `at`.
fn draw_scale(ui: &Ui, at: Pos2, scale: &Scale) {
    let size = vec2(SCALE.x + 2.0 * INSET, SCALE.y + 2.0 * LINE + 1.5 * INSET);
    let card = Rect::from_min_size(at - vec2(0.0, size.y), size);
    let visuals = ui.visuals();
    let painter = ui.painter();
    painter.rect_filled(card, 6.0, visuals.panel_fill.gamma_multiply(0.9));
    let (font, color) = (FontId::proportional(12.0), visuals.text_color());
    let top = card.min + vec2(INSET, INSET / 2.0);
    painter.text(top, Align2::LEFT_TOP, scale.title, font.clone(), color);
    let bar = Rect::from_min_size(top + vec2(0.0, LINE + 2.0), SCALE);
    let steps = SCALE.x as usize / 2;
    for k in 0..steps {
        let left = bar.left() + 2.0 * k as f32;
        let stripe = Rect::from_min_size(pos2(left, bar.top()), vec2(2.0, bar.height()));
        let share = (k as f32 + 0.5) / steps as f32;
        painter.rect_filled(stripe, 0.0, (scale.color)(share));
    }
    let below = vec2(0.0, 2.0);
    painter.text(bar.left_bottom() + below, Align2::LEFT_TOP, &scale.from, font.clone(), color);
    painter.text(bar.right_bottom() + below, Align2::RIGHT_TOP, &scale.to, font, color);
}

/// A round number of millimetres, about a sixth of the width.
fn draw_ruler(ui: &Ui, shown: &MapArea, geometry: &Geometry) {
    let points_per_mm = f64::from(shown.viewport.zoom) / geometry.mm_per_px();
    let length_mm = round_length(f64::from(shown.rect.width()) / 6.0 / points_per_mm);
    let length = (length_mm * points_per_mm) as f32;
    let end = shown.rect.right_bottom() - vec2(INSET + theme::GAP, INSET + theme::GAP);
    let start = end - vec2(length, 0.0);
    let painter = ui.painter();
    let card = Rect::from_min_max(start - vec2(theme::GAP, 22.0), end + Vec2::splat(theme::GAP));
    painter.rect_filled(card, 6.0, ui.visuals().panel_fill.gamma_multiply(0.9));
    let color = ui.visuals().text_color();
    painter.line_segment([start, end], Stroke::new(2.0, color));
    for tip in [start, end] {
        painter.line_segment([tip - vec2(0.0, 4.0), tip + vec2(0.0, 4.0)], Stroke::new(2.0, color));
    }
    let middle = pos2((start.x + end.x) / 2.0, end.y - 4.0);
    let font = FontId::proportional(12.0);
    painter.text(middle, Align2::CENTER_BOTTOM, texts::length(length_mm), font, color);
}

/// The largest of 1, 2, 5, 10, 20 ... not above a length.
fn round_length(length_mm: f64) -> f64 {
    let decade = 10.0_f64.powf(length_mm.max(1e-6).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|n| n * decade).find(|n| *n <= length_mm).unwrap_or(decade)
}

/// A text over the picture, readable on anything.
pub(super) fn tag(ui: &Ui, at: Pos2, align: Align2, text: &str) {
    let visuals = ui.visuals();
    let font = FontId::proportional(13.0);
    let painter = ui.painter();
    let galley = painter.layout_no_wrap(text.to_owned(), font, visuals.text_color());
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand2(vec2(6.0, 3.0)), 4.0, visuals.panel_fill.gamma_multiply(0.9));
    painter.galley(rect.min, galley, visuals.text_color());
}

/// A line that is seen on light and dark.
pub(super) fn line(painter: &egui::Painter, ends: [Pos2; 2], color: Color32) {
    painter.line_segment(ends, Stroke::new(4.0, Color32::from_black_alpha(140)));
    painter.line_segment(ends, Stroke::new(2.0, color));
}

#[cfg(test)]
mod tests {
    use super::round_length;

    #[test]
    fn rulers_are_round_and_not_too_long() {
        let check = |length: f64, expected: f64| {
            assert!((round_length(length) - expected).abs() < 1e-9, "{length}");
        };
        check(1.0, 1.0);
        check(1.99, 1.0);
        check(37.0, 20.0);
        check(50.1, 50.0);
        check(0.07, 0.05);
        check(980.0, 500.0);
    }
}
