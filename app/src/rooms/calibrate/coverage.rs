//! What the pictures of a step cover so far, how good they are, and what the next one brings.

use crate::rooms::calibrate::view::name;
use crate::texts::calibrate as texts;
use crate::ui::theme;
use crate::ui::theme::meaning;
use eframe::egui;
use eframe::egui::{Color32, Painter, Pos2, Rect, RichText, Stroke, StrokeKind, vec2};
use weavelight::calibrate::wizard::{BOARDS, Placement, Pose, State, Step, Task};

/// Height of the panel.
pub(super) const HEIGHT: f32 = 108.0;
/// The sketch in it.
const SKETCH: egui::Vec2 = vec2(120.0, 80.0);

/// What draws the panel of a task, if it has one.
pub(super) fn of(task: Task) -> Option<fn(&mut egui::Ui, &State)> {
    match (task.step(), task) {
        (Some(Step::Camera), _) => Some(boards),
        (Some(Step::Lights), Task::Sheet(_)) => Some(sheets),
        _ => None,
    }
}

/// What the corners so far cover, and how well they fit.
fn boards(ui: &mut egui::Ui, state: &State) {
    let [columns, rows] = state.so_far.coverage_grid;
    let [taken, found] = state.boards;
    ui.horizontal_centered(|ui| {
        let (rect, response) = ui.allocate_exact_size(SKETCH, egui::Sense::hover());
        let covered = state.so_far.coverage.iter().filter(|count| **count > 0).count();
        let text = texts::covered(covered, columns * rows);
        name(ui, &response, &text);
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        for (k, count) in state.so_far.coverage.iter().enumerate() {
            let cell = vec2(rect.width() / columns as f32, rect.height() / rows as f32);
            let corner = rect.min + vec2((k % columns) as f32, (k / columns) as f32) * cell;
            let strength = (*count as f32 / 12.0).min(1.0);
            let color = meaning::ACTIVE.gamma_multiply(0.15 + 0.85 * strength);
            if *count > 0 {
                let field = egui::Rect::from_min_size(corner, cell).shrink(0.75);
                painter.rect_filled(field, 1.0, color);
            }
        }
        ui.vertical(|ui| {
            ui.add_space(theme::GAP);
            ui.label(RichText::new(texts::boards(found, BOARDS, taken - found)).strong());
            ui.label(text);
            ui.label(RichText::new(texts::reprojection(state.so_far.rms_px)).weak());
        });
    });
}

/// Which sheets are there, how well they locate the lights, and what the next one improves.
fn sheets(ui: &mut egui::Ui, state: &State) {
    let taken = Pose::FIT.iter().filter(|pose| state.sheets.contains(pose)).count();
    let text = texts::sheets(taken, Pose::FIT.len());
    ui.horizontal_centered(|ui| {
        let (rect, response) = ui.allocate_exact_size(SKETCH, egui::Sense::hover());
        name(ui, &response, &texts::sheets_there(&state.sheets));
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        let next = state.next();
        for (k, pose) in Pose::FIT.into_iter().enumerate() {
            let cell = rect.size() / vec2(3.0, 2.0);
            let at = rect.min + cell * vec2((k % 3) as f32 + 0.5, (k / 3) as f32 + 0.5);
            let color = match (state.sheets.contains(&pose), next == Task::Sheet(pose)) {
                (true, _) => meaning::ACTIVE,
                (false, true) => ui.visuals().strong_text_color(),
                (false, false) => ui.visuals().weak_text_color(),
            };
            sheet(&painter, at, pose, (color, state.sheets.contains(&pose)));
        }
        ui.vertical(|ui| {
            ui.add_space(theme::GAP);
            ui.label(RichText::new(text).strong());
            let Some(foreseen) = state.foreseen else { return };
            if let Some(now_mm) = foreseen.now_mm {
                ui.label(texts::foreseen_now(taken, now_mm));
            }
            if let Some(then_mm) = foreseen.then_mm {
                ui.label(RichText::new(texts::foreseen_then(then_mm)).weak());
            }
        });
    });
}

/// A sheet from above: raised, it stands off its own outline on the table; tilted, an arrow says where it faces. Filled:
/// photographed.
fn sheet(painter: &Painter, at: Pos2, pose: Pose, (color, is_taken): (Color32, bool)) {
    let Placement { height_mm, tilt_deg, faces_deg } = pose.placement();
    let stroke = Stroke::new(1.5, color);
    let side = vec2(24.0, 18.0);
    let rect = Rect::from_center_size(at, side);
    if height_mm > 0.0 && tilt_deg == 0.0 {
        let below = rect.translate(vec2(4.0, 4.0));
        painter.rect_stroke(
            below,
            1.0,
            Stroke::new(1.0, color.gamma_multiply(0.6)),
            StrokeKind::Middle,
        );
    }
    let fill = if is_taken { color.gamma_multiply(0.35) } else { Color32::TRANSPARENT };
    painter.rect(rect, 1.0, fill, stroke, StrokeKind::Middle);
    if tilt_deg > 0.0 {
        let (sin, cos) = faces_deg.to_radians().sin_cos();
        // The picture's top is up, the screen's down.
        let along = vec2(cos as f32, -sin as f32);
        painter.arrow(at - 5.0 * along, 12.0 * along, stroke);
    }
}
