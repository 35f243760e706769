//! The simulated rig against the solver: two programs that share no forward model must agree on what is in the picture.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    clippy::print_stdout,
    reason = "a test that cannot set its scene up has failed; figures are to be seen"
)]

use std::path::Path;
use weavelight::compare::{self, Figures, Kind};
use weavelight::photometry::Method;
use weavelight::simulate::{self, Material, Part};
use weavelight::solve;
use weavelight_sim::cloth::{Preset, Structure};

/// Simulates without noise, solves with the true calibration, and compares.
fn errors(folder: &Path, change: impl Fn(&mut simulate::Options)) -> (Figures, Figures) {
    let mut options = simulate::Options {
        out: folder.join("sim"),
        size_px: Some([330, 218]),
        only: vec![Part::Swatch],
        material: Material { preset: Preset::Facets, ..Material::default() },
        ..simulate::Options::default()
    };
    options.flaws.noise = false;
    // Facets meet in sharp edges: what is measured is the solve, not the lens.
    options.flaws.psf_px = 0.0;
    change(&mut options);
    simulate::run(&options, &|_, _| {}).unwrap();
    let out = folder.join("maps");
    let mut wanted =
        solve::Options::new(options.out.join("swatch"), options.out.join("calibration"), &out);
    wanted.method = Method::LeastSquares;
    solve::run(&wanted, &|_| {}, None).unwrap();
    let compare = |name: &str, kind| {
        let (a, b) = (out.join(name), options.out.join("truth").join(name));
        compare::run(&compare::Options { a, b, mask: None, kind: Some(kind) }).unwrap().figures
    };
    (compare("normal.exr", Kind::Normal), compare("albedo.exr", Kind::Color))
}

fn check(
    name: &str,
    normal_rms_deg: f64,
    albedo_rms: f64,
    change: impl Fn(&mut simulate::Options),
) {
    let temp = tempfile::tempdir().unwrap();
    let (Figures::Normal(normal), Figures::Color(color)) = errors(temp.path(), change) else {
        panic!("figures of another kind");
    };
    println!("{name}: normals {normal:?}, albedo {color:?}");
    assert!(normal.rms_deg < normal_rms_deg, "{name}: {normal:?}");
    assert!(color.rms < albedo_rms, "{name}: {color:?}");
}

fn flat(options: &mut simulate::Options) {
    options.material.structure = Some(Structure::Flat);
}

#[test]
fn what_the_simulator_shows_is_what_the_solver_finds() {
    // Quantisation alone: a raw number is 1/8000 of the brightest light's signal.
    check("flat", 0.02, 5e-4, flat);
    check("flat, lens without vignetting", 0.02, 5e-4, |options| {
        flat(options);
        options.flaws.vignetting = 0.0;
    });
    check("flat, strong vignetting and a bent response", 0.02, 5e-4, |options| {
        flat(options);
        (options.flaws.vignetting, options.flaws.bend) = (0.5, 0.03);
    });
    check("flat, 12 mm thick, ambient light 30 times the usual", 0.02, 5e-4, |options| {
        flat(options);
        (options.material.thickness_mm, options.flaws.ambient) = (12.0, 30.0);
    });
}
