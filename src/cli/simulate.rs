//! `weavelight simulate`

use super::output::{Failure, Output};
use super::progress::Progress;
use crate::files::path_text;
use crate::simulate::{self, Flaws, Material, Options, Part, Summary, Targets};
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use weavelight_sim::cloth::{Preset, Structure};

/// Photograph a fabric and every calibration target on a simulated rig
///
/// Writes rig.toml, calibration/ (the truth), board/, grey/, white-flat/, white-raised/, white-tilt-N/, swatch/ and
/// truth/. An earlier simulation at DIR is replaced when the new one is whole. The same seed gives the same bytes.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  weavelight simulate --out rig --preset denim --size 1232x816 --only swatch"
)]
pub(super) struct Args {
    /// Folder to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The rig; its lights are where it says [default: the reference rig of ten LEDs]
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Size of the frames, the field of view stays [default: the rig's]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[usize; 2]>,
    /// Everything random follows from it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=MOST_SEED))]
    seed: u64,
    /// Photograph only these, comma-separated [default: all]
    #[arg(long, value_name = "PART,...", value_delimiter = ',', value_parser = names(&Part::ALL.map(Part::name)))]
    only: Vec<String>,
    #[command(flatten, next_help_heading = "Fabric")]
    fabric: FabricArgs,
    #[command(flatten, next_help_heading = "Calibration targets")]
    targets: TargetArgs,
    #[command(flatten, next_help_heading = "What is wrong with instrument and technician")]
    flaws: FlawArgs,
}

#[derive(Debug, clap::Args)]
struct FabricArgs {
    /// The fabric
    #[arg(long, value_name = "NAME", default_value = "linen", value_parser = names(&Preset::ALL.map(Preset::name)))]
    preset: String,
    /// Another structure in place of the fabric's own
    #[arg(long, value_name = "NAME", value_parser = names(&Structure::ALL.map(Structure::name)))]
    structure: Option<String>,
    /// Warp threads or wales per centimetre
    #[arg(long, value_name = "N")]
    threads_per_cm: Option<f64>,
    /// Half the width of a yarn
    #[arg(long, value_name = "MM")]
    yarn_radius_mm: Option<f64>,
    /// Reflectance of the warp's crowns (a knit's yarn), linear sRGB, 0 to 1 [default: the fabric's own]
    #[arg(long, value_name = "R,G,B", value_parser = triple)]
    warp_color: Option<[f64; 3]>,
    /// Reflectance of the weft's crowns [default: the fabric's own]
    #[arg(long, value_name = "R,G,B", value_parser = triple)]
    weft_color: Option<[f64; 3]>,
    /// By which share yarns are darker between their crowns than on them [default: the fabric's own; linen 0.08]
    #[arg(long, value_name = "SHARE")]
    wear: Option<f64>,
    /// Print colours on it
    #[arg(long)]
    print: bool,
    /// Height of wrinkles
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    wrinkles_mm: f64,
    /// Thickness: the surface lies this far above the table, and session.toml says so
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    thickness_mm: f64,
    /// Size of the swatch on the dark table [default: fills the picture]
    #[arg(long, value_name = "WxH", value_parser = extent)]
    swatch_mm: Option<[f64; 2]>,
    /// Let yarns throw light onto each other (one bounce)
    #[arg(long)]
    bounce: bool,
    /// Samples along each side of a photosite [default: by the size of the yarns]
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
}

#[derive(Debug, clap::Args)]
struct TargetArgs {
    /// Pictures of the chessboard
    #[arg(long, value_name = "N", default_value_t = Targets::default().boards)]
    boards: usize,
    /// Side of its squares [default: as fits, 25 at most]
    #[arg(long, value_name = "MM")]
    square_mm: Option<f64>,
    /// How thick the board is
    #[arg(long, value_name = "MM", default_value_t = Targets::default().board_thickness_mm)]
    board_thickness_mm: f64,
    /// Height of the raised white sheet
    #[arg(long, value_name = "MM", default_value_t = Targets::default().raised_mm)]
    raised_mm: f64,
    /// How many ways the white sheet is tilted
    #[arg(long, value_name = "N", default_value_t = Targets::default().tilts)]
    tilts: usize,
    /// By how much
    #[arg(long, value_name = "DEG", default_value_t = Targets::default().tilt_deg)]
    tilt_deg: f64,
    /// Leave the sheets' planes out of session.toml: only the printed strip tells
    #[arg(long)]
    unstated_planes: bool,
    /// Unevenness of the white sheet, relative, peak to peak
    #[arg(long, value_name = "SHARE", default_value_t = Targets::default().unevenness)]
    unevenness: f64,
    /// Low-frequency error of each light on the sheet, relative, RMS
    #[arg(long, value_name = "SHARE", default_value_t = Targets::default().kappa)]
    kappa: f64,
    /// Specks of dust on the sheet per square decimetre
    #[arg(long, value_name = "N", default_value_t = Targets::default().dust_per_dm2)]
    dust: f64,
    /// The light during which a hand shadows the sheet
    #[arg(long, value_name = "LIGHT")]
    hand: Option<usize>,
}

#[derive(Debug, clap::Args)]
struct FlawArgs {
    /// Error of the ruler in rig.toml, RMS per axis
    #[arg(long, value_name = "MM", default_value_t = Flaws::default().ruler_error_mm)]
    ruler_error_mm: f64,
    /// Share of the light lost in the farthest corner
    #[arg(long, value_name = "SHARE", default_value_t = Flaws::default().vignetting)]
    vignetting: f64,
    /// Blur of lens and low-pass filter, Gaussian sigma in photosites; 0 for none
    #[arg(long, value_name = "S", default_value_t = Flaws::default().psf_px)]
    psf_px: f64,
    /// Ambient light; 1 is a dim room
    #[arg(long, value_name = "X", default_value_t = Flaws::default().ambient)]
    ambient: f64,
    /// How far the lamps change during a capture session, relative
    #[arg(long, value_name = "SHARE", default_value_t = Flaws::default().drift, allow_negative_numbers = true)]
    drift: f64,
    /// Two lights whose wires are swapped
    #[arg(long, value_name = "LIGHT", num_args = 2)]
    swapped: Option<Vec<usize>>,
    /// A light that stays dark
    #[arg(long, value_name = "LIGHT")]
    dead: Option<usize>,
    /// Exposure relative to the advice (brightest light at half the range)
    #[arg(long, value_name = "X", default_value_t = Flaws::default().exposure_factor)]
    exposure_factor: f64,
    /// Bend of the sensor's response: light = (1 - b) x + b x^2
    #[arg(long, value_name = "B", default_value_t = Flaws::default().bend, allow_negative_numbers = true)]
    bend: f64,
    /// Share of photosites that are stuck
    #[arg(long, value_name = "SHARE", default_value_t = Flaws::default().defects)]
    defects: f64,
    /// Relative spread of the photosites' sensitivities
    #[arg(long, value_name = "SHARE", default_value_t = Flaws::default().prnu)]
    prnu: f64,
    /// Read noise in electrons
    #[arg(long, value_name = "E", default_value_t = Flaws::default().read_noise_e)]
    read_noise_e: f64,
    /// No noise at all
    #[arg(long)]
    noiseless: bool,
}

/// The largest integer that TOML holds.
pub(super) const MOST_SEED: u64 = i64::MAX as u64;

fn names(all: &[&'static str]) -> PossibleValuesParser {
    PossibleValuesParser::new(all)
}

/// "1232x816"
pub(super) fn size(text: &str) -> Result<[usize; 2], String> {
    pair(text).ok_or_else(|| "give width x height in pixels, as in 1232x816".to_owned())
}

fn extent(text: &str) -> Result<[f64; 2], String> {
    pair(text).ok_or_else(|| "give width x height in millimetres, as in 200x150".to_owned())
}

/// "0.5,0.4,0.3"
pub(super) fn triple(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    numbers
        .ok()
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| "give three numbers with commas between, as in 0.5,0.4,0.3".to_owned())
}

fn pair<T: std::str::FromStr>(text: &str) -> Option<[T; 2]> {
    let (width, height) = text.split_once(['x', 'X'])?;
    Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
}

impl Args {
    fn options(&self) -> Options {
        Options {
            out: self.out.clone(),
            rig: self.rig.clone(),
            size_px: self.size,
            seed: self.seed,
            only: self.only.iter().filter_map(|name| Part::parse(name)).collect(),
            material: self.fabric.material(),
            targets: self.targets.targets(),
            flaws: self.flaws.flaws(),
        }
    }
}

impl FabricArgs {
    fn material(&self) -> Material {
        Material {
            preset: Preset::parse(&self.preset).unwrap_or(Preset::Linen),
            structure: self.structure.as_deref().and_then(Structure::parse),
            threads_per_cm: self.threads_per_cm,
            yarn_radius_mm: self.yarn_radius_mm,
            warp_color: self.warp_color,
            weft_color: self.weft_color,
            wear: self.wear,
            print: self.print,
            wrinkles_mm: self.wrinkles_mm,
            thickness_mm: self.thickness_mm,
            extent_mm: self.swatch_mm,
            bounce: self.bounce,
            samples: self.samples,
        }
    }
}

impl TargetArgs {
    fn targets(&self) -> Targets {
        Targets {
            boards: self.boards,
            square_mm: self.square_mm,
            board_thickness_mm: self.board_thickness_mm,
            raised_mm: self.raised_mm,
            tilts: self.tilts,
            tilt_deg: self.tilt_deg,
            state_planes: !self.unstated_planes,
            unevenness: self.unevenness,
            kappa: self.kappa,
            dust_per_dm2: self.dust,
            hand: self.hand,
        }
    }
}

impl FlawArgs {
    fn flaws(&self) -> Flaws {
        Flaws {
            ruler_error_mm: self.ruler_error_mm,
            vignetting: self.vignetting,
            psf_px: self.psf_px,
            ambient: self.ambient,
            drift: self.drift,
            swapped: self.swapped.as_ref().map(|pair| [pair[0], pair[1]]),
            dead: self.dead,
            exposure_factor: self.exposure_factor,
            bend: self.bend,
            defects: self.defects,
            prnu: self.prnu,
            read_noise_e: self.read_noise_e,
            noise: !self.noiseless,
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let progress = Progress::new();
    let summary = simulate::run(&args.options(), &|share, what| progress.set(share, what))
        .map_err(Failure::work)?;
    drop(progress);
    Ok(Output { text: text(&summary), json: json(&summary), ..Output::default() })
}

fn text(summary: &Summary) -> String {
    let [width, height] = summary.size_px;
    format!(
        "{}: {} frames of {width} x {height} in {}; the truth is in calibration/{}",
        summary.out.display(),
        summary.frames,
        summary.sessions.join(", "),
        if summary.swatch_exposure_s.is_some() { " and truth/" } else { "" },
    )
}

fn json(summary: &Summary) -> serde_json::Value {
    serde_json::json!({
        "out": path_text(&summary.out),
        "sessions": summary.sessions,
        "frames": summary.frames,
        "size_px": summary.size_px,
        "swatch_exposure_s": summary.swatch_exposure_s,
    })
}
