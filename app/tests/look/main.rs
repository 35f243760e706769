//! The Look room on a small scan of the simulated rig: opened, relit, split, measured, masked and solved again.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its table up has failed")]

mod bare;
mod bench;
#[path = "../desk/names.rs"]
mod names;
mod pictures;
mod shading;
mod strokes;
mod tiles;

use bench::{Bench, SOLUTION};
use eframe::egui::{self, Key, Modifiers, pos2};
use egui_kittest::kittest::{NodeT, Queryable};
use weavelight::solution::Report;

const SIZE: [f32; 2] = [1280.0, 800.0];
/// Where the cloth is at this size.
const CLOTH: [egui::Pos2; 2] = [pos2(400.0, 300.0), pos2(700.0, 500.0)];

#[test]
fn a_lamp_is_dragged_over_the_cloth() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    let bright_at = |window: &mut bench::Window, at: egui::Pos2| {
        let picture = window.render().unwrap();
        let around = (0..81).map(|k| (at.x as u32 + 2 * (k % 9), at.y as u32 + 2 * (k / 9)));
        around.map(|(x, y)| u32::from(picture.get_pixel(x, y)[1])).sum::<u32>()
    };
    window.drag_at(CLOTH[0]);
    window.run();
    window.hover_at(CLOTH[1]);
    window.run();
    window.drop_at(CLOTH[1]);
    window.run();
    let there = [bright_at(&mut window, CLOTH[0]), bright_at(&mut window, CLOTH[1])];
    assert!(there[1] > there[0], "the lamp is at the second place: {there:?}");
    window.drag_at(CLOTH[1]);
    window.run();
    window.hover_at(CLOTH[0]);
    window.run();
    window.drop_at(CLOTH[0]);
    window.run();
    let back = [bright_at(&mut window, CLOTH[0]), bright_at(&mut window, CLOTH[1])];
    assert!(back[0] > back[1] && back[0] > there[0], "and back at the first: {back:?}");
}

/// The lamp is drawn where the hand is in the same frame, and its last move counts, even where it comes with the release.
#[test]
fn the_lamp_is_where_the_hand_is() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    // The panel beside them is drawn before the maps.
    let maps = |window: &mut bench::Window| {
        image::imageops::crop_imm(&window.render().unwrap(), 0, 100, 960, 620).to_image()
    };
    window.drag_at(CLOTH[0]);
    window.step();
    for share in [0.3, 0.7, 1.0] {
        window.hover_at(CLOTH[0] + share * (CLOTH[1] - CLOTH[0]));
        window.step();
    }
    let at_once = maps(&mut window);
    window.run();
    assert!(at_once == maps(&mut window), "the lamp lags behind the hand");
    window.drop_at(CLOTH[1]);
    window.run();
    window.remove_cursor();
    window.run();
    let dropped = maps(&mut window);
    // The same, with the last move in the frame of the release.
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    window.drag_at(CLOTH[0]);
    window.step();
    window.hover_at(CLOTH[0] + egui::vec2(20.0, 20.0));
    window.step();
    window.input_mut().events.extend([
        egui::Event::PointerMoved(CLOTH[1]),
        egui::Event::PointerButton {
            pos: CLOTH[1],
            button: egui::PointerButton::Primary,
            pressed: false,
            modifiers: Modifiers::NONE,
        },
    ]);
    window.run();
    window.remove_cursor();
    window.run();
    assert!(maps(&mut window) == dropped, "its last move is lost");
}

/// Where a frame takes long - in a test, each takes a quarter of a second - the cloth is drawn coarsely while the light is
/// dragged, much the same but for its finest detail, and finely as soon as it is let go.
#[test]
fn slow_frames_are_coarse_until_the_light_is_let_go() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    bench::drag(&mut window, [CLOTH[1], CLOTH[0]]);
    window.drag_at(CLOTH[0]);
    window.step();
    for k in 0..4 {
        window.hover_at(CLOTH[0] + egui::vec2(10.0 * k as f32, 10.0));
        window.step();
    }
    window.run();
    let coarse = window.render().unwrap();
    window.drop_at(CLOTH[0] + egui::vec2(30.0, 10.0));
    window.run();
    let fine = window.render().unwrap();
    let cloth = |picture: &image::RgbaImage| {
        let part = image::imageops::crop_imm(picture, 420, 320, 200, 160).to_image();
        part.pixels().map(|pixel| i32::from(pixel[1])).collect::<Vec<_>>()
    };
    let apart: Vec<i32> =
        cloth(&coarse).iter().zip(cloth(&fine)).map(|(a, b)| (a - b).abs()).collect();
    let mean = f64::from(apart.iter().sum::<i32>()) / apart.len() as f64;
    assert!(apart.iter().any(|apart| *apart > 0), "it was fine all the time");
    assert!(mean < 12.0, "{mean} grey values apart");
}

