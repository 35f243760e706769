//! A photosite from near: its neighbours, its numbers, and the lights that it rests on.

use crate::rooms::look::Look;
use crate::texts::look as texts;
use crate::ui::theme;
use crate::ui::theme::meaning;
use crate::ui::widgets::Sign;
use crate::viewer::maps::{Maps, Sample};
use crate::viewer::shade;
use eframe::egui;
use eframe::egui::{
    Color32, Rect, RichText, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, vec2,
};
use weavelight::photometry::{Part, Photosite};

/// Photosites along the loupe's side: odd, so that one is in the middle.
const SIDE: isize = 11;
/// Side of one, points.
const CELL: f32 = 8.0;
/// Height of a line of numbers.
const LINE: f32 = 15.0;
/// Widths of the columns of a photosite's lights, points.
const COLUMNS: [f32; 3] = [44.0, 70.0, 56.0];

impl Look {
    pub(super) fn loupe(&self, ui: &mut Ui) {
        let Some(maps) = self.opened.as_ref().map(|opened| &opened.maps) else { return };
        let clicked = self.taken.as_ref().map(|taken| taken.at);
        let Some(at) = self.canvas.hovered.or(clicked) else {
            ui.label(RichText::new(texts::POINT_AT).weak());
            return;
        };
        let sample = maps.sample(at[0], at[1]);
        ui.horizontal_top(|ui| {
            magnify(ui, maps, at);
            ui.add_space(theme::GAP / 2.0);
            ui.vertical(|ui| numbers(ui, maps, at, sample.as_ref()));
        });
        match &self.taken {
            Some(taken) => {
                ui.add_space(theme::GAP);
                self.lights_of(ui, taken);
            }
            None => {
                ui.label(RichText::new(texts::CLICK_FOR_LIGHTS).weak().small());
            }
        }
    }

    /// Which lights the photosite that was clicked rests on, and why not on the others.
    fn lights_of(&self, ui: &mut Ui, taken: &crate::rooms::look::PickedPhotosite) {
        ui.label(RichText::new(texts::photosite(taken.at)).strong());
        let changed = self.opened.as_ref().and_then(|o| o.capture()).map(|c| c.changed);
        match (&taken.found, changed) {
            (None, _) => {
                ui.label(RichText::new(texts::SOLVING_AGAIN).weak());
            }
            (Some(None), None) => {
                ui.label(RichText::new(texts::NO_FRAMES).weak());
            }
            (Some(None), Some(_)) => {
                ui.label(RichText::new(texts::NOT_SOLVED_AGAIN).weak());
            }
            (Some(Some(photosite)), changed) => {
                if changed == Some(true) {
                    ui.label(RichText::new(texts::FRAMES_CHANGED).color(meaning::WARNING));
                }
                table(ui, photosite);
            }
        }
    }
}

/// The neighbourhood, coloured by albedo.
fn magnify(ui: &mut Ui, maps: &Maps, [x, y]: [usize; 2]) {
    let size = egui::Vec2::splat(SIDE as f32 * CELL);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, texts::LOUPE));
    let painter = ui.painter();
    painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
    let cell = |k: isize, l: isize| {
        let corner = rect.min + vec2(k as f32, l as f32) * CELL;
        Rect::from_min_max(corner, corner + egui::Vec2::splat(CELL))
    };
    let neighbour = |at: usize, offset: isize| at.checked_add_signed(offset - SIDE / 2);
    for l in 0..SIDE {
        for k in 0..SIDE {
            let place = neighbour(x, k).zip(neighbour(y, l));
            if let Some(sample) = place.and_then(|(x, y)| maps.sample(x, y)) {
                painter.rect_filled(cell(k, l), 0.0, shade::on_screen(sample.albedo));
            }
        }
    }
    let middle = cell(SIDE / 2, SIDE / 2);
    painter.rect_stroke(middle, 0.0, Stroke::new(3.0, Color32::BLACK), StrokeKind::Outside);
    painter.rect_stroke(middle, 0.0, Stroke::new(1.5, meaning::LIT), StrokeKind::Outside);
}

