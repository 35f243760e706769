//! The desktop app's executable; `weavelight gui` starts it.

use weavelight_app::{App, settings::Settings, texts};

fn main() -> eframe::Result {
    weavelight::machine::correct_environment();
    weavelight::files::name_settings(texts::setting);
    weavelight::machine::start();
    weavelight::files::survive_size_limits();
    let settings = Settings::load();
    let options = eframe::NativeOptions {
        viewport: weavelight_app::window::builder(&settings)
            .with_app_id("weavelight")
            .with_title(texts::TITLE)
            .with_icon(weavelight_app::theme::icon()),
        ..Default::default()
    };
    let create = move |cc: &eframe::CreationContext| {
        Ok(Box::new(App::new(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), settings))
            as Box<dyn eframe::App>)
    };
    eframe::run_native(texts::TITLE, options, Box::new(create))
}
