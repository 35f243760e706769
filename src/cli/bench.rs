//! `weavelight bench`

use super::output::{Failure, Output};
use super::progress::Progress;
use crate::bench::{
    self, BENCH_SVG, ColorCloth, ColorOptions, Curves, Effort, Fabric, Options, SetFolders,
    colors_markdown, curves_text, sets_text,
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
    /// Measure the colours of the albedo instead, as a Markdown table: on every cloth, without and with lens blur, beside
    /// published demosaicers. Writes colors.md too
    #[arg(long, conflicts_with_all = ["quick", "sets", "curves", "no_fabrics"])]
    colors: bool,
    /// For --colors: sizes of the frame over the whole field of view, comma-separated
    #[arg(long, value_name = "WxH,...", value_delimiter = ',', value_parser = super::simulate::size, default_value = "1848x1224,1232x816", requires = "colors")]
    sizes: Vec<[usize; 2]>,
    /// For --colors: only the middle of the frame [default: all of it]
    #[arg(long, value_name = "WxH", value_parser = super::simulate::size, requires = "colors")]
    middle: Option<[usize; 2]>,
    /// For --colors: lens blur, Gaussian sigma in photosites
    #[arg(
        long,
        value_name = "S,...",
        value_delimiter = ',',
        default_value = "0,0.7",
        requires = "colors"
    )]
    psf_px: Vec<f64>,
    /// For --colors: seeds
    #[arg(
        long,
        value_name = "N,...",
        value_delimiter = ',',
        default_value = "2,3",
        requires = "colors"
    )]
    seeds: Vec<u64>,
    /// For --colors: only these, semicolon-separated, by the names in the table [default: all]
    #[arg(long, value_name = "NAME;...", value_delimiter = ';', value_parser = cloth, requires = "colors")]
    cloths: Vec<ColorCloth>,
}

fn cloth(text: &str) -> Result<ColorCloth, String> {
    let names = || ColorCloth::ALL.map(|cloth| cloth.name).join("; ");
    ColorCloth::parse(text.trim()).ok_or_else(|| format!("choose from: {}", names()))
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
        let fabrics = match (self.no_fabrics || self.colors, self.quick) {
            (true, _) => vec![],
            (false, true) => Fabric::FEW.to_vec(),
            (false, false) => Fabric::ALL.to_vec(),
        };
        if fabrics.is_empty() && self.sets.is_empty() && !self.curves && !self.colors {
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
            colors: self.colors.then(|| self.colors()),
        })
    }

    fn colors(&self) -> ColorOptions {
        ColorOptions {
            cloths: if self.cloths.is_empty() {
                ColorCloth::ALL.to_vec()
            } else {
                self.cloths.clone()
            },
            sizes_px: self.sizes.clone(),
            middle_px: self.middle,
            psf_px: self.psf_px.clone(),
            seeds: self.seeds.clone(),
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let options = args.options()?;
    let progress = Progress::new();
    let report = bench::run(&options, &|share, what: &str| progress.set(share, what))
        .map_err(Failure::work)?;
    drop(progress);
    if args.colors {
        return Ok(Output {
            text: colors_markdown(&report.colors),
            json: serde_json::to_value(&report).map_err(Failure::work)?,
            warnings: vec![],
            status: 0,
        });
    }
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
