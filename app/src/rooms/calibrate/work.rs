//! The worker's part: pictures of targets, what is seen in them, and the fits.

use super::picture::{Marks, Picture};
use super::task::{BOARD, GREY, Pose, State, Step, TargetSettings, Task};
use super::{Ask, Report, Told, foresee::Sheets, history, verdict::Verdict};
use crate::place::Place;
use crate::texts::calibrate as texts;
use crate::worker::{Ended, Outbox, Tools, Update, instruments::with_instruments};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use weavelight::calibrate::{
    self, CameraOptions, CheckOptions, ColorOptions, LightsOptions, SeenBoard, boards_so_far,
    find_board, status,
};
use weavelight::device::camera::Settings;
use weavelight::device::scan::{
    self, About, Begin, Event, Instruments, Options, ScanError, Sheet, Subject, preview,
};
use weavelight::files::{FileError, Provenance, sha256_of_file};
use weavelight::instrument::{Calibration, CameraKind, Rig};
use weavelight::raw::Frame;
use weavelight::session::{Board, FrameEntry, MANIFEST, Session, Target};
use weavelight::simulate::{Laid, Lying, lay};

type AnyError = Box<dyn std::error::Error + Send + Sync>;

/// What the worker remembers of the pictures, so that no board is looked for twice.
#[derive(Debug, Default)]
pub struct Memory {
    /// By the frame's hash.
    seen: HashMap<String, Option<SeenBoard>>,
    sheets: Sheets,
}

/// Largest slope error that passes, degrees: as on the command line.
const THRESHOLD_DEG: f64 = 0.1;
/// Exposure of a look that keeps nothing, seconds.
const LOOK_S: f64 = 0.1;
/// The folder of the last sheet that could not serve.
const REFUSED: &str = "refused";

pub(super) fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    let Some(place) = tools.place.clone() else { return };
    let done = match ask {
        Ask::Refresh => Ok(()),
        Ask::Take(task, targets) => take(task, &targets, tools, out),
        Ask::Look(task, targets) => look(task, &targets, tools, out),
        Ask::Fit(step) => fit(step, &place, out),
        Ask::Again(step) => told(again(step, &place), out),
        Ask::Anew => told(anew(&place), out),
        Ask::Restore(entry) => told(history::restore(&place, &entry), out),
    };
    if let Err(ended) = done {
        out.tell(Update::Calibrate(Told::Halted(ended)));
    }
    let state = out.job(texts::LOOKING, || state(&place, &mut tools.calibrate, out));
    out.tell(Update::Calibrated(place.folder.clone(), place.is_calibrated()));
    out.tell(Update::Calibrate(match state {
        Ok(state) => Told::State(Box::new(state)),
        Err(ended) => Told::Halted(ended),
    }));
}

/// Says where what was there before is now.
fn told<E: std::fmt::Display>(
    moved: Result<Option<PathBuf>, E>,
    out: &Outbox,
) -> Result<(), Ended> {
    let moved = moved.map_err(|error| {
        out.fail(texts::PUTTING_AWAY, &error);
        Ended::Failed
    })?;
    if let Some(folder) = moved {
        out.tell(Update::Calibrate(Told::Kept(folder)));
    }
    Ok(())
}

/// Lays a target on the simulated table, and the swatch back when it is done with.
struct Table<'a>(&'a Place);

impl<'a> Table<'a> {
    /// What lies there as far as the program knows; nothing on a rig that stands on a real table.
    fn lay(place: &'a Place, lying: Lying) -> Result<(Option<Self>, Option<Laid>), AnyError> {
        if place.rig.camera.kind != CameraKind::Simulated {
            return Ok((None, None));
        }
        let laid = lay(&place.rig_file(), lying)?;
        Ok((Some(Self(place)), Some(laid)))
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
            let [height_mm, tilt_deg, towards_deg] = pose.lies();
            Lying::White { height_mm, tilt_deg, towards_deg }
        }
        Task::Fit(_) | Task::Done => Lying::Swatch,
    }
}

