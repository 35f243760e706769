//! `weavelight scan`

use super::output::{Failure, Output};
use super::progress::Progress;
use super::target;
use crate::device::camera::Settings;
use crate::device::scan::{
    About, Begin, Control, Event, Instruments, Options, Plan, Preview, ScanError, Step, Subject,
    Summary, open, preview, scan, survey,
};
use crate::files::path_text;
use crate::instrument::Rig;
use crate::quantity::THICKNESS_MM;
use crate::session::{FrameEntry, Session};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Photograph a swatch, or a calibration target, under one light after the other
///
/// Takes a frame with every LED off, one under each light, and the first again. Every frame is safe on disk before the next
/// light; a scan that was stopped or killed goes on with --resume. Targets for `weavelight calibrate` are photographed with
/// --kind: a white sheet in the same way, a grey chart also under one light at several exposures, a chessboard one picture a
/// call.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  weavelight scan --rig rig.toml --out linen-4021 --thickness-mm 0.8\n  weavelight scan --rig rig.toml --preview\n  \
    weavelight scan --rig rig.toml --kind board --board 9x6x25 --out board\n  \
    weavelight scan --rig rig.toml --kind grey --target chart.toml --out grey\n  \
    weavelight scan --rig rig.toml --kind white --thickness-mm 100 --out white-raised\n  \
    weavelight scan --rig rig.toml --kind white --plane-point 0,0,60 --plane-normal 0.24,0.24,0.94 --out white-tilt-1"
)]
pub(super) struct Args {
    /// The rig
    #[arg(long, value_name = "FILE")]
    rig: PathBuf,
    /// Folder of the capture session to write
    #[arg(long, value_name = "SESSION", required_unless_present_any = ["preview", "dry_run"])]
    out: Option<PathBuf>,
    /// Name of the swatch [default: the folder's]
    #[arg(long, value_name = "N")]
    name: Option<String>,
    /// How thick the swatch is, or how far a level sheet is raised: its surface lies this far over the table
    #[arg(long, value_name = "T", value_parser = thickness)]
    thickness_mm: Option<f64>,
    /// Exposure time, the same for every light [default: found with test shots under light 0]
    #[arg(long, value_name = "S")]
    exposure_s: Option<f64>,
    /// Sensitivity
    #[arg(long, value_name = "N", default_value_t = 100.0)]
    iso: f64,
    /// Further exposures of each light, relative to the first, comma-separated: for cloth with highlights
    #[arg(long, value_name = "X,...", value_delimiter = ',')]
    bracket: Vec<f64>,
    /// Go on where an earlier scan ended
    #[arg(long)]
    resume: bool,
    /// Print what would be photographed and, with --out, what is there already; write nothing
    #[arg(long)]
    dry_run: bool,
    /// Take one test shot, tell exposure and focus, and write nothing
    #[arg(long, conflicts_with_all = ["resume", "dry_run", "bracket"])]
    preview: bool,
    /// The light of the test shot, or of a chessboard's picture [default: 0]
    #[arg(long, value_name = "K")]
    light: Option<usize>,
    #[command(flatten)]
    target: target::TargetArgs,
}

fn thickness(text: &str) -> Result<f64, String> {
    THICKNESS_MM.parse(text)
}

/// Exposure of a test shot where none is given, seconds.
const PREVIEW_S: f64 = 0.1;

pub(super) fn run(args: &Args) -> Result<Output, Failure> {
    let rig = Rig::load(&args.rig).map_err(Failure::work)?;
    if args.preview {
        return look(args, &rig, &Plan::new(&rig, &[]).map_err(failure)?);
    }
    if args.light.is_some() && !args.target.adds() {
        return Err(Failure::call("--light goes with --preview or --kind board; leave it out"));
    }
    let there = args.out.as_deref().map_or(Vec::new(), frames_in);
    let subject = args.target.subject(args.light.unwrap_or(0), there.is_empty())?;
    let plan = Plan::of(&rig, &subject, &args.bracket, &there).map_err(failure)?;
    match &args.out {
        _ if args.dry_run => describe_plan(&plan, args, &subject),
        Some(out) => photograph(args, &rig, out),
        None => Err(Failure::call("--out is missing; name a folder, as in --out linen-4021")),
    }
}

