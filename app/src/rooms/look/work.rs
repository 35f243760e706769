//! The worker's part: reads solutions, and asks the frames what they know.

use super::opened::{self, OpenError};
use super::view::{Pyramid, picture};
use super::{Ask, Sources, Told, slopes};
use crate::settings::SolveSettings;
use crate::texts::look as texts;
use crate::worker::{Outbox, Tools, Update};
use std::path::Path;
use std::sync::Arc;
use weavelight::files::FileError;
use weavelight::raster::write_png_grey8;
use weavelight::report::page_of_solve;
use weavelight::session::Session;
use weavelight::solve::{Rows, Scene, Shown, SolveError, load_scene, run_with_page};
use weavelight_calibration::description::Image;

/// The frames that were looked at last, decoded.
#[derive(Debug, Default)]
pub struct Frames {
    sources: Sources,
    scene: Option<Box<Scene>>,
}

pub(super) fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    match ask {
        Ask::Open(folder) => open(&folder, tools, out),
        Ask::Compare(folder, with) => compare(&folder, &with, out),
        Ask::Picture(sources, light) => look_at(&sources, light, Kind::Picture, tools, out),
        Ask::Residual(sources, light) => look_at(&sources, light, Kind::Residual, tools, out),
        Ask::Photosite(sources, at) => photosite(&sources, at, tools, out),
        Ask::Mask(session, mask) => save_mask(&session, &mask, tools, out),
        Ask::Solve(sources, solution, settings) => solve(&sources, &solution, settings, tools, out),
    }
}

fn open(folder: &Path, tools: &mut Tools, out: &Outbox) {
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let opened = out.job(&texts::opening(&name), || {
        opened::open(folder, tools.place.as_ref(), &|share, step| out.tick(share, step))
    });
    if let Ok(opened) = opened {
        out.tell(Update::Look(Told::Opened(Box::new(opened))));
    }
}

fn compare(folder: &Path, with: &Arc<Pyramid>, out: &Outbox) {
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
        out.tell(Update::Look(Told::Other { name, surface, angles }));
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
    out.tell(Update::Look(match kind {
        Kind::Picture => Told::Picture { light, picture },
        Kind::Residual => Told::Residual { light, picture },
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
    out.tell(Update::Look(Told::Photosite { at, found: found.flatten().map(Box::new) }));
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
            let (scene, _) = load_scene(&sources.session, &sources.calibration)?;
            Box::new(scene)
        }
    };
    Ok(frames.scene.insert(scene))
}

/// Writes `mask.png` and notes it in the manifest; the picture first, so that the manifest never names what is not there.
fn save_mask(session: &Path, mask: &Image<bool>, tools: &mut Tools, out: &Outbox) {
    const FILE: &str = "mask.png";
    let saved = || -> Result<(), Box<dyn std::error::Error>> {
        let mut manifest = Session::load(session)?;
        let white = mask.data.iter().map(|inside| if *inside { 255 } else { 0 }).collect();
        let picture = Image { width: mask.width, height: mask.height, data: white };
        let fresh = session.join(".mask-new.png");
        write_png_grey8(&fresh, &picture)?;
        let whole = session.join(FILE);
        std::fs::rename(&fresh, &whole).map_err(|error| FileError::write(&whole, error))?;
        manifest.mask = Some(FILE.into());
        manifest.save()?;
        Ok(())
    };
    match saved() {
        Ok(()) => {
            tools.frames = Frames::default();
            out.tell(Update::Look(Told::MaskSaved));
        }
        Err(error) => out.fail(texts::SAVING_MASK, &error),
    }
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
        run_with_page(&options, &|state| out.tick(state.share(), state.stage.what()), Some(&page))
    });
    if solved.is_ok() {
        open(solution, tools, out);
    }
}
