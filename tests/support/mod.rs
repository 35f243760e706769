//! What the whole-program tests share: a small capture session, and a way to run the program and judge what it says.

#![allow(dead_code, unreachable_pub, reason = "every test program uses a part of it")]

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};

/// Width of the frames.
pub const WIDTH: u32 = 24;
/// Height of the frames.
pub const HEIGHT: u32 = 18;

/// A folder with a capture session `s` of four lights and its calibration `c`; removed at the end.
pub struct Home {
    folder: tempfile::TempDir,
}

/// Directions of the lights, to be normalised.
pub const LIGHTS: [[f64; 3]; 4] =
    [[0.5, 0.0, 0.8], [-0.5, 0.1, 0.8], [0.0, 0.5, 0.8], [0.1, -0.5, 0.8]];

impl Home {
    /// The whole, faultless session.
    pub fn new() -> Self {
        Self::with_lights(&LIGHTS)
    }

    /// A faultless session with other lights.
    pub fn with_lights(lights: &[[f64; 3]]) -> Self {
        let home = Self { folder: tempfile::tempdir().unwrap() };
        fs::create_dir(home.path("s")).unwrap();
        fs::create_dir(home.path("c")).unwrap();
        for (k, light) in lights.iter().enumerate() {
            write_frame(&home.path(&format!("s/light-{k}.png")), *light, WIDTH, HEIGHT);
        }
        home.write("s/session.toml", manifest(lights.len(), &home.path("s")));
        home.write("c/lights.toml", lights_toml(lights));
        home.write("c/color.toml", "schema = 1\nresponse = [0, 1]\n");
        home
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Replaces text that must be there.
    pub fn replace(&self, name: &str, from: &str, to: &str) {
        let text = self.read(name);
        assert!(text.contains(from), "{name} lacks {from:?}:\n{text}");
        self.write(name, text.replacen(from, to, 1));
    }

    /// Takes the recorded hashes out, so that what is behind them is seen.
    pub fn forget_hashes(&self) {
        let text = self.read("s/session.toml");
        let kept: Vec<&str> = text.lines().filter(|line| !line.starts_with("sha256")).collect();
        self.write("s/session.toml", kept.join("\n"));
    }

    /// Runs the program in this folder.
    pub fn run(&self, call: &str) -> Said {
        self.run_with(call, &[])
    }

    /// Runs the program in this folder, with these environment variables.
    pub fn run_with(&self, call: &str, variables: &[(&str, &str)]) -> Said {
        let mut command = Command::cargo_bin("weavelight").unwrap();
        command.current_dir(self.folder.path()).args(call.split_whitespace());
        // As on every desktop; without it Vulkan's layers complain on standard error.
        command.env("XDG_RUNTIME_DIR", self.folder.path());
        command.envs(variables.iter().copied());
        let output = command.output().unwrap();
        Said {
            status: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Names in this folder, sorted.
    pub fn names(&self) -> Vec<String> {
        names(self.folder.path())
    }
}

/// Names in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = entries.collect();
    names.sort();
    names
}

/// What the program said.
pub struct Said {
    pub status: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Said {
    /// The JSON object on standard output.
    pub fn json(&self) -> serde_json::Value {
        assert_eq!(self.status, Some(0), "{}", self.stderr);
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{error}:\n{}", self.stdout))
    }

    /// It failed as it should: this status, one or two lines that hold `expected` and a remedy, no backtrace.
    pub fn expect_failure(&self, case: &str, status: i32, expected: &[&str]) {
        let Said { stderr, .. } = self;
        assert_eq!(self.status, Some(status), "{case}: {stderr}");
        let lines: Vec<&str> =
            stderr.lines().filter(|line| !line.starts_with("warning: ")).collect();
        assert!((1..=2).contains(&lines.len()), "{case}: {} lines:\n{stderr}", lines.len());
        assert!(lines[0].starts_with("error: "), "{case}: {stderr}");
        for part in expected {
            assert!(stderr.contains(part), "{case}: lacks {part:?}: {stderr}");
        }
        assert!(stderr.contains("; "), "{case}: names no remedy: {stderr}");
        for trace in ["panicked", "backtrace", "RUST_BACKTRACE"] {
            assert!(!stderr.contains(trace), "{case}: {stderr}");
        }
        assert_eq!(self.stdout, "", "{case}");
    }
}

/// A frame of a wavy matte surface as a 16-bit grey PNG, to be read as a mosaic.
pub fn write_frame(path: &Path, light: [f64; 3], width: u32, height: u32) {
    let length = light.iter().map(|c| c * c).sum::<f64>().sqrt();
    let shade = |x: u32, y: u32| {
        let slope = [0.2 * f64::from(x).sin(), 0.2 * f64::from(y).cos()];
        let normal = [-slope[0], -slope[1], 1.0];
        let norm = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
        let cosine: f64 =
            normal.iter().zip(light).map(|(n, l)| n * l).sum::<f64>() / (norm * length);
        (65535.0 * 0.6 * cosine.max(0.0)).round() as u16
    };
    image::ImageBuffer::from_fn(width, height, |x, y| image::Luma([shade(x, y)]))
        .save(path)
        .unwrap();
}

/// `session.toml` of frames `light-0.png` and on, hashes included.
fn manifest(lights: usize, folder: &Path) -> String {
    let mut text = "schema = 1\nkind = \"swatch\"\nname = \"small\"\n".to_owned();
    for k in 0..lights {
        let hash =
            weavelight::files::sha256_of_file(&folder.join(format!("light-{k}.png"))).unwrap();
        text.push_str(&format!(
            "\n[[frames]]\nfile = \"light-{k}.png\"\nlight = {k}\nexposure_s = 1.0\niso = 100\ncfa = \"RGGB\"\nsha256 = \"{hash}\"\n"
        ));
    }
    text
}

/// `lights.toml` of far lights.
pub fn lights_toml(lights: &[[f64; 3]]) -> String {
    let mut text = "schema = 1\n".to_owned();
    for [x, y, z] in lights {
        text.push_str(&format!(
            "\n[[lights]]\nkind = \"directional\"\ndirection = [{x:?}, {y:?}, {z:?}]\nintensity = [1.0, 1.0, 1.0]\n"
        ));
    }
    text
}