/// What a capture session holds already; nothing where there is none.
fn frames_in(folder: &Path) -> Vec<FrameEntry> {
    Session::load(folder).map_or(Vec::new(), |session| session.frames)
}

/// Some errors are about the call.
fn failure(error: ScanError) -> Failure {
    match error {
        ScanError::Bracket { .. }
        | ScanError::BracketByHand
        | ScanError::BracketOfTarget
        | ScanError::NoSuchLight { .. }
        | ScanError::Option { .. } => Failure::call(error),
        _ => Failure::work(error),
    }
}

fn photograph(args: &Args, rig: &Rig, folder: &Path) -> Result<Output, Failure> {
    let Instruments { board, mut camera, lock: _lock } = open(rig, &args.rig).map_err(failure)?;
    // Only now, when no other process adds pictures, is it certain which one comes next.
    let subject = args.target.subject(args.light.unwrap_or(0), frames_in(folder).is_empty())?;
    let options = Options {
        folder: folder.to_owned(),
        subject,
        about: About { name: args.name.clone(), thickness_mm: args.thickness_mm },
        begin: begin(args),
        exposure_s: args.exposure_s,
        iso: args.iso,
        bracket: args.bracket.clone(),
    };
    let progress = Progress::new();
    let tell = |event: &Event| show(&progress, event);
    let summary = scan(rig, &options, &board, camera.as_mut(), &Control::default(), &tell)
        .map_err(failure)?;
    drop(progress);
    let retried =
        summary.retries.iter().map(|(frame, why)| format!("{frame} was taken again: {why}"));
    let warnings = retried.chain(summary.warnings.iter().cloned()).collect();
    Ok(Output { text: text(&summary), json: of_summary(&summary), warnings, status: 0 })
}

fn show(progress: &Progress, event: &Event) {
    match event {
        Event::Metering => progress.set(0.0, "finding the exposure"),
        Event::Frame { frame, done, total, left } => {
            let left = left.map(|left| format!(", {:.0} s left", left.as_secs_f64()));
            let what = format!("{frame}{}", left.unwrap_or_default());
            progress.set(*done as f64 / (*total).max(1) as f64, &what);
        }
        Event::Waiting { frame, what, .. } => progress.note(&format!("{frame}: {what}")),
        Event::Kept { .. } => {}
        Event::Again { frame, why } => progress.say(&format!("{frame}: {why}")),
        Event::BoardLost => progress.note("the light board is gone; plug it in again"),
        Event::Paused => progress.note("paused"),
    }
}

fn text(summary: &Summary) -> String {
    let seconds = summary.seconds;
    let before = match summary.resumed {
        0 => String::new(),
        count => format!(" ({count} of them from before)"),
    };
    let exposure = summary
        .settings
        .map(|s| format!(" at {} s, ISO {}", s.exposure_s, s.iso))
        .unwrap_or_default();
    format!(
        "{}: {} frames{before}{exposure} in {:.1} s ({:.1} s exposing, {:.1} s transfer)",
        summary.folder.display(),
        summary.frames,
        seconds.total,
        seconds.exposing,
        seconds.transfer
    )
}

fn of_summary(summary: &Summary) -> Value {
    let seconds = summary.seconds;
    let retries: Vec<Value> =
        summary.retries.iter().map(|(frame, why)| json!({ "frame": frame, "why": why })).collect();
    json!({
        "session": path_text(&summary.folder),
        "frames": summary.frames,
        "resumed": summary.resumed,
        "exposure_s": summary.settings.map(|s| s.exposure_s),
        "iso": summary.settings.map(|s| s.iso),
        "retries": retries,
        "warnings": summary.warnings,
        "seconds": {
            "total": seconds.total,
            "exposing": seconds.exposing,
            "transfer": seconds.transfer,
            "lights": seconds.lights,
            "disk": seconds.disk,
        },
    })
}

