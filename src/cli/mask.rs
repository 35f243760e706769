//! `weavelight mask`

use super::output::{Failure, Output};
use super::progress::Progress;
use crate::files::path_text;
use crate::solution::Reuse;
use crate::solve::{self, MaskOptions};
use serde_json::json;
use std::path::PathBuf;

/// Find the swatch in the frames and write it as a mask, white on black
///
/// In the capture session's folder it is named in session.toml, and `solve` leaves out what is black; edit it in any paint
/// program. Where no smooth table of one colour shows in the corners of the frame, everything is kept.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  weavelight mask linen-4021 --calibration calibration\n  \
    weavelight solve linen-4021 --calibration calibration --out linen-4021-maps")]
pub(super) struct Args {
    /// Capture session: folder with session.toml and frames
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// Calibration folder
    #[arg(long, value_name = "CALIB")]
    calibration: PathBuf,
    /// Picture to write [default: mask.png in the capture session]
    #[arg(long, value_name = "M.png")]
    out: Option<PathBuf>,
    /// Replace a picture that differs and may have been edited; it is kept beside it as mask-1.png
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let progress = Progress::new();
    let tell = |state: solve::Progress| progress.set(state.share(), state.stage.what());
    let options = MaskOptions {
        session: args.session.clone(),
        calibration: args.calibration.clone(),
        out: args.out.clone(),
        reuse: if args.force { Reuse::Never } else { Reuse::IfCurrent },
    };
    let made = solve::make_mask(&options, &tell).map_err(Failure::work)?;
    drop(progress);
    let up_to_date = if made.up_to_date { "up to date, " } else { "" };
    let named = if made.named { "; session.toml names it" } else { "" };
    Ok(Output {
        text: format!("{}: {up_to_date}{}{named}", made.path.display(), made.swatch.said),
        json: json!({
            "mask": path_text(&made.path),
            "table_share": made.swatch.table_share,
            "said": made.swatch.said,
            "up_to_date": made.up_to_date,
            "named_in_session": made.named,
            "warnings": made.warnings,
        }),
        warnings: made.warnings,
        status: 0,
    })
}
