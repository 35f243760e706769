//! `weavelight solve`

use super::output::{Failure, Output};
use super::progress::Progress;
use crate::files::FileError;
use crate::photometry::Method;
use crate::report::page_of_solve;
use crate::settings::Settings;
use crate::solution::{AlbedoKind, Outputs, Residuals, Reuse, Scale};
use crate::solution::{REPORT_HTML, Report};
use crate::solve::{self, Options, Shown};
use crate::swatch::MaskChoice;
use clap::ValueEnum;
use std::path::PathBuf;

/// Turn a capture session into normal, albedo and confidence maps
///
/// An earlier solution at DIR is replaced when the new one is whole; one that was made from the same inputs with the same
/// settings is left as it is.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  weavelight solve linen-4021 --calibration calibration --out linen-4021-maps"
)]
pub(super) struct Args {
    /// Capture session: folder with session.toml and frames
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// Calibration folder
    #[arg(long, value_name = "CALIB")]
    calibration: PathBuf,
    /// Folder to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Settings file whose [solve] table says method, undistort, normal-y and device where the options here do not: the
    /// window's own, for the same maps
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// How each photosite's normal is found [default: auto; least-squares for a preview]
    #[arg(long)]
    method: Option<MethodName>,
    /// Take the lens's distortion out of the maps
    #[arg(long)]
    undistort: bool,
    /// Where green points in normal.png [default: up]
    #[arg(long)]
    normal_y: Option<NormalYName>,
    /// Where to solve: a picture that is not black there, "auto" to leave out the table if it can be told from the swatch, or
    /// "none" for everywhere [default: the capture session's own mask]
    #[arg(long, value_name = "M.png|auto|none")]
    mask: Option<PathBuf>,
    /// Who solves photosites that have all their samples [default: auto]
    #[arg(long)]
    device: Option<DeviceName>,
    /// What the albedo is: reflectance, with the shading of unresolved relief divided out into shade.exr, or as it appears
    #[arg(long, default_value = "reflectance")]
    albedo: AlbedoName,
    /// What a spectrophotometer reads of this cloth (CIE L*a*b*, D50, 2 degrees): the reflectance is scaled to that lightness
    #[arg(long, value_name = "L,a,b", value_parser = super::simulate::triple, allow_negative_numbers = true)]
    reference_lab: Option<[f64; 3]>,
    /// Make only these, comma-separated: maps, png for both as pictures, page for report.html [default: all]
    #[arg(long, value_name = "MAP,...", value_delimiter = ',')]
    only: Vec<Wanted>,
    /// A quick look: maps of a fraction of the resolution, one pixel for 8 x 8 (4 x 4, 2 x 2) photosites
    #[arg(long, value_name = "8|4|2", value_parser = clap::builder::PossibleValuesParser::new(["8", "4", "2"]))]
    preview: Option<String>,
    /// Solve again even if nothing has changed
    #[arg(long)]
    force: bool,
    /// Write what the fit leaves over of each light too, residual-LL.exr: highlights positive, shadows negative
    #[arg(long)]
    residuals: bool,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    threads: Option<u32>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum MethodName {
    /// Weighted by the noise; shadows and highlights looked for where the residual asks for it
    Auto,
    /// Plain: every unsaturated sample, all of equal weight
    LeastSquares,
    /// Weighted; shadows and highlights looked for at every photosite
    Robust,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum DeviceName {
    /// Whichever was measured to be faster here, transfers included
    Auto,
    /// The processor
    Cpu,
    /// The graphics processor, through Vulkan
    Gpu,
}

impl From<DeviceName> for crate::settings::DeviceName {
    fn from(name: DeviceName) -> Self {
        match name {
            DeviceName::Auto => Self::Auto,
            DeviceName::Cpu => Self::Cpu,
            DeviceName::Gpu => Self::Gpu,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum NormalYName {
    /// OpenGL
    Up,
    /// DirectX
    Down,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum AlbedoName {
    /// Comparable with a spectrophotometer; albedo times shade gives the photographs back
    Reflectance,
    /// With the shading in it; shade is 1
    Appearance,
}

impl From<AlbedoName> for AlbedoKind {
    fn from(name: AlbedoName) -> Self {
        match name {
            AlbedoName::Reflectance => Self::Reflectance,
            AlbedoName::Appearance => Self::Appearance,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Wanted {
    Normal,
    Albedo,
    Shade,
    Confidence,
    Png,
    Page,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Auto => Self::Auto,
            MethodName::LeastSquares => Self::LeastSquares,
            MethodName::Robust => Self::Robust,
        }
    }
}

impl From<MethodName> for crate::settings::MethodName {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Auto => Self::Auto,
            MethodName::LeastSquares => Self::LeastSquares,
            MethodName::Robust => Self::Robust,
        }
    }
}

impl From<NormalYName> for crate::settings::NormalYName {
    fn from(name: NormalYName) -> Self {
        match name {
            NormalYName::Up => Self::Up,
            NormalYName::Down => Self::Down,
        }
    }
}

impl Args {
    /// Those of the file, with what the command line says over them.
    fn settings(&self) -> Result<Settings, FileError> {
        let kept = self.settings.as_deref().map(Settings::read).transpose()?.unwrap_or_default();
        let usual = if self.preview.is_some() {
            crate::settings::MethodName::LeastSquares
        } else {
            kept.method
        };
        Ok(Settings {
            method: self.method.map_or(usual, Into::into),
            undistort: self.undistort || kept.undistort,
            normal_y: self.normal_y.map_or(kept.normal_y, Into::into),
            device: self.device.map_or(kept.device, Into::into),
        })
    }

    fn options(&self) -> Result<Options, FileError> {
        let mut options = self.settings()?.options(&self.session, &self.calibration, &self.out);
        options.mask = match &self.mask {
            None => MaskChoice::OfSession,
            Some(none) if none.as_os_str() == "none" => MaskChoice::Everything,
            Some(auto) if auto.as_os_str() == "auto" => MaskChoice::Found,
            Some(path) => MaskChoice::File(path.clone()),
        };
        options.outputs = Outputs {
            normal: self.wants(Wanted::Normal),
            albedo: self.wants(Wanted::Albedo),
            shade: self.wants(Wanted::Shade),
            confidence: self.wants(Wanted::Confidence),
            png: self.wants(Wanted::Png),
        };
        options.scale = match self.preview.as_deref() {
            Some("8") => Scale::Eighth,
            Some("4") => Scale::Quarter,
            Some("2") => Scale::Half,
            _ => Scale::Full,
        };
        options.reuse = if self.force { Reuse::Never } else { Reuse::IfCurrent };
        options.residuals = if self.residuals { Residuals::Write } else { Residuals::Leave };
        options.albedo = self.albedo.into();
        options.reference_lab = self.reference_lab;
        options.threads = self.threads.map(|count| usize::try_from(count).unwrap_or(usize::MAX));
        Ok(options)
    }

    fn wants(&self, what: Wanted) -> bool {
        self.only.is_empty() || self.only.contains(&what)
    }
}

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let options = args.options().map_err(Failure::work)?;
    let progress = Progress::new();
    let tell = |state: solve::Progress| progress.set(state.share(), state.stage.what());
    let page = |shown: &Shown| page_of_solve(shown, None);
    let page = args.wants(Wanted::Page).then_some(&page as &(dyn Fn(&Shown) -> String + Sync));
    let solved = solve::run(&options, &tell, page).map_err(Failure::work)?;
    drop(progress);
    let report = solved.report;
    let up_to_date = if solved.up_to_date { "up to date, " } else { "" };
    let look = page.map_or_else(String::new, |_| {
        format!("\n{}  to look at", args.out.join(REPORT_HTML).display())
    });
    let swatch = report.swatch.as_ref().map_or_else(String::new, |said| format!("\n{said}"));
    Ok(Output {
        text: format!("{}: {up_to_date}{}{swatch}{look}", args.out.display(), text(&report)),
        json: serde_json::to_value(&report).map_err(Failure::work)?,
        warnings: report.warnings,
        status: 0,
    })
}

fn text(report: &Report) -> String {
    let percent = |count: u64| 100.0 * count as f64 / report.pixels.max(1) as f64;
    let scale =
        report.mm_per_px.map_or_else(String::new, |scale| format!(", {scale:.4} mm per pixel"));
    let seconds: f64 = report.seconds.values().sum();
    let adapter = report.device.as_ref().and_then(|device| device.adapter.as_deref());
    let with = adapter.map_or_else(String::new, |name| format!(" with {name}"));
    let defective = match report.defective_pixels {
        0 => String::new(),
        count => format!(", {count} defective photosites left out"),
    };
    let what = match report.scale {
        1 => "photosites".to_owned(),
        side => format!("pixels of {side} x {side} photosites"),
    };
    let kind = report.albedo.as_ref().map_or("albedo", |albedo| albedo.kind.as_str());
    let level = report.albedo.as_ref().and_then(|albedo| albedo.reference.as_ref());
    let level = level.map_or_else(String::new, |level| {
        let [l, a, b] = level.lab_d50;
        format!(
            "\nlevel scaled by {:.3} to L* {l}; {:.1} CIEDE2000 to {l}, {a}, {b} left",
            level.factor, level.remaining_de2000
        )
    });
    format!(
        "{:.1} % of {} {what} solved from {} lights{scale}\n\
         robust path {:.2} %, clipped samples at {:.2} %{defective}, residual {:.5} of white, {kind} in {}, {seconds:.1} s{with}{level}",
        percent(report.solved),
        report.pixels,
        report.lights_used.len(),
        percent(report.robust_pixels),
        percent(report.saturated_pixels),
        report.residual_rms.unwrap_or(0.0),
        report.color_space,
    )
}
