//! `weavelight bench`

use super::output::{Failure, Output};
use super::progress::Progress;
use crate::bench::{
    self, BENCH_SVG, Curves, Effort, Fabric, Options, SetFolders, curves_text, sets_text,
};
use std::path::PathBuf;

/// Measure run time against error, for every method
///
/// On simulated fabrics with and without shadows and highlights, and on picture sets of yours whose true normals are known.
/// Writes bench.svg and bench.json. Times are multiples, in processor time, of reading every sample and
/// writing every map once; `*` marks
/// methods that no other beats in both time and error.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  weavelight bench --out bench --set bear=bear,bear/calibration,bear-normals.exr"
)]
pub(super) struct Args {
    /// Folder to write
    #[arg(long, value_name = "DIR", default_value = "bench")]
    out: PathBuf,
    /// Three fabrics, small frames, few repeats: whether it works, in seconds
    #[arg(long)]
    quick: bool,
    /// A picture set: capture session, calibration and true normals (0 where unknown); may be repeated
    #[arg(long = "set", value_name = "NAME=SESSION,CALIB,NORMALS.exr", value_parser = set)]
    sets: Vec<SetFolders>,
    /// Only the sets, no simulated fabrics
    #[arg(long)]
    no_fabrics: bool,
    /// Measure time over 1 to 100 megapixels and over 3 to 64 lights too
    #[arg(long)]
    curves: bool,
}

/// Reads `NAME=SESSION,CALIB,NORMALS.exr`.
fn set(text: &str) -> Result<SetFolders, String> {
    let wanted = || format!("{text:?} is not of the form NAME=SESSION,CALIB,NORMALS.exr");
    let (name, folders) = text.split_once('=').ok_or_else(wanted)?;
    let parts: Vec<&str> = folders.split(',').collect();
    let [session, calibration, truth] = parts[..] else { return Err(wanted()) };
    if [name, session, calibration, truth].iter().any(|part| part.trim().is_empty()) {
        return Err(wanted());
    }
    Ok(SetFolders {
        name: name.to_owned(),
        session: session.into(),
        calibration: calibration.into(),
        truth: truth.into(),
    })
}

impl Args {
    fn options(&self) -> Result<Options, Failure> {
        let fabrics = match (self.no_fabrics, self.quick) {
            (true, _) => vec![],
            (false, true) => Fabric::FEW.to_vec(),
            (false, false) => Fabric::ALL.to_vec(),
        };
        if fabrics.is_empty() && self.sets.is_empty() && !self.curves {
            return Err(Failure::call(
                "--no-fabrics leaves nothing to measure; give --set or --curves as well",
            ));
        }
        Ok(Options {
            out: self.out.clone(),
            fabrics,
            sets: self.sets.clone(),
            effort: if self.quick { Effort::Quick } else { Effort::Full },
            curves: if self.curves { Curves::Measure } else { Curves::Leave },
        })
    }
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let options = args.options()?;
    let progress = Progress::new();
    let report = bench::run(&options, &|share, what: &str| progress.set(share, what))
        .map_err(Failure::work)?;
    drop(progress);
    let picture = args.out.join(BENCH_SVG);
    let text = [sets_text(&report), curves_text(&report.curves), picture.display().to_string()];
    let warnings = report
        .sets
        .iter()
        .flat_map(|set| set.warnings.iter().map(move |warning| format!("{}: {warning}", set.name)));
    Ok(Output {
        text: text.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("\n"),
        json: serde_json::to_value(&report).map_err(Failure::work)?,
        warnings: warnings.collect(),
        status: 0,
    })
}
