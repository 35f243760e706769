//! The worker's part: pictures of targets, what is seen in them, and the fits.

use crate::jobs::calibrate::{Command, Event, Report};
use crate::jobs::instruments::with_instruments;
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::tools::Tools;
use crate::model::activity::Ended;
use crate::model::project::Project;
use crate::model::targets::TargetSettings;
use crate::texts::calibrate as texts;
use crate::viewer::target_picture::{Marks, Picture};
use std::path::{Path, PathBuf};
use weavelight::calibrate;
use weavelight::calibrate::wizard::{
    BOARD_SESSION, GREY_SESSION, Memory, Placement, Pose, REFUSED, Sheets, State, Step, Task,
    Verdict, history,
};
use weavelight::calibrate::{
    CameraOptions, CheckOptions, ColorOptions, LightsOptions, SeenBoard, find_board, wizard,
};
use weavelight::device::camera::Settings;
use weavelight::device::scan;
use weavelight::device::scan::{
    About, Begin, Event as DeviceEvent, Instruments, Options, ScanError, Sheet, Subject, preview,
};
use weavelight::files::FileError;
use weavelight::instrument::CameraKind;
use weavelight::raw::Frame;
use weavelight::session::{Board, FrameEntry, Session, Target};
use weavelight::simulate::{Laid, Lying, lay};

type AnyError = Box<dyn std::error::Error + Send + Sync>;

/// Largest slope error that passes, degrees: as on the command line.
const THRESHOLD_DEG: f64 = 0.1;
/// Exposure of a look that keeps nothing, seconds.
const LOOK_S: f64 = 0.1;

pub(crate) fn act(command: Command, tools: &mut Tools, out: &Outbox) {
    let Some(project) = tools.project.clone() else { return };
    let done = match command {
        Command::Refresh => Ok(()),
        Command::Take(task, targets) => take(task, &targets, tools, out),
        Command::Look(task, targets) => look(task, &targets, tools, out),
        Command::Fit(step) => fit(step, &project, out),
        Command::Again(step) => report_moved(again(step, &project), out),
        Command::StartOver => report_moved(start_over(&project), out),
        Command::Restore(entry) => report_moved(history::restore(&project, &entry), out),
    };
    if let Err(ended) = done {
        out.send(Update::Calibrate(Event::Halted(ended)));
    }
    let state = out.job(texts::LOOKING, || state(&project, &mut tools.calibrate, out));
    out.send(Update::Calibrated(project.folder.clone(), project.is_calibrated()));
    out.send(Update::Calibrate(match state {
        Ok(state) => Event::State(Box::new(state)),
        Err(ended) => Event::Halted(ended),
    }));
}

/// Says where what was there before is now.
fn report_moved<E: std::fmt::Display>(
    moved: Result<Option<PathBuf>, E>,
    out: &Outbox,
) -> Result<(), Ended> {
    let moved = moved.map_err(|error| {
        out.fail(texts::PUTTING_AWAY, &error);
        Ended::Failed
    })?;
    if let Some(folder) = moved {
        out.send(Update::Calibrate(Event::Kept(folder)));
    }
    Ok(())
}

/// Lays a target on the simulated table, and the swatch back when it is done with.
struct Table<'a>(&'a Project);

impl<'a> Table<'a> {
    /// What lies there as far as the program knows; nothing on a rig that stands on a real table.
    fn lay(project: &'a Project, lying: Lying) -> Result<(Option<Self>, Option<Laid>), AnyError> {
        if project.rig.camera.kind != CameraKind::Simulated {
            return Ok((None, None));
        }
        let laid = lay(&project.rig_file(), lying)?;
        Ok((Some(Self(project)), Some(laid)))
    }
}

impl Drop for Table<'_> {
    fn drop(&mut self) {
        // Where the scene cannot be written, the next scan says so.
        let _ = lay(&self.0.rig_file(), Lying::Swatch);
    }
}

/// What the program lays on the simulated table for a task.
fn lying(task: Task, pictures: usize) -> Lying {
    match task {
        Task::Table => Lying::Board { pose: 0 },
        // Sixteen poses; the first is the table's.
        Task::Board => Lying::Board { pose: 1 + pictures.saturating_sub(1) % 15 },
        Task::Chart => Lying::Grey,
        Task::Sheet(pose) => {
            let Placement { height_mm, tilt_deg, faces_deg: towards_deg } = pose.placement();
            Lying::White { height_mm, tilt_deg, towards_deg }
        }
        Task::Fit(_) | Task::Done => Lying::Swatch,
    }
}

