//! What went wrong and what ought to be known, over the lower right corner: nothing that is drawn moves for it. Hidden, it is a
//! button in the status bar.

use crate::model::problem::{Problem, Severity};
use crate::texts;
use crate::texts::shell;
use crate::ui::theme;
use crate::ui::widgets::Sign;
use eframe::egui;
use eframe::egui::{Align, Align2, Area, Frame, Id, Layout, Order, RichText, ScrollArea, vec2};

/// Widest, points.
const WIDTH: f32 = 440.0;
/// Share of the window's height that it takes at most.
const SHARE: f32 = 0.5;
/// Of the status bar below it, points.
const BELOW: f32 = 48.0;

/// Whether they are seen.
#[derive(Debug, Default)]
pub struct Problems {
    hidden: bool,
    /// The newest one that was drawn: another one is shown even where the earlier ones are hidden.
    newest: Option<Problem>,
}

impl Problems {
    /// Draws them, the newest first.
    pub fn ui(&mut self, ctx: &egui::Context, problems: &mut Vec<Problem>) {
        if problems.last() != self.newest.as_ref() {
            self.hidden &= problems.is_empty() || !is_new(self.newest.as_ref(), problems);
            self.newest = problems.last().cloned();
        }
        if problems.is_empty() || self.hidden {
            return;
        }
        let window = ctx.content_rect().size();
        let area = Area::new(Id::unique("problems")).order(Order::Middle);
        let area = area.anchor(Align2::RIGHT_BOTTOM, vec2(-theme::GAP, -BELOW));
        area.show(ctx, |ui| {
            let frame = Frame::popup(ui.style()).inner_margin(theme::GAP);
            frame.show(ui, |ui| {
                ui.set_width(WIDTH.min(window.x - 3.0 * theme::WIDE_GAP));
                self.head(ui, problems);
                let height = SHARE * window.y;
                // The corner grows upwards: what is below it now says nothing of the room that there is.
                let list = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
                list.show(ui, |ui| {
                    ui.set_width(ui.available_width());
                    let mut at = problems.len();
                    while at > 0 {
                        at -= 1;
                        if problem(ui, &problems[at]) {
                            problems.remove(at);
                        }
                    }
                });
            });
        });
    }

    fn head(&mut self, ui: &mut egui::Ui, problems: &mut Vec<Problem>) {
        ui.horizontal(|ui| {
            ui.label(RichText::new(texts::PROBLEMS).strong());
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.small_button(texts::DISMISS_ALL).clicked() {
                    problems.clear();
                }
                self.hidden |= ui.small_button(shell::HIDE).clicked();
            });
        });
    }

    /// In the status bar: how many there are. A click shows or hides them.
    pub fn button(&mut self, ui: &mut egui::Ui, problems: &[Problem]) {
        if problems.is_empty() {
            return;
        }
        let failed = problems.iter().any(|problem| problem.severity == Severity::Error);
        if failed { Sign::Bad } else { Sign::Warning }.ui(ui);
        let text = shell::problems(problems.len());
        if ui.selectable_label(!self.hidden, text).clicked() {
            self.hidden = !self.hidden;
        }
    }
}

/// Whether the last problem has come since `newest` was the last one; where it was put away, the one before it is last.
fn is_new(newest: Option<&Problem>, problems: &[Problem]) -> bool {
    newest.is_none_or(|newest| problems.contains(newest))
}

/// A problem with its remedy. True when it is put away.
fn problem(ui: &mut egui::Ui, problem: &Problem) -> bool {
    let (sign, title) = match problem.severity {
        Severity::Error => (Sign::Bad, format!("{} {}", problem.title, texts::FAILED)),
        Severity::Warning => (Sign::Warning, problem.title.clone()),
    };
    ui.horizontal_top(|ui| {
        sign.ui(ui);
        ui.vertical(|ui| {
            ui.add(egui::Label::new(RichText::new(&title).strong()).wrap());
            ui.add(egui::Label::new(&problem.text).wrap().selectable(true));
            ui.horizontal(|ui| {
                let dismissed = ui.small_button(texts::DISMISS).clicked();
                if ui.small_button(shell::COPY).clicked() {
                    ui.ctx().copy_text(format!("{title}: {}", problem.text));
                }
                dismissed
            })
            .inner
        })
        .inner
    })
    .inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_has_come_since_is_new() {
        let [a, b] = ["a", "b"].map(|text| Problem::error("Scan", text));
        let check = |newest: Option<&Problem>, problems: &[Problem], new: bool| {
            assert_eq!(is_new(newest, problems), new, "{newest:?} {problems:?}");
        };
        check(None, std::slice::from_ref(&a), true);
        check(Some(&a), &[a.clone(), b.clone()], true);
        check(Some(&b), std::slice::from_ref(&a), false);
    }
}
