//! What the Calibrate and Rig rooms say when something is wrong, or not there.

use super::uncalibrated;
use crate::desk::{self, Window};
use eframe::egui;
use egui_kittest::kittest::{NodeT, Queryable};
use weavelight::calibrate::wizard::State;
use weavelight::calibrate::{BoardsSoFar, status};
use weavelight::device::board::{BoardError, PortChoice};
use weavelight::device::camera::CameraError;
use weavelight::device::scan::CameraFinding;
use weavelight::doctor::{LightBoard, examine_boards};
use weavelight_app::jobs::calibrate::Event;
use weavelight_app::jobs::messages::Update;
use weavelight_app::jobs::rig;
use weavelight_app::model::activity::Ended;
use weavelight_app::model::problem::Problem;
use weavelight_app::model::room::Room;

impl Window {
    fn hear(&mut self, update: Update) {
        self.harness.state_mut().hear(update);
    }

    /// How often the window says something.
    fn says(&self, words: &str) -> usize {
        let labels = self.harness.query_all_by_role(egui::accesskit::Role::Label);
        labels
            .filter(|node| node.accesskit_node().value().is_some_and(|it| it.contains(words)))
            .count()
    }

    /// Rewrites the rig file, and opens the rig again.
    fn change_rig(&mut self, change: impl Fn(String) -> String) {
        let file = self.rig().join("rig.toml");
        std::fs::write(&file, change(std::fs::read_to_string(&file).unwrap())).unwrap();
        self.open_small_rig();
    }
}

/// What is there before the first picture.
fn nothing_yet(window: &Window) -> State {
    State {
        status: status(&window.rig().join("calibration")).unwrap(),
        begun: false,
        boards: [0, 0],
        table: false,
        corners_px: Vec::new(),
        so_far: BoardsSoFar::default(),
        chart: false,
        sheets: Vec::new(),
        foreseen: None,
        fresh: [false; 3],
        verdict: None,
        age_days: None,
        history: Vec::new(),
        sees_chessboards: true,
    }
}

#[cfg(feature = "opencv")]
#[test]
fn a_board_that_is_not_seen_is_told_beside_the_picture() {
    desk::state(
        "calibrate-no-board",
        |_| {},
        |window| {
            // Squares of a few pixels.
            super::make_uncalibrated(window, [60, 40]);
            window.click("Live");
            window.until_label(weavelight_app::texts::calibrate::BOARD_NOT_FOUND);
            window.click("Live");
            window.idle();
            assert_eq!(window.says("The board was not found"), 1);
        },
    );
}

#[test]
fn a_camera_that_was_unplugged_is_told_in_the_room_and_in_the_panel() {
    let text = CameraError::NoneFound.to_string();
    desk::state(
        "calibrate-no-camera",
        |_| {},
        |window| {
            super::make_uncalibrated(window, super::FRAME);
            window.hear(Update::Problem(Problem::error("Photographing the chessboard", &text)));
            window.hear(Update::Calibrate(Event::Halted(Ended::Failed)));
            window.idle();
            assert_eq!(window.says(&text), 2);
        },
    );
}

/// The same through the worker, with a camera that is really not there.
#[test]
fn what_went_wrong_stays_until_the_next_try() {
    let mut window = uncalibrated(desk::WIDE);
    window.change_rig(|rig| {
        let watched = "kind = \"watched\"\nfolder = \"from the camera\"";
        rig.replacen("kind = \"simulated\"", watched, 1)
    });
    window.until_label("Lay the chessboard flat in the middle");
    window.click("Live");
    window.idle();
    assert_eq!(
        window.says("the watched folder"),
        2,
        "{:?}",
        window.harness.state().shared().problems
    );
    window.click("Dismiss");
    window.idle();
    assert_eq!(window.says("the watched folder"), 1, "the room still says what is to be done");
    // Stopped is no fault.
    window.hear(Update::Calibrate(Event::Halted(Ended::Cancelled)));
    window.idle();
    assert_eq!(window.says("the watched folder"), 0);
    assert!(!window.rig().join("targets").exists(), "nothing has begun");
}

#[test]
fn a_build_without_chessboards_says_what_to_do() {
    desk::state(
        "calibrate-no-opencv",
        |_| {},
        |window| {
            super::make_uncalibrated(window, super::FRAME);
            let state = State { sees_chessboards: false, ..nothing_yet(window) };
            window.hear(Update::Calibrate(Event::State(Box::new(state))));
            window.idle();
            assert!(window.harness.query_by_label("Take the picture (Space)").is_none());
        },
    );
}