/// Both menus stay open while a path is written into their field with the mouse and the keys.
#[test]
fn the_menus_with_a_path_stay_open() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    let other = bench.solve_again("plain", weavelight::photometry::Method::LeastSquares);
    for (menu, there) in [("Compare with…", "Against plain"), ("Open…", "plain")] {
        window.get_by_label(menu).click();
        window.run();
        let role = egui::accesskit::Role::TextInput;
        let field = |window: &bench::Window| {
            window.query_by_role_and_label(role, "Folder of the solution").is_some()
        };
        window.get_by_role_and_label(role, "Folder of the solution").click();
        window.run();
        window.get_by_role_and_label(role, "Folder of the solution").click();
        window.run();
        assert!(field(&window), "{menu} has closed at a click");
        window.event(egui::Event::Paste(other.display().to_string()));
        window.run();
        window.key_press(Key::Enter);
        bench::wait(&mut window, "what was asked for", |window| {
            window.query_by_label(there).is_some()
        });
        window.run();
        assert!(!field(&window), "{menu} closes when it is done");
    }
    // The keyboard is in the field as soon as it is there; Escape and a click elsewhere close it.
    for way_out in [true, false] {
        window.get_by_label("Open…").click();
        window.run();
        window.event(egui::Event::Text("/tmp/x".to_owned()));
        window.run();
        assert!(window.query_all_by_value("/tmp/x").next().is_some(), "the keyboard is elsewhere");
        if way_out {
            window.key_press(Key::Escape);
            window.run();
            window.key_press(Key::Escape);
        } else {
            window.drag_at(CLOTH[0]);
            window.drop_at(CLOTH[0]);
        }
        window.run();
        assert!(window.query_by_label("Folder of the solution").is_none());
        window.get_by_label("Open…").click();
        window.run();
        window.key_press_modifiers(Modifiers::COMMAND, Key::A);
        window.key_press(Key::Backspace);
        window.run();
        window.key_press(Key::Escape);
        window.run();
        window.key_press(Key::Escape);
        window.run();
    }
}

#[test]
fn a_photosite_says_which_lights_it_rests_on() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Light);
    window.hover_at(CLOTH[0]);
    window.run();
    window.get_by_label("Loupe");
    window.drag_at(CLOTH[0]);
    window.drop_at(CLOTH[0]);
    bench::wait(&mut window, "its lights", |window| {
        window.query_all_by_label_contains("used").next().is_some()
    });
    let lights = window.query_all_by_label_contains("used").count();
    let others = ["shadow", "highlight", "clipped", "turned away"];
    let others: usize =
        others.iter().map(|why| window.query_all_by_label_contains(why).count()).sum();
    assert!(lights >= 3 && lights + others == 10, "{lights} used, {others} not");
}

#[test]
fn a_line_is_measured_and_put_away() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    window.get_by_label("Line").click();
    window.run();
    bench::drag(&mut window, CLOTH);
    window.get_by_label("Along the line");
    window.get_by_label_contains("mm from where it began");
    window.get_by_label("Close").click();
    window.run();
    assert!(window.query_by_label("Along the line").is_none());
}

#[test]
fn a_mask_is_painted_undone_saved_and_solved_with() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    // While the folder is being replaced, there is none.
    let solved = |bench: &Bench| {
        Report::read(&bench.solution().join("report.json")).map_or(u64::MAX, |report| report.solved)
    };
    let before = solved(&bench);
    window.get_by_label("Brush").click();
    window.run();
    window.get_by_label("Leave out").click();
    window.run();
    bench::drag(&mut window, CLOTH);
    // Undone and redone with the keys, and once more with the buttons.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run();
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.run();
    window.get_by_label("Undo").click();
    window.run();
    window.get_by_label("Redo").click();
    window.run();
    window.get_by_label("Save and solve again").click();
    bench::wait(&mut window, "the new solution", |_| solved(&bench) < before);
    let manifest = std::fs::read_to_string(bench.scan().join("session.toml")).unwrap();
    assert!(manifest.contains("mask = \"mask.png\""), "{manifest}");
    let left = std::fs::read_dir(bench.scan()).unwrap().map(|e| e.unwrap().file_name());
    let left: Vec<_> = left.filter(|name| name.to_string_lossy().starts_with('.')).collect();
    assert!(left.is_empty(), "{left:?} stayed");
}

