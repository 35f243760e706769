//! The order of Tab, and that what it comes to is seen.

use super::{desk, window};
use crate::desk::Window;
use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Pos2, Rect};
use egui_kittest::kittest::Queryable;
use weavelight_app::model::room::Room;

/// Presses Tab; what has the keyboard then.
fn tab(window: &mut Window) -> Option<Rect> {
    window.harness.key_press(Key::Tab);
    // What is out of sight scrolls in, which takes a few frames.
    (0..8).for_each(|_| window.harness.step());
    let id = window.harness.ctx.memory(|memory| memory.focused())?;
    Some(window.harness.ctx.read_response(id)?.rect)
}

#[test]
fn tab_goes_through_the_form_before_it_comes_to_the_button() {
    let mut window = window();
    window.enter(Room::Scan);
    let rect = |role, label: &str| window.harness.get_by_role_and_label(role, label).rect();
    let wanted = [
        rect(Role::TextInput, "Name"),
        rect(Role::SpinButton, "Thickness"),
        rect(Role::SpinButton, "ISO"),
        rect(Role::Button, "Test shot"),
        rect(Role::Button, "Scan the swatch"),
    ];
    let stops: Vec<Rect> = (0..40).filter_map(|_| tab(&mut window)).collect();
    let near = |a: &Rect, b: &Rect| a.center().distance(b.center()) < 2.0;
    let at = |rect: &Rect| stops.iter().position(|stop| near(stop, rect));
    let places: Vec<_> = wanted.iter().map(at).collect();
    assert!(places.iter().all(Option::is_some), "{places:?}: {stops:?}");
    assert!(places.is_sorted(), "{places:?}");
}

#[test]
fn a_scan_that_tab_comes_to_scrolls_into_sight() {
    let mut window = window();
    for k in 10..40 {
        window.scan_in_the_library(&format!("silk {k}"));
    }
    window.enter(Room::Scans);
    window.until_label("silk 39, not solved yet");
    let screen = Rect::from_min_size(Pos2::ZERO, desk::WIDE.into());
    let cards = |window: &Window| {
        let found = window.harness.query_all_by_role(Role::Button);
        found.map(|node| node.rect()).filter(|rect| rect.height() > 150.0).collect::<Vec<_>>()
    };
    let out_of_sight = cards(&window).iter().filter(|rect| !screen.contains_rect(**rect)).count();
    assert!(out_of_sight > 4, "there is nothing to scroll to: {out_of_sight}");
    let stops: Vec<Rect> = (0..44).filter_map(|_| tab(&mut window)).collect();
    let seen: Vec<_> = stops.iter().filter(|rect| rect.height() > 150.0).collect();
    assert!(seen.len() >= 30, "{} scans", seen.len());
    assert!(seen.iter().all(|rect| screen.contains_rect(**rect)), "{seen:?}");
}
