//! How the wizard looks.

use crate::model::number::Unit;
use crate::model::project::Project;
use crate::model::targets::TargetSettings;
use crate::texts::calibrate as texts;
use crate::ui::browse::Browse;
use crate::ui::number::Number;
use crate::ui::theme::meaning;
use crate::ui::widgets::Sign;
use crate::ui::{theme, widgets};
use crate::viewer::target_picture::{Picture, paint_earlier};
use eframe::egui;
use eframe::egui::emath::Numeric;
use eframe::egui::{RichText, TextureHandle, TextureOptions, vec2};
use std::path::Path;
use weavelight::calibrate::wizard::{Entry, State, Step, Task};
use weavelight::calibrate::{Action, StepState};
use weavelight::instrument::CameraKind;

/// The picture that was taken last.
#[derive(Default)]
pub(super) struct View {
    picture: Option<(Picture, Option<TextureHandle>)>,
    /// What it was taken for.
    of: Option<Task>,
}

impl std::fmt::Debug for View {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("View").finish_non_exhaustive()
    }
}

impl View {
    pub(super) fn show(&mut self, picture: Picture, of: Option<Task>) {
        self.picture = Some((picture, None));
        self.of = of;
    }

    /// Whether one was taken since the rig was opened.
    pub(super) fn has_picture(&self) -> bool {
        self.picture.is_some()
    }

    /// The picture as large as there is room, with what was found; `earlier`: corners of the pictures before it.
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, task: Task, earlier: &[[f64; 2]]) {
        let Some((picture, texture)) = &mut self.picture else { return nothing_yet(ui) };
        ui.horizontal_wrapped(|ui| {
            let sign = if picture.good { Sign::Good } else { Sign::Warning };
            sign.ui(ui);
            if self.of.is_some_and(|of| of != task) {
                ui.label(RichText::new(texts::LAST).weak());
            }
            ui.label(&picture.note);
        });
        let texture = texture.get_or_insert_with(|| {
            let image = picture.image.clone();
            ui.ctx().load_texture("calibration picture", image, TextureOptions::LINEAR)
        });
        let room = ui.available_size();
        let size = vec2(picture.size_px[0] as f32, picture.size_px[1] as f32);
        let scale = (room.x / size.x).min(room.y / size.y).max(0.01);
        ui.vertical_centered(|ui| {
            let image = egui::Image::new(&*texture)
                .fit_to_exact_size(size * scale)
                .alt_text(texts::LAST_PICTURE);
            let rect = ui.add(image).rect;
            let painter = ui.painter_at(rect);
            paint_earlier(&painter, rect, picture.size_px, earlier);
            picture.marks.paint(&painter, rect, picture.size_px);
        });
    }
}

fn nothing_yet(ui: &mut egui::Ui) {
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.35);
        ui.label(RichText::new(texts::NOTHING_YET).size(16.0).weak());
    });
}

/// Whether the program places the targets: on a simulated rig.
pub(super) fn places_targets(place: &Project) -> bool {
    place.rig.camera.kind == CameraKind::Simulated
}

/// One step of the four: how far it is and how good. True where its pictures are to be taken again.
pub(super) fn step(
    ui: &mut egui::Ui,
    state: &State,
    step: Step,
    now: Option<Step>,
    figures: Option<&str>,
) -> bool {
    let is_now = now == Some(step);
    let fill = if is_now { ui.visuals().faint_bg_color } else { egui::Color32::TRANSPARENT };
    let frame = egui::Frame::new().fill(fill).inner_margin(8.0).corner_radius(6.0);
    let color = if is_now { meaning::ACTIVE } else { egui::Color32::TRANSPARENT };
    let stroke = egui::Stroke::new(1.0, color);
    frame
        .stroke(stroke)
        .show(ui, |ui| {
            ui.set_width(ui.available_width());
            let mut again = false;
            ui.horizontal(|ui| {
                mark(ui, state, step);
                ui.label(RichText::new(texts::step(step)).strong());
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if state.share(step) > 0.0 {
                        let button = ui.small_button(texts::AGAIN).on_hover_text(texts::AGAIN_HINT);
                        name(ui, &button, &texts::again(step));
                        again = button.clicked();
                    } else if step == Step::Check && state.next() == Task::Done {
                        let button = ui.small_button(texts::CHECK);
                        again = button.on_hover_text(texts::CHECK_HINT).clicked();
                    }
                });
            });
            let quality = state
                .status
                .steps
                .get(step as usize)
                .filter(|step| step.state != StepState::Missing);
            let check = state.verdict.as_ref().filter(|_| step == Step::Check);
            let text =
                figures
                    .map(str::to_owned)
                    .or(quality.map(|step| step.quality.clone()))
                    .or(check
                        .map(|it| texts::check_figures(it.passed, it.slope_rms_deg, it.limit_deg)));
            let text = text.unwrap_or_else(|| texts::what(step).to_owned());
            ui.add(egui::Label::new(RichText::new(text).weak()).wrap());
            if is_now && state.share(step) > 0.0 && state.share(step) < 1.0 {
                let text = texts::so_many(step, state);
                ui.add(egui::ProgressBar::new(state.share(step)).text(text));
            }
            again
        })
        .inner
}

