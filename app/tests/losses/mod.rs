//! Nothing that was captured, solved or exported is lost by a click.

use super::desk::{self, Window};
use eframe::egui::{self, Key, Modifiers, accesskit::Role};
use egui_kittest::kittest::{NodeT, Queryable};
use std::path::{Path, PathBuf};
use weavelight_app::model::room::Room;
use weavelight_app::model::settings::Settings;

fn window() -> Window {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.open_small_rig();
    window
}

fn named(name: &'static str) -> Window {
    let named = |settings: &mut Settings| settings.scan.name = name.into();
    let mut window = Window::with(desk::WIDE, egui::Theme::Dark, named);
    window.open_small_rig();
    window
}

/// Scans what the form says, and waits for its solution.
fn scan(window: &mut Window, button: &str) {
    window.enter(Room::Scan);
    window.click(button);
    window.until_label("Stop");
    window.until_label("Look closer");
    window.idle();
}

fn type_into(window: &mut Window, label: &str, text: &str) {
    let field = window.harness.get_by_role_and_label(Role::TextInput, label);
    field.focus();
    field.type_text(text);
    window.harness.run();
}

/// What says which scan, and which solution, stands in a folder.
fn identity(rig: &Path, name: &str) -> [Vec<u8>; 2] {
    ["scans", "solutions"].map(|kind| {
        let file = if kind == "scans" { "session.toml" } else { "normal.exr" };
        std::fs::read(rig.join(kind).join(name).join(file)).unwrap_or_default()
    })
}

fn empty_the_bin(home: &Path) {
    let ours = |item: &trash::TrashItem| item.original_parent.starts_with(home);
    let items = trash::os_limited::list().unwrap().into_iter().filter(ours);
    trash::os_limited::purge_all(items).unwrap();
}

#[test]
fn scan_again_is_about_the_scan_that_is_shown_and_undone_as_a_whole() {
    let mut window = window();
    window.scan_in_the_library("other");
    let rig = window.rig();
    let other = identity(&rig, "other");
    scan(&mut window, "Scan the swatch");
    let first = identity(&rig, "linen 1");
    // The name of the next swatch is written already.
    type_into(&mut window, "Name", "23");
    assert_eq!(window.harness.state().shared().settings.scan.name, "linen 123");
    scan(&mut window, "Scan again");
    let second = identity(&rig, "linen 1");
    assert!(first[0] != second[0], "it was taken again");
    assert_eq!(identity(&rig, "other"), other);
    assert!(!rig.join("scans/linen 123").exists());
    for (expected, what) in [(&first, "the first"), (&second, "the second")] {
        window.click("Undo");
        window.idle();
        assert!(identity(&rig, "linen 1") == *expected, "{what} is back, scan and solution");
        window.until_label("Look closer");
        window.until_label("Light 9, taken");
    }
    // So small a picture has no reflectance, which its report says.
    let problems = &window.harness.state().shared().problems;
    let about = |text: &str| text.contains("The albedo is as it appears");
    assert!(problems.iter().all(|problem| about(&problem.text)), "{problems:?}");
    empty_the_bin(&window.home());
}

#[test]
fn names_that_one_folder_cannot_hold_are_two_scans() {
    let mut window = named("a/b");
    let rig = window.rig();
    scan(&mut window, "Scan the swatch");
    assert!(rig.join("scans/a%2Fb/session.toml").exists());
    let before = identity(&rig, "a%2Fb");
    let manifest = String::from_utf8(before[0].clone()).unwrap();
    assert!(manifest.contains("name = \"a/b\""), "{manifest}");
    window.enter(Room::Scans);
    window.until_label("a/b, solved");
    window.click("a/b, solved");
    window.click("Export");
    window.idle();
    assert!(window.home().join("exports/a%2Fb maps/normal.exr").exists());
    drop(window);
}

#[test]
fn an_export_never_takes_the_place_of_anything() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    window.enter(Room::Scans);
    window.click("silk 12, not solved yet");
    window.click("Solve");
    window.until_label("silk 12, solved");
    window.click("Export");
    window.idle();
    let exports = window.home().join("exports");
    let first = exports.join("silk 12 maps");
    std::fs::write(first.join("report.json"), "mine").unwrap();
    window.click("Export");
    window.idle();
    window.until_label(&format!("Exported to {}", exports.join("silk 12 maps 2").display()));
    assert_eq!(std::fs::read_to_string(first.join("report.json")).unwrap(), "mine");
    // A folder with other content, and the solution itself.
    let check = |window: &mut Window, to: &Path, expected: Result<PathBuf, &str>| {
        let field = window.harness.get_by_role_and_label(Role::TextInput, "Export the maps to");
        field.focus();
        window.harness.run();
        window.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        window.harness.run();
        type_into(window, "Export the maps to", &to.display().to_string());
        window.click("Export");
        window.idle();
        match expected {
            Ok(made) => assert!(made.join("normal.exr").exists(), "{}", made.display()),
            Err(text) => {
                let problems = &window.harness.state().shared().problems;
                assert!(problems.iter().any(|it| it.text.contains(text)), "{problems:?}");
            }
        }
    };
    let solution = window.rig().join("solutions/silk 12");
    check(&mut window, &exports, Ok(window_exports(&exports)));
    check(&mut window, &solution.join("copy"), Err("lies in the solution itself"));
    check(&mut window, &solution, Err("lies in the solution itself"));
    check(&mut window, Path::new("maps"), Err("is a relative path"));
    assert!(!solution.join("copy").exists());
}

