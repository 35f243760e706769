//! One piece of work: told about, and ended when nobody wants it any more.

use super::Update;
use crate::desk::{Area, Problem};
use eframe::egui;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use weavelight::device::scan::Control;

/// Ends or pauses the work under way. Clones act on the same worker.
#[derive(Clone, Debug, Default)]
pub struct Brake(Arc<State>);

#[derive(Debug, Default)]
struct State {
    cancelled: AtomicBool,
    closing: AtomicBool,
    scan: Mutex<Option<Control>>,
}

impl Brake {
    /// Ends the work under way.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::SeqCst);
        self.with_scan(Control::stop);
    }

    /// Pauses a scan.
    pub fn pause(&self) {
        self.with_scan(Control::pause);
    }

    /// Goes on with a scan.
    pub fn go_on(&self) {
        self.with_scan(Control::go_on);
    }

    fn with_scan(&self, act: impl Fn(&Control)) {
        if let Ok(scan) = self.0.scan.lock() {
            scan.iter().for_each(act);
        }
    }

    /// Ends the work under way, and begins no other.
    pub fn close(&self) {
        self.0.closing.store(true, Ordering::SeqCst);
        self.cancel();
    }

    /// Whether frames are being taken.
    pub fn is_capturing(&self) -> bool {
        self.0.scan.lock().is_ok_and(|scan| scan.is_some())
    }

    /// Whether no work is to begin any more.
    pub(super) fn is_closing(&self) -> bool {
        self.0.closing.load(Ordering::SeqCst)
    }

    /// Whether the work under way is no longer wanted.
    pub(super) fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Ordering::SeqCst)
    }
}

/// Why work has no result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Nobody wanted it any more.
    Cancelled,
    /// It failed, and the user has been told.
    Failed,
}

/// Unwinds from a progress callback.
struct Cancelled;

/// Where the worker tells what happens.
#[derive(Clone, Debug)]
pub struct Outbox {
    updates: Sender<Update>,
    ctx: egui::Context,
    brake: Brake,
    /// What problems belong to.
    area: Option<Area>,
}

impl Outbox {
    pub(super) fn new(updates: Sender<Update>, ctx: egui::Context, brake: Brake) -> Self {
        Self { updates, ctx, brake, area: None }
    }

    /// The same, for work of an area.
    pub(super) fn of(&self, area: Area) -> Self {
        Self { area: Some(area), ..self.clone() }
    }

    /// A new command: what ended the last one does not count for it.
    pub(super) fn begin(&self) {
        self.brake.0.cancelled.store(self.brake.is_closing(), Ordering::SeqCst);
    }

    /// Tells the window.
    pub fn tell(&self, update: Update) {
        let _ = self.updates.send(update);
        self.ctx.request_repaint();
    }

    /// Tells how far work is; unwinds where it is no longer wanted. To be called within [`Outbox::job`] only.
    pub fn tick(&self, share: f64, step: &str) {
        if self.brake.is_cancelled() {
            resume_unwind(Box::new(Cancelled));
        }
        self.progress(share, step, None);
    }

    /// Whether no command is to begin any more.
    pub(super) fn is_closing(&self) -> bool {
        self.brake.is_closing()
    }

    /// Whether the command under way is no longer wanted.
    pub fn is_cancelled(&self) -> bool {
        self.brake.is_cancelled()
    }

    /// Tells how far work is.
    pub fn progress(&self, share: f64, step: &str, left: Option<Duration>) {
        self.tell(Update::Progress { share, step: step.to_owned(), left });
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
        self.tell(Update::Problem(Problem { area: self.area, ..problem }));
    }

    /// Work that takes its time: told when it begins and ends, with its error put up, and ended where [`Outbox::tick`] finds
    /// that nobody wants it.
    ///
    /// # Errors
    /// Why there is no result; the user knows by then.
    pub fn job<T, E: std::fmt::Display>(
        &self,
        title: &str,
        work: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, Ended> {
        self.tell(Update::Began(title.to_owned()));
        let result = catch_unwind(AssertUnwindSafe(work));
        self.tell(Update::Ended);
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
        let put = |value| self.brake.0.scan.lock().map(|mut scan| *scan = value);
        let _ = put(Some(control.clone()));
        // Stopped before there was a scan to stop.
        if self.brake.is_cancelled() {
            control.stop();
        }
        let result = work(&control);
        let _ = put(None);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    fn outbox() -> (Outbox, mpsc::Receiver<Update>) {
        let (sender, receiver) = mpsc::channel();
        (Outbox::new(sender, egui::Context::default(), Brake::default()), receiver)
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
                    out.brake.cancel();
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
        out.brake.cancel();
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
