//! Run time against error, for every method: on simulated fabrics and on picture sets from outside, as a table, a picture
//! and JSON.
//!
//! Times are medians of repeats taken in turns. Multiples of touching the same bytes once in the same run are of processor
//! time, which other programs do not lengthen; bare seconds say more about the machine than about the program. Errors are angles to the true normals; a photosite
//! left unsolved counts 90 degrees, so that nobody gains by giving up.

pub mod band;
mod chart;
mod clock;
mod cloths;
mod colors;
mod curves;
mod error;
mod front;
mod measure;
pub mod methods;
mod picture;
mod report;
mod sets;
mod table;

pub use clock::{Spent, timed};
pub use cloths::ColorCloth;
pub use colors::{ColorOptions, ColorRow, Worst, colors_markdown, measure_colors};
pub use curves::{Curve, CurvePoint};
pub use error::BenchError;
pub use front::pareto_front;
pub use report::{MethodReport, Report, SetReport, Touch};
pub use sets::{Fabric, SetFolders};
pub use table::{curves_text, sets_text};

use crate::files::{OutputKind, PROGRAM, StagedFolder, write_atomic};
use sets::Set;
use std::path::PathBuf;

/// The schema of `bench.json` that this version reads and writes.
const SCHEMA: i64 = 1;

/// The figures, in the output folder.
pub const BENCH_JSON: &str = "bench.json";
/// The picture, in the output folder.
pub const BENCH_SVG: &str = "bench.svg";

/// The table of colours, in the output folder where it was asked for.
pub const COLORS_MD: &str = "colors.md";

const OUTPUT: OutputKind = OutputKind { name: "benchmark", marker: Some(BENCH_JSON) };

/// What to measure.
#[derive(Clone, Debug)]
pub struct Options {
    /// The folder to write: [`BENCH_JSON`] and [`BENCH_SVG`].
    pub out: PathBuf,
    /// Simulated fabrics.
    pub fabrics: Vec<Fabric>,
    /// Picture sets from outside.
    pub sets: Vec<SetFolders>,
    /// How much.
    pub effort: Effort,
    /// Whether to measure on generated bands of many sizes and light counts too.
    pub curves: Curves,
    /// Colours to measure, for [`COLORS_MD`] too.
    pub colors: Option<ColorOptions>,
}

/// How much to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Small frames, few repeats: whether it works, in seconds. Frames this small do not outweigh what a solve spends once.
    Quick,
    /// Four megapixels out of the middle of the reference sensor.
    Full,
}

/// Whether to measure curves over megapixels and lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curves {
    /// No.
    Leave,
    /// Yes.
    Measure,
}

impl Effort {
    /// Size of simulated frames.
    fn size_px(self) -> [usize; 2] {
        match self {
            Self::Quick => [320, 208],
            Self::Full => [2464, 1632],
        }
    }

    /// Timed rounds.
    fn rounds(self) -> usize {
        match self {
            Self::Quick => 3,
            Self::Full => 7,
        }
    }

    /// Photosites that slow methods solve, about.
    fn sampled_photosites(self) -> usize {
        match self {
            Self::Quick => 5_000,
            Self::Full => 60_000,
        }
    }
}

/// Measures everything that the options ask for and writes the output folder. `progress` is told the share done (0 to 1)
/// and what is being done.
///
/// # Errors
/// Where a set cannot be read or solved, a truth does not fit, or `out` cannot be written.
pub fn run(options: &Options, progress: &(dyn Fn(f64, &str) + Sync)) -> Result<Report, BenchError> {
    // Before the work: a place that cannot be written is told at once.
    let staged = StagedFolder::create(&options.out, OUTPUT)?;
    // Without one, or built without that part, the others are measured all the same.
    let methods = methods::all(crate::gpu::Gpu::open().ok());
    let steps = options.fabrics.len() + options.sets.len();
    let steps = (steps + usize::from(options.curves == Curves::Measure)).max(1) as f64;
    let mut sets = Vec::new();
    let mut measure = |name: &str, load: &dyn Fn() -> Result<Set, BenchError>| {
        progress(sets.len() as f64 / steps, name);
        sets.push(measure::of_set(&load()?, &methods, options.effort)?);
        Ok::<(), BenchError>(())
    };
    for set in &options.sets {
        measure(&set.name, &|| set.load())?;
    }
    for fabric in &options.fabrics {
        measure(fabric.name(), &|| fabric.simulate(options.effort.size_px()))?;
    }
    let mut curves = Vec::new();
    if options.curves == Curves::Measure {
        progress(sets.len() as f64 / steps, "curves");
        curves = curves::measure(options.effort);
    }
    let mut colors = Vec::new();
    if let Some(wanted) = &options.colors {
        let done = sets.len() as f64 / steps;
        colors = measure_colors(wanted, &|share, what| {
            progress(done + (1.0 - done) * share, what);
        })?;
        write_atomic(&staged.join(COLORS_MD), colors_markdown(&colors).as_bytes())?;
    }
    let threads = rayon::current_num_threads();
    let program = PROGRAM.to_owned();
    let report = Report { schema: SCHEMA, program, threads, sets, curves, colors };
    write_atomic(&staged.join(BENCH_SVG), picture::svg(&report).as_bytes())?;
    write_atomic(&staged.join(BENCH_JSON), report.json().as_bytes())?;
    staged.commit()?;
    progress(1.0, "done");
    Ok(report)
}
