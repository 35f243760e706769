use super::*;
use crate::instrument::{Calibration, Rig};
use crate::raw::{Layout, Samples};
use crate::session::{Kind, Session};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use weavelight_calibration::description::Light;
use weavelight_sim::cloth::Preset;

fn small(out: &Path) -> Options {
    Options {
        out: out.to_owned(),
        size_px: Some([156, 104]),
        material: Material { preset: Preset::Facets, ..Material::default() },
        targets: Targets { boards: 3, tilts: 1, ..Targets::default() },
        ..Options::default()
    }
}

fn simulate(options: &Options) -> Summary {
    run(options, &|_, _| {}).unwrap()
}

/// Every file below a folder with its bytes.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            found.extend(contents(&entry));
        } else {
            found.insert(entry.clone(), fs::read(&entry).unwrap());
        }
    }
    found
}

#[test]
fn everything_that_is_written_reads_back() {
    let temp = tempfile::tempdir().unwrap();
    let out = temp.path().join("sim");
    let summary = simulate(&small(&out));
    let expected = ["board", "grey", "white-flat", "white-raised", "white-tilt-1", "swatch"];
    assert_eq!(summary.sessions, expected);
    let rig = Rig::load(&out.join("rig.toml")).unwrap();
    assert_eq!((rig.lights.len(), rig.camera.width_px, rig.camera.height_px), (10, 156, 104));
    let calibration = Calibration::load(&out.join("calibration")).unwrap();
    assert_eq!(calibration.lights.len(), 10);
    assert!(calibration.camera.is_some() && calibration.lights[0].gain_map.is_some());
    let mut frames = 0;
    for (name, kind) in expected.iter().zip([
        Kind::Board,
        Kind::Grey,
        Kind::White,
        Kind::White,
        Kind::White,
        Kind::Swatch,
    ]) {
        let session = Session::load(&out.join(name)).unwrap();
        session.check_files().unwrap();
        session.check_lights(10).unwrap();
        assert_eq!(session.kind, kind, "{name}");
        frames += session.frames.len();
    }
    assert_eq!(frames, summary.frames);
    for truth in ["normal.exr", "albedo.exr", "height.exr"] {
        assert!(crate::raster::read_exr(&out.join("truth").join(truth)).is_ok(), "{truth}");
    }
    let left = fs::read_dir(temp.path()).unwrap().count();
    assert_eq!(left, 1, "something temporary is left beside the output");
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let temp = tempfile::tempdir().unwrap();
    let out = temp.path().join("sim");
    let mut options = small(&out);
    options.only = vec![Part::Swatch, Part::Board];
    let in_threads = |threads: usize, options: &Options| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| simulate(options));
        contents(&out)
    };
    let one = in_threads(1, &options);
    let three = in_threads(3, &options);
    assert_eq!(one.keys().collect::<Vec<_>>(), three.keys().collect::<Vec<_>>());
    let differ: Vec<_> =
        one.iter().filter(|(path, bytes)| three[*path] != **bytes).map(|(path, _)| path).collect();
    assert!(differ.is_empty(), "with three threads other bytes in {differ:?}");
    options.seed = 2;
    assert!(one != in_threads(1, &options), "another seed");
}

