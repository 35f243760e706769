//! The run from folder to folder, over small capture sessions of 16-bit PNG.

use super::scenes::{Recipe, scene};
use super::with_warnings;
use crate::files::Provenance;
use crate::instrument::{MeasuredCamera, write_camera, write_color, write_lights};
use crate::linear::Exposure;
use crate::photometry::Albedo;
use crate::photometry::Method;
use crate::raw::{Layout, Samples};
use crate::session::{FrameEntry, Kind, Session};
use crate::solution;
use crate::solution::{AlbedoKind, Grid, NormalY, Outputs, Residuals, Reuse};
use crate::solve::output::finish::finish;
use crate::solve::run::albedo_changes;
use crate::solve::*;
use crate::swatch::MaskChoice;
use std::collections::BTreeMap;
use std::path::Path;
use weavelight_calibration::description::Light;

/// A capture session and its calibration on disk.
struct Folders {
    root: tempfile::TempDir,
    session: Session,
}

impl Folders {
    fn of(scene: &Scene) -> Self {
        let root = tempfile::tempdir().unwrap();
        let calibration = root.path().join("calibration");
        let none = Provenance::default();
        let camera = MeasuredCamera::new(scene.camera.clone().unwrap());
        write_camera(&calibration, &camera, &none).unwrap();
        write_color(&calibration, &scene.color, &none).unwrap();
        let lights: Vec<_> = scene.lights.iter().map(|light| light.calibrated.clone()).collect();
        write_lights(&calibration, &lights, &none).unwrap();
        let mut session = Session::new(root.path().join("session"), Kind::Swatch, "made");
        session.plane = Some(scene.plane.clone());
        std::fs::create_dir(&session.folder).unwrap();
        for light in &scene.lights {
            for exposure in &light.exposures {
                session.frames.push(write_frame(&session.folder, exposure, Some(light.index)));
            }
        }
        for exposure in &scene.ambient {
            session.frames.push(write_frame(&session.folder, exposure, None));
        }
        session.save().unwrap();
        Self { root, session }
    }

    fn options(&self) -> Options {
        let root = self.root.path();
        let options =
            Options::new(root.join("session"), root.join("calibration"), root.join("out"));
        Options { reuse: Reuse::Never, ..options }
    }

    fn run(&self, options: &Options) -> BTreeMap<String, Vec<u8>> {
        run(options, &|_| {}, None).unwrap();
        let files = std::fs::read_dir(&options.out).unwrap().map(|entry| entry.unwrap());
        files
            .map(|file| {
                (
                    file.file_name().to_string_lossy().into_owned(),
                    std::fs::read(file.path()).unwrap(),
                )
            })
            // Seconds differ from run to run.
            .filter(|(name, _)| name != solution::REPORT_JSON && name != crate::files::LIST_FILE)
            .collect()
    }
}

fn write_frame(folder: &Path, exposure: &Exposure, light: Option<usize>) -> FrameEntry {
    let name = exposure.path.file_name().unwrap().to_string_lossy().into_owned();
    let frame = &exposure.frame;
    let Samples::U16(samples) = &frame.samples else { panic!("made of integers") };
    let (width, height) = (frame.width as u32, frame.height as u32);
    let path = folder.join(&name);
    match frame.layout {
        Layout::Rgb => {
            image::ImageBuffer::<image::Rgb<u16>, _>::from_raw(width, height, samples.clone())
                .unwrap()
                .save(&path)
                .unwrap();
        }
        _ => image::ImageBuffer::<image::Luma<u16>, _>::from_raw(width, height, samples.clone())
            .unwrap()
            .save(&path)
            .unwrap(),
    }
    let mut entry = FrameEntry::new(name, light, exposure.exposure_s, exposure.iso);
    entry.cfa = match frame.layout {
        Layout::Mosaic(cfa) => Some(cfa),
        _ => None,
    };
    entry.sha256 = Some(crate::files::sha256_of_file(&path).unwrap());
    entry
}

fn names(files: &BTreeMap<String, Vec<u8>>) -> Vec<&str> {
    files.keys().map(String::as_str).collect()
}

