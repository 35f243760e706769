//! `weavelight solve --device`, as a user calls it.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]

mod support;

use serde_json::Value;
use support::Home;

fn device(home: &Home, folder: &str) -> Value {
    let report: Value = serde_json::from_str(&home.read(&format!("{folder}/report.json"))).unwrap();
    report["device"].clone()
}

#[cfg(feature = "gpu")]
#[test]
fn the_graphics_processor_says_the_same() {
    let home = Home::new();
    for name in ["cpu", "gpu"] {
        let call = format!("solve s --calibration c --out {name} --device {name}");
        let said = home.run(&call);
        assert_eq!(said.status, Some(0), "{}", said.stderr);
    }
    let [cpu, gpu] = ["cpu", "gpu"].map(|name| device(&home, name));
    assert_eq!((&cpu["kind"], &cpu["adapter"]), (&Value::from("cpu"), &Value::Null));
    assert_eq!(gpu["kind"], "gpu");
    assert!(!gpu["adapter"].as_str().unwrap().is_empty());
    assert!(gpu["sent_mb"].as_f64().unwrap() > 0.0 && gpu["busy_s"].as_f64().unwrap() > 0.0);
    let off = home.run("compare gpu/normal.exr cpu/normal.exr --json").json();
    assert!(off["max_deg"].as_f64().unwrap() <= 1e-3, "{off}");
}

#[cfg(feature = "gpu")]
#[test]
fn without_a_device_only_who_asks_for_it_is_told() {
    let home = Home::new();
    let nowhere = [("VK_DRIVER_FILES", "/nowhere.json"), ("VK_ICD_FILENAMES", "/nowhere.json")];
    let said = home.run_with("solve s --calibration c --out a --device gpu", &nowhere);
    said.expect_failure("no device", 1, &["no Vulkan device", "mesa-vulkan-drivers"]);
    let said = home.run_with("solve s --calibration c --out a", &nowhere);
    // What else may be said is about the picture.
    let about_devices = ["Vulkan", "graphics", "--device"].map(|word| said.stderr.contains(word));
    assert_eq!((said.status, about_devices), (Some(0), [false; 3]), "{}", said.stderr);
    assert_eq!(device(&home, "a")["kind"], "cpu");
}

#[cfg(not(feature = "gpu"))]
#[test]
fn a_program_without_it_says_how_to_get_it() {
    let home = Home::new();
    home.run("solve s --calibration c --out a --device gpu").expect_failure(
        "not built",
        1,
        &["`gpu` feature"],
    );
    assert_eq!(home.run("solve s --calibration c --out a").status, Some(0));
    assert_eq!(device(&home, "a")["kind"], "cpu");
}
