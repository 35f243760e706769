//! The window around the rooms: keys, questions, problems, fields, focus.

mod fields;
mod leaving;
mod tabs;

use super::desk::{self, Window};
use eframe::egui::{self, Key, Rect};
use egui_kittest::kittest::Queryable;
use weavelight_app::jobs::messages::Request;
use weavelight_app::jobs::messages::Update;
use weavelight_app::model::problem::Problem;
use weavelight_app::model::room::Room;

fn window() -> Window {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.open_small_rig();
    window
}

fn rect_of(window: &Window, label: &str) -> Rect {
    window.harness.get_by_label(label).rect()
}

/// A problem lies over the window: nothing that is drawn moves for it, all of it can be read, and it can be copied.
#[test]
fn a_problem_moves_nothing_and_can_be_read() {
    let mut window = window();
    window.enter(Room::Scan);
    let places = |window: &Window| {
        [
            "Name",
            "Scan the swatch",
            "Light 3, waiting",
            "Lay the swatch on the table and press Space",
        ]
        .map(|label| rect_of(window, label))
    };
    let before = places(&window);
    let long = "The light board does not answer. ".repeat(20);
    for k in 0..5 {
        let text = format!("{k}: {long}");
        window.harness.state_mut().hear(Update::Problem(Problem::error("Scan", text)));
    }
    window.harness.run();
    assert_eq!(places(&window), before);
    let newest = window.harness.get_by_label_contains("4: The light board");
    let screen = Rect::from_min_size(egui::Pos2::ZERO, desk::WIDE.into());
    let text = newest.rect();
    assert!(screen.contains_rect(text), "{text:?}");
    // Whole, with its buttons.
    let dismiss = window.harness.get_all_by_label("Dismiss").next().unwrap().rect();
    assert!(dismiss.top() > text.bottom());
    let copy = window.harness.get_all_by_label("Copy").next().unwrap().rect().center();
    window.harness.drag_at(copy);
    window.harness.step();
    // What is copied is said in the frame of the release only.
    window.harness.input_mut().events.push(egui::Event::PointerButton {
        pos: copy,
        button: egui::PointerButton::Primary,
        pressed: false,
        modifiers: egui::Modifiers::NONE,
    });
    window.harness.step();
    let text = &window.harness.state().shared().problems.last().unwrap().text;
    let expected = format!("Scan failed: {text}");
    let copied = &window.harness.output().platform_output.commands;
    assert!(
        copied.iter().any(|command| matches!(command,
            egui::OutputCommand::CopyText(text) if *text == expected)),
        "{copied:?}"
    );
    // Hidden, they are a button; the next one shows them again.
    window.click("Hide");
    window.harness.run();
    assert!(window.harness.query_by_label_contains("4: The light board").is_none());
    window.harness.get_by_label("5 problems");
    window.harness.state_mut().hear(Update::Problem(Problem::error("Scan", "6: another")));
    window.harness.run();
    window.harness.get_by_label("6: another");
    window.click("Dismiss all");
    window.harness.run();
    assert!(window.harness.query_by_label("Problems").is_none());
}

/// An error stays until the next try shows that its cause is gone, not longer; one of another kind stays.
#[test]
fn an_error_goes_with_its_cause() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.harness.run();
    window.harness.state_mut().request(Request::Open("/no/such/rig".into()));
    window.until("it is told", |app| app.shared().problems.len() == 1);
    window.harness.state_mut().hear(Update::Problem(Problem::error("Scan", "of another kind")));
    window.open_small_rig();
    let problems = &window.harness.state().shared().problems;
    let titles: Vec<_> = problems.iter().map(|problem| problem.title.as_str()).collect();
    assert_eq!(titles, ["Scan"]);
}

/// Every control that Tab stops at shows that it has the keyboard, in either theme, and the stops go round.
#[test]
fn what_has_the_keyboard_is_seen() {
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        let mut window = Window::new(desk::WIDE, theme);
        window.open_small_rig();
        window.scan_in_the_library("silk 12");
        for room in [Room::Rig, Room::Scan, Room::Scans] {
            window.enter(room);
            window.idle();
            let stops = stops(&mut window, theme);
            assert!(stops.len() > 5, "{room:?}: {stops:?}");
        }
    }
}

/// Presses Tab until it comes back to where it began; each stop has its ring.
fn stops(window: &mut Window, theme: egui::Theme) -> Vec<Rect> {
    let color = weavelight_app::ui::theme::focus(theme);
    let mut stops: Vec<Rect> = Vec::new();
    for _ in 0..80 {
        window.harness.key_press(Key::Tab);
        // What is out of sight scrolls in, which takes a few frames.
        (0..8).for_each(|_| window.harness.step());
        let id = window.harness.ctx.memory(|memory| memory.focused());
        let Some(rect) = id.and_then(|id| window.harness.ctx.read_response(id)).map(|r| r.rect)
        else {
            continue;
        };
        if stops.first() == Some(&rect) {
            break;
        }
        stops.push(rect);
        let picture = window.harness.render().unwrap();
        let ring = rect.expand(4.0);
        let near = |at: f32, most: u32| (at.max(0.0) as u32).min(most - 1);
        let (width, height) = picture.dimensions();
        let rows = near(ring.top(), height)..=near(ring.bottom(), height);
        let [r, g, b, _] = color.to_array();
        let seen = rows.flat_map(|y| {
            (near(ring.left(), width)..=near(ring.right(), width)).map(move |x| (x, y))
        });
        let seen = seen.filter(|(x, y)| picture.get_pixel(*x, *y).0[..3] == [r, g, b]).count();
        assert!(seen as f32 > rect.width(), "{theme:?}: no ring around {rect:?}: {seen} pixels");
    }
    stops
}