#[test]
fn a_run_writes_what_the_kernels_found() {
    for layout in
        [Layout::Mosaic(weavelight_calibration::description::Cfa::RGGB), Layout::Grey, Layout::Rgb]
    {
        let scene = scene(Recipe { ambient: true, layout, ..Recipe::default() });
        let folders = Folders::of(&scene);
        let options = folders.options();
        let files = folders.run(&options);
        let expected = [
            "albedo.exr",
            "albedo.png",
            "camera.toml",
            "confidence.exr",
            "mask.png",
            "normal.exr",
            "normal.png",
            "shade.exr",
        ];
        assert_eq!(names(&files), expected);
        let (maps, _) = with_warnings(&scene, Method::Auto).unwrap();
        let exr = crate::raster::read_exr(&options.out.join("normal.exr")).unwrap();
        for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
            let written = exr.channel(name).unwrap();
            let same = written.iter().zip(&maps.normal.data).all(|(w, n)| *w == n[axis]);
            assert!(same, "{layout:?}: channel {name} is not the kernel's");
        }
        let report = solution::Solution::load(&options.out).unwrap().report;
        assert_eq!(report.lights_used, (0..10).collect::<Vec<_>>());
        assert_eq!((report.pixels, report.solved), (3500, maps.counts.solved() as u64));
        // The picture is smaller than a window of the colours.
        let [said] = &report.warnings[..] else { panic!("{:?}", report.warnings) };
        assert!(said.starts_with("The albedo is as it appears"), "{said}");
        assert_eq!(report.albedo.unwrap().kind, "appearance");
        assert!((report.mm_per_px.unwrap() - 3.0).abs() < 0.2, "{:?}", report.mm_per_px);
    }
}

#[test]
fn albedo_times_shade_is_the_photosites_own_value() {
    let cfa = weavelight_calibration::description::Cfa::RGGB;
    let recipe =
        Recipe { width: 160, height: 150, layout: Layout::Mosaic(cfa), ..Recipe::default() };
    let scene = scene(recipe);
    let (maps, _) = with_warnings(&scene, Method::Auto).unwrap();
    let Albedo::Mosaic(own, _) = &maps.albedo else { panic!("a mosaic gives a mosaic") };
    let own = own.clone();
    let inverse = scene.color.camera_to_linear_srgb.map(|matrix| matrix.try_inverse().unwrap());
    let make = |kind| finish(maps.clone(), &scene.color, Outputs::ALL, kind);
    let (reflectance, appearance) = (make(AlbedoKind::Reflectance), make(AlbedoKind::Appearance));
    assert_eq!(reflectance.albedo_report.kind, "reflectance");
    assert_eq!(appearance.albedo_report.kind, "appearance");
    assert!(appearance.shade.data.iter().all(|shade| [0.0, 1.0].contains(shade)));
    assert!(reflectance.shade.data.iter().all(|shade| (0.0..=1.0).contains(shade)));
    let camera = |rgb: [f32; 3]| {
        let rgb = nalgebra::Vector3::from(rgb).cast::<f64>();
        inverse.map_or(rgb, |inverse| inverse * rgb)
    };
    let mut compared = 0;
    for (k, value) in own.data.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        let channel = cfa.channel(k % 160, k / 160) as usize;
        for maps in [&reflectance, &appearance] {
            let rgb = maps.albedo.data[k];
            if rgb.iter().any(|v| [0.0, crate::albedo::BRIGHTEST].contains(v)) {
                continue;
            }
            let back = camera(rgb)[channel] * f64::from(maps.shade.data[k]);
            let off = (back / f64::from(*value) - 1.0).abs();
            assert!(off < 1e-5, "{k}: {back} and {value}");
            compared += 1;
        }
    }
    assert!(compared > 160 * 150, "{compared} photosites are no proof");
    for rgb in reflectance.albedo.data.iter().chain(&appearance.albedo.data) {
        assert!(rgb.iter().all(|v| (0.0..=crate::albedo::BRIGHTEST).contains(v)), "{rgb:?}");
    }
}

/// A solution from before shade was divided out holds no word of what its albedo is.
#[test]
fn that_the_albedo_changes_its_meaning_is_told_once() {
    let cfa = weavelight_calibration::description::Cfa::RGGB;
    let recipe =
        Recipe { width: 160, height: 150, layout: Layout::Mosaic(cfa), ..Recipe::default() };
    let folders = Folders::of(&scene(recipe));
    let report = run(&folders.options(), &|_| {}, None).unwrap().report;
    assert_eq!(report.albedo.as_ref().unwrap().kind, "reflectance");
    assert!(
        report.warnings.iter().all(|said| !said.contains("earlier solution")),
        "none was there"
    );
    let earlier = tempfile::tempdir().unwrap();
    assert_eq!(albedo_changes(earlier.path(), &report), None, "nothing is there");
    let silent = solution::Report { albedo: None, ..report.clone() };
    silent.write(&earlier.path().join("report.json")).unwrap();
    assert_eq!(albedo_changes(earlier.path(), &report), None, "it has no albedo");
    std::fs::write(earlier.path().join("albedo.exr"), "").unwrap();
    let said = albedo_changes(earlier.path(), &report).unwrap();
    assert!(said.contains("differs from that of the earlier solution"), "{said}");
    assert_eq!(albedo_changes(earlier.path(), &silent), None, "nothing changes");
    report.write(&earlier.path().join("report.json")).unwrap();
    assert_eq!(albedo_changes(earlier.path(), &report), None, "the second time");
}

