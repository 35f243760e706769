//! Runs a job: reports its progress and its error, and ends it when it is cancelled.

use crate::jobs::control::JobControl;
use crate::jobs::messages::Update;
use crate::model::activity::Ended;
use crate::model::problem::{Area, Problem};
use eframe::egui;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::Sender;
use std::time::Duration;
use weavelight::device::scan::Control;

/// Unwinds from a progress callback.
struct Cancelled;

/// Where jobs report to the window.
#[derive(Clone, Debug)]
pub struct Outbox {
    updates: Sender<Update>,
    ctx: egui::Context,
    control: JobControl,
    /// What problems belong to.
    area: Option<Area>,
}

impl Outbox {
    pub(crate) fn new(updates: Sender<Update>, ctx: egui::Context, control: JobControl) -> Self {
        Self { updates, ctx, control, area: None }
    }

    /// The same, for work of an area.
    pub(crate) fn of(&self, area: Area) -> Self {
        Self { area: Some(area), ..self.clone() }
    }

    /// A new command: what ended the last one does not count for it.
    pub(crate) fn begin(&self) {
        self.control.begin();
    }

    /// Sends an update to the window.
    pub fn send(&self, update: Update) {
        let _ = self.updates.send(update);
        self.ctx.request_repaint();
    }

    /// Reports progress; unwinds if the job was cancelled. Call it within [`Outbox::job`] only.
    pub fn tick(&self, share: f64, step: &str) {
        if self.control.is_cancelled() {
            resume_unwind(Box::new(Cancelled));
        }
        self.progress(share, step, None);
    }

    /// Whether no command is to begin any more.
    pub(crate) fn is_closing(&self) -> bool {
        self.control.is_closing()
    }

    /// Whether the command under way is no longer wanted.
    pub fn is_cancelled(&self) -> bool {
        self.control.is_cancelled()
    }

    /// Reports progress.
    pub fn progress(&self, share: f64, step: &str, left: Option<Duration>) {
        self.send(Update::Progress { share, step: step.to_owned(), left });
    }

    /// Puts up a warning for each sentence.
    pub fn warn(&self, title: &str, sentences: &[String]) {
        for text in sentences {
            self.put_up(Problem::warning(title, text));
        }
    }

    /// Puts up an error.
    pub fn fail(&self, title: &str, error: &dyn std::fmt::Display) {
        self.put_up(Problem::error(title, error.to_string()));
    }

    fn put_up(&self, problem: Problem) {
        self.send(Update::Problem(Problem { area: self.area, ..problem }));
    }

    /// Runs a job: reports its beginning, its end and its error. [`Outbox::tick`] ends it if it was cancelled.
    ///
    /// # Errors
    /// Why there is no result; an error is reported already.
    pub fn job<T, E: std::fmt::Display>(
        &self,
        title: &str,
        work: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, Ended> {
        self.send(Update::Began(title.to_owned()));
        let result = catch_unwind(AssertUnwindSafe(work));
        self.send(Update::Ended);
        match result {
            Ok(Ok(value)) => Ok(value),
            Ok(Err(error)) => {
                self.fail(title, &error);
                Err(Ended::Failed)
            }
            Err(payload) if payload.is::<Cancelled>() => Err(Ended::Cancelled),
            Err(_) => {
                self.fail(title, &crate::texts::BUG);
                Err(Ended::Failed)
            }
        }
    }

    /// Work that is paused and stopped as scans are.
    pub fn with_control<T>(&self, work: impl FnOnce(&Control) -> T) -> T {
        let control = Control::default();
        self.control.set_scan(Some(control.clone()));
        // Stopped before there was a scan to stop.
        if self.control.is_cancelled() {
            control.stop();
        }
        let result = work(&control);
        self.control.set_scan(None);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    fn outbox() -> (Outbox, mpsc::Receiver<Update>) {
        let (sender, receiver) = mpsc::channel();
        (Outbox::new(sender, egui::Context::default(), JobControl::default()), receiver)
    }

    #[test]
    fn work_that_nobody_wants_ends_at_its_next_tick() {
        let (out, updates) = outbox();
        let mut steps = 0;
        let result = out.job("Counting", || {
            for k in 0..10 {
                out.tick(f64::from(k) / 10.0, "");
                steps += 1;
                if k == 3 {
                    out.control.cancel();
                }
            }
            Ok::<_, String>(())
        });
        assert_eq!((result, steps), (Err(Ended::Cancelled), 4));
        assert!(matches!(updates.try_iter().last(), Some(Update::Ended)));
    }

    #[test]
    fn a_scan_that_was_stopped_before_it_began_does_not_begin() {
        let (out, _updates) = outbox();
        out.control.cancel();
        assert!(out.with_control(Control::is_stopped));
        out.begin();
        assert!(!out.with_control(Control::is_stopped));
    }

    #[test]
    fn an_error_is_put_up_with_its_remedy() {
        let (out, updates) = outbox();
        let result = out.job("Solving", || Err::<(), _>("no frames; scan again"));
        assert_eq!(result, Err(Ended::Failed));
        let problem = updates.try_iter().find_map(|update| match update {
            Update::Problem(problem) => Some(problem),
            _ => None,
        });
        assert_eq!(problem, Some(Problem::error("Solving", "no frames; scan again")));
    }

    #[test]
    fn a_panic_is_put_up_and_the_worker_lives() {
        let (out, _updates) = outbox();
        let result = out.job("Solving", || -> Result<(), String> { resume_unwind(Box::new("oh")) });
        assert_eq!(result, Err(Ended::Failed));
    }
}
