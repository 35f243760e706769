//! Fields: numbers as people write them, paths.

use super::window;
use crate::desk::Window;
use eframe::egui::accesskit::Role;
use eframe::egui::emath::Numeric;
use eframe::egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use weavelight_app::model::number::Unit;
use weavelight_app::model::room::Room;
use weavelight_app::ui::number::Number;
use weavelight_app::ui::widgets;

/// Writes into a number's field, over what stands there.
fn write<S>(window: &mut Harness<'_, S>, label: &str, text: &str) {
    let is_text = window.query_by_role_and_label(Role::TextInput, label).is_some();
    let role = if is_text { Role::TextInput } else { Role::SpinButton };
    window.get_by_role_and_label(role, label).click();
    window.step();
    window.step();
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.step();
    window.key_press(Key::Backspace);
    window.event(eframe::egui::Event::Text(text.to_owned()));
    window.step();
    window.step();
}

fn enter(window: &mut Window) {
    window.harness.key_press(Key::Enter);
    window.harness.run();
}

fn thickness(window: &Window) -> f64 {
    window.harness.state().shared().settings.scan.thickness_mm
}

fn can_scan(window: &Window) -> bool {
    !window.harness.get_by_label("Scan the swatch").accesskit_node().is_disabled()
}

#[test]
fn lengths_are_read_as_people_write_them() {
    let mut window = window();
    // The fonts of the system are not there in tests.
    window
        .harness
        .ctx
        .set_missing_glyph_policy(eframe::egui::epaint::text::MissingGlyphPolicy::Tofu);
    window.enter(Room::Scan);
    for (text, expected) in
        [("1,25", 1.25), ("0.4 mm", 0.4), ("900 µm", 0.9), ("", 0.0), ("３，５", 3.5)]
    {
        write(&mut window.harness, "Thickness", text);
        enter(&mut window);
        assert_eq!(thickness(&window), expected, "{text:?}");
        assert!(can_scan(&window));
    }
}

/// What cannot be read is said, stays in the field, and nothing is scanned with the number before it.
#[test]
fn what_is_no_length_stays_and_is_said() {
    let mut window = window();
    window.enter(Room::Scan);
    write(&mut window.harness, "Thickness", "1,25");
    enter(&mut window);
    write(&mut window.harness, "Thickness", "quite thin");
    assert!(!can_scan(&window), "while it is written");
    assert_eq!(thickness(&window), 1.25, "while it is written");
    enter(&mut window);
    assert_eq!(thickness(&window), 1.25);
    window.harness.get_by_label_contains("“quite thin” is not a length");
    window.harness.get_by_label_contains("A number above cannot be read");
    assert!(!can_scan(&window));
    let field = window.harness.get_by_role_and_label(Role::TextInput, "Thickness");
    assert_eq!(field.accesskit_node().value().as_deref(), Some("quite thin"));
    // Space does not get past it, either.
    window.harness.key_press(Key::Space);
    window.harness.step();
    assert!(!window.harness.state().shared().is_busy());
    write(&mut window.harness, "Thickness", "500 mm");
    enter(&mut window);
    window.harness.get_by_label_contains("Out of range: 0 to 100 mm");
    assert_eq!(thickness(&window), 1.25);
    write(&mut window.harness, "Thickness", "2,5");
    enter(&mut window);
    assert_eq!(thickness(&window), 2.5);
    assert!(can_scan(&window));
    assert!(window.harness.query_by_label_contains("Out of range").is_none());
    // Escape gives up: what stood there before is back.
    write(&mut window.harness, "Thickness", "x");
    enter(&mut window);
    write(&mut window.harness, "Thickness", "y");
    window.harness.key_press(Key::Escape);
    window.harness.run();
    assert_eq!(thickness(&window), 2.5);
    assert!(can_scan(&window));
}

/// Writes what is no number into a field, and then one: until that is read, the number before it stands.
fn keeps<N: Numeric + std::fmt::Debug>(number: Number, before: N, (text, expected): (&str, N)) {
    const NAME: &str = "Some number";
    type Field<N> = (Number, N, bool);
    let draw = |ui: &mut eframe::egui::Ui, (number, value, is_read): &mut Field<N>| {
        let label = ui.label(NAME);
        let field = number.show(ui, NAME, value);
        *is_read = field.is_read;
        field.response.labelled_by(label.id);
    };
    let mut window = Harness::new_ui_state(draw, (number, before, true));
    for unread in ["quite thin", "1,25 kg", "1 2", "9e99", "-9e99", "1,,2"] {
        write(&mut window, NAME, unread);
        assert_eq!((window.state().1, window.state().2), (before, false), "{unread:?}, written");
        window.key_press(Key::Enter);
        window.run();
        assert_eq!((window.state().1, window.state().2), (before, false), "{unread:?}, left");
        let told = |words: &str| window.query_by_label_contains(words).is_some();
        assert!(told("is not a") || told("Out of range"), "{unread:?}");
    }
    // Given up with Escape, it is as before.
    write(&mut window, NAME, text);
    window.key_press(Key::Escape);
    window.run();
    assert_eq!((window.state().1, window.state().2), (before, true), "Escape");
    // So it is where the field was left in order.
    write(&mut window, NAME, text);
    window.key_press(Key::Escape);
    window.run();
    assert_eq!((window.state().1, window.state().2), (before, true), "Escape, once more");
    write(&mut window, NAME, "x");
    window.key_press(Key::Enter);
    window.run();
    write(&mut window, NAME, text);
    window.key_press(Key::Enter);
    window.run();
    assert_eq!((window.state().1, window.state().2), (expected, true), "{text:?}");
    // What something else sets counts, whatever is written in the field.
    write(&mut window, NAME, "x");
    window.key_press(Key::Enter);
    window.run();
    window.state_mut().1 = before;
    window.run();
    assert_eq!((window.state().1, window.state().2), (before, true), "set by another");
}

