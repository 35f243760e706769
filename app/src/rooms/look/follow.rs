//! Which solution is looked at: the last scan's, unless another one is asked for or this one is to stay; and what is offered
//! where a folder is no solution.

use crate::jobs::look::Command;
use crate::jobs::look::drafts::Drafts;
use crate::jobs::look::opened::Opened;
use crate::jobs::messages::Request;
use crate::jobs::state::AppState;
use crate::model::problem::Problem;
use crate::rooms::look::edits::Edits;
use crate::rooms::look::{Look, Tool};
use crate::texts::look as texts;
use crate::viewer::mask::Painting;
use eframe::egui;
use eframe::egui::RichText;
use std::path::PathBuf;

/// What else there is to look at.
#[derive(Debug, Default)]
pub(super) struct Follow {
    /// The last scan's solution, until it is looked at.
    newest: Option<PathBuf>,
    /// What is looked at stays when another scan is solved.
    pub(super) pinned: bool,
    /// A capture session that was opened and has no solution.
    unsolved: Option<PathBuf>,
}

impl Look {
    /// A scan was solved.
    pub(super) fn newest(&mut self, solution: PathBuf) {
        self.follow.newest = Some(solution);
    }

    /// A capture session was opened that has no solution: it is asked about now.
    pub(super) fn unsolved(&mut self, scan: PathBuf, app: &mut AppState) {
        (self.follow.newest, self.follow.unsolved) = (None, Some(scan));
        app.go_to(crate::model::room::Room::Look);
    }

    /// The room is entered: the last scan's solution is what there is to see.
    pub(super) fn open_newest(&mut self, app: &mut AppState) {
        let asked = app.take_opening();
        if asked || self.follow.pinned && self.opened.is_some() {
            return;
        }
        if let Some(newest) = self.follow.newest.take() {
            app.request(Request::Look(Command::Open(newest)));
        }
    }

    /// What else could be looked at, where there is something.
    pub(super) fn offers(&mut self, ui: &mut egui::Ui, app: &mut AppState) {
        if let Some(newest) = self.follow.newest.clone() {
            let name = newest.file_name().unwrap_or_default().to_string_lossy().into_owned();
            match offer(ui, &texts::newer(&name), texts::SHOW_IT, true) {
                Some(true) => app.request(Request::Look(Command::Open(newest))),
                Some(false) => self.follow.newest = None,
                None => {}
            }
        }
        if let Some(scan) = self.follow.unsolved.clone() {
            let name = scan.file_name().unwrap_or_default().to_string_lossy().into_owned();
            match offer(ui, &texts::unsolved(&name), texts::SOLVE_IT, app.can_change()) {
                Some(true) => {
                    self.follow.unsolved = None;
                    let settings = app.settings.solve;
                    app.request(Request::Look(Command::SolveScan(scan, settings)));
                }
                Some(false) => self.follow.unsolved = None,
                None => {}
            }
        }
    }

    /// A new solution. The same one solved again keeps how it is looked at, and what was drawn; strokes that were not saved wait
    /// for their picture to be looked at again.
    pub(super) fn take(&mut self, opened: Box<Opened>, app: &mut AppState) {
        self.finish_stroke();
        let old = std::mem::take(self);
        (self.drafts, self.follow.pinned, self.browse) =
            (old.drafts, old.follow.pinned, old.browse);
        let before = old.opened.as_deref();
        let same_key = key_of(before).is_some() && key_of(before) == key_of(Some(&opened));
        if let (Some(painting), Some(key)) = (old.painting, key_of(before))
            && (painting.changed || same_key)
        {
            self.drafts.put_aside(key.to_owned(), painting);
        }
        let same = before.filter(|before| before.folder == opened.folder);
        if same.is_some_and(|before| before.maps.size() == opened.maps.size()) {
            self.view = old.view;
            self.lamp = old.lamp;
            self.layers = old.layers.of_one_solution();
            (self.tool, self.canvas, self.line) = (old.tool, old.canvas, old.line);
            self.edits = old.edits;
        } else {
            self.lamp.hang_over(&opened.maps.geometry);
        }
        self.opened = Some(opened);
        self.take_up_painting(app);
        self.measure();
        if matches!(self.tool, Tool::Brush | Tool::Lasso) && !self.can_mask() {
            self.tool = Tool::Hand;
        }
        app.go_to(crate::model::room::Room::Look);
    }

