//! What is attacked: small capture sessions, calibrations, pictures and lists, and the rules that every ending must keep.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// No call on these small files takes longer.
const LONGEST: Duration = Duration::from_secs(60);

/// A folder with everything that the commands below read.
pub(crate) struct Bench {
    pub(crate) home: tempfile::TempDir,
}

/// How a call ended.
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) said: String,
}

impl Bench {
    pub(crate) fn new() -> Self {
        let home = tempfile::tempdir().unwrap();
        let bench = Self { home };
        // Sharp: at this size a blur reaches across a patch of the chart.
        let rig = "simulate --out rig --size 76x52 --psf-px 0 --only swatch,grey";
        for call in [rig, "solve rig/swatch --calibration rig/calibration --out maps"] {
            let ended = bench.run(call);
            assert!(ended.status.success(), "{call}: {}", ended.said);
        }
        bench.write_pictures();
        bench
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    /// A picture set in every format that is imported, its list and a mask.
    fn write_pictures(&self) {
        let folder = self.path("pictures");
        fs::create_dir(&folder).unwrap();
        for k in 0..4_u16 {
            let grey = image::ImageBuffer::from_fn(12, 8, |x, y| {
                image::Luma([2000 + 700 * k + 90 * (x as u16) + 40 * (y as u16)])
            });
            let rgb = image::ImageBuffer::from_fn(12, 8, |x, y| {
                image::Rgb([0.1 + 0.01 * f32::from(k), 0.02 * x as f32, 0.03 * y as f32])
            });
            image::DynamicImage::ImageLuma16(grey.clone())
                .save(folder.join(format!("p{k}.png")))
                .unwrap();
            image::DynamicImage::ImageLuma16(grey).save(folder.join(format!("t{k}.tif"))).unwrap();
            let small = image::RgbImage::from_pixel(12, 8, image::Rgb([40 + k as u8, 50, 60]));
            small.save(folder.join(format!("j{k}.jpg"))).unwrap();
            image::DynamicImage::ImageRgb32F(rgb).save(folder.join(format!("e{k}.exr"))).unwrap();
        }
        image::GrayImage::from_pixel(12, 8, image::Luma([255]))
            .save(folder.join("mask.png"))
            .unwrap();
        let list = "4\np0.png 0.5 0 0.8\np1.png -0.5 0 0.8\np2.png 0 0.5 0.8\np3.png 0 -0.5 0.8\n";
        fs::write(folder.join("lights.lp"), list).unwrap();
        let plain = "0.5 0 0.8\n-0.5 0 0.8\n0 0.5 0.8\n0 -0.5 0.8\n";
        fs::write(folder.join("lights.txt"), plain).unwrap();
    }

    /// Runs the program in this folder.
    pub(crate) fn run(&self, call: &str) -> Ended {
        run_in(self.home.path(), call)
    }
}

pub(crate) fn program() -> PathBuf {
    assert_cmd::cargo::cargo_bin("weavelight")
}

pub(crate) fn run_in(folder: &Path, call: &str) -> Ended {
    let mut command = Command::new(program());
    command.args(call.split_whitespace());
    wait(spawn(command, folder), call)
}

/// Starts a command with its messages caught.
pub(crate) fn spawn(mut command: Command, folder: &Path) -> Child {
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Waits for a call to end, but not for ever.
pub(crate) fn wait(mut child: Child, call: &str) -> Ended {
    let start = Instant::now();
    let mut stderr = child.stderr.take().unwrap();
    let reader = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = stderr.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    });
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > LONGEST {
            child.kill().unwrap();
            panic!("{call}: still running after {} s", LONGEST.as_secs());
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    Ended { status, said: reader.join().unwrap() }
}

/// The rules of every ending that is not a kill: an exit status of the program's own, at most two lines of error, nothing that
/// a terminal would obey, and no word of a panic.
pub(crate) fn check_manners(ended: &Ended) -> Result<(), String> {
    let said = &ended.said;
    let code = ended.status.code();
    if !matches!(code, Some(0..=2)) {
        return Err(format!("ended with {:?}: {said}", ended.status));
    }
    if said.contains("panicked") || said.contains("RUST_BACKTRACE") {
        return Err(format!("panicked: {said}"));
    }
    if said.chars().any(|letter| letter.is_control() && letter != '\n') {
        return Err(format!("control characters: {said:?}"));
    }
    let lines = said.lines().filter(|line| !line.starts_with("warning: ")).count();
    let silent = code != Some(0) && lines == 0;
    if lines > 2 && code != Some(0) || silent || said.lines().any(|line| line.len() > 2000) {
        return Err(format!("{lines} lines of error: {said}"));
    }
    Ok(())
}

/// Every file below a folder with its content; what the program keeps for itself (hidden lock files) left out.
pub(crate) fn content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).into_iter().flatten().flatten() {
            let path = entry.path();
            if entry.file_type().unwrap().is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_owned();
                found.insert(name, fs::read(&path).unwrap_or_default());
            }
        }
    }
    found
}

/// Names of work folders and temporary files that a run has left below a folder.
pub(crate) fn leftovers(folder: &Path) -> Vec<PathBuf> {
    let partial = |path: &PathBuf| path.to_string_lossy().contains("partial-");
    content(folder).into_keys().filter(partial).collect()
}

/// Whether every file that `.weavelight-files` lists is there as it was written. A file that was being replaced is listed with
/// both hashes.
pub(crate) fn check_whole(folder: &Path) -> Result<(), String> {
    let list = fs::read_to_string(folder.join(weavelight::files::LIST_FILE))
        .map_err(|error| format!("{}: no list of files: {error}", folder.display()))?;
    let mut hashes: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for line in list.lines() {
        let (hash, name) = line.split_once("  ").ok_or_else(|| format!("odd line {line:?}"))?;
        hashes.entry(name).or_default().push(hash);
    }
    for (name, hashes) in hashes {
        let found = weavelight::files::sha256_of_file(&folder.join(name));
        if !hashes.contains(&&*found.map_err(|error| error.to_string())?) {
            return Err(format!("{name} is not as it was written"));
        }
    }
    Ok(())
}

/// Copies a folder with what is in it.
pub(crate) fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Numbers that look random and are the same in every run (splitmix64).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Below `count`; 0 for none.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }
}
