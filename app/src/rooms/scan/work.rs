//! The worker's part: test shots, scans with what can be seen of them so far, and the solve that follows.

use super::again::{self, Swapped};
use super::eyes::{Eyes, Sight};
use super::{Ask, Order, Told, What};
use crate::place::Place;
use crate::rooms::look;
use crate::rooms::scans::{Unfinished, incomplete};
use crate::settings::SolveSettings;
use crate::texts::scan as texts;
use crate::worker::{Outbox, Tools, Update, instruments::with_instruments, watch::holder};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use weavelight::device::camera::Settings;
use weavelight::device::scan::{
    About, Begin, Event, Options, Plan, Preview, ScanError, Subject, Summary, preview, scan,
};
use weavelight::raw::Hint;
use weavelight::report::{expected_error, page_of_solve};
use weavelight::session::Session;
use weavelight::simulate::Scene;
use weavelight::solution::Report;
use weavelight::solution::Reuse;
use weavelight::solve::{Shown, Solved, run};
use weavelight_sim::cloth::Preset;

/// How a scan ended that did not fail.
enum Outcome {
    Complete(Box<Summary>),
    Stopped,
}

type AnyError = Box<dyn std::error::Error + Send + Sync>;

pub(super) fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    match ask {
        Ask::TestShot { light, settings } => test_shot(light, settings, tools, out),
        Ask::Scan(order) => scan_and_solve(&order, tools, out),
        Ask::Solve { scan, settings } => solve_here(&scan, settings, tools, out),
        Ask::LayOut(preset) => lay_out(preset, tools, out),
        Ask::LookForUnfinished => look_for_unfinished(tools, out),
        Ask::Undo(replaced) => again::undo(replaced, tools, out),
    }
}

fn test_shot(light: usize, settings: Settings, tools: &mut Tools, out: &Outbox) {
    let shot = out.job(texts::TAKING_TEST_SHOT, || {
        with_instruments(tools, |place, with| -> Result<Preview, ScanError> {
            let output = u8::try_from(place.rig.channel(light)).unwrap_or(u8::MAX);
            preview(&with.board, with.camera.as_mut(), (light, output), settings)
        })
    });
    if let Ok(shot) = shot {
        out.tell(Update::Scan(Told::TestShot(Box::new(shot))));
    }
}

fn scan_and_solve(order: &Order, tools: &mut Tools, out: &Outbox) {
    let Some(place) = tools.place.clone() else { return };
    let title = texts::scanning(&order.name);
    let mut replaced = None;
    let mut into = None;
    let outcome = out.job(&title, || {
        with_instruments(tools, |place, with| -> Result<Outcome, AnyError> {
            let folder = folder_for(order, place)?;
            out.tell(Update::Scan(Told::Begun(folder.clone())));
            into = Some(folder.clone());
            // Not before board and camera are there.
            if matches!(order.what, What::Again(_)) {
                replaced = again::put_aside(&order.name, &folder, place, out)?;
            }
            let options = options(order, &folder);
            let eyes = Eyes::open(place, &folder, out);
            if matches!(order.what, What::Resume(_)) {
                look_at_what_is_there(&folder, &eyes);
            }
            let tell = |event: &Event| hear(event, &eyes, out);
            let outcome = out.with_control(|control| {
                scan(&place.rig, &options, &with.board, with.camera.as_mut(), control, &tell)
            });
            match outcome {
                Ok(summary) => Ok(Outcome::Complete(Box::new(summary))),
                Err(ScanError::Aborted { .. }) => Ok(Outcome::Stopped),
                Err(error) => Err(error.into()),
            }
        })
    });
    match (outcome, into) {
        (Ok(Outcome::Complete(summary)), Some(folder)) => {
            out.warn(&order.name, &summary.warnings);
            tell_taken(&place, out);
            out.tell(Update::Scan(Told::Complete(summary)));
            if place.is_calibrated() {
                solve_here(&folder, order.solve, tools, out);
            }
        }
        (_, folder) => {
            if let (Some(folder), Some(replaced)) = (&folder, replaced) {
                again::put_back_if_nothing_came(folder, replaced, tools, out);
            }
            let lights = folder.map_or_else(Vec::new, |folder| lights_of(&folder));
            out.tell(Update::Scan(Told::Ended(lights)));
            look_for_unfinished(tools, out);
        }
    }
}

