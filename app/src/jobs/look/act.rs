//! The worker's part: reads solutions, and asks the frames what they know.

use crate::jobs::identify::{What, is_open, newest_solution};
use crate::jobs::look::capture::Sources;
use crate::jobs::look::frames::Frames;
use crate::jobs::look::opened::OpenError;
use crate::jobs::look::{Command, EditedMask, Event, drafts, opened};
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::tools::Tools;
use crate::model::room::Room;
use crate::model::settings::SolveSettings;
use crate::texts::look as texts;
use crate::viewer::maps::picture;
use crate::viewer::pyramid::Pyramid;
use crate::viewer::slopes;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use weavelight::files::{FileError, Lock, write_atomic};
use weavelight::raster::encode_png_grey8;
use weavelight::report::page_of_solve;
use weavelight::session::MASK_FILE;
use weavelight::session::Session;
use weavelight::solve::{Rows, Scene, Shown, SolveError, run};
use weavelight_calibration::description::Image;

pub(crate) fn act(command: Command, tools: &mut Tools, out: &Outbox) {
    match command {
        Command::Open(folder) => open(&folder, tools, out),
        Command::Compare(folder, with) => compare(&folder, &with, tools, out),
        Command::Picture(sources, light) => look_at(&sources, light, Kind::Picture, tools, out),
        Command::Residual(sources, light) => look_at(&sources, light, Kind::Residual, tools, out),
        Command::Photosite(sources, at) => photosite(&sources, at, tools, out),
        Command::Mask(sources, edited) => save_mask(&sources.session, edited, tools, out),
        Command::Draft(file) => {
            let draft = drafts::read(&file).map(Box::new);
            out.send(Update::Look(Event::Draft(file, draft)));
        }
        Command::SolveScan(scan, settings) => solve_scan(&scan, settings, tools, out),
        Command::Solve(sources, solution, settings) => {
            solve(&sources, &solution, settings, tools, out);
        }
    }
}

/// Whatever is opened: a solution is shown, a capture session's newest solution too, a rig's scans are listed.
fn open(path: &Path, tools: &mut Tools, out: &Outbox) {
    match What::is(path) {
        What::Solution(folder) => open_solution(&folder, tools, out),
        What::Scan(scan) => match newest_solution(&scan, tools.project.as_ref()) {
            Some(solution) => open_solution(&solution, tools, out),
            None => out.send(Update::Look(Event::Unsolved(scan))),
        },
        What::Rig(folder) => {
            if !is_open(&folder, tools.project.as_ref()) {
                crate::jobs::open::open(&folder, tools, out);
            }
            // The room follows when the rig is there: opening it keeps the room as it is.
            out.send(Update::GoTo(Room::Scans));
        }
        What::Target(folder) => out.fail(texts::OPENING_FOLDER, &texts::is_target(&folder)),
        What::Calibration(folder, _) => {
            out.fail(texts::OPENING_FOLDER, &texts::is_calibration(&folder));
        }
        // It may be a solution without its report.
        What::Other(path) => open_solution(&path, tools, out),
    }
}

fn solve_scan(scan: &Path, settings: SolveSettings, tools: &mut Tools, out: &Outbox) {
    let how = (settings, weavelight::solution::Reuse::IfCurrent);
    if let Some(solved) = crate::jobs::scan::solve::solve(scan, how, tools, out) {
        open_solution(&solved.solution, tools, out);
    }
}

fn open_solution(folder: &Path, tools: &mut Tools, out: &Outbox) {
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let opened = out.job(&texts::opening(&name), || {
        opened::open(folder, tools.project.as_ref(), &|share, step| out.tick(share, step))
    });
    if let Ok(opened) = opened {
        out.send(Update::Look(Event::Opened(Box::new(opened))));
    }
}

fn compare(path: &Path, with: &Arc<Pyramid>, tools: &Tools, out: &Outbox) {
    let folder = match What::is(path) {
        What::Solution(folder) => folder,
        What::Scan(scan) => match newest_solution(&scan, tools.project.as_ref()) {
            Some(solution) => solution,
            None => return out.fail(texts::OPENING_FOLDER, &texts::not_solved(&scan)),
        },
        _ => path.to_owned(),
    };
    let folder = folder.as_path();
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let read = out.job(&texts::opening(&name), || {
        let surface = opened::read_surface(folder)?;
        match surface.size() == with.size() {
            true => Ok(surface),
            false => Err(OpenError::Incomparable {
                name: name.clone(),
                found: texts::size(surface.size()),
                expected: texts::size(with.size()),
            }),
        }
    });
    if let Ok(surface) = read {
        let angles = slopes::between(with, &surface);
        out.send(Update::Look(Event::Other { name, surface, angles }));
    }
}

/// What is wanted of a light's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Picture,
    Residual,
}