/// Names of files that are not the same in both.
fn differing<'a>(a: &'a BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) -> Vec<&'a str> {
    a.iter()
        .filter(|(name, bytes)| b.get(*name) != Some(bytes))
        .map(|(name, _)| name.as_str())
        .collect()
}

#[test]
fn neither_threads_nor_the_order_of_frames_change_a_byte() {
    let recipe =
        Recipe { height: 150, ambient: true, exposures: 2, gain_maps: true, ..Recipe::default() };
    let mut folders = Folders::of(&scene(recipe));
    let mut options = Options { threads: Some(1), ..folders.options() };
    let expected = folders.run(&options);
    for threads in [2, 3, 7, 16] {
        options.threads = Some(threads);
        assert_eq!(differing(&folders.run(&options), &expected), [""; 0], "with {threads} threads");
    }
    folders.session.frames.reverse();
    folders.session.frames.swap(2, 9);
    folders.session.save().unwrap();
    assert_eq!(
        differing(&folders.run(&options), &expected),
        [""; 0],
        "with frames in another order"
    );
}

#[test]
fn directx_normals_flip_green_in_the_png_alone() {
    let folders = Folders::of(&scene(Recipe::default()));
    let up = folders.run(&folders.options());
    let down = folders.run(&Options { normal_y: NormalY::Down, ..folders.options() });
    for (name, bytes) in &up {
        assert_eq!(bytes == &down[name], name != "normal.png", "{name}");
    }
    let pixels = |files: &BTreeMap<String, Vec<u8>>| {
        image::load_from_memory(&files["normal.png"]).unwrap().into_rgb16().into_raw()
    };
    for (a, b) in pixels(&up).chunks(3).zip(pixels(&down).chunks(3)) {
        assert_eq!((a[0], a[2]), (b[0], b[2]));
        assert!((i32::from(a[1]) + i32::from(b[1]) - 65535).abs() <= 1, "{a:?} {b:?}");
    }
}

#[test]
fn what_does_not_belong_together_is_told_with_the_remedy() {
    let check = |expected: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = scene(Recipe { width: 12, height: 8, ambient: true, ..Recipe::default() });
        change(&mut scene);
        let folders = Folders::of(&scene);
        let error = run(&folders.options(), &|_| {}, None).unwrap_err().to_string();
        assert!(error.contains(expected), "expected {expected:?}, got: {error}");
        assert!(error.lines().count() <= 2, "{error}");
        assert!(!folders.options().out.exists(), "something was left behind");
    };
    let crop = |exposure: &mut Exposure| {
        let Samples::U16(samples) = &mut exposure.frame.samples else { panic!("made of integers") };
        samples.truncate(12 * 6);
        exposure.frame.height = 6;
    };
    check("is 12 x 6 RGGB mosaic", &|scene| crop(&mut scene.lights[4].exposures[0]));
    check("is 12 x 6 RGGB mosaic", &|scene| crop(&mut scene.ambient[0]));
    check("is 12 x 8 grey", &|scene| scene.lights[9].exposures[0].frame.layout = Layout::Grey);
    check("use the calibration of this camera", &|scene| {
        scene.camera.as_mut().unwrap().width_px = 14;
    });
    check("lie in one plane through the swatch", &|scene| {
        scene.lights.truncate(3);
        level(scene, [[1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 1.0]]);
    });
    check("lights 0 and 2 are in the same direction", &|scene| {
        scene.lights.truncate(3);
        level(scene, [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]]);
    });
    check("no point of the capture session's plane", &|scene| scene.plane.point_mm.z = 700.0);
}

