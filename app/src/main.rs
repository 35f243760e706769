//! The desktop app's executable; `weavelight gui` starts it.

use eframe::egui;
use weavelight_app::{App, settings::Settings, texts};

fn main() -> eframe::Result {
    weavelight::machine::start();
    weavelight::files::survive_size_limits();
    let settings = Settings::load();
    let size = settings.window_size;
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_app_id("weavelight")
            .with_title(texts::TITLE)
            .with_icon(weavelight_app::theme::icon())
            .with_inner_size(size)
            .with_min_inner_size([800.0, 560.0]),
        ..Default::default()
    };
    let create = move |cc: &eframe::CreationContext| {
        Ok(Box::new(App::new(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), settings))
            as Box<dyn eframe::App>)
    };
    eframe::run_native(texts::TITLE, options, Box::new(create))
}
