//! Effects of real instruments, one at a time, from pictures to figures.

use super::bench::{Bench, SIX_SHEETS, WHITE, lights_of};
use weavelight::compare::{self, Kind, NormalFigures};
use weavelight::instrument::{Calibration, Defects};
use weavelight::raw::{self, Hint, Samples};
use weavelight::session::Session;
use weavelight::simulate::{Material, Part};
use weavelight_calibration::description::Light;
use weavelight_sim::cloth::Preset;

#[test]
fn a_bent_response_is_corrected_and_a_nearly_straight_one_left_alone() {
    let parts = [&[Part::Grey], &WHITE[..]].concat();
    let bench = Bench::new(&parts, |o| o.flaws.bend = 0.03);
    bench.know(&["camera.toml"]);
    let color = bench.color().unwrap();
    let nonlinearity = color.nonlinearity.unwrap();
    assert!(nonlinearity > 0.002 && color.response.len() > 2, "{color:?}");
    assert!(
        color.warnings.iter().any(|w| w.contains("response is corrected")),
        "{:?}",
        color.warnings
    );
    // Within 0.2 % of the truth, scale aside, as far up as the patches under light 0 reach.
    let truth = |x: f64| 0.97 * x + 0.03 * x * x;
    let found = |x: f64| color.response.iter().rev().fold(0.0, |sum, c| sum * x + c);
    for x in [0.01, 0.02, 0.1, 0.2, 0.3, 0.4, 0.55] {
        let off = found(x) / truth(x) * truth(0.5) / found(0.5) - 1.0;
        assert!(off.abs() < 2e-3, "{off} at {x}");
    }
    bench.lights(&SIX_SHEETS).unwrap();
    let error = bench.position_rms_mm();
    assert!(error < 1.0, "{error} mm");

    let straight = Bench::new(&[Part::Grey], |o| o.flaws.bend = 0.001);
    let color = straight.color().unwrap();
    assert_eq!(color.response, [0.0, 1.0], "{:?}", color.nonlinearity);
}

#[test]
fn without_several_exposures_black_comes_from_the_ambient_frame() {
    let bench = Bench::new(&[Part::Grey], |o| o.flaws.ambient = 2.0);
    let mut session = Session::load(&bench.rig("grey")).unwrap();
    session.frames.retain(|entry| !entry.file.to_string_lossy().contains("exposure"));
    session.save().unwrap();
    let color = bench.color().unwrap();
    assert!(color.black_from.contains("ambient"), "{}", color.black_from);
    assert!(color.black_level.iter().all(|b| (b - 600.0).abs() < 1.0), "{:?}", color.black_level);
    assert!(color.warnings.iter().any(|w| w.contains("linearity was not tested")));
}

/// Photosites of the simulated sensor that read the same number in every frame: stuck at the top, stuck at black.
fn stuck(bench: &Bench, session: &str) -> Defects {
    let session = Session::load(&bench.rig(session)).unwrap();
    let frames = session.frames.iter().map(|entry| {
        let frame = raw::decode(&session.read_frame(entry).unwrap(), &Hint::default()).unwrap();
        let Samples::U16(samples) = frame.samples else { panic!("simulated RAW is integer") };
        (frame.width, samples)
    });
    let frames: Vec<(usize, Vec<u16>)> = frames.collect();
    let width = frames[0].0;
    let all = |value: u16| -> Vec<[u32; 2]> {
        (0..frames[0].1.len())
            .filter(|k| frames.iter().all(|(_, samples)| samples[*k] == value))
            .map(|k| [(k % width) as u32, (k / width) as u32])
            .collect()
    };
    Defects::new(all(16_383), all(600))
}

fn normals(bench: &Bench, solution: &str) -> NormalFigures {
    let (a, b) = (bench.beside(solution).join("normal.exr"), bench.rig("truth/normal.exr"));
    let options = compare::Options { a, b, mask: None, kind: Some(Kind::Normal) };
    match compare::run(&options).unwrap().figures {
        compare::Figures::Normal(figures) => figures,
        compare::Figures::Color(_) => panic!("normals were compared"),
    }
}

