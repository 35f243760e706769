//! The worker's part: test shots, scans with what can be seen of them so far, and the solve that follows.

use super::eyes::{Eyes, Sight};
use super::{Ask, Order, Told};
use crate::place::Place;
use crate::rooms::scans::incomplete;
use crate::settings::SolveSettings;
use crate::texts::scan as texts;
use crate::worker::{Outbox, Tools, Update, instruments::with_instruments};
use std::path::Path;
use std::sync::OnceLock;
use weavelight::device::camera::Settings;
use weavelight::device::scan::{
    About, Begin, Event, Options, Preview, ScanError, Subject, Summary, preview, scan,
};
use weavelight::report::{expected_error, page_of_solve};
use weavelight::simulate::Scene;
use weavelight::solve::{Shown, Solved, run_with_page};
use weavelight_sim::cloth::Preset;

/// How a scan ended that did not fail.
enum Outcome {
    Complete(Box<Summary>),
    Stopped,
}

pub(super) fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    match ask {
        Ask::TestShot { light, settings } => test_shot(light, settings, tools, out),
        Ask::Scan(order) => scan_and_solve(&order, tools, out),
        Ask::Solve { scan, settings } => solve(&scan, settings, tools, out),
        Ask::LayOut(preset) => lay_out(preset, tools, out),
        Ask::LookForUnfinished => look_for_unfinished(tools, out),
        Ask::ThrowAway(scan) => throw_away(&scan, tools, out),
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
    let folder = place.scan(&order.name);
    let title = texts::scanning(&order.name);
    let outcome = out.job(&title, || {
        with_instruments(tools, |place, with| {
            let options = options(order, &folder);
            let eyes = Eyes::open(place, &folder, out);
            let tell = |event: &Event| hear(event, &eyes, out);
            let outcome = out.with_control(|control| {
                scan(&place.rig, &options, &with.board, with.camera.as_mut(), control, &tell)
            });
            match outcome {
                Ok(summary) => Ok(Outcome::Complete(Box::new(summary))),
                Err(ScanError::Aborted { .. }) => Ok(Outcome::Stopped),
                Err(error) => Err(error),
            }
        })
    });
    match outcome {
        Ok(Outcome::Complete(summary)) => {
            out.warn(&order.name, &summary.warnings);
            out.tell(Update::Scan(Told::Complete(summary)));
            if place.is_calibrated() {
                solve(&folder, order.solve, tools, out);
            }
        }
        Ok(Outcome::Stopped) | Err(_) => look_for_unfinished(tools, out),
    }
}

fn options(order: &Order, folder: &Path) -> Options {
    Options {
        folder: folder.to_owned(),
        subject: Subject::Swatch,
        about: About { name: Some(order.name.clone()), thickness_mm: order.thickness_mm },
        begin: if order.resume { Begin::Resume } else { Begin::Anew },
        exposure_s: order.exposure_s,
        iso: order.iso,
        bracket: Vec::new(),
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

/// The same call with the same settings as the command line's.
fn solve(scan: &Path, settings: SolveSettings, tools: &mut Tools, out: &Outbox) {
    let Some(place) = &tools.place else { return };
    let name = scan.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let solution = place.solution(scan);
    // Nobody asks for the page where the maps are there already.
    let expected = OnceLock::new();
    let solved =
        out.job(&texts::solving(&name), || -> Result<Solved, Box<dyn std::error::Error>> {
            std::fs::create_dir_all(solution.parent().unwrap_or(Path::new(".")))?;
            let options = settings.options(scan, &place.calibration(), &solution);
            let page = |shown: &Shown| {
                let _ = expected.set(expected_error(shown).map(|spread| spread.median));
                page_of_solve(shown, None)
            };
            Ok(run_with_page(
                &options,
                &|state| out.tick(state.share(), state.stage.what()),
                Some(&page),
            )?)
        });
    if let Ok(solved) = solved {
        out.warn(&name, &solved.report.warnings);
        let (report, expected_deg) = (Box::new(solved.report), expected.into_inner().flatten());
        out.tell(Update::Scan(Told::Solved { solution, report, expected_deg }));
    }
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

fn look_for_unfinished(tools: &Tools, out: &Outbox) {
    let found = tools.place.as_ref().and_then(newest_unfinished);
    out.tell(Update::Scan(Told::Unfinished(found)));
}

/// Name and frames of the newest scan that was stopped, by whatever.
fn newest_unfinished(place: &Place) -> Option<(String, usize)> {
    let entries = std::fs::read_dir(place.scans()).ok()?.flatten();
    let found = entries.filter_map(|entry| {
        let session = incomplete(&entry.path(), &place.rig)?;
        Some((entry.metadata().ok()?.modified().ok()?, session))
    });
    found.max_by_key(|(when, _)| *when).map(|(_, found)| found)
}

fn throw_away(scan: &Path, tools: &Tools, out: &Outbox) {
    match trash::delete(scan) {
        Ok(()) => look_for_unfinished(tools, out),
        Err(error) => out.fail(texts::THROWING_AWAY, &format!("{}: {error}", scan.display())),
    }
}