/// Signals of a frame: black subtracted, fraction of the range; per photosite.
fn signals(folder: &Path, file: &str) -> Vec<f32> {
    let frame = crate::raw::decode(&std::fs::read(folder.join(file)).unwrap(), &Default::default())
        .unwrap();
    assert!(matches!(frame.layout, Layout::Mosaic(_)));
    let Samples::U16(samples) = &frame.samples else { panic!("a mosaic of floats") };
    assert_eq!((frame.black, frame.saturation), ([600.0; 4], [16383.0; 4]));
    samples.iter().map(|&n| (f32::from(n) - 600.0) / 15783.0).collect()
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

#[test]
fn flaws_show_where_they_were_asked_for() {
    let temp = tempfile::tempdir().unwrap();
    let make = |name: &str, change: &dyn Fn(&mut Options)| {
        let mut options = small(&temp.path().join(name));
        options.only = vec![Part::WhiteFlat];
        change(&mut options);
        simulate(&options);
        options.out.join("white-flat")
    };
    let level = |folder: &Path, file: &str| mean(&signals(folder, file));
    let plain = make("plain", &|_| {});
    let swapped = make("swapped", &|o| o.flaws.swapped = Some([1, 3]));
    assert_eq!(
        level(&plain, "light-01.dng") > level(&plain, "light-03.dng"),
        level(&swapped, "light-01.dng") < level(&swapped, "light-03.dng")
    );
    let dead = make("dead", &|o| o.flaws.dead = Some(2));
    assert!(level(&dead, "light-02.dng") < 0.01 && level(&dead, "light-04.dng") > 0.2);
    let drift = make("drift", &|o| o.flaws.drift = 0.05);
    let change = level(&drift, "drift-check.dng") / level(&drift, "light-00.dng");
    assert!((change - 1.05).abs() < 0.003, "{change}");
    let bright = make("bright", &|o| o.flaws.exposure_factor = 4.0);
    assert!(signals(&bright, "light-06.dng").iter().filter(|s| **s >= 1.0).count() > 1000);
    let hand = make("hand", &|o| o.targets.hand = Some(5));
    assert!(level(&hand, "light-05.dng") < 0.95 * level(&plain, "light-05.dng"));
    assert!((level(&hand, "light-04.dng") / level(&plain, "light-04.dng") - 1.0).abs() < 0.01);
}

#[test]
fn the_ruler_errs_as_told_and_the_calibration_does_not() {
    let temp = tempfile::tempdir().unwrap();
    let mut options = small(&temp.path().join("sim"));
    options.only = vec![Part::Board];
    options.flaws.ruler_error_mm = 15.0;
    simulate(&options);
    let rig = Rig::load(&options.out.join("rig.toml")).unwrap();
    let truth = Calibration::load(&options.out.join("calibration")).unwrap();
    let errors: Vec<f64> = rig
        .lights
        .iter()
        .zip(&truth.lights)
        .flat_map(|(known, exact)| match (&known.place, &exact.light) {
            (crate::instrument::RigLightPlace::Point { position_mm, .. }, Light::Point(light)) => {
                (position_mm - light.position_mm).as_slice().to_vec()
            }
            other => panic!("{other:?}"),
        })
        .collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    assert!((9.0..21.0).contains(&rms), "RMS {rms} mm over {} axes", errors.len());
}

#[test]
fn impossible_options_are_named_and_leave_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let check = |change: &dyn Fn(&mut Options), expected: &str| {
        let mut options = small(&temp.path().join("sim"));
        change(&mut options);
        let error = run(&options, &|_, _| {}).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
        assert_eq!(fs::read_dir(temp.path()).unwrap().count(), 0);
    };
    check(&|o| o.material.thickness_mm = -1.0, "thickness is -1;");
    check(&|o| o.material.thickness_mm = f64::NAN, "thickness is NaN;");
    check(&|o| o.material.threads_per_cm = Some(0.0), "threads per cm is 0;");
    check(&|o| o.size_px = Some([0, 100]), "size is 0x100;");
    check(&|o| o.size_px = Some([100, 1 << 40]), "size");
    check(&|o| o.flaws.dead = Some(10), "dead is 10;");
    check(&|o| o.rig = Some("nowhere.toml".into()), "nowhere.toml");
}

#[test]
fn any_rig_can_be_simulated() {
    let temp = tempfile::tempdir().unwrap();
    let rig = temp.path().join("bench.toml");
    fs::write(
        &rig,
        "schema = 1\n[camera]\nmodel = \"Nikon D5100\"\nwidth_px = 90\nheight_px = 120\nfocal_length_mm = 50.0\n\
         pixel_pitch_um = 160.0\nheight_mm = 800.0\n\
         [[lights]]\nposition_mm = [300.0, 0.0, 300.0]\n\
         [[lights]]\nkind = \"directional\"\ndirection = [-0.6, 0.0, 0.8]\n\
         [[lights]]\nposition_mm = [0.0, 300.0, 400.0]\n",
    )
    .unwrap();
    let options = Options {
        rig: Some(rig),
        size_px: None,
        only: vec![Part::Swatch],
        ..small(&temp.path().join("sim"))
    };
    let summary = simulate(&options);
    assert_eq!((summary.size_px, summary.frames), ([90, 120], 5));
    let calibration = Calibration::load(&options.out.join("calibration")).unwrap();
    let focal = calibration.camera.unwrap().fx;
    assert!((focal / 312.5 - 1.0).abs() < 0.01, "fx {focal}");
    assert!(matches!(calibration.lights[1].light, Light::Directional(_)));
    let swatch = signals(&options.out.join("swatch"), "light-01.dng");
    assert!(mean(&swatch) > 0.02);
}
