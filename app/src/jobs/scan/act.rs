//! The worker's part: test shots, scans with what can be seen of them so far, and the solve that follows.

use crate::jobs::instruments::with_instruments;
use crate::jobs::look;
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::scan::live_preview::look_at_what_is_there;
use crate::jobs::scan::live_preview::{KeptFrame, LivePreview};
use crate::jobs::scan::solve::{SolvedScan, solve};
use crate::jobs::scan::unfinished::{look_for_unfinished, send_names};
use crate::jobs::scan::{Command, Event, Order, What, again};
use crate::jobs::tools::Tools;
use crate::model::project::Project;
use crate::model::settings::SolveSettings;
use crate::texts::scan as texts;
use std::path::{Path, PathBuf};
use weavelight::device::camera::Settings;
use weavelight::device::scan::{
    About, Begin, Event as DeviceEvent, Options, Plan, Preview, ScanError, Subject, Summary,
    preview, scan,
};
use weavelight::raw::Hint;
use weavelight::session::Session;
use weavelight::simulate::Scene;
use weavelight::solution::Reuse;
use weavelight_sim::cloth::Preset;

/// How a scan ended that did not fail.
enum Outcome {
    Complete(Box<Summary>),
    Stopped,
}

type AnyError = Box<dyn std::error::Error + Send + Sync>;

pub(crate) fn act(command: Command, tools: &mut Tools, out: &Outbox) {
    match command {
        Command::TestShot { light, settings } => test_shot(light, settings, tools, out),
        Command::Scan(order) => scan_and_solve(&order, tools, out),
        Command::Solve { scan, settings } => solve_here(&scan, settings, tools, out),
        Command::LayOut(preset) => lay_out(preset, tools, out),
        Command::LookForUnfinished => look_for_unfinished(tools, out),
        Command::Undo(replaced) => again::undo(replaced, tools, out),
    }
}

fn test_shot(light: usize, settings: Settings, tools: &mut Tools, out: &Outbox) {
    let shot = out.job(texts::TAKING_TEST_SHOT, || {
        with_instruments(tools, |project, with| -> Result<Preview, ScanError> {
            let output = u8::try_from(project.rig.channel(light)).unwrap_or(u8::MAX);
            preview(&with.board, with.camera.as_mut(), (light, output), settings)
        })
    });
    if let Ok(shot) = shot {
        out.send(Update::Scan(Event::TestShot(Box::new(shot))));
    }
}

fn scan_and_solve(order: &Order, tools: &mut Tools, out: &Outbox) {
    let Some(project) = tools.project.clone() else { return };
    let title = texts::scanning(&order.name);
    let mut replaced = None;
    let mut into = None;
    let outcome = out.job(&title, || {
        with_instruments(tools, |project, with| -> Result<Outcome, AnyError> {
            let folder = folder_for(order, project)?;
            out.send(Update::Scan(Event::Begun(folder.clone())));
            into = Some(folder.clone());
            // Not before board and camera are there.
            if matches!(order.what, What::Again(_)) {
                replaced = again::put_aside(&order.name, &folder, project, out)?;
            }
            let options = options(order, &folder);
            let preview_thread = LivePreview::open(project, &folder, out);
            if matches!(order.what, What::Resume(_)) {
                look_at_what_is_there(&folder, &preview_thread);
            }
            let send = |event: &DeviceEvent| hear(event, &preview_thread, out);
            let outcome = out.with_control(|control| {
                scan(&project.rig, &options, &with.board, with.camera.as_mut(), control, &send)
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
            send_names(&project, out);
            out.send(Update::Scan(Event::Complete(summary)));
            if project.is_calibrated() {
                solve_here(&folder, order.solve, tools, out);
            }
        }
        (_, folder) => {
            if let (Some(folder), Some(replaced)) = (&folder, replaced) {
                again::put_back_if_nothing_came(folder, replaced, tools, out);
            }
            let lights = folder.map_or_else(Vec::new, |folder| lights_of(&folder));
            out.send(Update::Scan(Event::Ended(lights)));
            look_for_unfinished(tools, out);
        }
    }
}

/// Where the frames go. A new scan never goes where something is already.
fn folder_for(order: &Order, project: &Project) -> Result<PathBuf, String> {
    match &order.what {
        What::Resume(folder) | What::Again(folder) => Ok(folder.clone()),
        What::New => {
            let taken = project.names();
            match taken.has(&order.name) {
                true => Err(texts::TAKEN.to_owned()),
                false => Ok(project.scans().join(taken.free(&order.name))),
            }
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

fn hear(event: &DeviceEvent, preview_thread: &LivePreview, out: &Outbox) {
    match event {
        DeviceEvent::Metering => out.progress(0.0, texts::METERING, None),
        DeviceEvent::Frame { frame, done, total, left } => {
            out.progress(*done as f64 / (*total).max(1) as f64, frame, *left);
            out.send(Update::Scan(Event::Taking(frame.clone())));
        }
        DeviceEvent::Kept { light, drift_check, file, settings } => preview_thread.add(KeptFrame {
            light: *light,
            drift_check: *drift_check,
            file: file.clone(),
            settings: *settings,
            hint: Hint::default(),
        }),
        DeviceEvent::Waiting { frame, what, done, total } => {
            let share = *done as f64 / (*total).max(1) as f64;
            out.progress(share, &format!("{frame}: {what}"), None);
        }
        DeviceEvent::Again { frame, why } => out.warn(frame, &[texts::again(why)]),
        DeviceEvent::BoardLost => out.progress(0.0, texts::BOARD_LOST, None),
        DeviceEvent::Paused => out.send(Update::Scan(Event::Paused)),
    }
}

/// Of the scan that this room is about; the Look room follows.
fn solve_here(scan: &Path, settings: SolveSettings, tools: &mut Tools, out: &Outbox) {
    let how = (settings, Reuse::IfCurrent);
    let scan =
        &tools.project.as_ref().map_or_else(|| scan.to_owned(), |project| project.as_ours(scan));
    let Some(SolvedScan { solution, report, expected_deg, .. }) = solve(scan, how, tools, out)
    else {
        return;
    };
    out.send(Update::Look(look::Event::Newest(solution.clone())));
    let scan = scan.to_owned();
    out.send(Update::Scan(Event::Solved { scan, solution, report, expected_deg }));
}

/// Another fabric on the simulated table.
fn lay_out(preset: Preset, tools: &mut Tools, out: &Outbox) {
    let Some(project) = &tools.project else { return };
    let changed = Scene::beside(&project.rig_file()).map_err(|error| error.to_string()).and_then(
        |mut scene| {
            scene.material.preset = preset;
            scene.save(&project.folder).map_err(|error| error.to_string())
        },
    );
    match changed {
        // The camera looks at the table when it is opened.
        Ok(()) => tools.instruments = None,
        Err(error) => out.fail(texts::LAYING_OUT, &error),
    }
}