/// A double click on *Scan* is one click: *Stop* appears under it.
#[test]
fn a_double_click_on_scan_stops_nothing() {
    let mut window = window();
    window.enter(Room::Scan);
    let button = rect_of(&window, "Scan the swatch");
    // Where Stop will be.
    let at = button.left_center() + egui::vec2(180.0, 0.0);
    for _ in 0..2 {
        window.harness.drag_at(at);
        window.harness.drop_at(at);
        window.harness.step();
    }
    let stop = rect_of(&window, "Stop");
    assert!(stop.contains(at), "{stop:?} is not under the mouse");
    window.until_label("Light 3, taken");
    window.until_label("Look closer");
}

/// A key that is held down scans once.
#[test]
fn a_held_space_bar_scans_once() {
    let mut window = window();
    window.enter(Room::Scan);
    let press = |window: &mut Window, repeat| {
        window.harness.event(egui::Event::Key {
            key: Key::Space,
            physical_key: None,
            pressed: true,
            repeat,
            modifiers: egui::Modifiers::NONE,
        });
        window.harness.step();
    };
    press(&mut window, false);
    window.until("it scans", |app| app.shared().is_busy());
    window.until("it is done", |app| app.is_idle());
    for _ in 0..20 {
        press(&mut window, true);
    }
    assert!(window.harness.state().is_idle());
    window.harness.get_by_label("Next swatch");
}

/// Whatever the alphabet, a name is drawn without a stumble.
#[test]
fn names_of_every_script_are_drawn() {
    let mut window = window();
    // The fonts of the system are not there in tests; boxes are what is left.
    window.harness.ctx.set_missing_glyph_policy(egui::epaint::text::MissingGlyphPolicy::Tofu);
    for name in [
        "麻布 4021",
        "リネン",
        "리넨",
        "льон",
        "كتان ١٢",
        "פשתן",
        "ผ้าลินิน",
        "🧵 thread 👩‍🔬",
        "e\u{301}\u{302}\u{303}",
        "\u{202e}desrever",
        "a\u{0}b\u{7}",
        &"\u{fdfd}".repeat(300),
    ] {
        let form = window.harness.state_mut();
        form.shared_mut().settings.scan.name = name.to_owned();
        window.enter(Room::Scan);
        window.harness.run();
        window.harness.state_mut().hear(Update::Problem(Problem::warning(name, name)));
        window.harness.run();
    }
    assert_eq!(window.harness.state().shared().problems.len(), 12);
}

/// The list of maps shows all nine at once.
#[test]
fn a_list_shows_all_that_it_has() {
    let mut window = window();
    window.enter(Room::Scan);
    window.harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "On the table").click();
    window.harness.run();
    let screen = Rect::from_min_size(egui::Pos2::ZERO, desk::WIDE.into());
    for preset in weavelight_sim::cloth::Preset::ALL {
        let entries = window.harness.query_all_by_label(preset.name());
        let lowest =
            entries.map(|entry| entry.rect()).max_by(|a, b| a.bottom().total_cmp(&b.bottom()));
        assert!(lowest.is_some_and(|rect| screen.contains_rect(rect)), "{}", preset.name());
    }
}

/// In the smallest window - a screen of 1280 x 800 at 200 % - what each room is about can be reached.
#[test]
fn the_smallest_window_can_be_used() {
    let size = [640.0, 400.0];
    let screen = Rect::from_min_size(egui::Pos2::ZERO, size.into());
    let mut window = Window::new(size, egui::Theme::Dark);
    window.harness.run();
    assert!(screen.contains_rect(rect_of(&window, "Try it with a simulated rig")));
    window.open_small_rig();
    for (room, controls) in [
        (Room::Rig, ["Look for board and camera", "Test each"]),
        (Room::Calibrate, ["View", "Scans"]),
        (Room::Scan, ["Scan the swatch", "Name"]),
        (Room::Look, ["Go to the scans", "Open"]),
        (Room::Scans, ["Scan the first swatch", "View"]),
    ] {
        window.enter(room);
        window.idle();
        for control in controls {
            let found = window.harness.query_all_by_label(control).map(|node| node.rect());
            let found: Vec<_> = found.collect();
            assert!(
                found.iter().any(|rect| screen.contains_rect(*rect)),
                "{room:?}: {control} is at {found:?}"
            );
        }
    }
    // The menu is longer than the window: it scrolls.
    window.click("View");
    window.harness.run();
    assert!(screen.contains_rect(rect_of(&window, "Dark")));
}