/// What would be photographed; with --out, what is there already.
fn describe_plan(plan: &Plan, args: &Args, subject: &Subject) -> Result<Output, Failure> {
    let about = About { name: args.name.clone(), thickness_mm: args.thickness_mm };
    let (there, warnings) = match &args.out {
        Some(out) => survey(out, (&about, subject), begin(args), plan).map_err(failure)?,
        None => (vec![false; plan.steps.len()], Vec::new()),
    };
    let exposure = |factor: f64| args.exposure_s.map(|s| s * factor);
    let line = |(k, (step, there)): (usize, (&Step, &bool))| {
        let output = step.output.map_or("all off".to_owned(), |output| format!("output {output}"));
        let exposure = match (there, exposure(step.factor)) {
            (true, _) => "there already".to_owned(),
            (false, Some(s)) => format!("{s} s"),
            (false, None) => format!("{} x the exposure to be found", step.factor),
        };
        format!("{:3}  {:24} {output:10} {exposure}", k + 1, step.stem)
    };
    let steps = || plan.steps.iter().zip(&there);
    let lines: Vec<String> = steps().enumerate().map(line).collect();
    let json: Vec<Value> = steps()
        .map(|(step, there)| {
            json!({
                "file": step.stem,
                "light": step.light,
                "output": step.output,
                "exposure_s": exposure(step.factor),
                "factor": step.factor,
                "drift_check": step.drift_check,
                "there": there,
            })
        })
        .collect();
    let json = json!({ "frames": json, "warnings": warnings });
    Ok(Output { text: lines.join("\n"), json, warnings, status: 0 })
}

fn begin(args: &Args) -> Begin {
    if args.resume || args.target.adds() { Begin::Resume } else { Begin::Anew }
}

fn look(args: &Args, rig: &Rig, plan: &Plan) -> Result<Output, Failure> {
    let light = args.light.unwrap_or(0);
    let step = plan.steps.iter().find(|step| step.light == Some(light));
    let output = step.and_then(|step| step.output).ok_or_else(|| {
        let last = rig.lights.len() - 1;
        Failure::call(format!("--light is {light}; the rig has lights 0 to {last}"))
    })?;
    let Instruments { board, mut camera, lock: _lock } = open(rig, &args.rig).map_err(failure)?;
    let wanted = Settings { exposure_s: args.exposure_s.unwrap_or(PREVIEW_S), iso: args.iso };
    let seen = preview(&board, camera.as_mut(), (light, output), wanted).map_err(failure)?;
    Ok(Output { text: of_preview(&seen), json: preview_json(&seen), ..Output::default() })
}

/// A histogram as a row of bars.
fn bars(histogram: &[f64]) -> String {
    const BARS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let pairs: Vec<f64> = histogram.chunks(2).map(|pair| pair.iter().sum()).collect();
    let most = pairs.iter().copied().fold(1e-9, f64::max);
    // Roots, so that a few bright samples are seen beside many dark ones.
    pairs.iter().map(|share| BARS[((share / most).sqrt() * 8.0).ceil() as usize % 9]).collect()
}

fn of_preview(seen: &Preview) -> String {
    let mut lines = vec![format!("light {}: {}", seen.light, seen.advice)];
    lines.extend(seen.look.channels.iter().map(|channel| {
        format!(
            "{:4} |{}| mean {:4.1} %, brightest {:4.1} %, clipped {:.2} %",
            channel.name,
            bars(&channel.histogram),
            100.0 * channel.mean,
            100.0 * channel.high,
            100.0 * channel.clipped
        )
    }));
    lines.push(format!(
        "focus {:.4}: larger is sharper; turn the focus ring and look again",
        seen.look.sharpness
    ));
    lines.join("\n")
}

fn preview_json(seen: &Preview) -> Value {
    let channels: Vec<Value> = seen
        .look
        .channels
        .iter()
        .map(|c| {
            json!({
                "name": c.name,
                "mean": c.mean,
                "high": c.high,
                "clipped": c.clipped,
                "histogram": c.histogram,
            })
        })
        .collect();
    json!({
        "light": seen.light,
        "exposure_s": seen.settings.exposure_s,
        "iso": seen.settings.iso,
        "better_exposure_s": seen.better_exposure_s,
        "advice": seen.advice,
        "focus": seen.look.sharpness,
        "channels": channels,
    })
}