fn mark(ui: &mut egui::Ui, state: &State, step: Step) {
    let of_status = state.status.steps.get(step as usize).map(|step| step.state);
    let sign = match (step, of_status) {
        (Step::Check, _) => state.verdict.as_ref().map(|verdict| sign(verdict.passed)),
        (_, Some(StepState::Good)) => Some(Sign::Good),
        (_, Some(StepState::Improvable)) => Some(Sign::Warning),
        _ => None,
    };
    match sign {
        Some(sign) => sign.ui(ui),
        None => {
            let (rect, _) = ui.allocate_exact_size(vec2(18.0, 18.0), egui::Sense::hover());
            let stroke = egui::Stroke::new(1.5, ui.visuals().weak_text_color());
            ui.painter().circle_stroke(rect.center(), 6.0, stroke);
        }
    }
}

fn sign(passed: bool) -> Sign {
    if passed { Sign::Good } else { Sign::Bad }
}

/// A button among others of the same text has a name of its own.
pub(super) fn name(ui: &egui::Ui, response: &egui::Response, name: &str) {
    let (enabled, name) = (ui.is_enabled(), name.to_owned());
    response
        .widget_info(move || egui::WidgetInfo::labeled(egui::Role::Button, enabled, name.clone()));
}

/// What to do, in large letters, and how.
pub(super) fn instructions(ui: &mut egui::Ui, task: Task, state: &State, simulated: bool) {
    ui.label(RichText::new(texts::title(task)).size(22.0).strong());
    let how = texts::how(task, state, simulated);
    ui.add(egui::Label::new(RichText::new(how).size(15.0)).wrap());
    if simulated && !matches!(task, Task::Done | Task::Fit(_)) {
        ui.add(egui::Label::new(RichText::new(texts::SIMULATED).weak()).wrap());
    }
    ui.add_space(theme::GAP);
}

/// When all is done: how good it is, and what would make it better; `is_old`: whether that is what is to be done about it. True
/// when scanning is to begin.
pub(super) fn verdict(ui: &mut egui::Ui, state: &State, is_old: bool) -> bool {
    let mut line = |sign: Sign, text: &str| {
        ui.horizontal_top(|ui| {
            sign.ui(ui);
            ui.add(egui::Label::new(text).wrap());
        });
    };
    if let Some(passed) = state.verdict.as_ref().map(|verdict| verdict.passed) {
        line(sign(passed), texts::verdict(passed));
    }
    if let Some(sigma) = state.status.position_sigma_mm {
        line(Sign::Good, &texts::sigma(sigma, state.status.next_sigma_mm));
    }
    for advice in &state.status.exposure {
        line(Sign::Warning, advice);
    }
    if !is_old || state.status.action != Action::Check {
        let text = texts::better(&state.status.action, state.begun, state.verdict.is_some());
        ui.add(egui::Label::new(RichText::new(text).weak()).wrap());
    }
    ui.add_space(theme::GAP);
    let size = vec2(220.0, theme::BIG);
    let scan = crate::ui::widgets::primary(ui, texts::SCAN, size, true).clicked();
    ui.add_space(theme::GAP);
    scan
}

/// What went wrong last and what to do, and where something went that was put away.
pub(super) fn outcome(ui: &mut egui::Ui, trouble: Option<&str>, kept: Option<&Path>) {
    if let Some(trouble) = trouble {
        ui.horizontal_top(|ui| {
            Sign::Bad.ui(ui);
            ui.add(egui::Label::new(trouble).wrap().selectable(true));
        });
    }
    if let Some(folder) = kept {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        ui.horizontal_top(|ui| {
            Sign::Good.ui(ui);
            ui.add(egui::Label::new(texts::kept(&name)).wrap())
                .on_hover_text(folder.display().to_string());
        });
    }
}

/// A build without OpenCV.
pub(super) fn no_chessboards(ui: &mut egui::Ui) {
    ui.horizontal_top(|ui| {
        Sign::Warning.ui(ui);
        ui.add(egui::Label::new(texts::NO_CHESSBOARDS).wrap().selectable(true));
    });
}

