//! `weavelight demo`

use super::output::{Failure, Output};
use super::progress::Progress;
use super::simulate::{MOST_SEED, size};
use crate::demo::{self, Options, Shot};
use crate::files::path_text;
use std::fmt::Write;
use std::path::PathBuf;
use weavelight_sim::cloth::Preset;

/// Do the whole job on the simulated rig and say how far the maps are from the truth
///
/// Photographs fabrics on a simulated rig (real RAW frames), solves them, compares with the truth, and writes a page for
/// each.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  weavelight demo --out demo --size 1232x816")]
pub(super) struct Args {
    /// Folder to write
    #[arg(long, value_name = "DIR", default_value = "demo")]
    out: PathBuf,
    /// Size of the frames
    #[arg(long, value_name = "WxH", default_value = "1232x816", value_parser = size)]
    size: [usize; 2],
    /// Everything random follows from it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=MOST_SEED))]
    seed: u64,
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let options = Options {
        out: args.out.clone(),
        size_px: args.size,
        fabrics: vec![Preset::Linen, Preset::Facets],
        seed: args.seed,
    };
    let progress = Progress::new();
    let shots =
        demo::run(&options, &|share, what| progress.set(share, what)).map_err(Failure::work)?;
    drop(progress);
    let warnings = shots.iter().flat_map(|shot| shot.report.warnings.clone()).collect();
    Ok(Output { text: text(&shots), json: json(&shots), warnings, status: 0 })
}

fn text(shots: &[Shot]) -> String {
    let mut text = String::from("against the truth:\n");
    for shot in shots {
        let (normal, albedo) = (&shot.normal, &shot.albedo);
        // Writing to a String does not fail.
        let _ = writeln!(
            text,
            "{:8} normal: median {:.2}, RMS {:.2}, 95 % below {:.2} degrees; albedo: RMS {:.4}, CIEDE2000 {:.2}, 95 % below {:.2}, 4 x 4 means {:.2}, false colour {:.2}\n{:8} {}",
            shot.fabric,
            normal.median_deg,
            normal.rms_deg,
            normal.p95_deg,
            albedo.rms,
            albedo.mean_de2000,
            albedo.p95_de2000,
            albedo.mean_de2000_4x4.unwrap_or(f64::NAN),
            albedo.false_color,
            "",
            shot.page.display(),
        );
    }
    text
}

fn json(shots: &[Shot]) -> serde_json::Value {
    let shot = |shot: &Shot| {
        serde_json::json!({
            "fabric": shot.fabric,
            "page": path_text(&shot.page),
            "normal": shot.normal,
            "albedo": shot.albedo,
            "report": shot.report,
        })
    };
    serde_json::json!({ "fabrics": shots.iter().map(shot).collect::<Vec<_>>() })
}
