//! Strokes of a mask: the first one counts, and none is lost, however the picture is left.

use super::bench::{self, Bench, SOLUTION};
use super::{CLOTH, SIZE};
use eframe::egui::{self, Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use std::path::Path;
use weavelight_app::model::room::Room;

fn savable(window: &bench::Window) -> bool {
    let button = window.query_by_label("Save and solve again");
    button.is_some_and(|button| !button.accesskit_node().is_disabled())
}

fn stroke(window: &mut bench::Window) {
    window.get_by_label("Brush").click();
    window.run();
    bench::drag(window, CLOTH);
}

fn settle(window: &mut bench::Window) {
    // A click is taken in by the next frame only.
    window.run();
    bench::wait(window, "everything", |window| window.state().is_idle());
    window.run();
}

#[test]
fn the_first_stroke_leaves_out_without_another_click() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    stroke(&mut window);
    assert!(savable(&window));
    // Once more at the same place nothing changes, and that is said.
    bench::drag(&mut window, CLOTH);
    window.get_by_label_contains("this is left out already");
    window.get_by_label("Keep").click();
    window.run();
    assert!(window.query_by_label_contains("already").is_none());
}

/// On slow graphics a whole stroke happens between two frames.
#[test]
fn a_stroke_within_one_frame_counts() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    window.get_by_label("Brush").click();
    window.run();
    let button = |pos, pressed| egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    let events = [
        egui::Event::PointerMoved(CLOTH[0]),
        button(CLOTH[0], true),
        egui::Event::PointerMoved(CLOTH[0] + egui::vec2(40.0, 0.0)),
        egui::Event::PointerMoved(CLOTH[1]),
        button(CLOTH[1], false),
    ];
    window.hover_at(CLOTH[0]);
    window.run();
    window.input_mut().events.extend(events);
    window.run();
    assert!(savable(&window));
}

#[test]
fn strokes_wait_while_another_solution_is_looked_at() {
    let bench = Bench::new();
    let [_, other] = bench.elsewhere();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    stroke(&mut window);
    bench::open_another(&mut window, &other);
    settle(&mut window);
    assert!(!savable(&window), "the other one has no strokes");
    bench::open_another(&mut window, &bench.solution());
    settle(&mut window);
    assert!(savable(&window));
    // Their steps are there, too.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run();
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.run();
    assert!(savable(&window));
}

#[test]
fn strokes_outlive_the_window_until_they_are_saved() {
    let bench = Bench::new();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    stroke(&mut window);
    window.state_mut().enter(Room::Scans);
    window.run();
    drop(window);
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    settle(&mut window);
    assert!(savable(&window));
    assert!(window.state().shared().problems.iter().any(|it| it.text.contains("were restored")));
    // One step, which can be undone and redone.
    window.get_by_label("Undo").click();
    window.run();
    window.get_by_label("Redo").click();
    window.run();
    window.get_by_label("Save and solve again").click();
    settle(&mut window);
    let manifest = std::fs::read_to_string(bench.scan().join("session.toml")).unwrap();
    assert!(manifest.contains("mask = \"mask.png\""), "{manifest}");
    drop(window);
    let drafts = bench.drafts();
    let left = std::fs::read_dir(&drafts).map_or(0, Iterator::count);
    assert_eq!(left, 0, "saved strokes are no draft any more");
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    settle(&mut window);
    assert!(!savable(&window));
}

#[test]
fn a_picture_that_is_not_the_scans_mask_stays() {
    let bench = Bench::new();
    std::fs::write(bench.scan().join("mask.png"), "a picture of mine").unwrap();
    let mut window = bench.look(SIZE, egui::Theme::Dark);
    stroke(&mut window);
    window.get_by_label("Save and solve again").click();
    settle(&mut window);
    let read = |name: &str| std::fs::read(bench.scan().join(name)).unwrap();
    assert_eq!(read("mask.png"), b"a picture of mine");
    let manifest = String::from_utf8(read("session.toml")).unwrap();
    assert!(manifest.contains("mask = \"mask-2.png\""), "{manifest}");
    assert!(window.state().shared().problems.is_empty());
}

#[test]
fn a_scan_is_opened_as_its_newest_solution_or_offered_to_be_solved() {
    let bench = Bench::new();
    let mut window = bench.empty(SIZE, egui::Theme::Dark);
    bench::enter_folder(&mut window, &bench.scan());
    window.get_by_label("Open").click();
    bench::wait(&mut window, "its solution", |window| window.query_by_label(SOLUTION).is_some());
    settle(&mut window);
    // Without one.
    std::fs::remove_dir_all(bench.solution()).unwrap();
    let mut window = bench.empty(SIZE, egui::Theme::Dark);
    bench::enter_folder(&mut window, &bench.scan().join("light-03.dng"));
    window.get_by_label("Open").click();
    bench::wait(&mut window, "an offer", |window| window.query_by_label("Solve it").is_some());
    window.get_by_label("Solve it").click();
    bench::wait(&mut window, "its solution", |window| window.query_by_label(SOLUTION).is_some());
    assert!(bench.solution().join("normal.exr").exists());
    // So small a picture has no reflectance: that warning is in the report, which the room shows, and no problem.
    let problems = &window.state().shared().problems;
    assert!(problems.is_empty(), "{problems:?}");
    let report = std::fs::read_to_string(bench.solution().join("report.json")).unwrap();
    assert!(report.contains("The albedo is as it appears"), "{report}");
}

#[test]
fn folders_that_are_something_else_are_told_or_used() {
    let bench = Bench::new();
    let check = |path: &Path, expected: Result<Room, &str>| {
        let mut window = bench.empty(SIZE, egui::Theme::Dark);
        bench::enter_folder(&mut window, path);
        window.get_by_label("Open").click();
        settle(&mut window);
        let desk = window.state().shared();
        match expected {
            Ok(room) => assert_eq!((desk.settings.room, desk.problems.len()), (room, 0)),
            Err(text) => {
                let problems = &desk.problems;
                assert!(problems.iter().any(|it| it.text.contains(text)), "{problems:?}");
            }
        }
    };
    let rig = bench.scan().ancestors().nth(2).unwrap().to_owned();
    check(&rig, Ok(Room::Scans));
    check(&rig.join("solutions"), Ok(Room::Scans));
    check(&rig.join("calibration"), Err("is a calibration; choose a solution or a scan"));
    check(&rig.join("nowhere"), Err("report.json"));
}