fn window_exports(exports: &Path) -> PathBuf {
    exports.with_file_name("exports 2")
}

#[test]
fn what_the_search_hides_is_not_acted_on() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    window.scan_in_the_library("wool 7");
    window.enter(Room::Scans);
    window.click("wool 7, not solved yet");
    window.until_label("Delete “wool 7”");
    let search = window.harness.get_by_role(Role::TextInput);
    search.focus();
    search.type_text("silk");
    window.harness.run();
    assert!(window.harness.query_by_label("Delete “wool 7”").is_none());
    // Enter chooses what is found, and leaves the field; Delete is about that.
    window.harness.key_press(Key::Enter);
    window.harness.run();
    window.until_label("Delete “silk 12”");
    assert_eq!(window.harness.state().shared().settings.room, Room::Scans, "nothing is opened");
    window.harness.key_press(Key::Delete);
    window.harness.run();
    window.idle();
    assert!(window.rig().join("scans/wool 7").exists());
    assert!(!window.rig().join("scans/silk 12").exists());
    // Escape empties the search.
    let search = window.harness.get_by_role(Role::TextInput);
    search.focus();
    window.harness.run();
    window.harness.key_press(Key::Escape);
    window.harness.run();
    window.until_label("wool 7, not solved yet");
    window.click("Undo");
    window.until_label("silk 12, not solved yet");
    empty_the_bin(&window.home());
}

#[test]
fn solving_what_is_up_to_date_says_so() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    window.enter(Room::Scans);
    window.click("silk 12, not solved yet");
    window.click("Solve");
    window.until_label("silk 12, solved");
    window.idle();
    let report = window.rig().join("solutions/silk 12/report.json");
    let made = || std::fs::metadata(&report).unwrap().modified().unwrap();
    let first = made();
    window.click("Solve again");
    window.click("Solve anyway");
    window.idle();
    assert!(made() > first, "it was solved again");
    assert!(window.harness.query_by_label_contains("Up to date").is_none());
    // This room's solutions are no business of the Scan room.
    window.enter(Room::Scan);
    assert!(window.harness.query_by_label("Scan again").is_none());
}

#[test]
fn frames_that_were_there_show_when_a_scan_goes_on() {
    let mut window = window();
    window.killed_scan("linen 1", 5);
    window.open_small_rig();
    window.enter(Room::Scan);
    let there: Vec<String> = (0..10).map(|light| format!("Light {light}, taken")).collect();
    window.click("Continue scan");
    window.until_label("Stop");
    window.until_label(&there[2]);
    window.until_label("Look closer");
    window.idle();
    for label in &there {
        assert!(window.harness.query_by_label(label).is_some(), "{label}");
    }
}

#[test]
fn frames_that_are_gone_are_not_counted() {
    let mut window = window();
    window.killed_scan("linen 1", 6);
    let scan = window.rig().join("scans/linen 1");
    let session = weavelight::session::Session::load(&scan).unwrap();
    for frame in &session.frames[..4] {
        std::fs::remove_file(scan.join(&frame.file)).unwrap();
    }
    window.open_small_rig();
    window.enter(Room::Scan);
    window.until_label("“linen 1” was stopped after 2 frames. Continue it?");
}

#[test]
fn look_shows_the_last_scan_unless_another_is_to_stay() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    window.enter(Room::Scans);
    window.click("silk 12, not solved yet");
    window.click("Solve");
    window.until_label("silk 12, solved");
    window.click("Open");
    window.until_label("Brush");
    let shown = |window: &Window, name: &str| {
        window.harness.query_all_by_label(name).any(|it| it.accesskit_node().role() == Role::Label)
    };
    assert!(shown(&window, "silk 12"));
    scan(&mut window, "Scan the swatch");
    window.enter(Room::Look);
    window.idle();
    assert!(shown(&window, "linen 1"), "the last one");
    window.click("Open…");
    window.click("Keep this one open");
    window.harness.key_press(Key::Escape);
    window.enter(Room::Scan);
    window.click("Next swatch");
    scan(&mut window, "Scan the swatch");
    window.enter(Room::Look);
    window.idle();
    assert!(shown(&window, "linen 1"), "it is to stay");
    window.click("Show it");
    window.idle();
    assert!(shown(&window, "linen 2"));
}

