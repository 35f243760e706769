//! What the fit leaves over of each light, against the simulator: highlights where a glossy cloth mirrors the light into the
//! camera, nothing but noise on a matt one.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot set its scene up has failed; figures are to be seen"
)]

use nalgebra::Vector3;
use std::path::Path;
use weavelight::compare::read_map;
use weavelight::raster::read_exr;
use weavelight::simulate::{self, Flaws, Material, Part};
use weavelight::solution::Residuals;
use weavelight::solution::{Report, residual_exr};
use weavelight::solve::{self, Scene};
use weavelight_calibration::description::{Image, Light};
use weavelight_calibration::projection::Projector;
use weavelight_sim::cloth::{Preset, Structure};

const SIZE_PX: [usize; 2] = [330, 218];

/// One sample of a light: how far the true normal is from where the light would mirror into the camera, and the residual.
struct Sample {
    off_mirror_deg: f64,
    residual: f64,
}

/// Facets of known tilt with the fibres of `preset`, photographed with noise: every solved photosite under every light.
fn samples(folder: &Path, preset: Preset) -> Vec<Vec<Sample>> {
    let structure = Some(Structure::Facets);
    let options = simulate::Options {
        out: folder.join("sim"),
        size_px: Some(SIZE_PX),
        only: vec![Part::Swatch],
        material: Material { preset, structure, ..Material::default() },
        flaws: Flaws { psf_px: 0.0, ..Flaws::default() },
        ..simulate::Options::default()
    };
    simulate::run(&options, &|_, _| {}).unwrap();
    let (session, calibration) = (options.out.join("swatch"), options.out.join("calibration"));
    let mut wanted = solve::Options::new(&session, &calibration, folder.join("maps"));
    wanted.residuals = Residuals::Write;
    solve::run(&wanted, &|_| {}, None).unwrap();
    let (scene, _) = Scene::load(&session, &calibration).unwrap();
    let truth = read_map(&options.out.join("truth/normal.exr")).unwrap();
    let projector = Projector::new(scene.camera.as_ref().unwrap());
    let eye = scene.camera.as_ref().unwrap().camera_from_rig.inverse() * nalgebra::Point3::origin();
    let report = Report::read(&wanted.out.join("report.json")).unwrap();
    assert_eq!(report.residuals.len(), scene.lights.len());
    let of_light = |light: &weavelight::linear::PhotographedLight| {
        let exr = read_exr(&wanted.out.join(residual_exr(light.index))).unwrap();
        let residual = exr.channel("Y").unwrap();
        assert!(residual.iter().all(|value| value.is_finite()));
        let Light::Point(lamp) = &light.calibrated.light else { panic!("a lamp") };
        let sample = |at: usize| {
            let pixel = [(at % SIZE_PX[0]) as f64, (at / SIZE_PX[0]) as f64];
            let point = projector.on_plane(pixel, &scene.plane).unwrap();
            let half = (lamp.position_mm - point).normalize() + (eye - point).normalize();
            let normal = Vector3::from(truth.data[at]).cast::<f64>();
            let off_mirror = half.cross(&normal).norm().atan2(half.dot(&normal));
            Sample { off_mirror_deg: off_mirror.to_degrees(), residual: f64::from(residual[at]) }
        };
        let inside = |at: &usize| residual[*at] != 0.0 && is_inside_a_facet(&truth, *at);
        (0..residual.len()).filter(inside).map(sample).collect()
    };
    scene.lights.iter().map(of_light).collect()
}

/// Whether the photosites around look at the same facet: one that sees two has no single normal.
fn is_inside_a_facet(truth: &Image<[f32; 3]>, at: usize) -> bool {
    let normal = |at: usize| Vector3::from(truth.data[at]);
    let around = [at.wrapping_sub(1), at + 1, at.wrapping_sub(SIZE_PX[0]), at + SIZE_PX[0]];
    around.iter().all(|&n| n < truth.data.len() && (normal(n) - normal(at)).norm() < 1e-4)
}

fn mean<'a>(samples: impl Iterator<Item = &'a Sample>) -> (f64, usize) {
    let (sum, count) = samples.fold((0.0, 0), |(sum, n), sample| (sum + sample.residual, n + 1));
    (sum / f64::from(count.max(1)), count as usize)
}

#[test]
fn highlights_are_positive_where_the_cloth_mirrors_the_light() {
    let folder = tempfile::tempdir().unwrap();
    for (light, samples) in samples(folder.path(), Preset::Satin).iter().enumerate() {
        let near: Vec<&Sample> = samples.iter().filter(|s| s.off_mirror_deg < 6.0).collect();
        let (inside, count) = mean(near.iter().copied());
        let (outside, _) = mean(samples.iter().filter(|s| s.off_mirror_deg > 40.0));
        let positive = near.iter().filter(|s| s.residual > 0.0).count();
        println!(
            "light {light}: {inside:.4} over {count} mirroring photosites, {outside:.4} elsewhere"
        );
        assert!(count > 50, "light {light}: {count}");
        assert!(inside > 0.02 && inside > 5.0 * outside.abs(), "light {light}: {inside} {outside}");
        assert!(positive * 100 > count * 95, "light {light}: {positive} of {count} are positive");
    }
}

#[test]
fn matt_cloth_leaves_noise_without_a_mean() {
    let folder = tempfile::tempdir().unwrap();
    for (light, samples) in samples(folder.path(), Preset::Facets).iter().enumerate() {
        let (mean, count) = mean(samples.iter());
        let squares: f64 = samples.iter().map(|s| s.residual * s.residual).sum();
        let rms = (squares / count as f64).sqrt();
        println!("light {light}: mean {mean:.6}, RMS {rms:.5} over {count} photosites");
        assert!(count > SIZE_PX[0] * SIZE_PX[1] / 3, "light {light}: {count}");
        assert!(mean.abs() < 1e-4 && rms < 0.01, "light {light}: mean {mean}, RMS {rms}");
    }
}
