//! What leaving undone saves: each line is the time with and without, in one run.

use super::solve;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};
use weavelight::files::sha256_of_file;
use weavelight::instrument::{MeasuredCamera, write_camera, write_color, write_lights};
use weavelight::linear::Exposure;
use weavelight::photometry::Method;
use weavelight::raster::{PngContent, write_png_grey16};
use weavelight::raw::{Layout, Samples};
use weavelight::report::page_of_solve;
use weavelight::session::{FrameEntry, Kind, Session};
use weavelight::solution::{Outputs, Reuse, Scale};
use weavelight::solve::{Options, Scene};

use weavelight_calibration::description::Image;

/// Runs of each; the median counts.
const REPEATS: usize = 3;

/// Prints a line for everything that can be left undone.
pub(crate) fn report(scene: &Scene) {
    println!(
        "what is left undone (median of {REPEATS}; with, without, and the share that is saved)"
    );
    table_outside_the_swatch(scene);
    lights_that_add_nothing(scene);
    full_resolution(scene);
    files(scene);
}

fn line(what: &str, all: Duration, less: Duration) {
    let [all, less] = [all, less].map(|time| time.as_secs_f64() * 1000.0);
    println!(
        "  {what:<52} {all:>8.1} ms -> {less:>8.1} ms, saves {:>3.0} %",
        100.0 * (1.0 - less / all)
    );
}

fn median(work: &mut dyn FnMut()) -> Duration {
    let mut times: Vec<Duration> = (0..REPEATS)
        .map(|_| {
            let begun = Instant::now();
            work();
            begun.elapsed()
        })
        .collect();
    times.sort();
    times[REPEATS / 2]
}

fn solving(scene: &Scene) -> Duration {
    median(&mut || drop(black_box(solve(scene, Method::Auto))))
}

fn table_outside_the_swatch(scene: &Scene) {
    let (width, height) = (scene.width, scene.height);
    let middle = |at: usize, length: usize| at >= length / 4 && at < length * 3 / 4;
    let data = (0..width * height).map(|i| middle(i % width, width) && middle(i / width, height));
    let masked =
        Scene { mask: Some(Image { width, height, data: data.collect() }), ..scene.clone() };
    line("table: three quarters of the frame", solving(scene), solving(&masked));
    let finding = median(&mut || drop(black_box(scene.find_swatch(&|_| {}).unwrap())));
    println!("  {:<52} {:>8.1} ms", "  finding it", finding.as_secs_f64() * 1000.0);
}

/// Solving with frames that add nothing, and without them, the search for them included.
fn lights_that_add_nothing(scene: &Scene) {
    let check = |what: &str, spoilt: &Scene| {
        let mut searched = spoilt.clone();
        let search = median(&mut || {
            searched = spoilt.clone();
            let begun = Instant::now();
            black_box(searched.leave_out_what_adds_nothing().unwrap());
            black_box(begun.elapsed());
        });
        let copying = median(&mut || drop(black_box(spoilt.clone())));
        line(what, solving(spoilt), solving(&searched) + search.saturating_sub(copying));
    };
    let with = |change: &dyn Fn(&mut Vec<u16>), again: bool| {
        let mut spoilt = scene.clone();
        let exposures = &mut spoilt.lights[3].exposures;
        if again {
            exposures.push(exposures[0].clone());
        }
        if let Some(Exposure { frame, .. }) = exposures.last_mut()
            && let Samples::U16(samples) = &mut frame.samples
        {
            change(samples);
        }
        spoilt
    };
    check("lights: one of ten clips everywhere", &with(&|samples| samples.fill(u16::MAX), false));
    check("lights: one of ten is dark", &with(&|samples| samples.fill(600), false));
    check("lights: a frame of one listed twice", &with(&|_| {}, true));
}

fn full_resolution(scene: &Scene) {
    let full = solving(scene);
    for (name, scale) in [("1/8", Scale::Eighth), ("1/4", Scale::Quarter), ("1/2", Scale::Half)] {
        let time = median(&mut || {
            let small = scene.reduced(scale);
            drop(black_box(solve(&small, Method::LeastSquares)));
        });
        line(&format!("full resolution: {name} of it, from frames in memory"), full, time);
    }
}

/// The whole run from folder to folder, and what of it need not be.
fn files(scene: &Scene) {
    let folder = tempfile::tempdir().unwrap();
    write_session(scene, folder.path());
    let at = |name: &str| folder.path().join(name);
    let options = Options { reuse: Reuse::Never, ..Options::new(at("s"), at("c"), at("out")) };
    let run = |options: &Options, page: bool| {
        median(&mut || {
            let show = |shown: &weavelight::solve::Shown| page_of_solve(shown, None);
            let page =
                page.then_some(&show as &(dyn Fn(&weavelight::solve::Shown) -> String + Sync));
            drop(black_box(weavelight::solve::run(options, &|_| {}, page).unwrap()));
        })
    };
    let all = run(&options, true);
    line("maps: no page", all, run(&options, false));
    let only = |outputs: Outputs| Options { outputs, ..options.clone() };
    line("maps: no page, no PNG", all, run(&only(Outputs { png: false, ..Outputs::ALL }), false));
    line(
        "maps: normal.exr alone",
        all,
        run(&only(Outputs { normal: true, ..Outputs::NONE }), false),
    );
    for (name, scale) in [("1/8", Scale::Eighth), ("1/4", Scale::Quarter), ("1/2", Scale::Half)] {
        let preview = Options { scale, method: Method::LeastSquares, ..options.clone() };
        line(
            &format!("full resolution: {name} of it, from folder to folder"),
            all,
            run(&preview, true),
        );
    }
    run(&options, true);
    let again = Options { reuse: Reuse::IfCurrent, ..options.clone() };
    line("re-solving: nothing has changed", all, run(&again, true));
}

/// The scene as a capture session `s` of 16-bit PNG and its calibration `c`.
fn write_session(scene: &Scene, folder: &Path) {
    let (calibration, none) = (folder.join("c"), Default::default());
    let camera = MeasuredCamera::new(scene.camera.clone().unwrap());
    write_camera(&calibration, &camera, &none).unwrap();
    let first = &scene.lights[0].exposures[0].frame;
    let mut color = scene.color.clone();
    color.black_level = Some(first.black.map(f64::from));
    color.saturation_level = Some(f64::from(first.saturation[0]));
    write_color(&calibration, &color, &none).unwrap();
    let lights: Vec<_> = scene.lights.iter().map(|light| light.calibrated.clone()).collect();
    write_lights(&calibration, &lights, &none).unwrap();
    let mut session = Session::new(folder.join("s"), Kind::Swatch, "made");
    std::fs::create_dir(&session.folder).unwrap();
    for light in &scene.lights {
        let name = format!("light-{:02}.png", light.index);
        let path = session.folder.join(&name);
        let Exposure { frame, exposure_s, iso, .. } = &light.exposures[0];
        let Samples::U16(samples) = &frame.samples else { return };
        let size = [frame.width, frame.height];
        let row =
            |y: usize, row: &mut [u16]| row.copy_from_slice(&samples[y * size[0]..][..size[0]]);
        write_png_grey16(&path, size, PngContent::Data, row).unwrap();
        let mut entry = FrameEntry::new(name, Some(light.index), *exposure_s, *iso);
        entry.sha256 = Some(sha256_of_file(&path).unwrap());
        if let Layout::Mosaic(cfa) = frame.layout {
            entry.cfa = Some(cfa);
        }
        session.frames.push(entry);
    }
    session.save().unwrap();
}
