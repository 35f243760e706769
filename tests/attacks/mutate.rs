//! Mutated inputs: whatever a file holds, the program says so in two lines, leaves nothing half-written, and writes no number
//! that is not finite.

use crate::bench::{Bench, Numbers, check_manners, copy, leftovers, run_in};
use crate::tries;
use std::fs;
use std::path::Path;

/// A command, what it reads (copied for each try), and the files that are mutated.
struct Target {
    call: &'static str,
    reads: &'static [&'static str],
    mutated: &'static [&'static str],
}

const SOLVE: &str =
    "solve rig/swatch --calibration rig/calibration --out out --only normal,albedo,confidence";
const TARGETS: [Target; 9] = [
    Target {
        call: SOLVE,
        reads: &["rig"],
        mutated: &["rig/swatch/session.toml", "rig/swatch/light-03.dng", "rig/swatch/ambient.dng"],
    },
    Target {
        call: SOLVE,
        reads: &["rig"],
        mutated: &[
            "rig/calibration/camera.toml",
            "rig/calibration/color.toml",
            "rig/calibration/lights.toml",
        ],
    },
    Target {
        call: "calibrate color --rig rig/rig.toml rig/grey --out out",
        reads: &["rig"],
        mutated: &["rig/grey/session.toml", "rig/grey/light-00.dng", "rig/rig.toml"],
    },
    Target {
        call: "simulate --rig rig/rig.toml --size 38x26 --only swatch --out out",
        reads: &["rig"],
        mutated: &["rig/rig.toml"],
    },
    Target {
        call: "scan --rig rig/rig.toml --out rig/swatch --resume --dry-run",
        reads: &["rig"],
        mutated: &["rig/rig.toml", "rig/scene.toml", "rig/swatch/session.toml"],
    },
    Target {
        call: "import --lights pictures/lights.lp --mask pictures/mask.png --out out",
        reads: &["pictures"],
        mutated: &["pictures/lights.lp", "pictures/p2.png", "pictures/mask.png"],
    },
    Target {
        call: "import --lights pictures/lights.txt pictures/t0.tif pictures/t1.tif pictures/t2.tif pictures/t3.tif --out out",
        reads: &["pictures"],
        mutated: &["pictures/lights.txt", "pictures/t2.tif"],
    },
    Target {
        call: "import --lights pictures/lights.txt pictures/e0.exr pictures/j1.jpg pictures/e2.exr pictures/e3.exr --encoding srgb --out out",
        reads: &["pictures"],
        mutated: &["pictures/e2.exr", "pictures/j1.jpg"],
    },
    Target {
        call: "compare maps/normal.exr maps/other.exr --mask maps/mask.png",
        reads: &["maps"],
        mutated: &["maps/normal.exr", "maps/mask.png"],
    },
];

#[test]
fn mutated_files() {
    let bench = Bench::new();
    fs::copy(bench.path("maps/normal.exr"), bench.path("maps/other.exr")).unwrap();
    let (mut numbers, mut failures) = (Numbers(12), Vec::new());
    let count = tries("WEAVELIGHT_MUTATIONS", 60);
    let (mut refused, start) = (0, std::time::Instant::now());
    for k in 0..count {
        let target = &TARGETS[k % TARGETS.len()];
        let name = target.mutated[numbers.below(target.mutated.len())];
        let home = tempfile::tempdir().unwrap();
        for folder in target.reads {
            copy(&bench.path(folder), &home.path().join(folder));
        }
        let file = home.path().join(name);
        let bytes = mutated(&fs::read(&file).unwrap(), name, &mut numbers);
        fs::write(&file, bytes).unwrap();
        // What is recorded of a frame would be all that is tested.
        forget_hashes(home.path());
        let ended = run_in(home.path(), target.call);
        refused += usize::from(!ended.status.success());
        let result = check_manners(&ended).and_then(|()| {
            check_output(home.path(), ended.status.success(), target.call.contains("--out out"))
        });
        if let Err(why) = result {
            let kept = std::env::temp_dir().join(format!("weavelight-mutation-{k}"));
            copy(home.path(), &kept);
            failures.push(format!("{k} ({}): {}: {name}: {why}", kept.display(), target.call));
        }
    }
    println!("{count} mutated files, {refused} refused, {:.0} s", start.elapsed().as_secs_f64());
    assert!(failures.is_empty(), "{}\n{} failed", failures.join("\n"), failures.len());
}

fn forget_hashes(home: &Path) {
    for name in ["rig/swatch/session.toml", "rig/grey/session.toml"] {
        let Ok(text) = fs::read_to_string(home.join(name)) else { continue };
        let kept = text.lines().filter(|line| !line.starts_with("sha256"));
        fs::write(home.join(name), kept.collect::<Vec<_>>().join("\n")).unwrap();
    }
}

