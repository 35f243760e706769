//! The solve beside touching the same bytes once, and the whole program's time and peak memory:
//!
//!     cargo bench --bench solve                                     4928 x 3264, ten lights, generated in memory
//!     cargo bench --bench solve -- 1232x816                         another size
//!     cargo bench --bench solve -- SESSION CALIBRATION              the program on a capture session of yours as well
//!     cargo bench --bench solve -- simulate                         ... on a simulated one of that size (about a minute)
//!
//! Bare seconds depend on the machine; the ratios are what counts.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and stops at the first error"
)]

mod skips;

use nalgebra::{Point3, UnitVector3, Vector3};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};
use weavelight::gpu::Device;
use weavelight::gpu::Gpu;
use weavelight::instrument::{CalibratedLight, Color, Noise};
use weavelight::linear::{Exposure, PhotographedLight};
use weavelight::live::Accumulator;
use weavelight::photometry::{Maps, Method, Outcome};
use weavelight::raw::{Frame, Layout, Metadata, Samples};
use weavelight::solution::Scale;
use weavelight::solve::{Origin, Scene};
use weavelight_calibration::description::{Camera, Cfa, Image, Light, Plane, PointLight};
use weavelight_calibration::irradiance::light_vector_in_rig;
use weavelight_calibration::projection::Projector;

const LIGHTS: usize = 10;
const REPEATS: usize = 5;
const BLACK: f64 = 600.0;
const SATURATION: f64 = 16_383.0;
const ELECTRONS_PER_DN: f64 = 40_000.0 / (SATURATION - BLACK);

fn main() {
    let arguments: Vec<String> =
        std::env::args().skip(1).filter(|text| !text.starts_with("--")).collect();
    let size = arguments.iter().find_map(|text| size_of(text)).unwrap_or((4928, 3264));
    let folders: Vec<&String> =
        arguments.iter().filter(|text| size_of(text).is_none() && *text != "simulate").collect();
    in_memory(size);
    match folders.as_slice() {
        [session, calibration] => whole_program(Path::new(session), Path::new(calibration)),
        _ if arguments.iter().any(|text| text == "simulate") => on_simulation(size),
        _ => {}
    }
}

fn size_of(text: &str) -> Option<(usize, usize)> {
    let (width, height) = text.split_once('x')?;
    Some((width.parse().ok()?, height.parse().ok()?))
}

fn in_memory((width, height): (usize, usize)) {
    let mut scene = scene(width, height);
    println!(
        "{width} x {height} x {LIGHTS}, {} threads, median of {REPEATS}",
        rayon::current_num_threads()
    );
    let touch = median(&mut || drop(touch(&scene)));
    println!("{:<44} {:>8.1} ms", "touching input and output once", ms(touch));
    let line = |name: &str, time: Duration| {
        println!(
            "{name:<44} {:>8.1} ms {:>6.2} x touching",
            ms(time),
            time.as_secs_f64() / touch.as_secs_f64()
        );
    };
    for (name, method) in [
        ("least squares", Method::LeastSquares),
        ("weighted", Method::Weighted),
        ("auto", Method::Auto),
    ] {
        line(name, median(&mut || drop(solve(&scene, method))));
    }
    on_gpu(&scene, &line);
    let maps = solve(&scene, Method::Auto);
    println!(
        "  auto: {} of {} solved, {} by the robust path",
        maps.counts.solved(),
        width * height,
        maps.counts.robust()
    );
    drop(maps);
    let half = |x: usize, y: usize| {
        x >= width / 4 && x < width * 3 / 4 && y >= height / 4 && y < height * 3 / 4
    };
    let data = (0..width * height).map(|i| half(i % width, i / width)).collect();
    scene.mask = Some(Image { width, height, data });
    line(
        "auto, a quarter of the frame inside the mask",
        median(&mut || drop(solve(&scene, Method::Auto))),
    );
    scene.mask = None;
    for (name, scale) in [
        ("full", Scale::Full),
        ("1/2", Scale::Half),
        ("1/4", Scale::Quarter),
        ("1/8", Scale::Eighth),
    ] {
        previews(name, scale, &mut scene, touch);
    }
    skips::report(&scene);
}

fn solve(scene: &Scene, method: Method) -> Maps {
    scene.check().unwrap().solve(method, &Device::Cpu, None, &|_| {}).unwrap().maps
}

/// The same with a graphics processor, transfers included, where there is one.
fn on_gpu(scene: &Scene, line: &dyn Fn(&str, Duration)) {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => return println!("  no graphics processor: {error}"),
    };
    let adapter = gpu.adapter().name.clone();
    let device = Device::Opened(Arc::new(gpu));
    for (name, method) in [("least squares", Method::LeastSquares), ("auto", Method::Auto)] {
        let solve = || {
            drop(scene.check().unwrap().solve(method, &device, None, &|_| {}).unwrap());
        };
        solve();
        line(&format!("{name}, on {adapter}"), median(&mut { solve }));
    }
}