/// Far lights in these directions.
fn level(scene: &mut Scene, directions: [[f64; 3]; 3]) {
    for (light, direction) in scene.lights.iter_mut().zip(directions) {
        light.calibrated.light =
            Light::Directional(weavelight_calibration::description::DirectionalLight {
                direction: nalgebra::UnitVector3::new_normalize(direction.into()),
                intensity: [1.0; 3],
            });
    }
}

#[test]
fn frames_that_are_missing_or_too_many_are_told() {
    let check = |expected: &str, change: &dyn Fn(&mut Session)| {
        let mut folders = Folders::of(&scene(Recipe { width: 12, height: 8, ..Recipe::default() }));
        change(&mut folders.session);
        folders.session.save().unwrap();
        let error = run(&folders.options(), &|_| {}, None).unwrap_err().to_string();
        assert!(error.contains(expected), "expected {expected:?}, got: {error}");
    };
    check("frames of 2 lights only", &|session| session.frames.truncate(2));
    check("light 12", &|session| session.frames[3].light = Some(12));
    check("altered", &|session| session.frames[3].sha256 = Some("0".repeat(64)));
    check("missing", &|session| session.frames[3].file = "nowhere.png".into());
    check("chessboard", &|session| session.kind = Kind::Board);
}

#[test]
fn a_light_without_a_frame_and_a_light_that_drifts_are_warned_about() {
    let mut made = scene(Recipe { lights: 5, ..Recipe::default() });
    let mut dimmed = made.lights[1].exposures[0].clone();
    let Samples::U16(samples) = &mut dimmed.frame.samples else { panic!("made of integers") };
    samples.iter_mut().for_each(|v| *v = 600 + ((f64::from(*v) - 600.0) * 0.98) as u16);
    dimmed.path = "again.png".into();
    made.lights[1].exposures.push(dimmed);
    let mut folders = Folders::of(&made);
    folders.session.frames[2].drift_check = true;
    folders.session.frames.remove(4);
    folders.session.save().unwrap();
    let report = run(&folders.options(), &|_| {}, None).unwrap().report;
    assert_eq!(report.lights_used, [0, 1, 2, 4]);
    let warnings = report.warnings.join("\n");
    assert!(warnings.contains("Light 3 has no frame"), "{warnings}");
    assert!(warnings.contains("Light 1 changed by -2.0 %"), "{warnings}");
}

#[test]
fn a_mask_keeps_the_table_out_and_changes_nothing_inside() {
    let made = scene(Recipe { width: 90, ..Recipe::default() });
    let folders = Folders::of(&made);
    let inside = |x: u32, y: u32| {
        (37..70).contains(&x) && (11..30).contains(&y) && !(x + y).is_multiple_of(7)
    };
    let mask =
        image::GrayImage::from_fn(90, 50, |x, y| image::Luma([if inside(x, y) { 255 } else { 0 }]));
    let path = folders.root.path().join("mask.png");
    mask.save(&path).unwrap();
    let options = Options { mask: MaskChoice::File(path), ..folders.options() };
    folders.run(&options);
    let masked = crate::raster::read_exr(&options.out.join("normal.exr")).unwrap();
    let (whole, _) = with_warnings(&made, Method::Auto).unwrap();
    let mut solved = 0;
    for y in 0..50 {
        for x in 0..90 {
            let at = y * 90 + x;
            let expected = if inside(x as u32, y as u32) { whole.normal.data[at][2] } else { 0.0 };
            assert!((masked.channel("B").unwrap()[at] - expected).abs() < 1e-6, "({x}, {y})");
            solved += u64::from(expected != 0.0);
        }
    }
    let report = solution::Solution::load(&options.out).unwrap().report;
    assert_eq!(report.solved, solved);
    assert_eq!(report.outcomes["masked"] + report.solved, 4500);
}

#[test]
fn undistorted_maps_belong_to_a_pinhole() {
    let made = scene(Recipe::default());
    let folders = Folders::of(&made);
    let options = Options { grid: Grid::Undistorted, ..folders.options() };
    folders.run(&options);
    let report = solution::Solution::load(&options.out).unwrap().report;
    assert!(report.undistorted);
    let exr = crate::raster::read_exr(&options.out.join("normal.exr")).unwrap();
    let camera = made.camera.as_ref().unwrap();
    let projector = weavelight_calibration::projection::Projector::new(camera);
    let mut compared = 0;
    for (v, u) in [(5, 5), (25, 35), (44, 60), (12, 50)] {
        let normal = ["R", "G", "B"].map(|name| exr.channel(name).unwrap()[v * 70 + u]);
        let pinhole = [(u as f64 - camera.cx) / camera.fx, (v as f64 - camera.cy) / camera.fy];
        let [x, y] = projector.pixel_of_undistorted(pinhole).unwrap();
        let truth = super::scenes::normal_at_place(x, y);
        let off = nalgebra::Vector3::from(normal).cast::<f64>().cross(&truth).norm().to_degrees();
        // Bilinear interpolation between normals that turn by up to 6 degrees a pixel.
        assert!(off < 0.5, "({u}, {v}): {off} degrees");
        compared += 1;
    }
    assert_eq!(compared, 4);
}

