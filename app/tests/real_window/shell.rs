//! The window on its desktop: its size, the clipboard, the way out.

use super::desktop::{Desktop, exists, until};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Of the field for the name, in a window of 1280 x 800 points.
const NAME: [u32; 2] = [270, 87];

macro_rules! desktop_or_return {
    () => {
        match Desktop::start() {
            Some(desktop) => desktop,
            None => return,
        }
    };
}

/// Sees that a program is there: `make test` installs it.
fn need(name: &str) {
    let mut asked = Command::new(name);
    let found = asked.arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok();
    assert!(found, "{name} is missing; `make test` installs it");
}

/// A value in the settings, as the file has it.
fn kept(settings: &Path, key: &str) -> Option<String> {
    let text = std::fs::read_to_string(settings).ok()?;
    let whole = toml::Value::Table(text.parse().ok()?);
    let value = key.split('.').try_fold(&whole, |value, key| value.get(key))?;
    Some(value.to_string())
}

#[test]
fn a_window_keeps_its_size_at_every_scale() {
    let mut desktop = desktop_or_return!();
    let file = desktop.settings("schema = 1\nscale = 2.0\nwindow_size = [1000.0, 700.0]\n");
    for _ in 0..2 {
        desktop.open();
        // Long enough to take what it is for what it should be.
        std::thread::sleep(Duration::from_secs(2));
        desktop.quit();
        assert_eq!(kept(&file, "window_size").as_deref(), Some("[1000.0, 700.0]"));
        assert_eq!(kept(&file, "scale").as_deref(), Some("2.0"));
    }
}

#[test]
fn the_first_window_leaves_room_on_its_screen() {
    let mut desktop = desktop_or_return!();
    let file = desktop.settings("schema = 1\n");
    desktop.open();
    until("its size is kept", || {
        kept(&file, "window_size").filter(|size| size == "[1178.0, 680.0]")
    });
    desktop.quit();
}

#[test]
fn a_maximised_window_is_so_again_and_keeps_its_other_size() {
    need("openbox");
    let mut desktop = desktop_or_return!();
    let mut manager = desktop.program("openbox").stderr(Stdio::null()).spawn().unwrap();
    // It reads what a window asks for when that appears, so it must be there before. Without it there are no desktops to count.
    until("the window manager is there", || {
        let mut count = desktop.program("xdotool");
        count.arg("get_num_desktops").stdout(Stdio::null()).stderr(Stdio::null());
        count.status().unwrap().success().then_some(())
    });
    let text = "schema = 1\nmaximized = true\nwindow_size = [900.0, 600.0]\n";
    let file = desktop.settings(text);
    for _ in 0..2 {
        desktop.open();
        until("it is maximised", || {
            let size = desktop.window_size();
            (size[0] > 1200 && size[1] > 700).then_some(())
        });
        // Long enough to take what it is for what it should be.
        std::thread::sleep(Duration::from_secs(2));
        desktop.quit();
        assert_eq!(kept(&file, "window_size").as_deref(), Some("[900.0, 600.0]"));
        assert_eq!(kept(&file, "maximized").as_deref(), Some("true"));
    }
    manager.kill().unwrap();
    manager.wait().unwrap();
}

#[test]
fn texts_go_to_other_programs_and_come_from_them() {
    need("xclip");
    let mut desktop = desktop_or_return!();
    let (_, file) = desktop.rig(super::FRAME);
    desktop.open();
    desktop.key("ctrl+3");
    desktop.click(NAME);
    // On a busy machine the first keys come before the field has the keyboard.
    until("the name is kept", || {
        desktop.key("ctrl+a");
        desktop.xdotool(&["type", "silk 9"]);
        std::thread::sleep(Duration::from_secs(1));
        kept(&file, "scan.name").filter(|name| name == "\"silk 9\"")
    });
    desktop.key("ctrl+a");
    desktop.key("ctrl+c");
    let copied = until("it is on the clipboard", || {
        let mut read = desktop.program("xclip");
        let output =
            read.args(["-selection", "clipboard", "-t", "UTF8_STRING", "-o"]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        (!text.is_empty()).then_some(text)
    });
    assert_eq!(copied, "silk 9");
    let mut other = desktop.program("xclip");
    let mut other =
        other.args(["-selection", "clipboard", "-i"]).stdin(Stdio::piped()).spawn().unwrap();
    other.stdin.take().unwrap().write_all("麻布 from elsewhere".as_bytes()).unwrap();
    other.wait().unwrap();
    desktop.key("ctrl+a");
    desktop.key("ctrl+v");
    until("the name came over", || {
        kept(&file, "scan.name").filter(|name| name.contains("麻布 from elsewhere"))
    });
    desktop.quit();
}

/// Control and Q while it scans: the question, then a scan that can be continued.
#[test]
fn a_window_that_is_closed_while_it_scans_loses_nothing() {
    let mut desktop = desktop_or_return!();
    let (rig, settings) = desktop.rig(super::FRAME);
    // The simulated camera takes its exposure's time: a whole scan far longer than this test, however slow the machine.
    let mut text = std::fs::read_to_string(&settings).unwrap();
    text.push_str("[scan]\nfind_exposure = false\nexposure_s = 6.0\niso = 25.0\n");
    std::fs::write(&settings, text).unwrap();
    let scan = rig.join("scans/linen 1");
    desktop.open();
    desktop.key("ctrl+3");
    desktop.key("space");
    exists(&scan.join("light-00.dng"));
    desktop.key("ctrl+q");
    std::thread::sleep(Duration::from_secs(1));
    desktop.picture("app-quit");
    // "Keep scanning" has the keyboard; "Stop and quit" comes after it.
    desktop.key("Tab");
    desktop.key("Return");
    desktop.has_left();
    let session = weavelight::session::Session::load(&scan).unwrap();
    let lights = weavelight::instrument::Rig::load(&rig.join("rig.toml")).unwrap().lights.len();
    let taken = session.frames.iter().filter(|frame| frame.light.is_some()).count();
    assert!((1..lights).contains(&taken), "{taken} of {lights} lights");
    for frame in &session.frames {
        session.read_frame(frame).unwrap();
    }
}

/// Where there is no desktop's folder for such things, too.
#[test]
fn a_window_that_opens_prints_nothing() {
    let mut desktop = desktop_or_return!();
    desktop.settings("schema = 1\n");
    let mut app = desktop.app();
    app.env_remove("XDG_RUNTIME_DIR").stderr(Stdio::piped());
    desktop.open_as(app);
    std::thread::sleep(Duration::from_secs(1));
    desktop.key("ctrl+q");
    assert_eq!(desktop.left(), "");
}

#[test]
fn without_a_display_there_is_an_error_with_a_remedy() {
    let desktop = desktop_or_return!();
    let mut app = desktop.app();
    app.env_remove("DISPLAY").env_remove("XDG_RUNTIME_DIR");
    let output = app.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.starts_with("error: the window cannot be opened (") && said.lines().count() == 1);
    assert!(said.contains("weavelight help"), "{said}");
}
