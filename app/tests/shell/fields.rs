//! Fields: numbers as people write them, paths.

use super::window;
use crate::desk::Window;
use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use weavelight_app::rooms::Room;

/// Writes into a number's field, over what stands there.
fn write(window: &mut Window, label: &str, text: &str) {
    let is_text = window.harness.query_by_role_and_label(Role::TextInput, label).is_some();
    let role = if is_text { Role::TextInput } else { Role::SpinButton };
    window.harness.get_by_role_and_label(role, label).click();
    window.harness.step();
    window.harness.step();
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.harness.step();
    window.harness.key_press(Key::Backspace);
    window.harness.event(eframe::egui::Event::Text(text.to_owned()));
    // The button above the fields sees it in the next frame.
    window.harness.step();
    window.harness.step();
}

fn enter(window: &mut Window) {
    window.harness.key_press(Key::Enter);
    window.harness.run();
}

fn thickness(window: &Window) -> f64 {
    window.harness.state().desk().settings.scan.thickness_mm
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
        write(&mut window, "Thickness", text);
        enter(&mut window);
        assert_eq!(thickness(&window), expected, "{text:?}");
        assert!(can_scan(&window));
    }
}

/// What cannot be read is said, stays in the field, and nothing is scanned with the number before it.
#[test]
#[ignore = "fails: a number written after one that could not be read is not taken; to be mended"]
fn what_is_no_length_stays_and_is_said() {
    let mut window = window();
    window.enter(Room::Scan);
    write(&mut window, "Thickness", "1,25");
    enter(&mut window);
    write(&mut window, "Thickness", "quite thin");
    assert!(!can_scan(&window), "while it is written");
    enter(&mut window);
    window.harness.get_by_label_contains("“quite thin” is not a length");
    window.harness.get_by_label_contains("A number above cannot be read");
    assert!(!can_scan(&window));
    let field = window.harness.get_by_role_and_label(Role::TextInput, "Thickness");
    assert_eq!(field.accesskit_node().value().as_deref(), Some("quite thin"));
    // Space does not get past it, either.
    window.harness.key_press(Key::Space);
    window.harness.step();
    assert!(!window.harness.state().desk().is_busy());
    write(&mut window, "Thickness", "500 mm");
    enter(&mut window);
    window.harness.get_by_label_contains("Out of range: 0 to 100 mm");
    write(&mut window, "Thickness", "2,5");
    enter(&mut window);
    assert_eq!(thickness(&window), 2.5);
    assert!(can_scan(&window));
    assert!(window.harness.query_by_label_contains("Out of range").is_none());
    // Escape gives up: what stood there before is back.
    write(&mut window, "Thickness", "x");
    enter(&mut window);
    write(&mut window, "Thickness", "y");
    window.harness.key_press(Key::Escape);
    window.harness.run();
    assert_eq!(thickness(&window), 2.5);
    assert!(can_scan(&window));
}

#[test]
fn exposures_are_fractions_too() {
    let mut window = window();
    window.enter(Room::Scan);
    window.click("find it");
    window.harness.run();
    write(&mut window, "Exposure", "1/8 s");
    enter(&mut window);
    assert_eq!(window.harness.state().desk().settings.scan.exposure_s, 0.125);
    // A field that was only visited keeps the digits that it does not show.
    write(&mut window, "Exposure", "1/60");
    enter(&mut window);
    let before = window.harness.state().desk().settings.scan.exposure_s;
    window.harness.get_by_role_and_label(Role::SpinButton, "Exposure").click();
    window.harness.run();
    enter(&mut window);
    assert_eq!(window.harness.state().desk().settings.scan.exposure_s, before);
    // An exposure that is not used does not stand in the way.
    write(&mut window, "Exposure", "long");
    enter(&mut window);
    assert!(!can_scan(&window));
    window.click("find it");
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
    window.until("it is open", |app| app.desk().place.is_some());
    assert_eq!(window.harness.state().desk().place.as_ref().unwrap().folder, rig);
}