fn numbers(ui: &mut Ui, maps: &Maps, [x, y]: [usize; 2], sample: Option<&Sample>) {
    close_lines(ui);
    let row =
        |ui: &mut Ui, name: &str, value: String| cells(ui, &[(name, 52.0), (value.as_str(), 0.0)]);
    row(ui, texts::PIXEL, format!("{x}, {y}"));
    if maps.geometry.is_physical() {
        let point = maps.geometry.on_plane([x as f64, y as f64]);
        row(ui, texts::PLACE, format!("{:.2}, {:.2} mm", point.x, point.y));
    }
    let Some(sample) = sample else {
        return row(ui, texts::NORMAL, texts::UNSOLVED.to_owned());
    };
    let [nx, ny, nz] = sample.normal;
    row(ui, texts::NORMAL, format!("{nx:.3} {ny:.3} {nz:.3}"));
    row(ui, texts::SLOPE, format!("{:.1}°", sample.slope_deg()));
    let [r, g, b] = sample.albedo;
    row(ui, texts::ALBEDO, format!("{r:.3} {g:.3} {b:.3}"));
    row(ui, texts::ERROR, format!("{:.2}°", sample.error_deg));
}

/// Lines of numbers, close together.
fn close_lines(ui: &mut Ui) {
    ui.spacing_mut().interact_size.y = LINE;
    ui.spacing_mut().item_spacing.y = 0.0;
}

/// Texts on one line, each in a cell of its width (points; 0 for what is left). Their own widths never move the cells, as
/// they would in a grid.
fn cells(ui: &mut Ui, texts: &[(&str, f32)]) {
    ui.horizontal(|ui| cells_in_line(ui, texts));
}

fn cells_in_line(ui: &mut Ui, texts: &[(&str, f32)]) {
    ui.spacing_mut().item_spacing.x = 0.0;
    for (text, width) in texts {
        let label = egui::Label::new(RichText::new(*text).size(12.0)).extend();
        let start = ui.cursor().left();
        ui.add(label);
        let used = ui.cursor().left() - start;
        ui.add_space((width - used).max(0.0));
    }
}

fn table(ui: &mut Ui, photosite: &Photosite) {
    close_lines(ui);
    let [light, measured, fit, _] = texts::LIGHT_COLUMNS;
    ui.scope(|ui| {
        ui.visuals_mut().override_text_color = Some(ui.visuals().weak_text_color());
        cells(ui, &in_columns([light, measured, fit]));
    });
    for sample in &photosite.samples {
        let number = |value: Option<f32>| value.map_or("–".to_owned(), |v| format!("{v:.3}"));
        let texts = [sample.light.to_string(), number(sample.measured), number(sample.predicted)];
        let (sign, said) = verdict(sample.part);
        ui.horizontal(|ui| {
            cells_in_line(ui, &in_columns(texts.each_ref().map(String::as_str)));
            let (place, _) = ui.allocate_exact_size(vec2(16.0, LINE), Sense::hover());
            if let Some(sign) = sign {
                sign.paint(ui.painter(), place.center(), 5.0);
            }
            let said = RichText::new(said).size(12.0);
            let plays_no_part = matches!(sample.part, Part::TurnedAway | Part::Unsolved);
            ui.label(if plays_no_part { said.weak() } else { said });
        });
    }
}

fn in_columns(texts: [&str; 3]) -> [(&str, f32); 3] {
    [0, 1, 2].map(|k| (texts[k], COLUMNS[k]))
}

fn verdict(part: Part) -> (Option<Sign>, &'static str) {
    match part {
        Part::Used => (None, texts::USED),
        Part::Unusable => (Some(Sign::Bad), texts::CLIPPED),
        Part::TurnedAway => (None, texts::TURNED_AWAY),
        Part::TooDark => (Some(Sign::Warning), texts::TOO_DARK),
        Part::TooBright => (Some(Sign::Warning), texts::TOO_BRIGHT),
        Part::Unsolved => (None, texts::UNSOLVED),
    }
}