/// Which capture session a task's pictures go to.
fn session_name(task: Task) -> String {
    match task {
        Task::Chart => GREY_SESSION.to_owned(),
        Task::Sheet(pose) => pose.folder(),
        _ => BOARD_SESSION.to_owned(),
    }
}

/// What is photographed: as the simulation knows it, else as the technician says.
fn subject(
    task: Task,
    settings: &TargetSettings,
    laid: Option<Laid>,
) -> Result<(Subject, Option<f64>), AnyError> {
    let shape = |[columns, rows]: [usize; 2], square_mm: f64| Board { columns, rows, square_mm };
    let (target, plane) = laid.map_or((None, None), |laid| (laid.target, laid.plane));
    let simulated = target.is_some();
    let target = target.unwrap_or_default();
    Ok(match task {
        Task::Chart => {
            let patches = if simulated {
                target.patches
            } else {
                let chart = crate::model::paths::typed(&settings.chart).ok_or(texts::NO_CHART)?;
                Target::load(&chart)?.patches
            };
            (Subject::Grey { patches }, None)
        }
        Task::Sheet(pose) => {
            let level_mm = match pose {
                Pose::Flat => Some(0.0),
                Pose::Raised if !simulated => Some(settings.raised_mm),
                _ => None,
            };
            let own_strip =
                level_mm.is_none().then(|| shape(settings.strip, settings.strip_square_mm));
            let strip = if simulated { target.board } else { own_strip };
            // Without detection only a stated plane serves, and the strip is left to the fit's own outlier test.
            let strip = strip.filter(|_| cfg!(feature = "opencv"));
            let reflectance = target.reflectance.or(Some(settings.reflectance));
            (Subject::White(Sheet { reflectance, plane, strip }), level_mm)
        }
        _ => {
            let board = target.board.unwrap_or(shape(settings.board, settings.board_square_mm));
            let pose = if task == Task::Table { scan::Pose::Table } else { scan::Pose::Free };
            (Subject::Board { board, pose, light: settings.board_light }, None)
        }
    })
}

/// Takes the pictures of a task, looks at them, and fits where they were the last.
fn take(
    task: Task,
    settings: &TargetSettings,
    tools: &mut Tools,
    out: &Outbox,
) -> Result<(), Ended> {
    let Some(project) = tools.project.clone() else { return Ok(()) };
    let taken = out.job(&texts::taking(task), || {
        with_instruments(tools, |project, with| photograph(task, settings, (project, with), out))
    });
    if !taken? {
        return Err(Ended::Cancelled);
    }
    let memory = &mut tools.calibrate;
    let looked = out.job(texts::LOOKING, || examine(task, &project, &mut memory.sheets, out));
    let good = looked?;
    // The fit follows its last picture.
    let next = out.job(texts::LOOKING, || state(&project, &mut tools.calibrate, out));
    match next?.next() {
        Task::Fit(step) if good => fit(step, &project, out),
        Task::Fit(_) => Err(Ended::Cancelled),
        // Of a calibration that was made elsewhere.
        _ if task == Task::Sheet(Pose::Check) => fit(Step::Check, &project, out),
        _ => Ok(()),
    }
}