#[test]
fn every_number_stands_until_another_one_is_read() {
    keeps(Number::of(Unit::Millimetres, 0.0..=100.0).unset("not measured"), 1.25, ("2,5 mm", 2.5));
    keeps(Number::of(Unit::Millimetres, 0.5..=200.0), 25.0, ("1 in", 25.4));
    keeps(Number::of(Unit::Seconds, 1e-4..=30.0).decimals(0..=4), 0.1, ("1/8", 0.125));
    keeps(Number::of(Unit::Iso, 25.0..=25_600.0), 100.0, ("ISO 400", 400.0));
    keeps(Number::of(Unit::Count, 2.0..=99.0), 9_usize, ("12", 12));
    keeps(Number::of(Unit::Days, 1.0..=3650.0), 90_i64, ("30 days", 30));
    keeps(Number::of(Unit::Share, 0.1..=1.0), 0.99, ("85 %", 0.85));
    keeps(Number::of(Unit::Degrees, 1.0..=90.0), 45.0_f32, ("30°", 30.0));
    keeps(Number::of(Unit::Stops, -4.0..=4.0), 0.3_f32, ("-1,5 EV", -1.5));
    keeps(Number::of(Unit::Pixels, 0.5..=40.0), 8.0, ("12 px", 12.0));
}

#[test]
fn a_test_shot_waits_for_numbers_that_are_read() {
    let mut window = window();
    window.enter(Room::Scan);
    let can =
        |window: &Window| !window.harness.get_by_label("Test shot").accesskit_node().is_disabled();
    assert!(can(&window));
    for field in ["ISO", "under light"] {
        write(&mut window.harness, field, "x");
        enter(&mut window);
        assert!(!can(&window), "{field}");
        write(&mut window.harness, field, "");
        enter(&mut window);
        assert!(can(&window), "{field}");
    }
}

#[test]
fn exposures_are_fractions_too() {
    let mut window = window();
    window.enter(Room::Scan);
    window.click("automatic");
    window.harness.run();
    write(&mut window.harness, "Exposure", "1/8 s");
    enter(&mut window);
    assert_eq!(window.harness.state().shared().settings.scan.exposure_s, 0.125);
    // A field that was only visited keeps the digits that it does not show.
    write(&mut window.harness, "Exposure", "1/60");
    enter(&mut window);
    let before = window.harness.state().shared().settings.scan.exposure_s;
    window.harness.get_by_role_and_label(Role::SpinButton, "Exposure").click();
    window.harness.run();
    enter(&mut window);
    assert_eq!(window.harness.state().shared().settings.scan.exposure_s, before);
    // An exposure that is not used does not stand in the way.
    write(&mut window.harness, "Exposure", "long");
    enter(&mut window);
    assert!(!can_scan(&window));
    window.click("automatic");
    window.harness.run();
    assert!(can_scan(&window));
}

#[test]
fn enter_opens_the_path_that_was_written() {
    let mut window = Window::new(crate::desk::WIDE, eframe::egui::Theme::Dark);
    window.open_small_rig();
    let rig = window.rig();
    window.enter(Room::Rig);
    window.click("Open another rig");
    window.until_label("Folder of the rig");
    window.harness.get_by_role_and_label(Role::TextInput, "Folder of the rig").click();
    window.harness.step();
    let uri = format!("file://{}", rig.display());
    window.harness.event(eframe::egui::Event::Paste(uri));
    window.harness.step();
    window.harness.key_press(Key::Enter);
    window.until("it is open", |app| app.shared().project.is_some());
    assert_eq!(window.harness.state().shared().project.as_ref().unwrap().folder, rig);
}

#[test]
fn enter_exports_to_the_path_that_was_written() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    window.enter(Room::Scans);
    window.click("silk 12, not solved yet");
    window.click("Solve");
    window.until_label("silk 12, solved");
    window.harness.get_by_role_and_label(Role::TextInput, "Export the maps to").focus();
    window.harness.run();
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.harness.step();
    let to = window.home().join("my maps");
    window.harness.event(eframe::egui::Event::Paste(format!("'{}'", to.display())));
    window.harness.step();
    window.harness.key_press(Key::Enter);
    window.harness.step();
    window.idle();
    assert!(to.join("normal.exr").exists());
    // The same key has not opened the scan.
    assert_eq!(window.harness.state().shared().settings.room, Room::Scans);
}

/// The chart's field, too: each of them is this one.
#[test]
fn a_path_becomes_what_its_writer_means() {
    let draw = |ui: &mut eframe::egui::Ui, (text, entered): &mut (String, bool)| {
        let label = ui.label("Some path");
        let field = widgets::path_field(ui, label.id, text, 200.0);
        *entered |= widgets::entered(ui, &field);
    };
    let home = std::env::home_dir().unwrap().join("maps").display().to_string();
    for (written, meant) in [
        ("~/maps", home.as_str()),
        ("file:///maps/of%20silk", "/maps/of silk"),
        ("'/maps/of silk'", "/maps/of silk"),
        ("maps", "maps"),
        ("", ""),
    ] {
        let mut window = Harness::new_ui_state(draw, (String::new(), false));
        window.get_by_role_and_label(Role::TextInput, "Some path").focus();
        window.run();
        window.event(eframe::egui::Event::Text(written.to_owned()));
        window.run();
        assert_eq!(*window.state(), (written.to_owned(), false), "while it is written");
        window.key_press(Key::Enter);
        window.run();
        assert_eq!(*window.state(), (meant.to_owned(), true));
    }
}
