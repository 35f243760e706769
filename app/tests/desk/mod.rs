//! A window in a test, with a home of its own and a small simulated rig.

mod names;

use eframe::egui;
use egui_kittest::{Harness, SnapshotResults, kittest::Queryable};
pub(crate) use names::check_names;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use weavelight::simulate;
use weavelight_app::App;
use weavelight_app::jobs::messages::Request;
use weavelight_app::model::room::Room;
use weavelight_app::model::settings::Settings;

/// The size that most have.
pub(crate) const WIDE: [f32; 2] = [1280.0, 800.0];
/// A small laptop's.
pub(crate) const SMALL: [f32; 2] = [960.0, 640.0];
/// So long nothing may be heard of work that is waited for. A calibration takes more than a minute, but it tells how far it is.
const PATIENCE: Duration = Duration::from_secs(120);
/// Small enough for a test, large enough for a calibrated camera.
const FRAME: [usize; 2] = [96, 64];

pub(crate) struct Window {
    pub(crate) harness: Harness<'static, App>,
    home: tempfile::TempDir,
}

impl Window {
    pub(crate) fn new(size: [f32; 2], theme: egui::Theme) -> Self {
        Self::with(size, theme, |_| {})
    }

    /// A window whose settings were changed by `change` when it was closed the last time.
    pub(crate) fn with(size: [f32; 2], theme: egui::Theme, change: impl Fn(&mut Settings)) -> Self {
        let home = tempfile::tempdir().unwrap();
        let mut settings = Settings::load_from(&home.path().join("settings.toml"));
        settings.home = home.path().to_owned();
        settings.theme = match theme {
            egui::Theme::Dark => weavelight_app::model::settings::Theme::Dark,
            egui::Theme::Light => weavelight_app::model::settings::Theme::Light,
        };
        change(&mut settings);
        let quiet = weavelight::machine::Quiet::begin();
        let harness = Harness::builder()
            .with_size(size)
            .with_theme(theme)
            .with_max_steps(64)
            .wgpu()
            .build_eframe(|cc| {
                App::new(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), settings).unwrap()
            });
        drop(quiet);
        Self { harness, home }
    }

    pub(crate) fn home(&self) -> PathBuf {
        self.home.path().to_owned()
    }

    /// The small rig's folder.
    pub(crate) fn rig(&self) -> PathBuf {
        self.home().join("rig")
    }

    /// Makes the small rig, with its true calibration, where there is none yet, and opens it.
    pub(crate) fn open_small_rig(&mut self) {
        let rig = self.rig();
        if !rig.exists() {
            let options = simulate::Options {
                out: rig.clone(),
                size_px: Some(FRAME),
                only: vec![simulate::Part::Swatch],
                ..Default::default()
            };
            simulate::run(&options, &|_, _| ()).unwrap();
        }
        self.harness.state_mut().request(Request::Open(rig));
        self.until("the rig is open", |app| app.shared().project.is_some());
        self.idle();
    }

    /// A scan that was killed after some of the simulator's frames.
    pub(crate) fn killed_scan(&mut self, name: &str, frames: usize) {
        self.scan_in_the_library(name);
        let folder = self.rig().join("scans").join(name);
        let mut session = weavelight::session::Session::load(&folder).unwrap();
        for lost in session.frames.drain(frames..) {
            std::fs::remove_file(folder.join(lost.file)).unwrap();
        }
        session.save().unwrap();
    }

    /// A scan as the simulator writes it.
    pub(crate) fn scan_in_the_library(&mut self, name: &str) {
        let to = self.rig().join("scans").join(name);
        std::fs::create_dir_all(&to).unwrap();
        for file in std::fs::read_dir(self.rig().join("swatch")).unwrap().flatten() {
            std::fs::copy(file.path(), to.join(file.file_name())).unwrap();
        }
        let manifest = to.join("session.toml");
        let text = std::fs::read_to_string(&manifest).unwrap();
        let renamed = text.lines().map(|line| match line.starts_with("name = ") {
            true => format!("name = \"{name}\"\n"),
            false => format!("{line}\n"),
        });
        std::fs::write(&manifest, renamed.collect::<String>()).unwrap();
    }

    pub(crate) fn enter(&mut self, room: Room) {
        self.harness.state_mut().enter(room);
        self.harness.run();
    }

    pub(crate) fn click(&mut self, label: &str) {
        self.until_label(label);
        // What has just appeared may still move.
        self.harness.step();
        self.harness.get_by_label(label).click();
        self.harness.step();
    }

    /// Waits for something with this name.
    pub(crate) fn until_label(&mut self, label: &str) {
        self.wait_for(label, |window| window.harness.query_by_label(label).is_some());
    }

    pub(crate) fn until(&mut self, what: &str, happened: impl Fn(&App) -> bool) {
        self.wait_for(what, |window| happened(window.harness.state()));
    }

    fn wait_for(&mut self, what: &str, happened: impl Fn(&Self) -> bool) {
        let (mut heard, mut since) = (self.news(), Instant::now());
        while !happened(self) {
            let news = self.news();
            if news != heard {
                (heard, since) = (news, Instant::now());
            }
            let desk = self.harness.state().shared();
            assert!(since.elapsed() < PATIENCE, "{what}: not yet; {desk:?}");
            self.wait();
        }
    }

    /// What is known of the work under way.
    fn news(&self) -> Option<(String, String, f64)> {
        let activity = self.harness.state().shared().activity.as_ref()?;
        Some((activity.title.clone(), activity.step.clone(), activity.share))
    }

    /// Until the worker has nothing left to do and nothing moves.
    pub(crate) fn idle(&mut self) {
        self.until("everything is done", App::is_idle);
        for _ in 0..4 {
            self.harness.step();
        }
    }

    fn wait(&mut self) {
        self.harness.step();
        std::thread::sleep(Duration::from_millis(5));
    }
}

type Variant = (&'static str, egui::Theme, [f32; 2]);

const VARIANTS: [Variant; 4] = [
    ("dark", egui::Theme::Dark, WIDE),
    ("light-small", egui::Theme::Light, SMALL),
    ("light", egui::Theme::Light, WIDE),
    ("dark-small", egui::Theme::Dark, SMALL),
];

/// What `act` leads to, as a picture at two sizes and in both themes.
pub(crate) fn both_themes(name: &str, act: impl Fn(&mut Window)) {
    pictures(name, &VARIANTS, |_| {}, act);
}

/// A state of a room: a picture of either size and either theme, which takes half the time. `change`: of the settings.
pub(crate) fn state(name: &str, change: impl Fn(&mut Settings), act: impl Fn(&mut Window)) {
    pictures(name, &VARIANTS[..2], change, act);
}

fn pictures(
    name: &str,
    variants: &[Variant],
    change: impl Fn(&mut Settings),
    act: impl Fn(&mut Window),
) {
    let mut results = SnapshotResults::new();
    for (variant, theme, size) in variants {
        let mut window = Window::with(*size, *theme, &change);
        act(&mut window);
        window.harness.run();
        check_names(&window.harness);
        results.add(window.harness.try_snapshot(format!("{name}-{variant}")));
    }
}
