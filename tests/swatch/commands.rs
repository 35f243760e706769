//! What the commands leave undone, and that what they do is the same.

use crate::photograph::{Field, Scan};
use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;
use weavelight::simulate::Material;
use weavelight_sim::cloth::Preset;

fn scan() -> Scan {
    let material =
        Material { preset: Preset::Knit, extent_mm: Some([12.0, 8.0]), ..Material::default() };
    Scan::new(Field::Close, [256, 160], material, |_| {})
}

/// Runs the program: exit status, the JSON object on standard output, standard error.
fn run(arguments: &[&str]) -> (i32, Value, String) {
    let output =
        Command::cargo_bin("weavelight").unwrap().args(arguments).arg("--json").output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    let json = serde_json::from_str(&text(&output.stdout)).unwrap_or(Value::Null);
    (output.status.code().unwrap(), json, text(&output.stderr))
}

fn solve(scan: &Scan, out: &Path, more: &[&str]) -> Value {
    let (session, calibration) = (scan.path("swatch"), scan.path("calibration"));
    let fixed =
        ["solve", session.to_str().unwrap(), "--calibration", calibration.to_str().unwrap()];
    let out = ["--out", out.to_str().unwrap()];
    let (status, json, stderr) = run(&[&fixed[..], &out[..], more].concat());
    assert_eq!(status, 0, "{stderr}");
    json
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn what_nobody_asks_for_is_not_made_and_the_rest_is_the_same() {
    let scan = scan();
    let (full, part) = (scan.path("full"), scan.path("part"));
    solve(&scan, &full, &[]);
    let check = |only: &str, expected: &[&str]| {
        solve(&scan, &part, &["--force", "--only", only]);
        let always = ["camera.toml", "mask.png", "report.json"];
        let mut names = [expected, &always].concat();
        names.sort_unstable();
        let mut found = files(&part);
        found.retain(|name| name != weavelight::files::LIST_FILE);
        assert_eq!(found, names, "--only {only}");
        for name in names.iter().filter(|name| !name.starts_with("report")) {
            let same = fs::read(part.join(name)).unwrap() == fs::read(full.join(name)).unwrap();
            assert!(same, "--only {only}: {name} is another");
        }
    };
    check("normal", &["normal.exr"]);
    check("normal,png", &["normal.exr", "normal.png"]);
    check("albedo,confidence", &["albedo.exr", "confidence.exr"]);
    check("shade", &["shade.exr"]);
    check("page", &["report.html"]);
}

#[test]
fn what_has_not_changed_is_not_solved_again() {
    let scan = scan();
    let out = scan.path("maps");
    let made = |more: &[&str]| {
        let before = fs::metadata(out.join("report.json")).and_then(|file| file.modified()).ok();
        solve(&scan, &out, more);
        before != fs::metadata(out.join("report.json")).and_then(|file| file.modified()).ok()
    };
    assert!(made(&[]), "nothing there");
    assert!(!made(&[]), "the same again");
    assert!(!made(&["--only", "normal"]), "less of the same");
    assert!(made(&["--force"]), "asked to");
    assert!(made(&["--mask", "auto"]), "another mask");
    assert!(!made(&["--mask", "auto"]), "that mask again");
    assert!(made(&["--albedo", "appearance"]), "another albedo");
    assert!(!made(&["--albedo", "appearance"]), "that albedo again");
    assert!(made(&["--preview", "4"]), "a preview");
    assert!(!made(&["--preview", "4"]), "that preview again");
    assert!(made(&["--only", "normal"]), "the whole again");
    assert!(made(&[]), "maps that are missing");
}

#[test]
fn a_preview_is_a_small_solution() {
    let scan = scan();
    for (side, size) in [("8", [32, 20]), ("4", [64, 40]), ("2", [128, 80])] {
        let out = scan.path(&format!("preview-{side}"));
        let report = solve(&scan, &out, &["--preview", side]);
        assert_eq!(report["size_px"], serde_json::json!(size));
        assert_eq!(report["scale"].to_string(), side);
        let full = 0.083 * side.parse::<f64>().unwrap();
        assert!((report["mm_per_px"].as_f64().unwrap() / full - 1.0).abs() < 0.02, "{report}");
        let camera: toml::Table =
            toml::from_str(&fs::read_to_string(out.join("camera.toml")).unwrap()).unwrap();
        assert_eq!(camera["width_px"].as_integer(), Some(size[0]));
        assert!(files(&out).contains(&"confidence.exr".to_owned()));
    }
}

#[test]
fn an_edited_mask_is_kept_and_heeded() {
    let scan = scan();
    let (session, calibration) = (scan.path("swatch"), scan.path("calibration"));
    let fixed = ["mask", session.to_str().unwrap(), "--calibration", calibration.to_str().unwrap()];
    let (status, found, stderr) = run(&fixed);
    assert_eq!(status, 0, "{stderr}");
    assert!(found["table_share"].as_f64().unwrap() > 0.3, "{found}");
    assert!(
        fs::read_to_string(session.join("session.toml")).unwrap().contains("mask = \"mask.png\"")
    );
    assert_eq!(run(&fixed).1["up_to_date"], true);
    let picture = session.join("mask.png");
    let auto = solve(&scan, &scan.path("auto"), &["--mask", "auto"]);
    let masked = solve(&scan, &scan.path("masked"), &[]);
    assert_eq!(masked["solved"], auto["solved"]);
    let all = solve(&scan, &scan.path("all"), &["--mask", "none"]);
    assert!(all["solved"].as_u64() > masked["solved"].as_u64());
    // Somebody paints a hole.
    let mut edited = image::open(&picture).unwrap().into_luma8();
    (0..50).for_each(|x| edited.put_pixel(110 + x, 80, image::Luma([0])));
    edited.save(&picture).unwrap();
    let (status, _, stderr) = run(&fixed);
    assert_eq!(status, 1);
    assert!(stderr.contains("may have been edited and was kept"), "{stderr}");
    let with_hole = solve(&scan, &scan.path("masked"), &[]);
    assert_eq!(
        with_hole["outcomes"]["masked"].as_u64(),
        masked["outcomes"]["masked"].as_u64().map(|n| n + 50)
    );
    let (status, again, stderr) = run(&[&fixed[..], &["--force"]].concat());
    assert_eq!((status, &again["up_to_date"]), (0, &Value::Bool(false)));
    assert!(stderr.contains("is kept as") && stderr.contains("mask-1.png"), "{stderr}");
    let kept = image::open(session.join("mask-1.png")).unwrap().into_luma8();
    assert_eq!(kept, edited, "the edited one lost nothing");
    // The same again has nothing to keep.
    assert_eq!(run(&[&fixed[..], &["--force"]].concat()).0, 0);
    assert!(!session.join("mask-2.png").exists());
    assert_eq!(image::open(&picture).unwrap().into_luma8().get_pixel(120, 80).0, [255]);
    // Elsewhere it is nobody's mask but one's own.
    let elsewhere = scan.path("elsewhere.png");
    let (_, made, _) = run(&[&fixed[..], &["--out", elsewhere.to_str().unwrap()]].concat());
    assert_eq!(made["named_in_session"], false);
}
