//! The system's dialogue for folders and files. It waits in a thread of its own: the window goes on drawing, and a scan goes on, while it is
//! open.

use crate::texts;
use eframe::egui;
use std::future::Future;
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, TryRecvError};

/// A button that opens it.
#[derive(Debug, Default)]
pub struct Browse {
    /// `None` where no dialogue is open.
    answer: Option<Receiver<Option<PathBuf>>>,
}

impl Browse {
    /// Draws the button; grey while the dialogue is open. The folder that was chosen, once.
    pub fn folder(&mut self, ui: &mut egui::Ui) -> Option<PathBuf> {
        self.ui(ui, || rfd::AsyncFileDialog::new().pick_folder())
    }

    /// The same for a file.
    pub fn file(&mut self, ui: &mut egui::Ui) -> Option<PathBuf> {
        self.ui(ui, || rfd::AsyncFileDialog::new().pick_file())
    }

    fn ui<D>(&mut self, ui: &mut egui::Ui, dialogue: impl FnOnce() -> D) -> Option<PathBuf>
    where
        D: Future<Output = Option<rfd::FileHandle>> + Send + 'static,
    {
        let button = egui::Button::new(texts::BROWSE);
        if ui.add_enabled(self.answer.is_none(), button).clicked() {
            let dialogue = dialogue();
            self.open(ui.ctx(), async { dialogue.await.map(PathBuf::from) });
        }
        self.take()
    }

    /// Waits for a dialogue, beside the window.
    fn open(
        &mut self,
        ctx: &egui::Context,
        dialogue: impl Future<Output = Option<PathBuf>> + Send + 'static,
    ) {
        let (sender, answer) = mpsc::channel();
        let ctx = ctx.clone();
        // Without a thread there is no dialogue, as if it had been closed.
        let _ = weavelight::machine::spawn("dialogue", move || {
            // Whoever asked may be gone by then.
            let _ = sender.send(pollster::block_on(dialogue));
            ctx.request_repaint();
        });
        self.answer = Some(answer);
    }

    fn take(&mut self) -> Option<PathBuf> {
        let answer = match self.answer.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            answer => answer.ok().flatten(),
        };
        self.answer = None;
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    /// What is answered, `None` for a dialogue that was closed; the frame before is drawn without it.
    fn check(chosen: Option<PathBuf>) {
        let mut browse = Browse::default();
        let (choose, choice) = mpsc::channel();
        browse.open(&egui::Context::default(), async move { choice.recv().unwrap_or(None) });
        assert_eq!((browse.take(), browse.answer.is_some()), (None, true), "it is still open");
        choose.send(chosen.clone()).unwrap();
        let begun = Instant::now();
        let mut found = None;
        while browse.answer.is_some() {
            assert!(begun.elapsed() < Duration::from_secs(60), "no answer");
            found = browse.take();
            std::thread::yield_now();
        }
        assert_eq!((found, browse.take()), (chosen, None));
    }

    #[test]
    fn the_window_goes_on_while_somebody_browses() {
        check(Some("/rigs/one".into()));
        check(None);
    }
}
