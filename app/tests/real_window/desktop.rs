//! A display without a screen, and what is needed on it.

#[allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "test programs share it")]
#[path = "../../../tests/support/skip.rs"]
mod skip;

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use weavelight::simulate;

/// How long anything may take on a machine with much else to do.
const PATIENCE: Duration = Duration::from_secs(180);

/// A display without a screen, and the program in it.
pub(crate) struct Desktop {
    server: Child,
    display: String,
    app: Option<Child>,
    home: tempfile::TempDir,
}

impl Desktop {
    /// `None` where the tools are missing and their tests are to be skipped.
    pub(crate) fn start() -> Option<Self> {
        let missing =
            || "Xvfb, xdotool or ImageMagick is missing; `make test` installs them".to_owned();
        skip::need("window", Self::try_start().ok_or_else(missing))
    }

    fn try_start() -> Option<Self> {
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

    pub(crate) fn home(&self) -> &Path {
        self.home.path()
    }

    /// The program, to be started on this display.
    pub(crate) fn app(&self) -> Command {
        let mut app = self.program(env!("CARGO_BIN_EXE_weavelight-app"));
        app.env("XDG_CONFIG_HOME", self.home().join("config"));
        app.env("XDG_RUNTIME_DIR", self.home());
        app
    }

    pub(crate) fn open(&mut self) {
        let app = self.app();
        self.open_as(app);
    }

    /// Opens the window of this command.
    pub(crate) fn open_as(&mut self, mut app: Command) {
        self.app = Some(app.spawn().unwrap());
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
    pub(crate) fn rig(&self, size_px: [usize; 2]) -> (PathBuf, PathBuf) {
        let rig = self.home().join("rig");
        let options = simulate::Options {
            out: rig.clone(),
            size_px: Some(size_px),
            only: vec![simulate::Part::Swatch],
            ..Default::default()
        };
        simulate::run(&options, &|_, _| ()).unwrap();
        let settings = format!(
            "schema = 1\nrig = {:?}\nhome = {:?}\ntheme = \"dark\"\nwindow_size = [1280.0, 800.0]\n",
            rig.display().to_string(),
            self.home().display().to_string()
        );
        (rig, self.settings(&settings))
    }

    /// What the program remembers of its last start, and the file with it.
    pub(crate) fn settings(&self, text: &str) -> PathBuf {
        let config = self.home().join("config/weavelight");
        std::fs::create_dir_all(&config).unwrap();
        let file = config.join("settings.toml");
        std::fs::write(&file, text).unwrap();
        file
    }

    /// Another program on this display.
    pub(crate) fn program(&self, name: &str) -> Command {
        let mut command = Command::new(name);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        command.env("HOME", self.home()).stdin(Stdio::null());
        command
    }

    /// As by a power cut: no signal that a program could hear.
    pub(crate) fn kill(&mut self) {
        let mut app = self.app.take().unwrap();
        app.kill().unwrap();
        app.wait().unwrap();
    }

    pub(crate) fn xdotool(&self, arguments: &[&str]) {
        let done = Command::new("xdotool")
            .env("DISPLAY", &self.display)
            .args(arguments)
            .stdout(Stdio::null())
            .status();
        assert!(done.unwrap().success(), "xdotool {arguments:?}");
    }

    /// Of the program's window, pixels.
    pub(crate) fn window_size(&self) -> [u32; 2] {
        let found = self
            .program("xdotool")
            .args(["search", "--onlyvisible", "--name", "^Weavelight$", "getwindowgeometry"])
            .output()
            .unwrap();
        let text = String::from_utf8(found.stdout).unwrap();
        let size = text.lines().find_map(|line| line.trim().strip_prefix("Geometry: ")).unwrap();
        let (width, height) = size.split_once('x').unwrap();
        [width, height].map(|length| length.trim().parse().unwrap())
    }

    pub(crate) fn key(&self, keys: &str) {
        self.xdotool(&["key", "--delay", "50", keys]);
        // One frame to take it in.
        std::thread::sleep(Duration::from_millis(300));
    }

    /// Clicks something by its place.
    pub(crate) fn click(&self, [x, y]: [u32; 2]) {
        // It may just be about to appear.
        std::thread::sleep(Duration::from_secs(1));
        self.xdotool(&["mousemove", &x.to_string(), &y.to_string(), "sleep", "0.2", "click", "1"]);
    }

    /// A picture of the screen; more than one colour is in it.
    pub(crate) fn picture(&self, name: &str) -> PathBuf {
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
    pub(crate) fn quit(&mut self) {
        self.key("ctrl+q");
        self.has_left();
    }

    /// So it does, as something else has told it to.
    pub(crate) fn has_left(&mut self) {
        self.left();
    }

    /// The same; what it has printed to its standard error stream where that is piped.
    pub(crate) fn left(&mut self) -> String {
        let mut app = self.app.take().unwrap();
        let status = until("the program has left", || app.try_wait().unwrap());
        assert!(status.success(), "{status}");
        let mut said = String::new();
        if let Some(mut stderr) = app.stderr.take() {
            stderr.read_to_string(&mut said).unwrap();
        }
        said
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _ = self.app.as_mut().map(Child::kill);
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

pub(crate) fn until<T>(what: &str, mut happened: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(value) = happened() {
            return value;
        }
        assert!(begun.elapsed() < PATIENCE, "{what}: not yet");
        std::thread::sleep(Duration::from_millis(100));
    }
}

pub(crate) fn exists(file: &Path) {
    until(&file.display().to_string(), || file.exists().then_some(()));
}