#[test]
fn defective_photosites_are_found_and_drop_out() {
    let parts = [&[Part::Board, Part::Grey, Part::Swatch], &WHITE[..]].concat();
    let bench = |defects: f64| {
        let bench = Bench::new(&parts, |o| {
            o.material = Material { preset: Preset::Facets, ..Material::default() };
            o.flaws.defects = defects;
        });
        let camera = bench.camera().unwrap();
        assert!(camera.rms_reprojection_px < 0.06, "{}", camera.rms_reprojection_px);
        bench.color().unwrap();
        bench.lights(&SIX_SHEETS).unwrap();
        let error = bench.position_rms_mm();
        assert!(error < 1.0, "{error} mm with defects {defects}");
        let report = bench.solve("swatch", &bench.found(), "out");
        (bench, report)
    };
    let ((clean, without), (spoilt, with)) = (bench(0.0), bench(1e-3));
    let truth = stuck(&spoilt, "grey");
    let found = Calibration::load(&spoilt.found()).unwrap().defects;
    let known = |list: &[[u32; 2]], truth: &[[u32; 2]]| {
        list.iter().filter(|place| truth.contains(place)).count()
    };
    for (found, truth) in [(found.hot(), truth.hot()), (found.dead(), truth.dead())] {
        let right = known(found, truth);
        assert!(truth.len() > 80, "{}", truth.len());
        assert!(right * 100 >= 97 * truth.len(), "{right} of {} found", truth.len());
        assert!(found.len() - right <= 2, "{} wrongly listed", found.len() - right);
    }
    assert_eq!(without.defective_pixels, 0);
    assert_eq!(with.defective_pixels, found.count() as u64);
    assert_eq!(with.outcomes["defective"], with.defective_pixels);
    assert!(with.solved + with.defective_pixels <= with.pixels);
    assert!(with.saturated_pixels < with.defective_pixels / 10, "{}", with.saturated_pixels);
    let (clean, spoilt) = (normals(&clean, "out"), normals(&spoilt, "out"));
    assert!(spoilt.rms_deg < 1.03 * clean.rms_deg, "{spoilt:?} {clean:?}");
}

#[test]
fn a_strip_tells_poses_that_nobody_stated() {
    let bench = Bench::new(&WHITE, |o| o.targets.state_planes = false);
    bench.know(&["camera.toml"]);
    let report = bench.lights(&SIX_SHEETS).unwrap();
    let error = bench.position_rms_mm();
    let sigma = report.lights.iter().map(|l| l.position_sigma_mm.unwrap().powi(2)).sum::<f64>();
    let sigma = (3.0 * sigma / report.lights.len() as f64).sqrt();
    assert!(error < 2.0 * sigma && error < 6.0, "{error} mm where {sigma} mm is expected");
    for (sheet, tilt) in report.sheets.iter().zip([0.0, 0.0, 20.0, 20.0, 20.0, 20.0]) {
        assert!((sheet.tilt_deg - tilt).abs() < 1.5, "{}: {}", sheet.name, sheet.tilt_deg);
    }
}

#[test]
fn far_lights_are_found_too() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("rig.toml");
    let directions: Vec<[f64; 3]> = (0..8)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * 45f64.to_radians()).sin_cos();
            let low = if k % 2 == 0 { 0.9 } else { 0.5 };
            [low * cos, low * sin, 0.8]
        })
        .collect();
    let light = |d: &[f64; 3]| format!("[[lights]]\nkind = \"directional\"\ndirection = {d:?}\n");
    let rig = "schema = 1\nname = \"far\"\n[camera]\nkind = \"simulated\"\nwidth_px = 616\nheight_px = 408\n\
        focal_length_mm = 35.0\npixel_pitch_um = 38.24\nheight_mm = 610.0\n";
    std::fs::write(&path, rig.to_owned() + &directions.iter().map(light).collect::<String>())
        .unwrap();
    let bench = Bench::new(&WHITE, |o| {
        o.rig = Some(path.clone());
        o.size_px = None;
    });
    bench.know(&["camera.toml"]);
    let report = bench.lights(&SIX_SHEETS).unwrap();
    assert!(report.lights.iter().all(|light| light.position_mm.is_none()));
    for (k, (found, truth)) in
        lights_of(&bench.found()).iter().zip(lights_of(&bench.truth())).enumerate()
    {
        let (Light::Directional(found), Light::Directional(truth)) = (found, &truth) else {
            panic!("light {k} is near");
        };
        let off = found.direction.angle(&truth.direction).to_degrees();
        assert!(off < 0.05, "light {k}: {off} degrees off");
        for (found, truth) in found.intensity.iter().zip(&truth.intensity) {
            // Vignetting is in the gain map, the sheet's unevenness in both.
            assert!((found / truth - 1.0).abs() < 0.02, "light {k}: {found} for {truth}");
        }
    }
    let check = bench.check(&["white-tilt-2"]).unwrap();
    assert!(check.passed, "{check:?}");
}

#[test]
fn dust_and_a_hand_cost_little() {
    let bench = Bench::new(&WHITE, |o| {
        o.targets.dust_per_dm2 = 20.0;
        o.targets.hand = Some(4);
    });
    bench.know(&["camera.toml"]);
    let report = bench.lights(&SIX_SHEETS).unwrap();
    let error = bench.position_rms_mm();
    assert!(error < 1.5, "{error} mm");
    assert!(report.lights[4].rejected > 0.02, "{}", report.lights[4].rejected);
    assert!(report.warnings.iter().any(|w| w.contains("light 4")), "{:?}", report.warnings);
}

#[test]
fn drift_is_named() {
    let bench = Bench::new(&[Part::WhiteFlat], |o| o.flaws.drift = 0.02);
    bench.know(&["camera.toml"]);
    let report = bench.lights(&["white-flat"]).unwrap();
    let told = report.warnings.iter().any(|w| w.contains("light 0") && w.contains("drifted"));
    assert!(told, "{:?}", report.warnings);
}
