//! The whole job without hardware: a simulated rig photographs a fabric, the frames are solved, and the maps are held
//! against the truth.

use crate::compare::{self, ColorFigures, CompareError, Figures, Kind, NormalFigures, read_map};
use crate::report::{Truth, page_of_solve};
use crate::simulate::{self, Material, Part, SimulateError};
use crate::solution::{ALBEDO_EXR, NORMAL_EXR, REPORT_HTML, Report};
use crate::solve::{self, Shown, SolveError};
use std::path::{Path, PathBuf};
use weavelight_sim::cloth::Preset;

/// What to show.
#[derive(Clone, Debug)]
pub struct Options {
    /// The folder to write: one folder a fabric, with `rig/` (what was photographed, and the truth) and `maps/`.
    pub out: PathBuf,
    /// Size of the frames.
    pub size_px: [usize; 2],
    /// The fabrics, one after the other.
    pub fabrics: Vec<Preset>,
    /// Everything random follows from it.
    pub seed: u64,
}

/// What became of one fabric.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Its name.
    pub fabric: &'static str,
    /// The page to look at.
    pub page: PathBuf,
    /// Normals against the truth.
    pub normal: NormalFigures,
    /// Albedo against the truth.
    pub albedo: ColorFigures,
    /// What the solve says of itself.
    pub report: Report,
}

/// What goes wrong.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// The simulated rig.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The solve.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The truth.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

/// Runs the whole job; `progress` is told the share done (0..1) and what is being done, possibly from several threads.
///
/// # Errors
/// Where a folder cannot be written, or holds something that is not ours to replace.
pub fn run(
    options: &Options,
    progress: &(dyn Fn(f64, &str) + Sync),
) -> Result<Vec<Shot>, DemoError> {
    let total = options.fabrics.len() as f64;
    let one = |(k, fabric): (usize, &Preset)| {
        shoot(options, *fabric, &|share, what: &str| progress((k as f64 + share) / total, what))
    };
    options.fabrics.iter().enumerate().map(one).collect()
}

fn shoot(
    options: &Options,
    fabric: Preset,
    progress: &(dyn Fn(f64, &str) + Sync),
) -> Result<Shot, DemoError> {
    let folder = options.out.join(fabric.name());
    let (rig, maps) = (folder.join("rig"), folder.join("maps"));
    simulate::run(&simulation(options, fabric, &rig), &|share, _| {
        progress(0.7 * share, &format!("photographing {}", fabric.name()));
    })?;
    let truth_folder = rig.join("truth");
    let truth = Truth {
        normal: read_map(&truth_folder.join(NORMAL_EXR))?,
        albedo: read_map(&truth_folder.join(ALBEDO_EXR))?,
    };
    let page = |shown: &Shown| page_of_solve(shown, Some(&truth));
    let solving = solve::Options::new(rig.join("swatch"), rig.join("calibration"), &maps);
    progress(0.75, &format!("solving {}", fabric.name()));
    let solved = solve::run(&solving, &|_| (), Some(&page))?;
    let against = |file: &str, kind| figures(&maps.join(file), &truth_folder.join(file), kind);
    let (normal, albedo) = (against(NORMAL_EXR, Kind::Normal)?, against(ALBEDO_EXR, Kind::Color)?);
    progress(1.0, "done");
    match (normal, albedo) {
        (Figures::Normal(normal), Figures::Color(albedo)) => {
            let page = maps.join(REPORT_HTML);
            Ok(Shot { fabric: fabric.name(), page, normal, albedo, report: solved.report })
        }
        _ => unreachable!("figures are of the kind that was asked for"),
    }
}

fn simulation(options: &Options, fabric: Preset, out: &Path) -> simulate::Options {
    simulate::Options {
        out: out.to_owned(),
        size_px: Some(options.size_px),
        seed: options.seed,
        only: vec![Part::Swatch],
        material: Material { preset: fabric, ..Material::default() },
        ..simulate::Options::default()
    }
}

fn figures(a: &Path, b: &Path, kind: Kind) -> Result<Figures, CompareError> {
    let options =
        compare::Options { a: a.to_owned(), b: b.to_owned(), mask: None, kind: Some(kind) };
    Ok(compare::run(&options)?.figures)
}