#[test]
fn another_solution_is_compared() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    let other = bench.solve_again("plain", weavelight::photometry::Method::LeastSquares);
    window.get_by_label("Compare with…").click();
    window.run();
    bench::enter_folder(&mut window, &other);
    window.get_by_label("Compare").click();
    bench::wait(&mut window, "the angles", |window| {
        window.query_by_label("Against plain").is_some()
    });
    window.get_by_label("Angle between the normals");
}

#[test]
fn the_frames_of_a_solution_are_found_wherever_they_are() {
    let bench = Bench::new();
    let [scan, solution] = bench.elsewhere();
    let mut window = bench.empty(SIZE, egui::Theme::Dark);
    bench::open(&mut window, &solution);
    assert!(window.query_by_label_contains("No frames").is_none());
    let changed = "Scan or calibration changed since it was solved.";
    let solve_photosite = |window: &mut bench::Window| {
        window.drag_at(CLOTH[0]);
        window.drop_at(CLOTH[0]);
        bench::wait(window, "its lights", |window| {
            window.query_all_by_label_contains("used").next().is_some()
        });
        window.query_by_label(changed).is_some()
    };
    assert!(!solve_photosite(&mut window), "nothing has changed yet");
    // Another manifest is another scan: it is shown, and that it has changed is said.
    let manifest = std::fs::read_to_string(scan.join("session.toml")).unwrap();
    std::fs::write(scan.join("session.toml"), format!("{manifest}\n# edited\n")).unwrap();
    bench::open_another(&mut window, &solution);
    assert!(solve_photosite(&mut window), "the manifest has changed");
    // And what is not there is missed, by its path.
    std::fs::rename(&scan, scan.with_file_name("moved")).unwrap();
    bench::open_another(&mut window, &solution);
    bench::wait(&mut window, "that the frames are gone", |window| {
        window.query_by_label_contains("No frames. Its scan is no longer at").is_some()
    });
}

#[test]
fn a_preview_says_why_it_shows_no_frames() {
    let bench = Bench::new();
    let mut window = bench.empty(SIZE, egui::Theme::Dark);
    bench::open(&mut window, &bench.preview("preview"));
    window.get_by_label_contains("No frames. This is a preview at 1/2");
}

#[test]
fn lines_are_undone_in_turn_with_the_mask() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    let length = |window: &bench::Window| {
        let along = window.query_by_label_contains("mm from where it began");
        along.map(|along| {
            let node = along.accesskit_node();
            node.value().or(node.label()).unwrap_or_default()
        })
    };
    window.get_by_label("Line").click();
    window.run();
    bench::drag(&mut window, CLOTH);
    let first = length(&window);
    bench::drag(&mut window, [CLOTH[0], CLOTH[0] + egui::vec2(60.0, 0.0)]);
    let second = length(&window);
    assert!(first.is_some() && second.is_some() && first != second, "{first:?} {second:?}");
    window.get_by_label("Brush").click();
    window.run();
    window.get_by_label("Leave all out").click();
    window.run();
    let savable = |window: &bench::Window| {
        !window.get_by_label("Save and solve again").accesskit_node().is_disabled()
    };
    assert!(!savable(&window), "nothing is left to solve");
    let key = |window: &mut bench::Window, modifiers| {
        window.key_press_modifiers(modifiers, Key::Z);
        window.run();
    };
    let (undo, redo) = (Modifiers::COMMAND, Modifiers::COMMAND | Modifiers::SHIFT);
    key(&mut window, undo);
    assert!(savable(&window));
    assert_eq!(length(&window), second);
    key(&mut window, undo);
    assert_eq!(length(&window), first);
    key(&mut window, undo);
    assert_eq!(length(&window), None);
    (0..3).for_each(|_| key(&mut window, redo));
    assert_eq!(length(&window), second);
    assert!(!savable(&window));
}

#[test]
fn without_graphics_the_remedy_is_said() {
    let bench = Bench::new();
    let mut window = bench.without_graphics(SIZE, egui::Theme::Dark);
    window.get_by_label_contains("Maps cannot be drawn");
    window.get_by_label_contains("Vulkan driver");
    // The numbers are there all the same.
    window.hover_at(CLOTH[0]);
    window.run();
    window.get_by_label("Loupe");
}

#[test]
fn what_is_no_solution_is_told_with_its_remedy() {
    let bench = Bench::new();
    let mut window = bench.empty(SIZE, egui::Theme::Dark);
    let truth = bench.scan().ancestors().nth(2).unwrap().join("truth");
    bench::enter_folder(&mut window, &truth);
    window.get_by_label("Open").click();
    bench::wait(&mut window, "a problem", |window| !window.state().shared().problems.is_empty());
    window.run();
    window.get_by_label_contains("report.json");
    assert!(window.query_by_label(SOLUTION).is_none());
}
