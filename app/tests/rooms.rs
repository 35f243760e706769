//! The window's rooms, drawn and used.

use eframe::egui;
use egui_kittest::{Harness, kittest::Queryable};
use weavelight_app::{App, settings::Settings};

fn window(folder: &std::path::Path, size: [f32; 2], theme: egui::Theme) -> Harness<'static, App> {
    let mut settings = Settings::load_from(&folder.join("settings.toml"));
    settings.home = folder.to_owned();
    Harness::builder()
        .with_size(size)
        .with_theme(theme)
        .with_max_steps(64)
        .build_eframe(move |cc| App::new(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), settings))
}

#[test]
fn a_first_start_offers_a_simulated_rig() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = window(folder.path(), [1280.0, 800.0], egui::Theme::Dark);
    window.run();
    window.get_by_label("Try it with a simulated rig").click();
    for _ in 0..600 {
        window.step();
        if window.state().desk().place.is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(folder.path().join("simulated rig/rig.toml").exists());
    window.run();
    window.get_by_label("simulated rig");
}