fn look_at(sources: &Sources, light: usize, kind: Kind, tools: &mut Tools, out: &Outbox) {
    let title = match kind {
        Kind::Picture => texts::frame_of(light),
        Kind::Residual => texts::residual_of(light),
    };
    let made = out.job(&title, || {
        let scene = scene(sources, tools, out)?;
        out.tick(0.5, &title);
        let position = scene.lights.iter().position(|of| of.index == light);
        let Some(position) = position else { return Ok(None) };
        let made = Rows::with_method(scene, sources.method, |rows| match kind {
            Kind::Picture => of_rgb(&rows.picture_of(position)),
            Kind::Residual => of_residual(&rows.residual_of(position)),
        })?;
        Ok::<_, SolveError>(Some(made))
    });
    let Ok(Some(picture)) = made else { return };
    out.send(Update::Look(match kind {
        Kind::Picture => Event::Picture { light, picture },
        Kind::Residual => Event::Residual { light, picture },
    }));
}

fn of_rgb(image: &Image<[f32; 3]>) -> Arc<Pyramid> {
    picture([image.width, image.height], &|k| image.data[k], &|_| 1.0)
}

fn of_residual(image: &Image<f32>) -> Arc<Pyramid> {
    let known = |k: usize| if image.data[k].is_finite() { 1.0 } else { 0.0 };
    picture([image.width, image.height], &|k| [image.data[k]; 3], &known)
}

fn photosite(sources: &Sources, at: [usize; 2], tools: &mut Tools, out: &Outbox) {
    let solve = |tools: &mut Tools| {
        let scene = scene(sources, tools, out)?;
        Rows::with_method(scene, sources.method, |rows| rows.photosite(at))
    };
    // Once the frames are there, a click is answered at once.
    let known = tools.frames.scene.is_some() && tools.frames.sources.same_frames(sources);
    let found = match known {
        true => solve(tools).ok(),
        false => out.job(texts::READING_FRAMES, || solve(tools)).ok(),
    };
    out.send(Update::Look(Event::Photosite { at, found: found.flatten().map(Box::new) }));
}

/// The frames of a capture session; those of the last one are kept.
fn scene<'t>(
    sources: &Sources,
    tools: &'t mut Tools,
    out: &Outbox,
) -> Result<&'t Scene, SolveError> {
    let frames = &mut tools.frames;
    if !frames.sources.same_frames(sources) {
        *frames = Frames { sources: sources.clone(), scene: None };
    }
    let scene = match frames.scene.take() {
        Some(scene) => scene,
        None => {
            out.tick(0.1, texts::READING_FRAMES);
            let (scene, _) = Scene::load(&sources.session, &sources.calibration)?;
            Box::new(scene)
        }
    };
    Ok(frames.scene.insert(scene))
}

/// Writes the mask and notes it in the manifest; the picture first, so that the manifest never names what is not there. A
/// picture that the manifest does not name is another one, and stays.
fn save_mask(session: &Path, edited: EditedMask, tools: &mut Tools, out: &Outbox) {
    let saved = || -> Result<(), Box<dyn std::error::Error>> {
        let _lock = Lock::acquire(session, "edit")?;
        let mut manifest = Session::load(session)?;
        let file = mask_file(&manifest);
        let path = session.join(&file);
        let bytes = encode_png_grey8(&drafts::in_grey(&edited.mask))
            .map_err(|error| FileError::write(&path, error))?;
        write_atomic(&path, &bytes)?;
        if manifest.mask.as_ref() != Some(&file) {
            manifest.mask = Some(file);
            manifest.save()?;
        }
        Ok(())
    };
    match saved() {
        Ok(()) => {
            tools.frames = Frames::default();
            out.send(Update::Look(Event::MaskSaved(edited.key, edited.version)));
        }
        Err(error) => out.fail(texts::SAVING_MASK, &error),
    }
}

/// `mask.png`, or the next number where a picture of that name is not this capture session's mask.
fn mask_file(session: &Session) -> PathBuf {
    let numbered = (2..).map(|k| PathBuf::from(format!("mask-{k}.png")));
    let is_ours = |file: &PathBuf| {
        session.mask.as_ref() == Some(file) || session.folder.join(file).symlink_metadata().is_err()
    };
    std::iter::once(PathBuf::from(MASK_FILE)).chain(numbered).find(is_ours).unwrap_or_default()
}

/// The same call with the same settings as the command line's, and then its solution is looked at.
fn solve(
    Sources { session, calibration, .. }: &Sources,
    solution: &Path,
    settings: SolveSettings,
    tools: &mut Tools,
    out: &Outbox,
) {
    let name = session.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let options = settings.options(session, calibration, solution);
    let solved = out.job(&texts::solving(&name), || {
        let page = |shown: &Shown| page_of_solve(shown, None);
        run(&options, &|state| out.tick(state.share(), state.stage.what()), Some(&page))
    });
    if solved.is_ok() {
        open_solution(solution, tools, out);
    }
}