#[test]
fn what_is_up_to_date_is_not_made_again() {
    let mut folders =
        Folders::of(&scene(Recipe { width: 12, height: 8, lights: 5, ..Recipe::default() }));
    let options = Options { reuse: Reuse::IfCurrent, ..folders.options() };
    let check = |what: &str, options: &Options, expected: bool| {
        let solved = run(options, &|_| {}, None).unwrap();
        assert_eq!(solved.up_to_date, expected, "{what}");
        let on_disk = solution::Solution::load(&options.out).unwrap().report;
        assert_eq!(solved.report, on_disk, "{what}");
    };
    check("nothing there", &options, false);
    check("the same again", &options, true);
    check("another number of threads", &Options { threads: Some(2), ..options.clone() }, true);
    let robust = Options { method: Method::LeastSquares, ..options.clone() };
    check("another method", &robust, false);
    check("that method again", &robust, true);
    check("asked to", &Options { reuse: Reuse::Never, ..robust.clone() }, false);
    std::fs::remove_file(options.out.join("albedo.png")).unwrap();
    check("a map is missing", &robust, false);
    folders.session.name = "renamed".into();
    folders.session.save().unwrap();
    check("another manifest", &robust, false);
    std::fs::write(folders.session.frame_path(&folders.session.frames[0]), b"altered").unwrap();
    assert!(run(&robust, &|_| {}, None).unwrap_err().to_string().contains("altered"));
}

#[test]
fn residuals_are_written_where_they_are_asked_for() {
    let mut made = scene(Recipe { lights: 4, width: 40, height: 30, ..Recipe::default() });
    // A photosite that clips has no residual.
    if let Samples::U16(samples) = &mut made.lights[1].exposures[0].frame.samples {
        samples[15 * 40 + 20] = u16::MAX;
    }
    let folders = Folders::of(&made);
    let plain = folders.run(&folders.options());
    assert!(!plain.keys().any(|name| name.starts_with("residual")), "{:?}", names(&plain));
    let mut asked = Options { residuals: Residuals::Write, ..folders.options() };
    let files = folders.run(&asked);
    let expected: Vec<String> = (0..4).map(solution::residual_exr).collect();
    let found: Vec<&String> = files.keys().filter(|name| !plain.contains_key(*name)).collect();
    assert_eq!(found, expected.iter().collect::<Vec<_>>());
    assert!(plain.iter().all(|(name, bytes)| files[name] == *bytes), "the maps stay as they are");
    let report = solution::Report::read(&asked.out.join(solution::REPORT_JSON)).unwrap();
    let listed: Vec<&String> = report.residuals.iter().map(|residual| &residual.file).collect();
    assert_eq!(listed, expected.iter().collect::<Vec<_>>());
    let value = |light: usize, at: usize| {
        let path = asked.out.join(solution::residual_exr(light));
        crate::raster::read_exr(&path).unwrap().channel("Y").unwrap()[at]
    };
    assert_eq!(value(1, 15 * 40 + 20), 0.0);
    assert!(value(0, 15 * 40 + 20) != 0.0 && value(1, 15 * 40 + 21) != 0.0);
    // Threads, reuse, the other grid.
    assert!(folders.run(&Options { threads: Some(1), ..asked.clone() }) == files);
    asked.reuse = Reuse::IfCurrent;
    assert!(run(&asked, &|_| {}, None).unwrap().up_to_date);
    std::fs::remove_file(asked.out.join("residual-02.exr")).unwrap();
    assert!(!run(&asked, &|_| {}, None).unwrap().up_to_date);
    let undistorted = folders.run(&Options { grid: Grid::Undistorted, ..asked.clone() });
    assert!(undistorted["residual-00.exr"] != files["residual-00.exr"]);
    assert_eq!(undistorted["residual-00.exr"].len(), files["residual-00.exr"].len());
}