/// Which capture session a task's pictures go to.
fn session_name(task: Task) -> String {
    match task {
        Task::Chart => GREY.to_owned(),
        Task::Sheet(pose) => pose.folder(),
        _ => BOARD.to_owned(),
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
                let chart = crate::paths::typed(&settings.chart).ok_or(texts::NO_CHART)?;
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
    let Some(place) = tools.place.clone() else { return Ok(()) };
    let taken = out.job(&texts::taking(task), || {
        with_instruments(tools, |place, with| photograph(task, settings, (place, with), out))
    });
    if !taken? {
        return Err(Ended::Cancelled);
    }
    let memory = &mut tools.calibrate;
    let looked = out.job(texts::LOOKING, || examine(task, &place, &mut memory.sheets, out));
    let good = looked?;
    // The fit follows its last picture.
    let next = out.job(texts::LOOKING, || state(&place, &mut tools.calibrate, out));
    match next?.next() {
        Task::Fit(step) if good => fit(step, &place, out),
        Task::Fit(_) => Err(Ended::Cancelled),
        // Of a calibration that was made elsewhere.
        _ if task == Task::Sheet(Pose::Check) => fit(Step::Check, &place, out),
        _ => Ok(()),
    }
}

/// False where it was stopped.
fn photograph(
    task: Task,
    settings: &TargetSettings,
    (place, with): (&Place, &mut Instruments),
    out: &Outbox,
) -> Result<bool, AnyError> {
    let folder = place.targets().join(session_name(task));
    let pictures = Session::load(&folder).map_or(0, |session| session.frames.len());
    let (_table, laid) = Table::lay(place, lying(task, pictures))?;
    let (subject, thickness_mm) = subject(task, settings, laid)?;
    let is_new = !place.targets().exists();
    std::fs::create_dir_all(place.targets())?;
    let options = Options {
        folder,
        subject,
        about: About { name: None, thickness_mm },
        begin: Begin::Resume,
        exposure_s: None,
        iso: 100.0,
        bracket: Vec::new(),
    };
    let tell = |event: &Event| hear(event, out);
    let scanned = out.with_control(|control| {
        scan::scan(&place.rig, &options, &with.board, with.camera.as_mut(), control, &tell)
    });
    if is_new && scanned.is_err() {
        // Empty, it would say that a calibration has begun.
        let _ = std::fs::remove_dir(place.targets());
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

fn hear(event: &Event, out: &Outbox) {
    match event {
        Event::Metering => out.progress(0.0, texts::METERING, None),
        Event::Frame { frame, done, total, left } => {
            out.progress(*done as f64 / (*total).max(1) as f64, frame, *left);
        }
        Event::Waiting { frame, what, done, total } => {
            let share = *done as f64 / (*total).max(1) as f64;
            out.progress(share, &format!("{frame}: {what}"), None);
        }
        Event::Again { frame, why } => out.warn(frame, std::slice::from_ref(why)),
        Event::BoardLost => out.progress(0.0, texts::BOARD_LOST, None),
        Event::Kept { .. } | Event::Paused => {}
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
        with_instruments(tools, |place, with| -> Result<Picture, AnyError> {
            let folder = place.targets().join(session_name(task));
            let pictures = Session::load(&folder).map_or(0, |session| session.frames.len());
            let (_table, laid) = Table::lay(place, lying(task, pictures))?;
            let (subject, _) = subject(task, settings, laid)?;
            let light = settings.board_light.min(place.rig.lights.len().saturating_sub(1));
            let output = u8::try_from(place.rig.channel(light)).unwrap_or(u8::MAX);
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
    out.tell(Update::Calibrate(Told::Picture(Box::new(looked?))));
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
fn examine(task: Task, place: &Place, sheets: &mut Sheets, out: &Outbox) -> Result<bool, AnyError> {
    let folder = place.targets().join(session_name(task));
    let session = Session::load(&folder)?;
    let tell = |picture: Picture| {
        let good = picture.good;
        out.tell(Update::Calibrate(Told::Picture(Box::new(picture))));
        good
    };
    let lit = session.frames.iter().find(|entry| entry.light.is_some());
    match task {
        Task::Chart => {
            let Some(entry) = lit else { return Ok(false) };
            let frame = read(&session, entry)?;
            let patches = session.target.as_ref().map_or(&[][..], |target| &target.patches);
            let note = texts::chart_taken(patches.len(), session.frames.len());
            Ok(tell(chart_picture(&frame, patches, note)))
        }
        Task::Sheet(_) => {
            let Some(entry) = lit else { return Ok(false) };
            let frame = read(&session, entry)?;
            let progress = |share: f64, what: &str| out.tick(share, what);
            match sheets.look(place, &folder, &progress) {
                Ok(seen) => {
                    let note = [vec![texts::sheet_seen(seen)], seen.warnings.clone()].concat();
                    let note = note.join(" ");
                    let marks = Marks::Cells { px: seen.cells_px.clone(), side_px: seen.cell_px };
                    Ok(tell(Picture::new(&frame, marks, note, true)))
                }
                Err(error) => {
                    tell(Picture::new(&frame, Marks::None, texts::SHEET_REFUSED.to_owned(), false));
                    // It would spoil the fit: what it says is what to photograph instead.
                    put_aside(place, &folder)?;
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
            Ok(tell(board_picture(&frame, &board, seen)))
        }
    }
}

/// Out of the way of the fit; the last one that was refused can still be looked at.
fn put_aside(place: &Place, folder: &Path) -> Result<(), FileError> {
    let refused = place.targets().join(REFUSED);
    if refused.exists() {
        history::put_refused_away(place, &refused)?;
    }
    std::fs::rename(folder, &refused).map_err(|error| FileError::write(&refused, error))
}

fn read(session: &Session, entry: &FrameEntry) -> Result<Frame, AnyError> {
    Ok(session.frame(entry)?)
}

/// The fit of a step, the same call as the command line's.
fn fit(step: Step, place: &Place, out: &Outbox) -> Result<(), Ended> {
    let (rig, targets, calibration) = (place.rig_file(), place.targets(), place.calibration());
    let progress = |share: f64, what: &str| out.tick(share, what);
    let fitted = out.job(texts::fitting(step), || -> Result<(Report, Vec<String>), AnyError> {
        history::keep_before(place, step)?;
        Ok(match step {
            Step::Camera => {
                let sessions = vec![targets.join(BOARD)];
                let report = calibrate::camera(
                    &CameraOptions { rig, sessions, out: calibration },
                    &progress,
                )?;
                let warnings = report.warnings.clone();
                (Report::Camera(Box::new(report)), warnings)
            }
            Step::Color => {
                let session = targets.join(GREY);
                let report =
                    calibrate::color(&ColorOptions { rig, session, out: calibration }, &progress)?;
                let warnings = report.warnings.clone();
                (Report::Color(Box::new(report)), warnings)
            }
            Step::Lights => {
                let sessions = sheets(place);
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
                Verdict::of(&report, place).keep(place)?;
                let warnings = report.warnings.clone();
                (Report::Check(Box::new(report)), warnings)
            }
        })
    });
    let (report, warnings) = fitted?;
    out.warn(texts::fitting(step), &warnings);
    out.tell(Update::Calibrate(Told::Report(report)));
    Ok(())
}

/// The sheets that the lights are calibrated with.
fn sheets(place: &Place) -> Vec<PathBuf> {
    let folders = Pose::FIT.iter().map(|pose| place.targets().join(pose.folder()));
    folders.filter(|folder| is_complete(folder, &place.rig)).collect()
}

/// Every light, the ambient light, and the first light again.
pub(super) fn is_complete(folder: &Path, rig: &Rig) -> bool {
    Session::load(folder).is_ok_and(|session| session.frames.len() >= rig.lights.len() + 2)
}

/// The pictures of a step, and of all that follow from them, into the history. Where they are now.
fn again(step: Step, place: &Place) -> Result<Option<PathBuf>, AnyError> {
    match step {
        // Everything stands in the camera's frame.
        Step::Camera => anew(place),
        step => Ok(history::put_away(place, step)?),
    }
}

/// That the folder is there says that a calibration is under way.
fn anew(place: &Place) -> Result<Option<PathBuf>, AnyError> {
    let kept = history::keep(place)?;
    std::fs::create_dir_all(place.targets())?;
    Ok(kept)
}

/// Whether the pictures of a calibration are there, or it is to be made anew. A check alone is none: the calibration that was
/// checked may come from elsewhere.
fn begun(place: &Place) -> bool {
    let Ok(entries) = std::fs::read_dir(place.targets()) else { return false };
    let names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
    let of_a_check = |name: &std::ffi::OsString| *name == *Pose::Check.folder() || name == REFUSED;
    names.is_empty() || !names.iter().all(of_a_check)
}

/// What is there.
fn state(place: &Place, memory: &mut Memory, out: &Outbox) -> Result<State, AnyError> {
    let status = status(&place.calibration())?;
    let calibration = Calibration::load(&place.calibration()).ok();
    let board = Session::load(&place.targets().join(BOARD)).ok();
    let seen = board.as_ref().map(|board| look_for_boards(board, memory, out)).transpose()?;
    let seen = seen.unwrap_or_default();
    let found: Vec<SeenBoard> = seen.iter().flat_map(|(_, seen)| seen.clone()).collect();
    let size_px = [place.rig.camera.width_px, place.rig.camera.height_px];
    let shape = board.as_ref().and_then(|board| board.target.as_ref()?.board);
    let table = seen.iter().any(|(entry, seen)| entry.pose.is_some() && seen.is_some());
    let whole = |pose: Pose| is_complete(&place.targets().join(pose.folder()), &place.rig);
    let mut sheets: Vec<Pose> = Pose::FIT.into_iter().filter(|pose| whole(*pose)).collect();
    sheets.extend(Some(Pose::Check).filter(|pose| whole(*pose)));
    let checked = sheets.contains(&Pose::Check);
    let mut state = State {
        begun: begun(place),
        boards: [seen.len(), found.len()],
        table,
        corners_px: found.iter().flat_map(|seen| seen.corners_px().to_vec()).collect(),
        so_far: shape.map(|shape| boards_so_far(&found, &shape, size_px)).unwrap_or_default(),
        chart: is_complete(&place.targets().join(GREY), &place.rig),
        fresh: fresh(place, calibration.as_ref(), &sheets),
        verdict: Verdict::load(place).filter(|_| checked),
        age_days: calibration.as_ref().and_then(crate::place::age_days),
        history: history::entries(place),
        sees_chessboards: cfg!(feature = "opencv"),
        sheets,
        foreseen: None,
        status,
    };
    // No tick: what is there is told after work that was stopped, too.
    let progress = |share: f64, what: &str| out.progress(share, what, None);
    state.foreseen = memory.sheets.foresee(place, state.next(), &progress);
    Ok(state)
}

/// Every picture of the board with what was found in it; each is looked at once.
fn look_for_boards(
    session: &Session,
    memory: &mut Memory,
    out: &Outbox,
) -> Result<Vec<(FrameEntry, Option<SeenBoard>)>, AnyError> {
    let Some(board) = session.target.as_ref().and_then(|target| target.board) else {
        return Ok(Vec::new());
    };
    // What is there is told after work that was stopped, too.
    let stopped = out.is_cancelled();
    let mut all = Vec::new();
    for (k, entry) in session.frames.iter().enumerate() {
        let (share, step) = (k as f64 / session.frames.len() as f64, texts::picture_of(k, session));
        let tick = || match stopped {
            true => out.progress(share, &step, None),
            false => out.tick(share, &step),
        };
        tick();
        let hash = entry.sha256.clone().unwrap_or_default();
        let seen = match memory.seen.get(&hash) {
            Some(seen) => seen.clone(),
            // Without detection nothing is found; the wizard says what to build.
            None if !cfg!(feature = "opencv") => None,
            None => find_board(&read(session, entry)?, &board, &tick)?,
        };
        memory.seen.insert(hash, seen.clone());
        all.push((entry.clone(), seen));
    }
    Ok(all)
}

/// Which of camera, colour and lights were made from exactly what lies in `targets` now.
fn fresh(place: &Place, calibration: Option<&Calibration>, sheets: &[Pose]) -> [bool; 3] {
    let from = |provenance: Option<&Provenance>, names: &[String]| {
        let Some(provenance) = provenance else { return false };
        let made_from = |name: &String| {
            let hash = sha256_of_file(&place.targets().join(name).join(MANIFEST));
            hash.is_ok_and(|hash| provenance.inputs.iter().any(|input| input.sha256 == hash))
        };
        !names.is_empty() && names.iter().all(made_from)
    };
    let Some(calibration) = calibration else { return [false; 3] };
    let of = &calibration.provenance;
    let folders: Vec<String> =
        sheets.iter().filter(|pose| **pose != Pose::Check).map(|pose| pose.folder()).collect();
    let stale = calibration.lights_of_another_camera().unwrap_or(true);
    [
        from(of.camera.as_ref(), &[BOARD.to_owned()]),
        from(of.color.as_ref(), &[GREY.to_owned()]),
        from(of.lights.as_ref(), &folders) && !stale,
    ]
}