/// Where the frames go. A new scan never goes where something is already.
fn folder_for(order: &Order, place: &Place) -> Result<PathBuf, String> {
    match &order.what {
        What::Resume(folder) | What::Again(folder) => Ok(folder.clone()),
        What::New => {
            let taken = place.taken();
            match taken.has(&order.name) {
                true => Err(texts::TAKEN.to_owned()),
                false => Ok(place.scans().join(taken.free(&order.name))),
            }
        }
    }
}

/// The frames that are there show in the strip, and their light counts in the maps.
pub(super) fn look_at_what_is_there(folder: &Path, eyes: &Eyes) {
    let Ok(session) = Session::load(folder) else { return };
    for entry in &session.frames {
        // What was altered is taken again.
        if session.read_frame(entry).is_ok() {
            eyes.look_at(Sight {
                light: entry.light,
                drift_check: entry.drift_check,
                file: session.frame_path(entry),
                settings: Settings { exposure_s: entry.exposure_s, iso: entry.iso },
                hint: entry.hint(),
            });
        }
    }
}

/// The lights whose frames are on the disk; `None`: no light.
fn lights_of(folder: &Path) -> Vec<Option<usize>> {
    let Ok(session) = Session::load(folder) else { return Vec::new() };
    let there = session.frames.iter().filter(|entry| session.frame_path(entry).is_file());
    there.filter(|entry| !entry.drift_check).map(|entry| entry.light).collect()
}

fn options(order: &Order, folder: &Path) -> Options {
    let resume = matches!(order.what, What::Resume(_));
    // It goes on as it was begun, whatever the form says by now.
    let there = Session::load(folder).map_or(Vec::new(), |session| session.frames);
    let thickness_mm = order.thickness_mm.filter(|_| !resume);
    Options {
        folder: folder.to_owned(),
        subject: Subject::Swatch,
        about: About { name: Some(order.name.clone()), thickness_mm },
        begin: if resume { Begin::Resume } else { Begin::Anew },
        exposure_s: order.exposure_s,
        iso: order.iso,
        bracket: Plan::bracket_of(&there),
    }
}

fn hear(event: &Event, eyes: &Eyes, out: &Outbox) {
    match event {
        Event::Metering => out.progress(0.0, texts::METERING, None),
        Event::Frame { frame, done, total, left } => {
            out.progress(*done as f64 / (*total).max(1) as f64, frame, *left);
            out.tell(Update::Scan(Told::Taking(frame.clone())));
        }
        Event::Kept { light, drift_check, file, settings } => eyes.look_at(Sight {
            light: *light,
            drift_check: *drift_check,
            file: file.clone(),
            settings: *settings,
            hint: Hint::default(),
        }),
        Event::Waiting { frame, what, done, total } => {
            let share = *done as f64 / (*total).max(1) as f64;
            out.progress(share, &format!("{frame}: {what}"), None);
        }
        Event::Again { frame, why } => out.warn(frame, &[texts::again(why)]),
        Event::BoardLost => out.progress(0.0, texts::BOARD_LOST, None),
        Event::Paused => out.tell(Update::Scan(Told::Paused)),
    }
}

/// Of the scan that this room is about; the Look room follows.
fn solve_here(scan: &Path, settings: SolveSettings, tools: &mut Tools, out: &Outbox) {
    let how = (settings, Reuse::IfCurrent);
    let scan = &tools.place.as_ref().map_or_else(|| scan.to_owned(), |place| place.as_ours(scan));
    let Some(SolvedScan { solution, report, expected_deg, .. }) = solve(scan, how, tools, out)
    else {
        return;
    };
    out.tell(Update::Look(look::Told::Newest(solution.clone())));
    let scan = scan.to_owned();
    out.tell(Update::Scan(Told::Solved { scan, solution, report, expected_deg }));
}

