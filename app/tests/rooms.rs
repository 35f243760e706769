//! The window's rooms, drawn and used: the real worker, the real library, the simulated board and camera.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its table up has failed")]

mod desk;
mod losses;
mod shell;
mod wizard;

use desk::{Window, both_themes};
use eframe::egui;
use egui_kittest::kittest::Queryable;
use weavelight_app::jobs::messages::Request;
use weavelight_app::model::room::Room;
use weavelight_app::model::settings::Settings;

#[test]
fn a_first_start_offers_a_simulated_rig() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.harness.run();
    window.click("Try it with a simulated rig");
    window.until("the rig is open", |app| app.shared().project.is_some());
    assert!(window.home().join("simulated rig/rig.toml").exists());
    assert!(
        !window.home().join("simulated rig/calibration").exists(),
        "calibrating is the user's first task"
    );
}

#[test]
fn a_folder_without_a_rig_is_told_with_a_remedy() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.harness.run();
    let field = window.harness.get_by_label("Folder of the rig");
    field.focus();
    field.type_text("/no/such/rig");
    window.harness.run();
    window.click("Open");
    window.until("a problem is shown", |app| !app.shared().problems.is_empty());
    window.harness.run();
    window.click("Dismiss");
    window.harness.run();
    assert!(window.harness.state().shared().problems.is_empty());
}

#[test]
fn welcome_looks_as_it_did() {
    both_themes("welcome", |_| {});
}

#[test]
fn the_rig_is_drawn_and_its_lights_are_lit() {
    both_themes("rig", |window| {
        window.open_small_rig();
        window.enter(Room::Rig);
        window.click("Light 3");
        window.until_label("Light 3, on");
        window.click("Look for board and camera");
        window.idle();
    });
}

#[test]
fn a_scan_goes_from_click_to_maps() {
    both_themes("scanned", |window| {
        window.open_small_rig();
        window.enter(Room::Scan);
        window.click("Scan the swatch");
        window.until_label("Look closer");
        window.idle();
        let home = window.rig();
        assert!(home.join("scans/linen 1/session.toml").exists());
        assert!(home.join("solutions/linen 1/normal.exr").exists());
    });
}

#[test]
fn a_test_shot_shows_exposure_and_focus() {
    both_themes("test-shot", |window| {
        window.open_small_rig();
        window.enter(Room::Scan);
        window.click("Test shot");
        window.until_label("Mark clipped pixels");
        window.idle();
    });
}

#[test]
fn a_scan_that_was_stopped_is_offered_and_continued() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.open_small_rig();
    window.enter(Room::Scan);
    window.click("Scan the swatch");
    window.until_label("Light 2, taken");
    window.click("Stop");
    window.until_label("Continue scan");
    window.idle();
    assert!(window.harness.state().shared().problems.is_empty(), "stopping is no fault");
    window.click("Continue scan");
    window.until_label("Look closer");
}

#[test]
fn a_fault_in_the_middle_is_told_and_the_scan_goes_on_later() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.open_small_rig();
    window.enter(Room::Scan);
    window.click("Scan the swatch");
    window.until_label("Light 1, taken");
    // The disk goes away under the scan.
    let scan = window.rig().join("scans/linen 1");
    let aside = window.rig().join("aside");
    std::fs::rename(&scan, &aside).unwrap();
    window.until("a problem is shown", |app| !app.shared().problems.is_empty());
    window.idle();
    std::fs::rename(&aside, &scan).unwrap();
    window.enter(Room::Rig);
    window.open_small_rig();
    window.enter(Room::Scan);
    window.until_label("Continue scan");
    window.click("Continue scan");
    window.until_label("Look closer");
}

#[test]
fn what_went_wrong_is_shown_with_its_remedy() {
    let gone = |settings: &mut Settings| settings.rig = Some("/no/such/rig".into());
    desk::state("problems", gone, |window| {
        window.harness.state_mut().request(Request::Open("/no/such/rig".into()));
        window.until("both are told", |app| app.shared().problems.len() == 2);
        window.idle();
    });
}

#[test]
fn a_frame_that_clips_is_marked_and_the_remedy_named() {
    let long = |settings: &mut Settings| settings.scan.exposure_s = 1.1;
    desk::state("clipped", long, |window| {
        window.open_small_rig();
        window.enter(Room::Scan);
        window.click("Test shot");
        window.click("Mark clipped pixels");
        window.idle();
    });
}

#[test]
fn a_scan_that_was_killed_is_the_first_thing_to_be_seen() {
    desk::state(
        "unfinished",
        |_| {},
        |window| {
            window.open_small_rig();
            window.killed_scan("linen 1", 4);
            window.open_small_rig();
            window.enter(Room::Scan);
            window.until_label("Continue scan");
            window.idle();
        },
    );
}

#[test]
fn a_rig_without_calibration_leads_to_it() {
    desk::state(
        "not-calibrated",
        |_| {},
        |window| {
            window.open_small_rig();
            std::fs::remove_dir_all(window.rig().join("calibration")).unwrap();
            window.open_small_rig();
            window.enter(Room::Scan);
            window.until_label("Calibrate the rig");
            window.idle();
        },
    );
}

#[test]
fn an_old_calibration_is_told_where_it_is_used() {
    desk::state(
        "expired",
        |_| {},
        |window| {
            window.open_small_rig();
            let file = window.rig().join("calibration/lights.toml");
            let days = jiff::SignedDuration::from_hours(24 * 200 + 1);
            let made = format!("[provenance]\ncreated = {}", jiff::Timestamp::now() - days);
            let text = std::fs::read_to_string(&file).unwrap().replace("[provenance]", &made);
            std::fs::write(&file, text).unwrap();
            window.open_small_rig();
            window.enter(Room::Scan);
            window.until_label("Check calibration");
            window.idle();
        },
    );
}

