//! Pictures of the room at two sizes and in both themes.

use super::bench::{self, Bench};
use eframe::egui::{self, pos2};
use egui_kittest::kittest::Queryable;
use std::path::Path;

const SIZES: [[f32; 2]; 2] = [[1280.0, 800.0], [960.0, 640.0]];
const THEMES: [(egui::Theme, &str); 2] =
    [(egui::Theme::Dark, "dark"), (egui::Theme::Light, "light")];

/// A picture in every size and theme, after `act`.
fn check(
    name: &str,
    open: fn(&Bench, [f32; 2], egui::Theme) -> bench::Window,
    act: impl Fn(&mut bench::Window),
) {
    let bench = Bench::new();
    let mut results = egui_kittest::SnapshotResults::new();
    for size in SIZES {
        for (theme, theme_name) in THEMES {
            let mut window = open(&bench, size, theme);
            act(&mut window);
            window.remove_cursor();
            window.run();
            // Tiles come to the card when they are first drawn.
            window.render().unwrap();
            window.run();
            super::names::check_names(&window);
            results.add(
                window.try_snapshot(format!("look-{name}-{}x{}-{theme_name}", size[0], size[1])),
            );
        }
    }
}

#[test]
fn nothing_open_yet() {
    check("empty", Bench::empty, |_| {});
}

#[test]
fn under_a_lamp() {
    check("lamp", Bench::look, |_| {});
}

#[test]
fn a_light_beside_its_frame_with_a_photosite() {
    check("frame", Bench::look, |window| {
        window.get_by_label("Rig's lights").click();
        window.run();
        window.get_by_label("Beside its captured frame").click();
        window.run();
        bench::wait(window, "the frame", |window| window.state().is_idle());
        window.run();
        let cloth = pos2(360.0, 330.0);
        window.drag_at(cloth);
        window.drop_at(cloth);
        bench::wait(window, "its lights", |window| {
            window.query_all_by_label_contains("used").next().is_some()
        });
    });
}

#[test]
fn slopes_with_a_line_through_them() {
    check("line", Bench::look, |window| {
        choose(window, "Map", "Slope");
        window.get_by_label("Line").click();
        window.run();
        bench::drag(window, [pos2(300.0, 250.0), pos2(460.0, 330.0)]);
    });
}

#[test]
fn a_mask_being_painted() {
    let open = |bench: &Bench, size, theme| {
        // The strokes of the picture before would be back.
        let _ = std::fs::remove_dir_all(bench.drafts());
        bench.look(size, theme)
    };
    check("mask", open, |window| {
        choose(window, "Map", "Expected error");
        window.get_by_role_and_label(egui::accesskit::Role::Button, "Brush").click();
        window.run();
        window.get_by_label("Leave out").click();
        window.run();
        bench::drag(window, [pos2(300.0, 250.0), pos2(460.0, 330.0)]);
    });
}

#[test]
fn a_solution_without_its_normals() {
    check("broken", Bench::empty, |window| {
        // A path that is the same everywhere.
        bench::enter_folder(window, Path::new("tests/look/without normals"));
        window.get_by_label("Open").click();
        wait_for_problem(window, "normal.exr");
    });
}

#[test]
fn a_comparison_of_another_size() {
    let open = |bench: &Bench, size, theme| {
        let preview = bench.preview("preview");
        let mut window = bench.look(size, theme);
        window.get_by_label("Compare with…").click();
        window.run();
        bench::enter_folder(&mut window, &preview);
        window
    };
    check("other-size", open, |window| {
        window.get_by_label("Compare").click();
        wait_for_problem(window, "preview is 72 × 48 px");
    });
}

#[test]
fn no_graphics_to_draw_with() {
    check("no-graphics", Bench::without_graphics, |_| {});
}

fn wait_for_problem(window: &mut bench::Window, text: &str) {
    bench::wait(window, "a problem", |window| !window.state().shared().problems.is_empty());
    window.run();
    window.get_by_label_contains(text);
}

fn choose(window: &mut bench::Window, list: &str, entry: &str) {
    window.get_by_role_and_label(egui::accesskit::Role::ComboBox, list).click();
    window.run();
    window.get_by_label(entry).click();
    window.run();
}