/// A solution of a scan.
pub struct SolvedScan {
    /// Its folder.
    pub solution: PathBuf,
    /// What it says of itself.
    pub report: Box<Report>,
    /// Expected error of a normal, median, degrees; `None` where the maps were there already.
    pub expected_deg: Option<f64>,
    /// Whether they were.
    pub up_to_date: bool,
}

/// The same call with the same settings as the command line's. `None` where it failed: then the user knows.
pub(super) fn solve(
    scan: &Path,
    (settings, reuse): (SolveSettings, Reuse),
    tools: &mut Tools,
    out: &Outbox,
) -> Option<SolvedScan> {
    let name = scan.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let title = texts::solving(&name);
    let Some(place) = &tools.place else {
        out.fail(&title, &crate::texts::rig::NONE_OPEN);
        return None;
    };
    let solution = place.solution(scan);
    // Nobody asks for the page where the maps are there already.
    let expected = OnceLock::new();
    let solved = out.job(&title, || -> Result<Solved, Box<dyn std::error::Error>> {
        std::fs::create_dir_all(solution.parent().unwrap_or(Path::new(".")))?;
        let mut options = settings.options(scan, &place.calibration(), &solution);
        options.reuse = reuse;
        let page = |shown: &Shown| {
            let _ = expected.set(expected_error(shown).map(|spread| spread.median));
            page_of_solve(shown, None)
        };
        let tell = |state: weavelight::solve::Progress| out.tick(state.share(), state.stage.what());
        Ok(run(&options, &tell, Some(&page))?)
    });
    let Solved { report, up_to_date } = solved.ok()?;
    out.warn(&name, &report.warnings);
    let (report, expected_deg) = (Box::new(report), expected.into_inner().flatten());
    Some(SolvedScan { solution, report, expected_deg, up_to_date })
}

/// Another fabric on the simulated table.
fn lay_out(preset: Preset, tools: &mut Tools, out: &Outbox) {
    let Some(place) = &tools.place else { return };
    let changed = Scene::beside(&place.rig_file()).map_err(|error| error.to_string()).and_then(
        |mut scene| {
            scene.material.preset = preset;
            scene.save(&place.folder).map_err(|error| error.to_string())
        },
    );
    match changed {
        // The camera looks at the table when it is opened.
        Ok(()) => tools.instruments = None,
        Err(error) => out.fail(texts::LAYING_OUT, &error),
    }
}

pub(super) fn look_for_unfinished(tools: &Tools, out: &Outbox) {
    let found = tools.place.as_ref().and_then(newest_unfinished);
    if let Some(place) = &tools.place {
        tell_taken(place, out);
    }
    out.tell(Update::Scan(Told::Unfinished(found)));
}

fn tell_taken(place: &Place, out: &Outbox) {
    out.tell(Update::Scan(Told::Taken(place.folder.clone(), place.taken())));
}

/// The newest scan that was stopped, by whatever.
fn newest_unfinished(place: &Place) -> Option<Unfinished> {
    let entries = std::fs::read_dir(place.scans()).ok()?.flatten();
    let found = entries.filter_map(|entry| {
        // One that another program is taking is not stopped.
        let session =
            incomplete(&entry.path(), &place.rig).filter(|_| holder(&entry.path()).is_none())?;
        Some((entry.metadata().ok()?.modified().ok()?, session))
    });
    found.max_by_key(|(when, _)| *when).map(|(_, found)| found)
}

/// What takes the place of the scan that the room shows, after an undo.
pub(super) fn show(swapped: Swapped, place: &Place, out: &Outbox) {
    let folder = swapped.folder.clone();
    out.tell(Update::Scan(Told::Swapped(swapped)));
    look_at_what_is_there(&folder, &Eyes::open(place, &folder, out));
}
