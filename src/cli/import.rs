//! `weavelight import`

use super::output::{Failure, Output};
use super::progress::Progress;
use crate::files::path_text;
use crate::session::Encoding;
use crate::session::import::{self, ImportError, Options};
use clap::ValueEnum;
use serde_json::json;
use std::path::PathBuf;
use weavelight_calibration::description::Cfa;

/// Make a capture session from pictures and light directions of another origin
///
/// FILE is an RTI .lp file, or a list of directions, one "x y z" a line (to the light; x right, y up, z to the viewer),
/// its number of lines first if you like. An .lp file, or a filenames.txt beside FILE, names the pictures; otherwise give
/// them, and they pair with the directions in natural order (2 before 10). Of a list with names, the pictures given choose
/// the lights. A light_intensities.txt beside FILE is used. Exposure times and ISO come from the files.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  weavelight import --lights cat/light_directions.txt --mask cat/mask.png --out cat-session\n  \
    weavelight solve cat-session --calibration cat-session/calibration --out cat-maps"
)]
pub(super) struct Args {
    /// Light directions
    #[arg(long, value_name = "FILE")]
    lights: PathBuf,
    /// Pictures, one per light
    #[arg(value_name = "IMAGE")]
    images: Vec<PathBuf>,
    /// Folder to write; must not hold anything yet
    #[arg(long, value_name = "SESSION")]
    out: PathBuf,
    /// How the pictures encode light, where their files do not say (sRGB and gAMA chunks, ICC profiles): 8-bit pictures
    /// must, others are linear unless said
    #[arg(long)]
    encoding: Option<EncodingName>,
    /// Colour filters of the top-left 2 x 2 cell, for pictures that are a sensor's samples and do not say so
    #[arg(long, value_name = "RGGB", ignore_case = true, value_parser = ["RGGB", "BGGR", "GRBG", "GBRG"])]
    cfa: Option<String>,
    /// Take all pictures as equally exposed, whatever their files state: for sets that were normalised already
    #[arg(long)]
    same_exposure: bool,
    /// Picture that is white, or opaque, where the object is
    #[arg(long, value_name = "M.png")]
    mask: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EncodingName {
    /// Proportional to light
    Linear,
    /// sRGB's curve, as cameras write JPEG
    Srgb,
}

impl From<EncodingName> for Encoding {
    fn from(name: EncodingName) -> Self {
        match name {
            EncodingName::Linear => Self::Linear,
            EncodingName::Srgb => Self::Srgb,
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let options = Options {
        lights: args.lights.clone(),
        images: args.images.clone(),
        out: args.out.clone(),
        encoding: args.encoding.map(Encoding::from),
        cfa: args.cfa.as_deref().and_then(|name| Cfa::parse(&name.to_ascii_uppercase())),
        same_exposure: args.same_exposure,
        mask: args.mask.clone(),
    };
    let progress = Progress::new();
    let summary = import::run(&options, &|share, what| progress.set(share, what)).map_err(
        |error| match error {
            ImportError::EncodingUnknown(_)
            | ImportError::EncodingUnreadable { .. }
            | ImportError::EncodingContradicted { .. }
            | ImportError::CfaContradicted { .. } => Failure::call(error),
            _ => Failure::work(error),
        },
    )?;
    drop(progress);
    let [width, height] = summary.size_px;
    let (session, calibration) = (summary.session.display(), summary.calibration.display());
    let exposures = summary.exposures.as_ref().map(|text| format!(", {text}")).unwrap_or_default();
    Ok(Output {
        text: format!(
            "{session}: {} pictures of {width} x {height}{exposures}\n{calibration}: their lights\n\
             next: weavelight solve {session} --calibration {calibration} --out MAPS",
            summary.frames
        ),
        json: json!({
            "session": path_text(&summary.session),
            "calibration": path_text(&summary.calibration),
            "frames": summary.frames,
            "lights_in_list": summary.lights_in_list,
            "exposures": summary.exposures,
            "width_px": width,
            "height_px": height,
            "warnings": summary.warnings,
        }),
        warnings: summary.warnings,
        status: 0,
    })
}
