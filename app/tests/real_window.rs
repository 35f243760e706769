//! The program in a real window, on a display of its own: started, a swatch scanned with the simulated board and camera, lit
//! anew, exported, quit. With `WEAVELIGHT_PICTURES=DIR` its pictures are kept there: the README's.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its table up has failed")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use weavelight::simulate;

/// Frames of the rig that is scanned: small, so that the test is quick; larger for pictures.
const FRAME: [usize; 2] = [308, 204];
const PICTURE_FRAME: [usize; 2] = [1232, 816];
/// How long anything may take on a machine with much else to do.
const PATIENCE: Duration = Duration::from_secs(180);

/// A display without a screen, and the program in it.
struct Desktop {
    server: Child,
    display: String,
    app: Option<Child>,
    home: tempfile::TempDir,
}

impl Desktop {
    /// `None` where the tools are missing.
    fn start() -> Option<Self> {
        for tool in ["xdotool", "import"] {
            Command::new(tool)
                .arg("--version")
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status()
                .ok()?;
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut number = String::new();
        BufReader::new(server.stdout.take()?).read_line(&mut number).ok()?;
        let display = format!(":{}", number.trim());
        Some(Self { server, display, app: None, home: tempfile::tempdir().unwrap() })
    }

    fn home(&self) -> &Path {
        self.home.path()
    }

    fn open(&mut self) {
        let app = Command::new(env!("CARGO_BIN_EXE_weavelight-app"))
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .env("HOME", self.home())
            .env("XDG_CONFIG_HOME", self.home().join("config"))
            .env("XDG_RUNTIME_DIR", self.home())
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        self.app = Some(app);
        self.xdotool(&[
            "search",
            "--sync",
            "--onlyvisible",
            "--name",
            "^Weavelight$",
            "windowfocus",
        ]);
    }

    /// A calibrated rig that was open last, and the file that says so.
    fn rig(&self, size_px: [usize; 2]) -> (PathBuf, PathBuf) {
        let rig = self.home().join("rig");
        let options = simulate::Options {
            out: rig.clone(),
            size_px: Some(size_px),
            only: vec![simulate::Part::Swatch],
            ..Default::default()
        };
        simulate::run(&options, &|_, _| ()).unwrap();
        let config = self.home().join("config/weavelight");
        std::fs::create_dir_all(&config).unwrap();
        let file = config.join("settings.toml");
        let settings = format!(
            "schema = 1\nrig = {:?}\nhome = {:?}\ntheme = \"dark\"\n",
            rig.display().to_string(),
            self.home().display().to_string()
        );
        std::fs::write(&file, settings).unwrap();
        (rig, file)
    }

    /// As by a power cut: no signal that a program could hear.
    fn kill(&mut self) {
        let mut app = self.app.take().unwrap();
        app.kill().unwrap();
        app.wait().unwrap();
    }

    fn xdotool(&self, arguments: &[&str]) {
        let done = Command::new("xdotool")
            .env("DISPLAY", &self.display)
            .args(arguments)
            .stdout(Stdio::null())
            .status();
        assert!(done.unwrap().success(), "xdotool {arguments:?}");
    }

    fn key(&self, keys: &str) {
        self.xdotool(&["key", "--delay", "50", keys]);
        // One frame to take it in.
        std::thread::sleep(Duration::from_millis(300));
    }

    /// Clicks something by its place.
    fn click(&self, [x, y]: [u32; 2]) {
        // It may just be about to appear.
        std::thread::sleep(Duration::from_secs(1));
        self.xdotool(&["mousemove", &x.to_string(), &y.to_string(), "sleep", "0.2", "click", "1"]);
    }

    /// A picture of the screen; more than one colour is in it.
    fn picture(&self, name: &str) -> PathBuf {
        std::thread::sleep(Duration::from_millis(500));
        let folder =
            std::env::var_os("WEAVELIGHT_PICTURES").map_or(self.home().to_owned(), PathBuf::from);
        let file = folder.join(format!("{name}.png"));
        let done = Command::new("import")
            .env("DISPLAY", &self.display)
            .args(["-window", "root"])
            .arg(&file)
            .status();
        assert!(done.unwrap().success());
        let pixels = image::open(&file).unwrap().to_rgb8();
        let first = *pixels.get_pixel(0, 0);
        assert!(pixels.pixels().any(|pixel| *pixel != first), "{name}: nothing is drawn");
        file
    }

    /// The program leaves by itself, without a complaint.
    fn quit(&mut self) {
        self.key("ctrl+q");
        let mut app = self.app.take().unwrap();
        let status = until("the program has left", || app.try_wait().unwrap());
        assert!(status.success(), "{status}");
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _ = self.app.as_mut().map(Child::kill);
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn until<T>(what: &str, mut happened: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(value) = happened() {
            return value;
        }
        assert!(begun.elapsed() < PATIENCE, "{what}: not yet");
        std::thread::sleep(Duration::from_millis(100));
    }
}

fn exists(file: &Path) {
    until(&file.display().to_string(), || file.exists().then_some(()));
}

/// Pixels that differ visibly between two pictures.
fn changed_pixels(before: &Path, after: &Path) -> usize {
    let read = |file: &Path| image::open(file).unwrap().to_rgb8();
    let differ =
        |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 8);
    read(before).pixels().zip(read(after).pixels()).filter(|pair| differ(*pair)).count()
}

#[test]
fn a_scan_in_a_real_window_is_lit_anew_and_exported() {
    let Some(mut desktop) = Desktop::start() else {
        println!("not run: Xvfb, xdotool or ImageMagick is missing");
        return;
    };
    let pictures = std::env::var_os("WEAVELIGHT_PICTURES").is_some();
    let (rig, settings) = desktop.rig(if pictures { PICTURE_FRAME } else { FRAME });

    desktop.open();
    desktop.key("ctrl+3");
    desktop.key("space");
    exists(&rig.join("scans/linen 1/light-05.dng"));
    desktop.picture("app-scan");
    exists(&rig.join("solutions/linen 1/report.json"));
    desktop.picture("app-scanned");
    desktop.key("ctrl+1");
    desktop.picture("app-rig");
    desktop.key("ctrl+2");
    desktop.picture("app-calibrate");
    desktop.key("ctrl+5");
    std::thread::sleep(Duration::from_secs(1));
    desktop.key("Right");
    desktop.picture("app-scans");
    desktop.key("ctrl+e");
    exists(&desktop.home().join("exports/linen 1 maps/normal.exr"));
    desktop.key("Return");
    std::thread::sleep(Duration::from_secs(2));
    let before = desktop.picture("app-look");
    // The hand on the light: it follows, and the cloth with it.
    desktop.xdotool(&["mousemove", "560", "420", "mousedown", "1"]);
    for place in [["520", "380"], ["470", "330"], ["420", "280"]] {
        desktop.xdotool(&["mousemove", place[0], place[1]]);
        std::thread::sleep(Duration::from_millis(150));
    }
    desktop.xdotool(&["mouseup", "1"]);
    let after = desktop.picture("app-relit");
    let changed = changed_pixels(&before, &after);
    assert!(changed > 50_000, "{changed} pixels changed under the light that was dragged");
    desktop.quit();
    let kept = std::fs::read_to_string(settings).unwrap();
    assert!(kept.contains("room = \"look\""), "the room is remembered:\n{kept}");
}

/// The program is killed while it scans; started again, it opens the rig and the room, and goes on where the scan stood.
#[test]
fn a_killed_window_reopens_the_scan_where_it_stood() {
    let Some(mut desktop) = Desktop::start() else {
        println!("not run: Xvfb, xdotool or ImageMagick is missing");
        return;
    };
    let (rig, _) = desktop.rig(FRAME);
    let scan = rig.join("scans/linen 1");
    desktop.open();
    desktop.key("ctrl+3");
    desktop.key("space");
    exists(&scan.join("light-04.dng"));
    desktop.kill();
    let frame = |light: usize| std::fs::metadata(scan.join(format!("light-{light:02}.dng")));
    assert!(frame(9).is_err(), "it was killed in the middle");
    let before = frame(3).unwrap().modified().unwrap();

    desktop.open();
    desktop.picture("app-reopened");
    // "Continue it" has the keyboard from the start: one key goes on.
    desktop.key("Return");
    exists(&rig.join("solutions/linen 1/report.json"));
    assert!(frame(9).is_ok());
    assert_eq!(frame(3).unwrap().modified().unwrap(), before, "what was there is not taken again");
    desktop.quit();
}

/// From nothing to a hand on the light, as somebody does it who has only just installed the program: the simulated rig at a
/// quarter of full size, calibrated, a swatch scanned, looked at. `--run-ignored all --no-capture` tells how long it takes.
#[test]
#[ignore = "two minutes of measuring time"]
fn the_first_run_takes_five_minutes() {
    let Some(mut desktop) = Desktop::start() else {
        println!("not run: Xvfb, xdotool or ImageMagick is missing");
        return;
    };
    let rig = desktop.home().join("Weavelight/simulated rig");
    let begun = Instant::now();
    let tell = |what: &str| println!("{:5.1} s: {what}", begun.elapsed().as_secs_f64());
    desktop.open();
    tell("the window is there");
    // Where the buttons are in a window of 1280 x 800 points: see the rooms' pictures.
    let (try_it, calibrate, by_itself) = ([698, 287], [844, 259], [780, 128]);
    desktop.click(try_it);
    exists(&rig.join("rig.toml"));
    desktop.click(calibrate);
    desktop.click(by_itself);
    exists(&rig.join("calibration/camera.toml"));
    tell("the camera is calibrated");
    exists(&rig.join("calibration/lights.toml"));
    tell("the lights are calibrated");
    desktop.key("ctrl+3");
    // The big button wakes up when the check is done.
    until("the scan has begun", || {
        desktop.key("space");
        rig.join("scans/linen 1").exists().then_some(())
    });
    tell("the rig is checked, the scan has begun");
    exists(&rig.join("solutions/linen 1/report.json"));
    tell("the swatch is scanned and solved");
    std::thread::sleep(Duration::from_secs(1));
    desktop.key("Return");
    std::thread::sleep(Duration::from_secs(1));
    let before = desktop.picture("first-look");
    desktop.xdotool(&["mousemove", "500", "400", "mousedown", "1", "mousemove", "300", "500"]);
    let after = desktop.picture("first-relit");
    tell("the light is in the hand");
    assert!(changed_pixels(&before, &after) > 50_000);
    assert!(begun.elapsed() < Duration::from_secs(300));
    desktop.quit();
}