/// From the last frame to the maps: what a user waits for.
fn previews(name: &str, scale: Scale, scene: &mut Scene, touch: Duration) {
    let calibration = weavelight::instrument::Calibration {
        folder: PathBuf::from("bench"),
        camera: scene.camera.clone(),
        rms_reprojection_px: None,
        optics: Default::default(),
        color: scene.color.clone(),
        defects: Default::default(),
        lights: scene.lights.iter().map(|light| light.calibrated.clone()).collect(),
        provenance: Default::default(),
    };
    let mut sums = Accumulator::new(
        calibration,
        scene.plane.clone(),
        &scene.lights[0].exposures[0].frame,
        scale,
    );
    let mut last = Duration::ZERO;
    for light in &scene.lights {
        let exposure = light.exposures[0].clone();
        let begun = Instant::now();
        sums.add(light.index, exposure).unwrap();
        last = begun.elapsed();
    }
    let begun = Instant::now();
    let maps = sums.preview().unwrap().unwrap();
    let finish = begun.elapsed();
    std::hint::black_box(&maps);
    println!(
        "preview at {name:<4}: last frame {:>7.1} ms, maps {:>7.1} ms, together {:>6.2} x touching",
        ms(last),
        ms(finish),
        (last + finish).as_secs_f64() / touch.as_secs_f64()
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

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1000.0
}

/// The maps that a solve returns, as plain memory.
struct Output {
    normal: Vec<[f32; 3]>,
    albedo: Vec<f32>,
    error: Vec<f32>,
    outcome: Vec<Outcome>,
}

/// Reads every sample once and writes every byte of the maps once, on the same threads, into fresh memory like a solve.
fn touch(scene: &Scene) -> Output {
    let (width, pixels) = (scene.width, scene.width * scene.height);
    let mut out = Output {
        normal: vec![[0.0; 3]; pixels],
        albedo: vec![0.0; pixels],
        error: vec![0.0; pixels],
        outcome: vec![Outcome::Masked; pixels],
    };
    let band = width * 64;
    out.normal
        .par_chunks_mut(band)
        .zip(out.albedo.par_chunks_mut(band))
        .zip(out.error.par_chunks_mut(band))
        .zip(out.outcome.par_chunks_mut(band))
        .enumerate()
        .for_each(|(index, (((normal, albedo), error), outcome))| {
            let span = index * band..index * band + albedo.len();
            let sum: u32 = scene
                .lights
                .iter()
                .map(|light| sum_of(&light.exposures[0].frame, span.clone()))
                .fold(0, u32::wrapping_add);
            let value = sum as f32;
            normal.fill([value; 3]);
            albedo.fill(value);
            error.fill(value);
            outcome.fill(Outcome::Fitted);
        });
    std::hint::black_box(out)
}

fn sum_of(frame: &Frame, span: std::ops::Range<usize>) -> u32 {
    match &frame.samples {
        Samples::U16(samples) => {
            samples[span].iter().fold(0_u32, |sum, &v| sum.wrapping_add(u32::from(v)))
        }
        Samples::F32(_) => 0,
    }
}

/// A coloured weave of bumps under the reference rig, with shot and read noise.
fn scene(width: usize, height: usize) -> Scene {
    let mm_per_px = 400.0 / width as f64;
    let camera = Camera {
        width_px: width,
        height_px: height,
        fx: 610.0 / mm_per_px,
        fy: 610.0 / mm_per_px,
        cx: width as f64 / 2.0,
        cy: height as f64 / 2.0,
        distortion: [-0.08, 0.05, 0.0004, -0.0003, 0.0],
        camera_from_rig: Camera::looking_down(610.0),
    };
    let calibrated = |index: usize| CalibratedLight {
        light: Light::Point(lamp(index)),
        gain_map: None,
        position_sigma_mm: None,
        position_claimed: None,
        warnings: vec![],
    };
    let lights = (0..LIGHTS).map(|index| PhotographedLight {
        index,
        calibrated: calibrated(index),
        exposures: vec![expose(&camera, &lamp(index), index)],
    });
    Scene {
        width,
        height,
        layout: Layout::Mosaic(Cfa::RGGB),
        lights: lights.collect(),
        ambient: vec![],
        camera: Some(camera.clone()),
        plane: Plane::table(),
        color: Color {
            noise: Some(Noise {
                electrons_per_dn: ELECTRONS_PER_DN,
                read_noise_e: 4.0,
                kappa: 0.0,
            }),
            ..Color::default()
        },
        defects: Default::default(),
        mask: None,
        origin: Origin::default(),
    }
}

/// Six LEDs at 45 degrees of elevation, four at 62.
fn lamp(index: usize) -> PointLight {
    let (azimuth, elevation) = if index < 6 {
        (index as f64 * 60.0_f64.to_radians(), 45.0_f64.to_radians())
    } else {
        (index as f64 * 90.0_f64.to_radians() + 0.5, 62.0_f64.to_radians())
    };
    let direction = Vector3::new(
        elevation.cos() * azimuth.cos(),
        elevation.cos() * azimuth.sin(),
        elevation.sin(),
    );
    PointLight {
        position_mm: Point3::from(direction * 560.0),
        axis: UnitVector3::new_normalize(-direction),
        exponent: 1.2,
        intensity: [0.2, 0.3, 0.25],
    }
}

fn expose(camera: &Camera, lamp: &PointLight, index: usize) -> Exposure {
    let (width, height) = (camera.width_px, camera.height_px);
    let projector = Projector::new(camera);
    let light = Light::Point(lamp.clone());
    let mut samples = vec![0_u16; width * height];
    samples.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let vector = |x: usize| {
            light_vector_in_rig(
                &light,
                &projector.on_plane([x as f64, y as f64], &Plane::table()).unwrap(),
            )
        };
        let mut random = (y * LIGHTS + index) as u64;
        for start in (0..width).step_by(16) {
            let (a, b) = (vector(start), vector(start + 16));
            for (x, sample) in row.iter_mut().enumerate().skip(start).take(16) {
                let l = a + (b - a) * ((x - start) as f64 / 16.0);
                let shading = l.dot(&normal(x, y)).max(0.0);
                let channel = Cfa::RGGB.channel(x, y) as usize;
                let electrons =
                    40_000.0 * albedo(x, y)[channel] * shading * lamp.intensity[channel];
                let noisy = electrons + (electrons + 16.0).sqrt() * gaussian(&mut random);
                *sample = (BLACK + noisy / ELECTRONS_PER_DN).round().clamp(0.0, SATURATION) as u16;
            }
        }
    });
    let frame = Frame {
        width,
        height,
        layout: Layout::Mosaic(Cfa::RGGB),
        samples: Samples::U16(samples),
        black: [BLACK as f32; 4],
        saturation: [SATURATION as f32; 4],
        metadata: Metadata::default(),
    };
    Exposure { frame, exposure_s: 1.0, iso: 100.0, path: format!("light-{index:02}").into() }
}