/// False where it was stopped.
fn photograph(
    task: Task,
    settings: &TargetSettings,
    (project, with): (&Project, &mut Instruments),
    out: &Outbox,
) -> Result<bool, AnyError> {
    let folder = project.targets().join(session_name(task));
    let pictures = Session::load(&folder).map_or(0, |session| session.frames.len());
    let (_table, laid) = Table::lay(project, lying(task, pictures))?;
    let (subject, thickness_mm) = subject(task, settings, laid)?;
    let is_new = !project.targets().exists();
    std::fs::create_dir_all(project.targets())?;
    let options = Options {
        folder,
        subject,
        about: About { name: None, thickness_mm },
        begin: Begin::Resume,
        exposure_s: None,
        iso: 100.0,
        bracket: Vec::new(),
    };
    let send = |event: &DeviceEvent| hear(event, out);
    let scanned = out.with_control(|control| {
        scan::scan(&project.rig, &options, &with.board, with.camera.as_mut(), control, &send)
    });
    if is_new && scanned.is_err() {
        // Empty, it would say that a calibration has begun.
        let _ = std::fs::remove_dir(project.targets());
    }
    match scanned {
        Ok(summary) => {
            out.warn(&texts::title(task), &summary.warnings);
            Ok(true)
        }
        Err(ScanError::Aborted { .. }) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

fn hear(event: &DeviceEvent, out: &Outbox) {
    match event {
        DeviceEvent::Metering => out.progress(0.0, texts::METERING, None),
        DeviceEvent::Frame { frame, done, total, left } => {
            out.progress(*done as f64 / (*total).max(1) as f64, frame, *left);
        }
        DeviceEvent::Waiting { frame, what, done, total } => {
            let share = *done as f64 / (*total).max(1) as f64;
            out.progress(share, &format!("{frame}: {what}"), None);
        }
        DeviceEvent::Again { frame, why } => out.warn(frame, std::slice::from_ref(why)),
        DeviceEvent::BoardLost => out.progress(0.0, texts::BOARD_LOST, None),
        DeviceEvent::Kept { .. } | DeviceEvent::Paused => {}
    }
}

/// A test shot of what lies there; nothing is kept.
fn look(
    task: Task,
    settings: &TargetSettings,
    tools: &mut Tools,
    out: &Outbox,
) -> Result<(), Ended> {
    let looked = out.job(texts::TAKING_LOOK, || {
        with_instruments(tools, |project, with| -> Result<Picture, AnyError> {
            let folder = project.targets().join(session_name(task));
            let pictures = Session::load(&folder).map_or(0, |session| session.frames.len());
            let (_table, laid) = Table::lay(project, lying(task, pictures))?;
            let (subject, _) = subject(task, settings, laid)?;
            let light = settings.board_light.min(project.rig.lights.len().saturating_sub(1));
            let output = u8::try_from(project.rig.channel(light)).unwrap_or(u8::MAX);
            let wanted = Settings { exposure_s: LOOK_S, iso: 100.0 };
            let shot = preview(&with.board, with.camera.as_mut(), (light, output), wanted)?;
            out.tick(0.7, texts::LOOKING);
            Ok(match &subject {
                Subject::Board { board, .. } => {
                    let tick = || out.tick(0.7, texts::LOOKING);
                    board_picture(&shot.frame, board, find_board(&shot.frame, board, &tick)?)
                }
                Subject::Grey { patches } => chart_picture(&shot.frame, patches, shot.advice),
                _ => Picture::new(&shot.frame, Marks::None, shot.advice, true),
            })
        })
    });
    out.send(Update::Calibrate(Event::Picture(Box::new(looked?))));
    Ok(())
}

fn board_picture(frame: &Frame, board: &Board, seen: Option<SeenBoard>) -> Picture {
    match seen {
        Some(seen) => {
            let px = seen.corners_px().to_vec();
            let note = texts::board_found(px.len());
            Picture::new(frame, Marks::Corners { px, columns: board.columns }, note, true)
        }
        None => Picture::new(frame, Marks::None, texts::BOARD_NOT_FOUND.to_owned(), false),
    }
}

fn chart_picture(frame: &Frame, patches: &[weavelight::session::Patch], note: String) -> Picture {
    let rects = patches.iter().map(|patch| patch.rect_px).collect();
    Picture::new(frame, Marks::Patches(rects), note, true)
}

/// Looks at what was photographed and shows it; whether it serves.
fn examine(
    task: Task,
    project: &Project,
    sheets: &mut Sheets,
    out: &Outbox,
) -> Result<bool, AnyError> {
    let folder = project.targets().join(session_name(task));
    let session = Session::load(&folder)?;
    let send = |picture: Picture| {
        let good = picture.good;
        out.send(Update::Calibrate(Event::Picture(Box::new(picture))));
        good
    };
    let lit = session.frames.iter().find(|entry| entry.light.is_some());
    match task {
        Task::Chart => {
            let Some(entry) = lit else { return Ok(false) };
            let frame = read(&session, entry)?;
            let patches = session.target.as_ref().map_or(&[][..], |target| &target.patches);
            let note = texts::chart_taken(patches.len(), session.frames.len());
            Ok(send(chart_picture(&frame, patches, note)))
        }
        Task::Sheet(_) => {
            let Some(entry) = lit else { return Ok(false) };
            let frame = read(&session, entry)?;
            let progress = |share: f64, what: &str| out.tick(share, what);
            match sheets.look(project, &folder, &progress) {
                Ok(seen) => {
                    let note = [vec![texts::sheet_seen(seen)], seen.warnings.clone()].concat();
                    let note = note.join(" ");
                    let marks = Marks::Cells { px: seen.cells_px.clone(), side_px: seen.cell_px };
                    Ok(send(Picture::new(&frame, marks, note, true)))
                }
                Err(error) => {
                    send(Picture::new(&frame, Marks::None, texts::SHEET_REFUSED.to_owned(), false));
                    // It would spoil the fit: what it says is what to photograph instead.
                    put_aside(project, &folder)?;
                    Err(error.into())
                }
            }
        }
        _ => {
            let newest = session.frames.iter().max_by_key(|entry| entry.captured);
            let board = session.target.as_ref().and_then(|target| target.board);
            let (Some(entry), Some(board)) = (newest, board) else { return Ok(false) };
            let frame = read(&session, entry)?;
            let seen = find_board(&frame, &board, &|| out.tick(0.9, texts::LOOKING))?;
            Ok(send(board_picture(&frame, &board, seen)))
        }
    }
}

/// Out of the way of the fit; the last one that was refused can still be looked at.
fn put_aside(project: &Project, folder: &Path) -> Result<(), FileError> {
    let refused = project.targets().join(REFUSED);
    if refused.exists() {
        history::put_refused_away(project, &refused)?;
    }
    std::fs::rename(folder, &refused).map_err(|error| FileError::write(&refused, error))
}

fn read(session: &Session, entry: &FrameEntry) -> Result<Frame, AnyError> {
    Ok(session.frame(entry)?)
}

/// The fit of a step, the same call as the command line's.
fn fit(step: Step, project: &Project, out: &Outbox) -> Result<(), Ended> {
    let (rig, targets, calibration) =
        (project.rig_file(), project.targets(), project.calibration());
    let progress = |share: f64, what: &str| out.tick(share, what);
    let fitted = out.job(texts::fitting(step), || -> Result<(Report, Vec<String>), AnyError> {
        history::keep_before(project, step)?;
        Ok(match step {
            Step::Camera => {
                let sessions = vec![targets.join(BOARD_SESSION)];
                let report = calibrate::camera(
                    &CameraOptions { rig, sessions, out: calibration },
                    &progress,
                )?;
                let warnings = report.warnings.clone();
                (Report::Camera(Box::new(report)), warnings)
            }
            Step::Color => {
                let session = targets.join(GREY_SESSION);
                let report =
                    calibrate::color(&ColorOptions { rig, session, out: calibration }, &progress)?;
                let warnings = report.warnings.clone();
                (Report::Color(Box::new(report)), warnings)
            }
            Step::Lights => {
                let sessions = sheets(project);
                let report = calibrate::lights(
                    &LightsOptions { rig, sessions, out: calibration },
                    &progress,
                )?;
                let warnings = report.warnings.clone();
                (Report::Lights(Box::new(report)), warnings)
            }
            Step::Check => {
                let options = CheckOptions {
                    calibration: calibration.clone(),
                    sessions: vec![targets.join(Pose::Check.folder())],
                    threshold_deg: THRESHOLD_DEG,
                    out: None,
                };
                let report = calibrate::check(&options, &progress)?;
                Verdict::of(&report, project).keep(project)?;
                let warnings = report.warnings.clone();
                (Report::Check(Box::new(report)), warnings)
            }
        })
    });
    let (report, warnings) = fitted?;
    out.warn(texts::fitting(step), &warnings);
    out.send(Update::Calibrate(Event::Report(report)));
    Ok(())
}

/// The sheets that the lights are calibrated with.
fn sheets(project: &Project) -> Vec<PathBuf> {
    let folders = Pose::FIT.iter().map(|pose| project.targets().join(pose.folder()));
    folders.filter(|folder| project.is_complete(folder)).collect()
}

/// The pictures of a step, and of all that follow from them, into the history. Where they are now.
fn again(step: Step, project: &Project) -> Result<Option<PathBuf>, AnyError> {
    match step {
        // Everything stands in the camera's frame.
        Step::Camera => start_over(project),
        step => Ok(history::put_away(project, step)?),
    }
}

/// That the folder is there says that a calibration is under way.
fn start_over(project: &Project) -> Result<Option<PathBuf>, AnyError> {
    let kept = history::keep(project)?;
    std::fs::create_dir_all(project.targets())?;
    Ok(kept)
}

/// What is there. After work that was cancelled the pictures are still searched to the end: the state is needed all the same.
fn state(project: &Project, memory: &mut Memory, out: &Outbox) -> Result<State, AnyError> {
    let cancelled = out.is_cancelled();
    let progress = |share: f64, step: &str| match cancelled {
        true => out.progress(share, step, None),
        false => out.tick(share, step),
    };
    let mut state = wizard::read(project, memory, &progress)?;
    let progress = |share: f64, step: &str| out.progress(share, step, None);
    wizard::foresee(&mut state, project, memory, &progress);
    Ok(state)
}
