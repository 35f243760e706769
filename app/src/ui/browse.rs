//! The system's dialogue for folders and files. It waits in a thread of its own: the window goes on drawing, and a scan goes on, while it is
//! open.

use crate::model::desktop::has_dialogue;
use crate::texts;
use crate::texts::shell;
use crate::ui::widgets::Sign;
use eframe::egui;
use std::future::Future;
use std::path::PathBuf;
use std::sync::mpsc;
use std::sync::mpsc::{Receiver, TryRecvError};

/// A button that opens it.
#[derive(Debug, Default)]
pub struct Browse {
    /// `None` where no dialogue is open.
    answer: Option<Receiver<Answer>>,
    /// There is none, and why is being said.
    why_none: Option<String>,
}

/// What came of it.
#[derive(Debug)]
enum Answer {
    Chosen(PathBuf),
    Closed,
    /// There is nothing that could show one; what to do about it.
    None(String),
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
        let button = ui.add_enabled(self.answer.is_none(), egui::Button::new(texts::BROWSE));
        if button.clicked() {
            let dialogue = dialogue();
            self.open(ui.ctx(), has_dialogue, async { dialogue.await.map(PathBuf::from) });
        }
        self.say_none(&button);
        self.take()
    }

    /// Where there is no dialogue: that, what would bring one, and what goes without.
    fn say_none(&mut self, button: &egui::Response) {
        let Some(why) = &self.why_none else { return };
        let mut open = true;
        egui::Popup::from_response(button)
            .open_bool(&mut open)
            .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
            .width(320.0)
            .show(|ui| {
                ui.horizontal_top(|ui| {
                    Sign::Warning.ui(ui);
                    ui.add(egui::Label::new(why).wrap().selectable(true));
                });
            });
        if !open {
            self.why_none = None;
        }
    }

    /// Waits for a dialogue, beside the window. `available`: whether there is one; that may take its time, too.
    fn open(
        &mut self,
        ctx: &egui::Context,
        available: impl FnOnce() -> bool + Send + 'static,
        dialogue: impl Future<Output = Option<PathBuf>> + Send + 'static,
    ) {
        let (sender, answer) = mpsc::channel();
        let ctx = ctx.clone();
        let failure = sender.clone();
        let waits = weavelight::machine::spawn("dialogue", move || {
            let answer = match available() {
                true => pollster::block_on(dialogue).map_or(Answer::Closed, Answer::Chosen),
                false => Answer::None(shell::NO_DIALOGUE.to_owned()),
            };
            // The window may be gone by then.
            let _ = sender.send(answer);
            ctx.request_repaint();
        });
        if let Err(error) = waits {
            let why = shell::no_thread(shell::threads::DIALOGUE, &error);
            let _ = failure.send(Answer::None(why));
        }
        self.answer = Some(answer);
    }

    fn take(&mut self) -> Option<PathBuf> {
        let answer = match self.answer.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            answer => answer.unwrap_or(Answer::Closed),
        };
        self.answer = None;
        match answer {
            Answer::Chosen(path) => Some(path),
            Answer::Closed => None,
            Answer::None(why) => {
                self.why_none = Some(why);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::kittest::Queryable;
    use std::time::{Duration, Instant};

    /// What is answered, `None` for a dialogue that was closed; the frame before is drawn without it.
    fn check(chosen: Option<PathBuf>) {
        let mut browse = Browse::default();
        let (choose, choice) = mpsc::channel();
        let dialogue = async move { choice.recv().unwrap_or(None) };
        browse.open(&egui::Context::default(), || true, dialogue);
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
    fn where_there_is_no_dialogue_that_is_said() {
        let mut browse = Browse::default();
        let dialogue = async { panic!("there is none to be opened") };
        browse.open(&egui::Context::default(), || false, dialogue);
        let begun = Instant::now();
        while browse.answer.is_some() {
            assert!(begun.elapsed() < Duration::from_secs(60), "no answer");
            assert_eq!(browse.take(), None);
            std::thread::yield_now();
        }
        assert!(browse.why_none.is_some());
        let mut window = egui_kittest::Harness::new_ui(|ui| {
            assert_eq!(browse.folder(ui), None);
        });
        window.run();
        window.get_by_label_contains("zenity");
        window.get_by_label_contains("type or paste the path");
        // It goes with a click elsewhere.
        window.drag_at(egui::pos2(700.0, 500.0));
        window.drop_at(egui::pos2(700.0, 500.0));
        window.run();
        assert!(window.query_by_label_contains("zenity").is_none());
    }

    #[test]
    fn the_window_goes_on_while_somebody_browses() {
        check(Some("/rigs/one".into()));
        check(None);
    }
}
