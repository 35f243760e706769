//! What came of a scan, and what can be done with it: all of it about the scan that is shown, not about what the form says.

use crate::jobs::messages::Request;
use crate::jobs::scan::{Command, Order, RestoredScan, What};
use crate::jobs::state::AppState;
use crate::model::project::Project;
use crate::rooms::scan::form::order;
use crate::rooms::scan::{About, Scan, Stage};
use crate::texts::scan as texts;
use crate::ui::{theme, widgets};
use eframe::egui;
use eframe::egui::RichText;
use std::path::PathBuf;
use weavelight::solution::Report;

impl Scan {
    /// What came of the scan, and what to do with it.
    pub(super) fn result(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let name = self.about.as_ref().map_or("", |about| about.name.as_str());
        let (good, text) = match &self.stage {
            Stage::Scanned(Some(summary)) => (true, texts::scanned(summary)),
            Stage::Scanned(None) => (true, texts::brought_back(name)),
            Stage::Solved { report, expected_deg, .. } => {
                (is_good(report), texts::solved(report, *expected_deg))
            }
            _ => return,
        };
        let warnings = self.warnings();
        let sign =
            if good && warnings.is_empty() { widgets::Sign::Good } else { widgets::Sign::Warning };
        ui.horizontal_wrapped(|ui| {
            sign.ui(ui);
            ui.label(RichText::new(text).strong());
            self.next_steps(ui, app);
        });
        show_warnings(ui, &warnings);
    }

    /// Warnings of the scan that is shown: from taking its frames, and from its solution.
    fn warnings(&self) -> Vec<String> {
        let of_solution = match &self.stage {
            Stage::Solved { report, .. } => &report.warnings[..],
            _ => &[],
        };
        [&self.scan_warnings[..], of_solution].concat()
    }

    fn next_steps(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        if let Stage::Solved { solution, .. } = &self.stage
            && ui.button(texts::LOOK_CLOSER).on_hover_text(texts::ENTER).clicked()
        {
            app.look_at(solution.clone());
        }
        if !app.can_change() {
            return;
        }
        let folder = self.about.as_ref().and_then(|about| about.folder.clone());
        let calibrated = app.is_calibrated;
        if let (Stage::Scanned(_), Some(scan), true) = (&self.stage, folder, calibrated)
            && ui.button(texts::SOLVE).clicked()
        {
            let settings = app.settings.solve;
            app.request(Request::Scan(Command::Solve { scan, settings }));
        }
        if let Some(order) = self.again(app)
            && ui.button(texts::REPEAT).on_hover_text(texts::REPEAT_HINT).clicked()
        {
            self.begin(order, app);
        }
    }

    /// The order that takes the scan that is shown once more: as the form says, as long as that is still about this scan, else
    /// as it was taken. `None` where it is no scan of this rig.
    fn again(&self, app: &AppState) -> Option<Order> {
        let About { name, folder, order: taken } = self.about.as_ref()?;
        let scan: PathBuf = folder.clone()?;
        let ours = |place: &Project| scan.parent() == Some(&place.scans());
        if !app.project.as_ref().is_some_and(ours) {
            return None;
        }
        let form = order(app);
        let how = if form.name == *name { form } else { taken.clone()? };
        Some(Order { name: name.clone(), what: What::Again(scan), ..how })
    }

    /// What was scanned again can be had back, as long as this room is about it.
    pub(super) fn offer_undo(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        let Some(replaced) = self.replaced.clone().filter(|_| app.can_change()) else { return };
        let frame = egui::Frame::group(ui.style()).fill(ui.visuals().faint_bg_color);
        frame.show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.label(texts::replaced(&replaced.name));
            if ui.button(texts::UNDO).clicked() {
                app.request(Request::Scan(Command::Undo(replaced)));
            }
        });
        ui.add_space(theme::GAP);
    }

    /// The scan of that name that was in the bin is the one that is shown.
    pub(super) fn show_restored(
        &mut self,
        RestoredScan { folder, solution, replaced }: RestoredScan,
    ) {
        self.clear();
        let of = |about: &About| about.folder.as_ref() == Some(&folder);
        if !self.about.as_ref().is_some_and(of) {
            let name = replaced.as_ref().or(self.replaced.as_ref());
            let name = name.map(|deleted| deleted.name.clone()).unwrap_or_default();
            self.about = Some(About { name, folder: Some(folder), order: None });
        }
        self.stage = match solution {
            Some((solution, report)) => Stage::Solved { solution, report, expected_deg: None },
            None => Stage::Scanned(None),
        };
        self.replaced = replaced;
    }
}

/// They belong to the result, and stay with it as long as it is shown.
fn show_warnings(ui: &mut egui::Ui, warnings: &[String]) {
    if warnings.is_empty() {
        return;
    }
    let title = texts::warnings(warnings.len());
    egui::CollapsingHeader::new(title).id_salt("scan warnings").show(ui, |ui| {
        for warning in warnings {
            ui.add(egui::Label::new(warning).wrap().selectable(true));
        }
    });
}

/// Whether a solution can be kept without looking twice: nothing was warned of, and hardly anything clips.
fn is_good(report: &Report) -> bool {
    const CLIPPED: f64 = 0.01;
    let clipped = report.saturated_pixels as f64;
    report.warnings.is_empty() && clipped <= CLIPPED * report.pixels as f64
}
