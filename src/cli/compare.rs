//! `weavelight compare`

use super::output::{Failure, Output};
use crate::compare::{self, ColorFigures, Figures, Kind, NormalFigures, Options};
use clap::ValueEnum;
use std::path::PathBuf;

/// Say how far two maps are apart
///
/// Maps are OpenEXR, or PNG, TIFF and JPEG: there normals are decoded as 2 v - 1, and colours by the file's own encoding
/// (sRGB where it says nothing). Normals: angles in degrees. Colours: CIEDE2000 and the difference of linear values. Pixels
/// that are 0 (unsolved) or not finite in either map do not count; a normal.png has no such pixels, so give it a --mask.
/// Without --kind a map is taken for normals if its name says normal, or if it holds negative values or unit vectors only;
/// else for colours.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  weavelight compare maps/normal.exr truth/normal.exr --mask maps/mask.png --json"
)]
pub(super) struct Args {
    /// One map
    #[arg(value_name = "A")]
    a: PathBuf,
    /// The other
    #[arg(value_name = "B")]
    b: PathBuf,
    /// Picture that is white, or opaque, where to compare
    #[arg(long, value_name = "M.png")]
    mask: Option<PathBuf>,
    /// What the maps hold
    #[arg(long)]
    kind: Option<KindName>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum KindName {
    /// Unit vectors
    Normal,
    /// Linear RGB
    Color,
}

impl From<KindName> for Kind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::Normal => Self::Normal,
            KindName::Color => Self::Color,
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let options = Options {
        a: args.a.clone(),
        b: args.b.clone(),
        mask: args.mask.clone(),
        kind: args.kind.map(Kind::from),
    };
    let comparison = compare::run(&options).map_err(Failure::work)?;
    let (mut text, json) = match &comparison.figures {
        Figures::Normal(figures) => (normal_text(figures), serde_json::to_value(figures)),
        Figures::Color(figures) => (color_text(figures), serde_json::to_value(figures)),
    };
    if comparison.left_out > 0 {
        text.push_str(&format!(" ({} more have no value in one of the maps)", comparison.left_out));
    }
    Ok(Output { text, json: json.map_err(Failure::work)?, ..Output::default() })
}

fn normal_text(figures: &NormalFigures) -> String {
    let NormalFigures { mean_deg, median_deg, rms_deg, p95_deg, max_deg, pixels } = figures;
    format!(
        "normals, degrees: mean {mean_deg:.4}, median {median_deg:.4}, rms {rms_deg:.4}, 95 % below {p95_deg:.4}, \
         max {max_deg:.4}\n{pixels} pixels compared"
    )
}

fn color_text(figures: &ColorFigures) -> String {
    let ColorFigures { mean_de2000, p95_de2000, false_color, rms, psnr_db, pixels, .. } = figures;
    let blocks =
        figures.mean_de2000_4x4.map_or_else(|| "-".to_owned(), |mean| format!("{mean:.4}"));
    let psnr =
        psnr_db.map_or_else(|| "infinite (equal)".to_owned(), |psnr| format!("{psnr:.2} dB"));
    format!(
        "colours, CIEDE2000: mean {mean_de2000:.4}, 95 % below {p95_de2000:.4}, 4 x 4 means {blocks}; \
         false colour {false_color:.4} (a*, b*), rms {rms:.6} (linear), PSNR {psnr}\n{pixels} pixels compared"
    )
}
