//! A small rig with one scan and its solution, and the window on it.

use eframe::egui;
use egui_kittest::{Harness, kittest::Queryable};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use weavelight::photometry::Method;
use weavelight::simulate::{self, Part};
use weavelight::solve;
use weavelight_app::App;
use weavelight_app::model::room::Room;
use weavelight_app::model::settings::Settings;

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
        solve::run(&options, &|_| {}, None).unwrap();
        folder
    }

    /// A solution of another size: a preview.
    pub(crate) fn preview(&self, name: &str) -> PathBuf {
        let folder = self.rig().join("solutions").join(name);
        let mut options = solve::Options::new(self.scan(), self.rig().join("calibration"), &folder);
        options.method = Method::LeastSquares;
        options.scale = weavelight::solution::Scale::Half;
        solve::run(&options, &|_| {}, None).unwrap();
        folder
    }

    /// A scan and its solution, with a calibration of their own, in folders that no rig has.
    pub(crate) fn elsewhere(&self) -> [PathBuf; 2] {
        let [scan, calibration, solution] = ["shot today", "lights of March", "result"]
            .map(|name| self.folder.path().join("elsewhere").join(name));
        copy(&self.scan(), &scan);
        copy(&self.rig().join("calibration"), &calibration);
        let options = solve::Options::new(&scan, &calibration, &solution);
        solve::run(&options, &|_| {}, None).unwrap();
        [scan, solution]
    }

    /// The capture session.
    pub(crate) fn scan(&self) -> PathBuf {
        self.rig().join("scans").join(SOLUTION)
    }

    /// Its solution.
    pub(crate) fn solution(&self) -> PathBuf {
        self.rig().join("solutions").join(SOLUTION)
    }

    /// Where strokes are kept until they are saved.
    pub(crate) fn drafts(&self) -> PathBuf {
        self.folder.path().join("drafts")
    }

    /// The Look room with nothing in it.
    pub(crate) fn empty(&self, size: [f32; 2], theme: egui::Theme) -> Window {
        self.window(size, theme, true)
    }

    /// The Look room on a computer without graphics.
    pub(crate) fn without_graphics(&self, size: [f32; 2], theme: egui::Theme) -> Window {
        let mut window = self.window(size, theme, false);
        open(&mut window, &self.solution());
        window
    }

    fn window(&self, size: [f32; 2], theme: egui::Theme, graphics: bool) -> Window {
        let mut settings = Settings::load_from(&self.folder.path().join("settings.toml"));
        settings.home = self.folder.path().to_owned();
        settings.rig = Some(self.rig());
        settings.room = Room::Look;
        settings.theme = match theme {
            egui::Theme::Dark => weavelight_app::model::settings::Theme::Dark,
            egui::Theme::Light => weavelight_app::model::settings::Theme::Light,
        };
        let builder = Harness::builder().with_size(size).with_theme(theme).with_max_steps(64);
        let quiet = weavelight::machine::Quiet::begin();
        let mut window = builder.with_render_cursor(false).wgpu().build_eframe(move |cc| {
            let renderer = cc.wgpu_render_state.as_ref().filter(|_| graphics);
            App::new(&cc.egui_ctx, renderer, settings).unwrap()
        });
        drop(quiet);
        wait(&mut window, "the rig", |window| window.state().shared().project.is_some());
        window.run();
        window
    }

    /// The Look room with the solution, opened as a user does.
    pub(crate) fn look(&self, size: [f32; 2], theme: egui::Theme) -> Window {
        let mut window = self.empty(size, theme);
        open(&mut window, &self.solution());
        window
    }

    fn rig(&self) -> PathBuf {
        self.folder.path().join("rig")
    }
}

/// Opens a solution, as a user does who has none yet.
pub(crate) fn open(window: &mut Window, solution: &Path) {
    enter_folder(window, solution);
    window.get_by_label("Open").click();
    let name = solution.file_name().unwrap().to_string_lossy();
    wait(window, "the solution", |window| window.query_by_label(&name).is_some());
    window.run();
}

/// Opens a solution where there is one already.
pub(crate) fn open_another(window: &mut Window, solution: &Path) {
    window.get_by_label("Open…").click();
    window.run();
    enter_folder(window, solution);
    window.get_by_label("Open").click();
    window.run();
    wait(window, "the solution", |window| window.state().is_idle());
    window.run();
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
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
        assert!(Instant::now() < patience, "{what} did not come: {:?}", window.state().shared());
        std::thread::sleep(Duration::from_millis(10));
        window.step();
    }
}
