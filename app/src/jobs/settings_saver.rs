//! Saves the settings whenever they change, so that a window that is killed loses nothing. Runs in its own thread, so that no
//! frame waits for the disk.

use crate::model::settings::Settings;
use crate::texts::shell::{no_thread, threads};
use std::sync::mpsc;
use std::sync::mpsc::{Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Duration;
use weavelight::machine::spawn;

/// So long nothing must have changed: a slider that is dragged changes them with every frame.
const QUIET: Duration = Duration::from_millis(300);

/// Saves settings.
#[derive(Debug)]
pub struct SettingsSaver {
    /// As they are kept, or will soon be.
    known: Settings,
    changes: Option<Sender<Settings>>,
    outcome: Receiver<Result<(), String>>,
    thread: Option<JoinHandle<()>>,
}

impl SettingsSaver {
    /// Begins with settings as they are on the disk.
    pub fn start(known: Settings) -> Self {
        let (changes, inbox) = mpsc::channel();
        let (outbox, outcome) = mpsc::channel();
        let failure = outbox.clone();
        let thread = spawn("settings", move || keep(&inbox, &outbox));
        let thread = thread.inspect_err(|error| {
            let _ = failure.send(Err(no_thread(threads::SETTINGS, error)));
        });
        let thread = thread.ok();
        Self { known, changes: Some(changes), outcome, thread }
    }

    /// Keeps them where they differ from what is kept.
    pub fn update(&mut self, settings: &Settings) {
        if *settings != self.known {
            self.known = settings.clone();
            if let Some(changes) = &self.changes {
                // The thread lives as long as this value.
                let _ = changes.send(settings.clone());
            }
        }
    }

    /// That they were kept, or why they could not be, once.
    pub fn outcome(&self) -> Option<Result<(), String>> {
        self.outcome.try_recv().ok()
    }
}

impl Drop for SettingsSaver {
    /// Returns when the last change is on the disk.
    fn drop(&mut self) {
        self.changes = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn keep(inbox: &Receiver<Settings>, outcome: &Sender<Result<(), String>>) {
    while let Ok(mut newest) = inbox.recv() {
        while let Ok(newer) = inbox.recv_timeout(QUIET) {
            newest = newer;
        }
        // The window may be gone by then.
        let _ = outcome.send(newest.save().map_err(|error| error.to_string()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    const PATIENCE: Duration = Duration::from_secs(60);

    #[test]
    fn a_change_is_kept_while_the_window_is_open_and_the_last_one_when_it_closes() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        let mut settings = Settings::load_from(&file);
        let mut saver = SettingsSaver::start(settings.clone());
        saver.update(&settings);
        settings.scale = 1.25;
        saver.update(&settings);
        let begun = Instant::now();
        while Settings::load_from(&file) != settings {
            assert!(begun.elapsed() < PATIENCE, "not kept");
            std::thread::sleep(Duration::from_millis(5));
        }
        settings.scale = 2.0;
        saver.update(&settings);
        drop(saver);
        assert_eq!(Settings::load_from(&file), settings);
    }

    #[test]
    fn what_cannot_be_kept_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let blocked = folder.path().join("a file");
        std::fs::write(&blocked, "").unwrap();
        let mut settings = Settings::load_from(&blocked.join("settings.toml"));
        let mut saver = SettingsSaver::start(settings.clone());
        settings.scale = 1.25;
        saver.update(&settings);
        let begun = Instant::now();
        let trouble = loop {
            assert!(begun.elapsed() < PATIENCE, "not reported");
            if let Some(Err(trouble)) = saver.outcome() {
                break trouble;
            }
            std::thread::yield_now();
        };
        assert!(trouble.contains("settings.toml"), "{trouble}");
        // Once the way is free, that is news, too.
        std::fs::remove_file(&blocked).unwrap();
        settings.scale = 1.5;
        saver.update(&settings);
        let kept = loop {
            assert!(begun.elapsed() < PATIENCE, "not kept");
            if let Some(outcome) = saver.outcome() {
                break outcome;
            }
            std::thread::yield_now();
        };
        assert_eq!(kept, Ok(()));
    }
}