    /// Strokes of this picture: those of this window, else those that an earlier one has left on the disk.
    fn take_up_painting(&mut self, app: &mut AppState) {
        let opened = self.opened.as_deref();
        let Some(key) = key_of(opened).map(str::to_owned) else { return };
        let size = opened.map(|opened| opened.maps.size());
        let of_disk = opened.and_then(Opened::capture).and_then(|capture| capture.mask.clone());
        let fits = |painting: &Painting| {
            let mask = painting.mask();
            size == Some([mask.width, mask.height])
        };
        match self.drafts.take(&key) {
            // Where another mask took the place of one that was saved, that one counts.
            Some(painting)
                if fits(&painting)
                    && (painting.changed
                        || of_disk.is_some_and(|mask| *mask == *painting.mask())) =>
            {
                self.edits.begin_with(painting.steps());
                self.painting = Some(painting);
            }
            Some(painting) if painting.changed => self.drafts.put_aside(key, painting),
            _ => {
                self.edits.forget_mask();
                self.awaits_draft = true;
                let file = Drafts::file(&app.settings.drafts(), &key);
                app.request(Request::Look(Command::Draft(file)));
            }
        }
    }

    /// What an earlier window left of this picture: one step that can be undone.
    pub(super) fn take_draft(
        &mut self,
        file: PathBuf,
        draft: Option<weavelight_calibration::description::Image<bool>>,
        app: &mut AppState,
    ) {
        let opened = self.opened.as_deref();
        let of_this = key_of(opened).map(|key| Drafts::file(&app.settings.drafts(), key));
        if of_this != Some(file) {
            return;
        }
        self.awaits_draft = false;
        let (Some(draft), Some(opened)) = (draft, opened) else { return };
        let mask = opened.capture().and_then(|capture| capture.mask.as_ref());
        let mut painting = Painting::new(opened.maps.size(), mask);
        if painting.replace(&draft) {
            self.painting = Some(painting);
            self.edits = Edits::default();
            self.edits.changed_mask();
            app.report(Problem::warning(texts::MASK, texts::DRAFT_IS_BACK));
        } else if let Some(key) = key_of(self.opened.as_deref()) {
            // It is what is on the disk.
            self.drafts.forget(&app.settings.drafts(), key);
        }
    }

    /// Keeps strokes on the disk until they are saved.
    pub(super) fn keep_draft(&mut self, app: &mut AppState) {
        if let Some(text) = self.drafts.trouble() {
            app.report(Problem::error(texts::KEEPING_STROKES, text));
        }
        let key = key_of(self.opened.as_deref()).map(str::to_owned);
        if let (Some(painting), Some(key)) = (&mut self.painting, key)
            && painting.changed
            && painting.kept != painting.version
        {
            painting.kept = painting.version;
            self.drafts.keep(&app.settings.drafts(), &key, painting.mask());
        }
    }

    /// A mask is on the disk; strokes that came since are not.
    pub(super) fn mask_saved(&mut self, key: &str, version: u64, app: &AppState) {
        let folder = app.settings.drafts();
        if key_of(self.opened.as_deref()) != Some(key) {
            if let Some(mut painting) = self.drafts.take(key) {
                if painting.version != version {
                    return self.drafts.put_aside(key.to_owned(), painting);
                }
                painting.changed = false;
            }
            return self.drafts.forget(&folder, key);
        }
        match &mut self.painting {
            Some(painting) if painting.version != version => {}
            painting => {
                painting.iter_mut().for_each(|painting| painting.changed = false);
                self.drafts.forget(&folder, key);
            }
        }
    }
}

/// What the strokes of a solution's picture are kept under.
fn key_of(opened: Option<&Opened>) -> Option<&str> {
    opened?.capture().map(|capture| capture.key.as_str())
}

/// A sentence and what can be done: true for that, false for not now.
fn offer(ui: &mut egui::Ui, text: &str, action: &str, enabled: bool) -> Option<bool> {
    ui.horizontal(|ui| {
        ui.label(RichText::new(text).strong());
        let act = ui.add_enabled(enabled, egui::Button::new(action)).clicked();
        let not_now = ui.button(texts::NOT_NOW).clicked();
        act.then_some(true).or(not_now.then_some(false))
    })
    .inner
}
