//! Small things that several rooms draw.

use crate::desk::{Activity, Problem, Severity};
use crate::texts;
use crate::theme::meaning;
use eframe::egui::{self, RichText};

/// A room's heading with a sentence below.
pub fn heading(ui: &mut egui::Ui, title: &str, what: &str) {
    ui.heading(title);
    if !what.is_empty() {
        ui.label(RichText::new(what).weak());
    }
}

/// What there is to see where there is nothing yet: what is missing, and one button that does something about it. True when
/// it is clicked.
pub fn empty(ui: &mut egui::Ui, what: &str, remedy: &str) -> bool {
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.3);
        ui.label(RichText::new(what).size(16.0).weak());
        ui.button(remedy).clicked()
    })
    .inner
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

/// A problem with its remedy. True when it is put away.
pub fn problem(ui: &mut egui::Ui, problem: &Problem) -> bool {
    let (sign, color) = match problem.severity {
        Severity::Error => ("✖", meaning::BAD),
        Severity::Warning => ("⚠", meaning::WARNING),
    };
    ui.horizontal_top(|ui| {
        ui.label(RichText::new(sign).color(color).size(16.0));
        ui.vertical(|ui| {
            let title = match problem.severity {
                Severity::Error => format!("{} {}", problem.title, texts::FAILED),
                Severity::Warning => problem.title.clone(),
            };
            ui.label(RichText::new(title).strong());
            ui.add(egui::Label::new(&problem.text).wrap().selectable(true));
            ui.small_button(texts::DISMISS).clicked()
        })
        .inner
    })
    .inner
}