fn normal(x: usize, y: usize) -> Vector3<f64> {
    let (x, y) = (x as f64 * 0.3, y as f64 * 0.3);
    Vector3::new(0.5 * x.sin(), 0.5 * y.sin(), 1.0).normalize()
}

fn albedo(x: usize, y: usize) -> [f64; 3] {
    if (x / 20 + y / 20).is_multiple_of(2) { [0.6, 0.3, 0.15] } else { [0.2, 0.5, 0.7] }
}

/// Sum of four uniform numbers, scaled to variance 1.
fn gaussian(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (uniform() + uniform() + uniform() + uniform()) * 3.0_f64.sqrt()
}

fn on_simulation((width, height): (usize, usize)) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("rig");
    let begun = Instant::now();
    let options = weavelight::simulate::Options {
        size_px: Some([width, height]),
        only: vec![weavelight::simulate::Part::Swatch],
        out: out.clone(),
        ..weavelight::simulate::Options::default()
    };
    weavelight::simulate::run(&options, &|_, _| {}).unwrap();
    println!("simulated in {:.1} s", begun.elapsed().as_secs_f64());
    whole_program(&out.join("swatch"), &out.join("calibration"));
}

/// Time and peak memory of `weavelight solve`.
fn whole_program(session: &Path, calibration: &Path) {
    let folder = tempfile::tempdir().unwrap();
    for method in ["least-squares", "auto"] {
        let begun = Instant::now();
        let mut child = Command::new(env!("CARGO_BIN_EXE_weavelight"))
            .arg("solve")
            .arg(session)
            .arg("--calibration")
            .arg(calibration)
            .arg("--out")
            .arg(folder.path().join(method))
            .args(["--method", method])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let mut peak_kb = 0;
        let status = loop {
            peak_kb = peak_kb.max(peak_memory_kb(child.id()).unwrap_or(0));
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        assert!(status.success(), "weavelight solve failed");
        let seconds = begun.elapsed().as_secs_f64();
        println!(
            "weavelight solve --method {method}: {seconds:.2} s, peak memory {:.0} MB",
            peak_kb as f64 / 1000.0
        );
        let report =
            weavelight::solution::Solution::load(&folder.path().join(method)).unwrap().report;
        let stages: Vec<String> =
            report.seconds.iter().map(|(stage, s)| format!("{stage} {s:.2}")).collect();
        println!("  {}", stages.join(", "));
    }
}

/// The most memory that a process had resident, where the system tells.
fn peak_memory_kb(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}
