//! A small rig with one scan and its solution, and the window on it.

use eframe::egui;
use egui_kittest::{Harness, kittest::Queryable};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use weavelight::photometry::Method;
use weavelight::simulate::{self, Part};
use weavelight::solve;
use weavelight_app::rooms::Room;
use weavelight_app::{App, settings::Settings};

/// The window.
pub(crate) type Window = Harness<'static, App>;

/// Name of scan and solution.
pub(crate) const SOLUTION: &str = "linen 4021";
/// Small enough for a test to take a second.
const SIZE_PX: [usize; 2] = [144, 96];

/// A rig's folder; removed at the end.
pub(crate) struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    /// Simulates, and solves.
    pub(crate) fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        let options = simulate::Options {
            out: bench.rig(),
            size_px: Some(SIZE_PX),
            only: vec![Part::Swatch],
            ..simulate::Options::default()
        };
        simulate::run(&options, &|_, _| {}).unwrap();
        std::fs::create_dir_all(bench.scan().parent().unwrap()).unwrap();
        std::fs::rename(bench.rig().join("swatch"), bench.scan()).unwrap();
        bench.solve_again(SOLUTION, Method::Auto);
        bench
    }

    /// A further solution of the same scan.
    pub(crate) fn solve_again(&self, name: &str, method: Method) -> PathBuf {
        let folder = self.rig().join("solutions").join(name);
        std::fs::create_dir_all(folder.parent().unwrap()).unwrap();
        let mut options = solve::Options::new(self.scan(), self.rig().join("calibration"), &folder);
        options.method = method;
        solve::run(&options, &|_| {}).unwrap();
        folder
    }

    /// The capture session.
    pub(crate) fn scan(&self) -> PathBuf {
        self.rig().join("scans").join(SOLUTION)
    }

    /// Its solution.
    pub(crate) fn solution(&self) -> PathBuf {
        self.rig().join("solutions").join(SOLUTION)
    }

    /// The Look room with nothing in it.
    pub(crate) fn empty(&self, size: [f32; 2], theme: egui::Theme) -> Window {
        let mut settings = Settings::load_from(&self.folder.path().join("settings.toml"));
        settings.home = self.folder.path().to_owned();
        settings.rig = Some(self.rig());
        settings.room = Room::Look;
        settings.theme = match theme {
            egui::Theme::Dark => weavelight_app::settings::Theme::Dark,
            egui::Theme::Light => weavelight_app::settings::Theme::Light,
        };
        let builder = Harness::builder().with_size(size).with_theme(theme).with_max_steps(64);
        let mut window = builder.with_render_cursor(false).wgpu().build_eframe(move |cc| {
            App::new(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), settings)
        });
        wait(&mut window, "the rig", |window| window.state().desk().place.is_some());
        window.run();
        window
    }

    /// The Look room with the solution, opened as a user does.
    pub(crate) fn look(&self, size: [f32; 2], theme: egui::Theme) -> Window {
        let mut window = self.empty(size, theme);
        enter_folder(&mut window, &self.solution());
        window.get_by_label("Open").click();
        wait(&mut window, "the solution", |window| window.query_by_label(SOLUTION).is_some());
        window.run();
        window
    }

    fn rig(&self) -> PathBuf {
        self.folder.path().join("rig")
    }
}

/// Types a folder's path into the field for it.
pub(crate) fn enter_folder(window: &mut Window, folder: &Path) {
    let field =
        window.get_by_role_and_label(egui::accesskit::Role::TextInput, "Folder of the solution");
    field.focus();
    field.type_text(&folder.display().to_string());
    window.run();
}

/// Drags with the first button, in a few steps.
pub(crate) fn drag(window: &mut Window, [from, to]: [egui::Pos2; 2]) {
    window.drag_at(from);
    window.run();
    for share in [0.25, 0.5, 0.75, 1.0] {
        window.hover_at(from + share * (to - from));
        window.run();
    }
    window.drop_at(to);
    window.run();
}

/// Steps until something is there.
pub(crate) fn wait(window: &mut Window, what: &str, mut there: impl FnMut(&Window) -> bool) {
    let patience = Instant::now() + Duration::from_secs(20);
    while !there(window) {
        assert!(Instant::now() < patience, "{what} did not come: {:?}", window.state().desk());
        std::thread::sleep(Duration::from_millis(10));
        window.step();
    }
}