fn check_output(home: &Path, done: bool, writes: bool) -> Result<(), String> {
    let (left, out) = (leftovers(home), home.join("out"));
    if !left.is_empty() {
        return Err(format!("left {left:?}"));
    }
    if writes && done != out.exists() {
        return Err(format!("done: {done}, but the output exists: {}", out.exists()));
    }
    for name in ["normal.exr", "albedo.exr", "confidence.exr"] {
        let map = out.join(name);
        if map.exists() && !finite(&map) {
            return Err(format!("{name} holds numbers that are not finite"));
        }
    }
    Ok(())
}

fn finite(map: &Path) -> bool {
    use exr::prelude::*;
    let image = read_all_flat_layers_from_file(map).unwrap();
    let mut samples = image.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
    samples.all(|channel| match &channel.sample_data {
        FlatSamples::F32(values) => values.iter().all(|value| value.is_finite()),
        FlatSamples::F16(values) => values.iter().all(|value| value.to_f32().is_finite()),
        FlatSamples::U32(_) => true,
    })
}

fn mutated(bytes: &[u8], name: &str, numbers: &mut Numbers) -> Vec<u8> {
    let text = [".toml", ".lp", ".txt"].iter().any(|ending| name.ends_with(ending));
    if text && numbers.below(4) > 0 {
        mutated_text(&String::from_utf8_lossy(bytes), numbers).into_bytes()
    } else {
        mutated_bytes(bytes, numbers)
    }
}

/// Numbers at the edges of what 8 to 64 bits hold.
const EDGES: [u64; 8] = [0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFF_FFFF, 0xFFFF_FFFF];

fn mutated_bytes(bytes: &[u8], numbers: &mut Numbers) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let header = bytes.len().min(600);
    for _ in 0..=numbers.below(4) {
        // Most of what matters is at the beginning.
        let reach = if numbers.below(3) > 0 { header } else { bytes.len() };
        let at = numbers.below(reach);
        match numbers.below(6) {
            0 if at < bytes.len() => bytes[at] ^= 1 << numbers.below(8),
            1 if at < bytes.len() => bytes[at] = numbers.next() as u8,
            2 => {
                let width = [1, 2, 4, 8][numbers.below(4)];
                let value = EDGES[numbers.below(EDGES.len())].to_le_bytes();
                let end = (at + width).min(bytes.len());
                bytes[at.min(end)..end].copy_from_slice(&value[..end - at.min(end)]);
            }
            3 => bytes.truncate(at),
            4 => {
                let block: Vec<u8> =
                    bytes[at.min(bytes.len())..].iter().take(64).copied().collect();
                bytes.splice(at.min(bytes.len())..at.min(bytes.len()), block);
            }
            _ => bytes.extend((0..numbers.below(200)).map(|k| k as u8)),
        }
    }
    bytes
}

/// What a number in a text may become.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "1e300",
    "-1e300",
    "1e-300",
    "nan",
    "inf",
    "0.0",
    "99999999999999999999",
    "1e9",
    "-0.0",
    "1e-9",
    "\"x\"",
    "[1, 2]",
];
/// What may stand where nothing should.
const STRANGE: [&str; 6] = ["\u{1b}[31mred", "\u{202e}", "\u{0}", "= =", "[[[[[[[[", "\u{feff}"];

fn mutated_text(text: &str, numbers: &mut Numbers) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..=numbers.below(2) {
        let at = numbers.below(lines.len());
        match numbers.below(7) {
            0..=2 => lines[at] = with_another_number(&lines[at], numbers),
            3 => drop(lines.remove(at)),
            4 => lines.insert(at, lines[at].clone()),
            5 => lines[at].push_str(STRANGE[numbers.below(STRANGE.len())]),
            _ => lines[at] = lines[at].replacen(" = ", " = \"", 1),
        }
        if lines.is_empty() {
            break;
        }
    }
    lines.join("\n")
}

fn with_another_number(line: &str, numbers: &mut Numbers) -> String {
    let is_part = |letter: char| letter.is_ascii_digit() || matches!(letter, '.' | '-' | 'e' | '+');
    let value = line.find(" = ").map_or(0, |at| at + 3);
    let starts: Vec<usize> = line
        .char_indices()
        .filter(|(at, letter)| *at >= value && letter.is_ascii_digit())
        .map(|(at, _)| at)
        .filter(|at| *at == value || !line[..*at].ends_with(is_part))
        .collect();
    if starts.is_empty() {
        return line.to_owned();
    }
    let start = starts[numbers.below(starts.len())];
    let end = line[start..].find(|letter| !is_part(letter)).map_or(line.len(), |end| start + end);
    format!("{}{}{}", &line[..start], NUMBERS[numbers.below(NUMBERS.len())], &line[end..])
}