#[test]
fn an_old_calibration_is_told_with_what_to_do() {
    desk::state(
        "calibrate-expired",
        |_| {},
        |window| {
            window.open_small_rig();
            window.enter(Room::Calibrate);
            window.until_label("The rig is calibrated");
            let state = State { age_days: Some(200), ..nothing_yet(window) };
            window.hear(Update::Calibrate(Event::State(Box::new(state))));
            window.idle();
            assert_eq!(window.says("Calibrated 200 days ago"), 1);
        },
    );
}

/// A calibration that came with the rig has no pictures here; it is checked all the same, and stays as it is.
#[cfg(feature = "opencv")]
#[test]
fn a_calibration_from_elsewhere_is_checked() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    super::make_uncalibrated(&mut window, super::FRAME);
    let truth = weavelight::simulate::Options {
        out: window.home().join("elsewhere"),
        size_px: Some(super::FRAME),
        only: vec![weavelight::simulate::Part::Swatch],
        ..Default::default()
    };
    weavelight::simulate::run(&truth, &|_, _| ()).unwrap();
    std::fs::rename(truth.out.join("calibration"), window.rig().join("calibration")).unwrap();
    window.open_small_rig();
    window.until_label("The rig is calibrated");
    window.click("Check now");
    window.until_label("Not now");
    window.click("Not now");
    window.until_label("The rig is calibrated");
    window.idle();
    window.click("Check now");
    window.click("Take the picture (Space)");
    window.until_label("The rig is calibrated");
    window.idle();
    // Its truth knows nothing of this rig's lens: what counts is that there is a verdict.
    assert_eq!(window.says("A sheet that was not used for the calibration is solved"), 1);
    assert!(window.rig().join("targets/check-tilt/session.toml").exists());
    // The next day.
    window.open_small_rig();
    window.until_label("Start scanning");
    window.idle();
    assert_eq!(window.says("A sheet that was not used for the calibration is solved"), 1);
}

#[test]
fn a_light_board_that_does_not_answer_is_told_with_its_remedy() {
    let port = std::path::Path::new("/dev/ttyACM98");
    let missing = examine_boards(&PortChoice::Path(port.into()), Some(10));
    let problem = missing[0].problem.clone().unwrap();
    assert!(problem.contains("connect the light board"), "{problem}");
    desk::state(
        "rig-no-board",
        |_| {},
        |window| {
            window.open_small_rig();
            window.enter(Room::Rig);
            let error = BoardError::Silent { port: "/dev/ttyACM0".into() };
            let silent = LightBoard {
                port: "/dev/ttyACM0".into(),
                firmware: None,
                lights: None,
                back_light: false,
                trigger: false,
                problem: Some(error.to_string()),
            };
            let what = "Nikon D5100 at usb:001,004, battery 80 %".to_owned();
            let cameras = vec![CameraFinding { what, problem: None }];
            window.hear(Update::Rig(rig::Event::Found { boards: vec![silent], cameras }));
            window.idle();
            assert_eq!(window.says("nothing answers"), 1);
        },
    );
}

/// Through the worker: the port of the rig file is not there, and lighting a lamp says so, too.
#[test]
fn a_port_that_is_not_there_is_told_in_the_room_and_when_a_light_is_switched() {
    let mut window = Window::new(desk::WIDE, egui::Theme::Dark);
    window.open_small_rig();
    window.change_rig(|rig| {
        let (camera, rest) = rig.split_once("[controller]").unwrap();
        let serial = "kind = \"serial\"\nport = \"/dev/ttyACM98\"";
        format!("{camera}[controller]{}", rest.replacen("kind = \"simulated\"", serial, 1))
            .replacen("kind = \"simulated\"", "kind = \"watched\"\nfolder = \".\"", 1)
    });
    window.enter(Room::Rig);
    window.click("Look for board and camera");
    window.idle();
    assert_eq!(window.says("/dev/ttyACM98: there is no such port; connect the light board"), 1);
    window.click("Light 3");
    window.idle();
    assert_eq!(window.says("/dev/ttyACM98: there is no such port; connect the light board"), 2);
}
