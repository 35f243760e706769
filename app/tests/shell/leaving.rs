//! Escape and the ways out.

use super::{desk, window};
use crate::desk::Window;
use eframe::egui::{self, Key, ViewportCommand, ViewportEvent, ViewportId};
use egui_kittest::kittest::Queryable;
use weavelight_app::model::room::Room;
use weavelight_app::ui::questions::Question;

/// A scan under way.
fn scanning() -> Window {
    let mut window = window();
    window.enter(Room::Scan);
    window.click("Scan the swatch");
    window.until_label("Light 0, taken");
    window
}

fn escape(window: &mut Window) {
    window.harness.key_press(Key::Escape);
    window.harness.step();
    window.harness.step();
}

fn question(window: &Window) -> Option<&Question> {
    window.harness.state().question()
}

/// A scan that is still under way, however small.
fn paused(window: &mut Window) {
    window.until("its buttons are there", |_| true);
    window.click("Pause");
    window.until_label("Continue");
}

#[test]
fn escape_leaves_a_field_before_it_asks_about_the_scan() {
    let mut window = scanning();
    paused(&mut window);
    window.enter(Room::Scans);
    let search = window.harness.get_by_role(egui::accesskit::Role::TextInput);
    search.click();
    window.harness.step();
    window.harness.get_by_role(egui::accesskit::Role::TextInput).type_text("silk");
    window.harness.step();
    escape(&mut window);
    assert_eq!(question(&window), None, "Escape has left the field");
    // A menu that is open is closed by it.
    window.click("View");
    window.until_label("Dark");
    escape(&mut window);
    assert_eq!(question(&window), None, "Escape has closed the menu");
    assert!(window.harness.query_by_label("Dark").is_none());
    // Only now it means the scan, and asks.
    escape(&mut window);
    assert_eq!(question(&window), Some(&Question::StopScan));
    escape(&mut window);
    assert_eq!(question(&window), None, "Escape is no");
    assert!(window.harness.state().shared().is_busy(), "the scan goes on");
    escape(&mut window);
    window.click("Stop the scan");
    window.until("it is stopped", |app| app.is_idle());
    assert_eq!(question(&window), None);
    window.enter(Room::Scan);
    window.until_label("Continue scan");
}

#[test]
fn a_question_about_a_scan_goes_with_the_scan() {
    let mut window = scanning();
    escape(&mut window);
    assert_eq!(question(&window), Some(&Question::StopScan));
    // Keys that scan behind it do nothing.
    window.until_label("Look closer");
    window.harness.step();
    assert_eq!(question(&window), None);
}

fn close(window: &mut Window) -> Vec<ViewportCommand> {
    let input = window.harness.input_mut();
    input.viewports.entry(ViewportId::ROOT).or_default().events.push(ViewportEvent::Close);
    window.harness.step();
    let commands = commands(window);
    window.harness.input_mut().viewports.entry(ViewportId::ROOT).or_default().events.clear();
    commands
}

fn commands(window: &Window) -> Vec<ViewportCommand> {
    let output = window.harness.output();
    output
        .viewport_output
        .get(&ViewportId::ROOT)
        .map(|root| root.commands.clone())
        .unwrap_or_default()
}

#[test]
fn closing_asks_while_it_scans_and_stops_the_scan_first() {
    let mut window = scanning();
    paused(&mut window);
    assert!(close(&mut window).contains(&ViewportCommand::CancelClose));
    assert_eq!(question(&window), Some(&Question::QuitWhileScanning));
    window.click("Keep scanning");
    window.harness.step();
    assert_eq!(question(&window), None);
    assert!(window.harness.state().shared().is_busy());
    assert!(close(&mut window).contains(&ViewportCommand::CancelClose));
    window.click("Stop and quit");
    let begun = std::time::Instant::now();
    while !commands(&window).contains(&ViewportCommand::Close) {
        assert!(begun.elapsed() < std::time::Duration::from_secs(60), "it does not close");
        window.harness.step();
    }
    assert!(window.harness.state().is_idle(), "it closes when the work has ended");
    assert!(!close(&mut window).contains(&ViewportCommand::CancelClose), "and now it may");
    // What was taken is whole, and can be continued.
    let scan = window.rig().join("scans/linen 1");
    let session = weavelight::session::Session::load(&scan).unwrap();
    assert!(!session.frames.is_empty());
    for frame in &session.frames {
        session.read_frame(frame).unwrap();
    }
}

#[test]
fn control_q_closes_at_once_where_nothing_is_going_on() {
    let mut window = Window::new(desk::SMALL, egui::Theme::Light);
    window.harness.run();
    // What it commands is said in that frame only.
    window.harness.input_mut().events.push(egui::Event::Key {
        key: Key::Q,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: egui::Modifiers::COMMAND,
    });
    window.harness.step();
    assert!(commands(&window).contains(&ViewportCommand::Close));
    assert!(!close(&mut window).contains(&ViewportCommand::CancelClose));
}
