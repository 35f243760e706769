//! The desktop app's executable; `weavelight gui` starts it.

use std::process::ExitCode;
use weavelight::files::name_settings;
use weavelight::machine::{Quiet, correct_environment, start};
use weavelight_app::{App, model::settings::Settings, texts};

fn main() -> ExitCode {
    correct_environment();
    name_settings(texts::settings::name);
    start();
    weavelight::files::survive_size_limits();
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            #[allow(clippy::print_stderr, reason = "there is no window to show it in")]
            let () = eprintln!("error: {}", texts::shell::no_window(&error));
            ExitCode::FAILURE
        }
    }
}

fn run() -> eframe::Result {
    let settings = Settings::load();
    let options = eframe::NativeOptions {
        viewport: weavelight_app::ui::window::builder(&settings)
            .with_app_id("weavelight")
            .with_title(texts::TITLE)
            .with_icon(weavelight_app::ui::theme::icon()),
        ..Default::default()
    };
    // The graphics are opened before the window's contents are made.
    let quiet = Quiet::begin();
    let create = move |cc: &eframe::CreationContext| {
        drop(quiet);
        let app = App::new(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), settings)?;
        Ok(Box::new(app) as Box<dyn eframe::App>)
    };
    eframe::run_native(texts::TITLE, options, Box::new(create))
}
