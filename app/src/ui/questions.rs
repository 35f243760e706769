//! What is asked before a scan under way is ended.

use crate::texts::shell::questions as texts;
use crate::ui::{theme, widgets};
use eframe::egui;
use eframe::egui::{Id, Modal, RichText, vec2};

/// A question that waits for its answer, over everything else.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Question {
    /// Escape: stop the scan?
    StopScan,
    /// The window is to close while frames are being taken.
    QuitWhileScanning,
    /// The window closes as soon as the work has ended.
    Ending,
}

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Go on as before.
    Stay,
    /// What was asked about.
    Yes,
}

impl Question {
    /// Heading, text, the button that goes on as before, and the one that does not.
    fn words(&self) -> [&'static str; 4] {
        match self {
            Question::StopScan => texts::STOP_SCAN,
            Question::QuitWhileScanning => texts::QUIT_WHILE_SCANNING,
            Question::Ending => texts::ENDING,
        }
    }

    /// Draws it. Escape, Enter and a click beside it go on as before.
    pub fn ui(&self, ctx: &egui::Context) -> Option<Answer> {
        let [heading, text, stay, yes] = self.words();
        let shown = Modal::new(Id::unique("question")).show(ctx, |ui| {
            ui.set_width(380.0_f32.min(ui.ctx().content_rect().width() - 60.0));
            ui.label(RichText::new(heading).size(17.0).strong());
            ui.add(egui::Label::new(text).wrap());
            if stay.is_empty() {
                ui.spinner();
                return None;
            }
            ui.add_space(theme::GAP);
            ui.horizontal(|ui| {
                let stay = widgets::primary(ui, stay, vec2(150.0, 34.0), true);
                let yes = ui.add_sized(vec2(150.0, 34.0), egui::Button::new(yes));
                // Whatever has the keyboard behind it must not hear the keys.
                if !yes.has_focus() && !stay.has_focus() {
                    stay.request_focus();
                }
                let stays = stay.clicked().then_some(Answer::Stay);
                stays.or(yes.clicked().then_some(Answer::Yes))
            })
            .inner
        });
        let closes = !stay.is_empty() && shown.should_close();
        shown.inner.or(closes.then_some(Answer::Stay))
    }
}