#[test]
fn without_scans_the_room_leads_to_the_first() {
    desk::state(
        "no-scans",
        |_| {},
        |window| {
            window.open_small_rig();
            window.enter(Room::Scans);
            window.idle();
        },
    );
}

/// The next day: the form is as it was, and the name counted on past the scans that are there.
#[test]
fn a_window_begins_where_the_last_one_ended() {
    let kept = |settings: &mut Settings| {
        settings.scan.name = "silk 12".into();
        settings.scan.thickness_mm = 0.4;
    };
    let mut window = Window::with(desk::WIDE, egui::Theme::Dark, kept);
    window.open_small_rig();
    window.scan_in_the_library("silk 12");
    window.scan_in_the_library("silk 13");
    window.open_small_rig();
    window.enter(Room::Scan);
    let form = &window.harness.state().shared().settings.scan;
    assert_eq!((form.name.as_str(), form.thickness_mm), ("silk 14", 0.4));
    // It is on the disk long before the window closes.
    let file = window.home().join("settings.toml");
    window.until("the settings are kept", |_| {
        std::fs::read_to_string(&file).is_ok_and(|text| text.contains("silk 14"))
    });
}

/// The light in the hand, while nobody has looked any closer yet.
#[test]
fn the_maps_of_a_scan_are_lit_by_hand() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.open_small_rig();
    window.enter(Room::Scan);
    window.click("Scan the swatch");
    window.until_label("Look closer");
    window.idle();
    let before = window.harness.render().unwrap();
    let maps = window.harness.get_by_label("Maps of the swatch so far").rect();
    let [from, to] = [(0.3, 0.3), (0.8, 0.7)].map(|(x, y)| maps.lerp_inside(egui::vec2(x, y)));
    window.harness.drag_at(from);
    window.harness.step();
    window.harness.hover_at(to);
    window.harness.step();
    window.harness.drop_at(to);
    window.idle();
    let after = window.harness.render().unwrap();
    let changed = before.pixels().zip(after.pixels()).filter(|(a, b)| a != b).count();
    let all = maps.area() as usize;
    assert!(changed > all / 4, "{changed} of {all} pixels are lit otherwise");
}

#[test]
fn scans_are_found_opened_exported_and_deleted() {
    both_themes("scans", |window| {
        window.open_small_rig();
        window.scan_in_the_library("silk 12");
        window.scan_in_the_library("wool 7");
        window.enter(Room::Scans);
        window.until_label("wool 7, not solved yet");
        window.idle();
    });
}

#[test]
fn scans_are_searched_solved_exported_and_deleted() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.open_small_rig();
    window.scan_in_the_library("silk 12");
    window.scan_in_the_library("wool 7");
    window.enter(Room::Scans);
    window.until_label("wool 7, not solved yet");
    let search = window.harness.get_by_role(egui::accesskit::Role::TextInput);
    search.focus();
    search.type_text("SILK");
    window.harness.run();
    assert!(window.harness.query_by_label("wool 7, not solved yet").is_none());
    window.click("silk 12, not solved yet");
    window.click("Solve");
    window.until_label("silk 12, solved");
    window.click("Export");
    window.idle();
    let exported = window.home().join("exports/silk 12 maps");
    assert!(exported.join("normal.exr").exists());
    window.click("Delete “silk 12”");
    window.idle();
    assert!(!window.rig().join("scans/silk 12").exists());
    window.click("Undo");
    window.idle();
    assert!(window.rig().join("scans/silk 12/session.toml").exists());
    assert!(window.rig().join("solutions/silk 12/normal.exr").exists());
    assert!(window.harness.query_by_label("Undo").is_none());
    window.click("Delete “silk 12”");
    window.idle();
    assert!(!window.rig().join("scans/silk 12").exists());
    assert!(!window.rig().join("solutions/silk 12").exists());
    assert!(window.rig().join("scans/wool 7").exists());
    // From the bin they could be restored; here they leave it again.
    let ours = |item: &trash::TrashItem| item.original_parent.starts_with(window.home());
    let binned: Vec<_> = trash::os_limited::list().unwrap().into_iter().filter(ours).collect();
    assert_eq!(binned.len(), 2, "the scan and its solution");
    trash::os_limited::purge_all(binned).unwrap();
}

/// The window and the command line make the same library calls with the same settings.
#[test]
fn the_window_solves_as_the_command_line_does() {
    let mut window = Window::new(desk::SMALL, egui::Theme::Dark);
    window.open_small_rig();
    window.enter(Room::Scan);
    window.click("Solving");
    window.click("Robust everywhere");
    window.click("Scan the swatch");
    window.until_label("Look closer");
    let rig = window.rig();
    // As `weavelight solve --settings FILE` makes them.
    window.harness.state().shared().settings.save().unwrap();
    let settings =
        weavelight::settings::Settings::read(&window.home().join("settings.toml")).unwrap();
    let options = settings.options(
        &rig.join("scans/linen 1"),
        &rig.join("calibration"),
        &rig.join("by-command"),
    );
    weavelight::solve::run(&options, &|_| (), None).unwrap();
    for file in [
        "normal.exr",
        "albedo.exr",
        "shade.exr",
        "confidence.exr",
        "normal.png",
        "albedo.png",
        "mask.png",
    ] {
        let read = |folder: &str| std::fs::read(rig.join(folder).join(file)).unwrap();
        assert!(read("by-command") == read("solutions/linen 1"), "{file} differs");
    }
}