#[test]
fn whatever_is_dropped_is_used_for_what_it_is() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    let rig = window.rig();
    let drop_on = |window: &mut Window, path: &Path, expected: Result<Room, &str>| {
        window.enter(Room::Rig);
        window
            .harness
            .state_mut()
            .request(weavelight_app::jobs::messages::Request::Dropped(path.to_owned()));
        window.idle();
        window.idle();
        let desk = window.harness.state().shared();
        match expected {
            Ok(room) => assert_eq!(desk.settings.room, room, "{}", path.display()),
            Err(text) => {
                assert!(
                    desk.problems.iter().any(|it| it.text.contains(text)),
                    "{:?}",
                    desk.problems
                );
            }
        }
    };
    drop_on(&mut window, &rig.join("calibration"), Ok(Room::Calibrate));
    drop_on(&mut window, &rig.join("calibration/lights.toml"), Ok(Room::Calibrate));
    drop_on(&mut window, &rig, Ok(Room::Rig));
    drop_on(&mut window, &rig.join("scans/silk 12"), Ok(Room::Scan));
    assert!(rig.join("solutions/silk 12/report.json").exists());
    drop_on(&mut window, &rig.join("solutions/silk 12/normal.exr"), Ok(Room::Look));
    let pictures = window.home().join("pictures");
    std::fs::create_dir(&pictures).unwrap();
    drop_on(&mut window, &pictures, Err("pictures is not a rig (rig.toml), scan"));
    // A scan of the same name from elsewhere gets a solution of its own.
    let before = identity(&rig, "silk 12");
    let elsewhere = window.home().join("usb/silk 12");
    copy(&rig.join("scans/silk 12"), &elsewhere);
    drop_on(&mut window, &elsewhere, Ok(Room::Scan));
    assert!(rig.join("solutions/silk 12~2/report.json").exists());
    assert!(identity(&rig, "silk 12") == before);
    assert!(window.harness.query_by_label("Scan again").is_none(), "it is not this rig's");
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for file in std::fs::read_dir(from).unwrap().flatten() {
        std::fs::copy(file.path(), to.join(file.file_name())).unwrap();
    }
}

/// A lock as another process holds it.
fn held_by_another(file: &Path) -> std::fs::File {
    std::fs::write(file, "program = \"weavelight 0.1.0\"\npurpose = \"rig\"\npid = 1\n").unwrap();
    let lock = std::fs::File::options().read(true).write(true).open(file).unwrap();
    lock.lock().unwrap();
    lock
}

#[test]
fn a_rig_that_another_program_holds_is_looked_at_until_it_is_free() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    let lock = held_by_another(&window.rig().join(".rig.toml.weavelight-lock"));
    window.until("it is held", |app| app.shared().held_by.is_some());
    window.enter(Room::Scan);
    window.harness.get_by_label_contains("in use by weavelight 0.1.0 (rig, process 1)");
    let disabled = |window: &Window, label: &str| {
        window.harness.get_by_label(label).accesskit_node().is_disabled()
    };
    assert!(disabled(&window, "Scan the swatch") && disabled(&window, "Test shot"));
    window.enter(Room::Scans);
    window.click("silk 12, not solved yet");
    window.until_label("Delete “silk 12”");
    assert!(disabled(&window, "Delete “silk 12”") && disabled(&window, "Solve"));
    window.harness.key_press(Key::Delete);
    window.idle();
    assert!(window.rig().join("scans/silk 12").exists());
    drop(lock);
    window.until("it is free", |app| app.shared().held_by.is_none());
    scan(&mut window, "Scan the swatch");
    assert!(window.rig().join("solutions/linen 1/normal.exr").exists());
}

#[test]
fn a_scan_that_another_program_takes_is_not_deleted() {
    let mut window = window();
    window.scan_in_the_library("silk 12");
    let folder = window.rig().join("scans/silk 12");
    let lock = held_by_another(&folder.join(".weavelight-lock"));
    window.enter(Room::Scans);
    window.click("silk 12, not solved yet");
    window.click("Delete “silk 12”");
    window.idle();
    let problems = &window.harness.state().shared().problems;
    assert!(problems.iter().any(|it| it.text.contains("is in use by weavelight")), "{problems:?}");
    assert!(folder.join("session.toml").exists());
    drop(lock);
}