/// What the technician says of the target in hand. Whether every number can be read.
pub(super) fn targets(
    ui: &mut egui::Ui,
    task: Task,
    targets: &mut TargetSettings,
    browse: &mut Browse,
    place: Option<&Project>,
) -> bool {
    let last_light = place.map_or(0, |place| place.rig.lights.len().saturating_sub(1));
    let row = ui.horizontal_wrapped(|ui| match task {
        Task::Table | Task::Board => {
            let light = Number::of(Unit::Count, 0.0..=last_light as f64);
            let board = shape(ui, texts::BOARD, &mut targets.board, &mut targets.board_square_mm);
            field(ui, texts::LIGHT, &light, &mut targets.board_light) && board
        }
        Task::Chart => {
            let label = ui.label(texts::CHART);
            let field = widgets::path_field(ui, label.id, &mut targets.chart, 280.0);
            // The keyboard is given back, so that Space takes the picture.
            widgets::entered(ui, &field.on_hover_text(texts::CHART_HINT));
            if let Some(file) = browse.file(ui) {
                targets.chart = file.display().to_string();
            }
            true
        }
        Task::Sheet(pose) => {
            let share = Number::of(Unit::Share, 0.1..=1.0).speed(0.005);
            let reflectance = field(ui, texts::REFLECTANCE, &share, &mut targets.reflectance);
            let height = Number::of(Unit::Millimetres, 1.0..=300.0);
            reflectance
                && match pose {
                    weavelight::calibrate::wizard::Pose::Flat => true,
                    weavelight::calibrate::wizard::Pose::Raised => {
                        field(ui, texts::RAISED, &height, &mut targets.raised_mm)
                    }
                    _ => shape(ui, texts::STRIP, &mut targets.strip, &mut targets.strip_square_mm),
                }
        }
        Task::Fit(_) | Task::Done => true,
    });
    row.inner
}

fn shape(
    ui: &mut egui::Ui,
    text: &str,
    [columns, rows]: &mut [usize; 2],
    square_mm: &mut f64,
) -> bool {
    let count = Number::of(Unit::Count, 2.0..=99.0);
    let columns = field(ui, text, &count, columns);
    let rows = field(ui, "×", &count, rows);
    let side = Number::of(Unit::Millimetres, 0.5..=200.0);
    field(ui, texts::SQUARES, &side, square_mm) && columns && rows
}

/// A number with its name. Whether it can be read.
fn field<N: Numeric>(ui: &mut egui::Ui, text: &str, number: &Number, value: &mut N) -> bool {
    let label = ui.label(text);
    let field = number.show(ui, text, value);
    field.response.labelled_by(label.id);
    field.is_read
}

/// How old it is, and from when on that counts.
pub(super) fn age(ui: &mut egui::Ui, state: &State, targets: &mut TargetSettings) {
    let limit = targets.expires_after_days;
    let unfinished = state.status.steps.iter().any(|step| step.state == StepState::Missing);
    match state.age_days.filter(|_| !unfinished) {
        None => {
            ui.label(RichText::new(texts::NEVER).weak());
        }
        Some(days) if days > limit => {
            ui.horizontal_top(|ui| {
                Sign::Warning.ui(ui);
                ui.add(egui::Label::new(texts::expired(days)).wrap());
            });
        }
        Some(days) => {
            ui.add(egui::Label::new(texts::age(days)).wrap());
        }
    }
    ui.horizontal(|ui| {
        let days = Number::of(Unit::Days, 1.0..=3650.0).speed(1.0);
        field(ui, texts::EXPIRES, &days, &mut targets.expires_after_days);
    });
}

/// Earlier calibrations and pictures; the one that is to be restored.
pub(super) fn history(ui: &mut egui::Ui, state: &State, free: bool) -> Option<Entry> {
    ui.label(RichText::new(texts::HISTORY).strong());
    if state.history.is_empty() {
        ui.add(egui::Label::new(RichText::new(texts::NO_HISTORY).weak()).wrap());
    }
    let mut restore = None;
    for entry in &state.history {
        ui.horizontal(|ui| {
            ui.label(texts::entry(entry)).on_hover_text(texts::where_kept(&entry.name));
            let text = texts::restore(entry.kept);
            let button = ui.add_enabled(free, egui::Button::new(text).small());
            name(ui, &button, &texts::restore_name(entry));
            if button.clicked() {
                restore = Some(entry.clone());
            }
        });
    }
    restore
}
