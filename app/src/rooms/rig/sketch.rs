//! The rig drawn to scale, from the front or from above: table, camera, lights; the lit one glows.

use crate::texts::rig as texts;
use crate::ui::theme::meaning;
use eframe::egui;
use eframe::egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, Vec2, pos2, vec2};

/// From where it is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// x to the right, z up.
    Front,
    /// x to the right, y up.
    Above,
}

/// A light of the sketch; places in the rig frame.
#[derive(Clone, Debug)]
pub(super) struct Lamp {
    pub(super) channel: u32,
    /// As the rig's file says; `None`: far away.
    pub(super) place_mm: Option<[f64; 3]>,
    /// As the calibration says.
    pub(super) calibrated_mm: Option<[f64; 3]>,
    pub(super) sigma_mm: Option<f64>,
}

impl Lamp {
    fn at(&self) -> Option<[f64; 3]> {
        self.calibrated_mm.or(self.place_mm)
    }
}

/// Radius of a light on the screen, points.
const LAMP: f32 = 11.0;
/// Half the side of the scan area that is drawn, millimetres.
const TABLE_MM: f64 = 210.0;

/// Draws it. The light that was clicked.
pub(super) fn ui(
    ui: &mut egui::Ui,
    size: Vec2,
    side: Side,
    lamps: &[Lamp],
    camera_mm: f64,
    lit: Option<usize>,
) -> Option<usize> {
    // No stop for the keyboard: it has the table below.
    let (rect, response) = ui.allocate_exact_size(size, Sense::CLICK);
    let name = texts::side(side == Side::Front);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
    let map = Map::new(rect, side, lamps, camera_mm);
    let painter = ui.painter_at(rect);
    let visuals = ui.visuals();
    painter.rect_filled(rect, 6.0, visuals.extreme_bg_color);
    let line = Stroke::new(1.5, visuals.weak_text_color());
    painter.text(
        rect.min + vec2(10.0, 8.0),
        Align2::LEFT_TOP,
        name,
        FontId::proportional(12.0),
        visuals.weak_text_color(),
    );
    furniture(&painter, &map, camera_mm, line);
    for (k, lamp) in lamps.iter().enumerate() {
        if let Some(at) = lamp.at() {
            draw_lamp(&painter, &map, at, (k, lit == Some(k)), visuals);
        }
    }
    let pointer = response.interact_pointer_pos().filter(|_| response.clicked())?;
    let near =
        |lamp: &Lamp| lamp.at().is_some_and(|at| map.place(at).distance(pointer) < 1.5 * LAMP);
    lamps.iter().position(near)
}

fn draw_lamp(
    painter: &egui::Painter,
    map: &Map,
    at: [f64; 3],
    (number, lit): (usize, bool),
    visuals: &egui::Visuals,
) {
    let centre = map.place(at);
    if lit {
        let target = map.place([0.0; 3]);
        let beam = Color32::from_rgba_unmultiplied(0xF0, 0xE4, 0x42, 70);
        painter.line_segment([centre, target], Stroke::new(10.0, beam));
        for (radius, alpha) in [(26.0, 40), (19.0, 80)] {
            painter.circle_filled(
                centre,
                radius,
                Color32::from_rgba_unmultiplied(0xF0, 0xE4, 0x42, alpha),
            );
        }
    }
    let fill = if lit { meaning::LIT } else { visuals.faint_bg_color };
    let text = if lit { Color32::BLACK } else { visuals.text_color() };
    painter.circle(centre, LAMP, fill, Stroke::new(1.5, visuals.text_color()));
    painter.text(centre, Align2::CENTER_CENTER, number, FontId::proportional(12.0), text);
}

/// Table, swatch and camera.
fn furniture(painter: &egui::Painter, map: &Map, camera_mm: f64, line: Stroke) {
    let corner = [-TABLE_MM, -0.67 * TABLE_MM, 0.0];
    let other = [TABLE_MM, 0.67 * TABLE_MM, 0.0];
    let table = Rect::from_two_pos(map.place(corner), map.place(other));
    let camera = map.place([0.0, 0.0, camera_mm]);
    match map.side {
        Side::Front => {
            let y = map.place([0.0; 3]).y;
            painter.hline(map.rect.shrink(14.0).x_range(), y, line);
            painter.line_segment(
                [table.left_top(), table.right_top()],
                Stroke::new(4.0, meaning::ACTIVE),
            );
            let faint = Stroke::new(1.0, line.color.gamma_multiply(0.6));
            painter.line_segment([camera, table.left_top()], faint);
            painter.line_segment([camera, table.right_top()], faint);
        }
        Side::Above => {
            painter.rect_stroke(
                table,
                2.0,
                Stroke::new(2.0, meaning::ACTIVE),
                egui::StrokeKind::Middle,
            );
        }
    }
    let body = Rect::from_center_size(camera, vec2(30.0, 20.0));
    painter.rect(body, 3.0, line.color, Stroke::NONE, egui::StrokeKind::Middle);
    painter.circle_filled(camera, 6.0, Color32::from_gray(20));
}

/// Millimetres to points, everything in sight.
struct Map {
    rect: Rect,
    side: Side,
    scale: f32,
    centre_mm: [f64; 2],
}

impl Map {
    fn new(rect: Rect, side: Side, lamps: &[Lamp], camera_mm: f64) -> Self {
        let places = lamps.iter().filter_map(Lamp::at);
        let all = places.chain([
            [-TABLE_MM, -TABLE_MM, 0.0],
            [TABLE_MM, TABLE_MM, 0.0],
            [0.0, 0.0, camera_mm],
        ]);
        let seen: Vec<[f64; 2]> = all.map(|place| project(side, place)).collect();
        let range = |axis: usize| {
            let values = seen.iter().map(|place| place[axis]);
            let (least, most) =
                (values.clone().fold(f64::MAX, f64::min), values.fold(f64::MIN, f64::max));
            ((least + most) / 2.0, (most - least).max(1.0))
        };
        let ((cx, width), (cy, height)) = (range(0), range(1));
        let room = rect.shrink(38.0).size();
        let scale = (room.x / width as f32).min(room.y / height as f32);
        Self { rect, side, scale, centre_mm: [cx, cy] }
    }

    fn place(&self, place_mm: [f64; 3]) -> Pos2 {
        let [x, y] = project(self.side, place_mm);
        let middle = self.rect.center();
        let offset =
            [x - self.centre_mm[0], y - self.centre_mm[1]].map(|mm| mm as f32 * self.scale);
        pos2(middle.x + offset[0], middle.y - offset[1])
    }
}

fn project(side: Side, [x, y, z]: [f64; 3]) -> [f64; 2] {
    match side {
        Side::Front => [x, z],
        Side::Above => [x, y],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_in_sight_and_the_right_way_up() {
        let lamp = |place_mm| Lamp { channel: 0, place_mm, calibrated_mm: None, sigma_mm: None };
        let lamps = [lamp(Some([900.0, 0.0, 700.0])), lamp(None)];
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(300.0, 200.0));
        for side in [Side::Front, Side::Above] {
            let map = Map::new(rect, side, &lamps, 610.0);
            assert!(rect.contains(map.place([900.0, 0.0, 700.0])), "{side:?}");
            assert!(rect.contains(map.place([-TABLE_MM, 0.0, 0.0])), "{side:?}");
            let up = if side == Side::Front { [0.0, 0.0, 100.0] } else { [0.0, 100.0, 0.0] };
            assert!(map.place(up).y < map.place([0.0; 3]).y);
            assert!(map.place([100.0, 0.0, 0.0]).x > map.place([0.0; 3]).x);
        }
    }
}
