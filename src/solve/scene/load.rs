//! From two folders to a scene in memory.

use crate::files::Setting;
use crate::instrument::{CAMERA_FILE, COLOR_FILE, Calibration, LIGHTS_FILE, Optics};
use crate::linear::{Exposure, PhotographedLight};
use crate::machine::check_memory;
use crate::raster::decode_mask;
use crate::raw::{Frame, Histogram, ReadError, Samples, contradictions, mixed_encodings};
use crate::session::{FrameEntry, Kind, Session, SessionError};
use crate::solve::progress::{Progress, Stage};
use crate::solve::scene::{Origin, Scene};
use crate::solve::screen::drift_warnings;
use crate::solve::words::{few, in_words};
use crate::solve::{Options, SolveError};
use crate::swatch::MaskChoice;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use weavelight_calibration::description::{Image, Light};

/// Files held in memory at once beside the decoded frames: enough to keep cores busy, few enough for the memory bound.
const FILES_AT_ONCE: usize = 4;
/// Exposures of one light that can be merged.
const MOST_EXPOSURES: usize = 64;

/// A scene and what reading it had to say.
pub(crate) struct Loaded {
    pub(crate) scene: Scene,
    pub(crate) warnings: Vec<String>,
}

impl Scene {
    /// A capture session with its calibration as [`crate::solve::run`] solves it: lights that add nothing left out. With the
    /// scene come the warnings.
    ///
    /// # Errors
    /// As [`crate::solve::run`].
    pub fn load(session: &Path, calibration: &Path) -> Result<(Scene, Vec<String>), SolveError> {
        let options = Options::new(session, calibration, "");
        let (session, calibration) = (Session::load(session)?, Calibration::load(calibration)?);
        let Loaded { mut scene, mut warnings } = load(&options, &session, calibration, &|_| {})?;
        warnings.extend(scene.leave_out_what_adds_nothing()?);
        Ok((scene, warnings))
    }
}

/// Reads and checks everything that can be checked before solving.
pub(crate) fn load(
    options: &Options,
    session: &Session,
    mut calibration: Calibration,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Loaded, SolveError> {
    check_folders(session, &calibration)?;
    let mut warnings = unphotographed(session, &calibration);
    warnings.extend(stale_lights(&calibration)?);
    let frames = read_frames(session, progress)?;
    warnings.extend(other_optics(session, &frames, &calibration));
    let entries = || session.frames.iter().zip(&frames);
    let numbers =
        || entries().map(|(entry, frame)| (entry.file.as_path(), &frame.metadata.numbers));
    warnings.extend(contradictions(numbers()));
    warnings.extend(mixed_encodings(numbers()));
    warnings.extend(find_ceiling(&frames, &mut calibration));
    warnings.extend(crate::solve::scene::exposures::contradictions(session, &frames));
    warnings.extend(assumed_levels(session, &frames, &calibration));
    let (drift, frames): (Vec<_>, Vec<_>) =
        session.frames.iter().zip(frames).partition(|(entry, _)| entry.drift_check);
    let mut scene = arrange(session, calibration, frames);
    crate::solve::scene::check::check_frames(&scene)?;
    let drift: Vec<_> = drift
        .into_iter()
        .map(|(entry, frame)| (entry.light, exposure(session, entry, frame)))
        .collect();
    warnings.extend(drift_warnings(&scene, &drift));
    let mask = options.mask.file(session);
    scene.mask = mask.map(|path| read_mask(&path, &scene)).transpose()?;
    Ok(Loaded { scene, warnings })
}

impl MaskChoice {
    /// The picture that says it, if one does.
    pub(crate) fn file(&self, session: &Session) -> Option<PathBuf> {
        match self {
            MaskChoice::OfSession => session.mask_path(),
            MaskChoice::Everything | MaskChoice::Found => None,
            MaskChoice::File(path) => Some(path.clone()),
        }
    }
}

fn check_folders(session: &Session, calibration: &Calibration) -> Result<(), SolveError> {
    if session.kind == Kind::Board {
        return Err(SolveError::Board { session: session.manifest_path() });
    }
    if calibration.lights.is_empty() {
        return Err(SolveError::NoLights { calibration: calibration.folder.join(LIGHTS_FILE) });
    }
    session.check_lights(calibration.lights.len())?;
    check_counts(session)?;
    let near = |index: usize| matches!(calibration.lights[index].light, Light::Point(_));
    if calibration.camera.is_none() && photographed(session).into_iter().any(near) {
        return Err(SolveError::NoCamera { calibration: calibration.folder.join(CAMERA_FILE) });
    }
    session.check_files()?;
    Ok(())
}

fn check_counts(session: &Session) -> Result<(), SolveError> {
    let lights = photographed(session);
    if lights.len() < 3 {
        return Err(SolveError::TooFewLights {
            session: session.manifest_path(),
            found: lights.len(),
        });
    }
    for light in lights {
        let found =
            session.frames.iter().filter(|f| f.light == Some(light) && !f.drift_check).count();
        if found > MOST_EXPOSURES {
            return Err(SolveError::TooManyExposures {
                session: session.manifest_path(),
                light,
                found,
            });
        }
    }
    Ok(())
}

/// Lights with a frame that counts, ascending.
fn photographed(session: &Session) -> Vec<usize> {
    let counting = session.frames.iter().filter(|frame| !frame.drift_check);
    let mut lights: Vec<usize> = counting.filter_map(|frame| frame.light).collect();
    lights.sort_unstable();
    lights.dedup();
    lights
}

/// Frames whose content nothing vouches for, told once.
pub(crate) fn unverified(session: &Session) -> Option<String> {
    let without = session.frames.iter().filter(|frame| frame.sha256.is_none());
    let names: Vec<String> = without.map(|frame| frame.file.display().to_string()).collect();
    let (count, all) = (names.len(), session.frames.len());
    let which =
        if count == all { "no frame".to_owned() } else { format!("{count} of {all} frames") };
    let has = if count == all { "has" } else { "have no" };
    let names = if count == all { String::new() } else { format!(" ({})", few(names)) };
    (count > 0).then(|| {
        format!("session.toml: {which}{names} {has} a sha256; that they are as they were taken was not verified.")
    })
}

fn unphotographed(session: &Session, calibration: &Calibration) -> Vec<String> {
    let there = photographed(session);
    let missing: Vec<String> = (0..calibration.lights.len())
        .filter(|light| !there.contains(light))
        .map(|light| light.to_string())
        .collect();
    match missing.as_slice() {
        [] => vec![],
        [one] => vec![format!("Light {one} has no frame; solved with the other {}.", there.len())],
        several => {
            let names = in_words(several);
            vec![format!("Lights {names} have no frames; solved with the other {}.", there.len())]
        }
    }
}

/// Lights measured in the rig frame of a camera that is no longer the calibration's.
fn stale_lights(calibration: &Calibration) -> Result<Option<String>, SolveError> {
    let stale = calibration.lights_of_another_camera()?;
    Ok(stale.then(|| {
        format!(
            "{}: the lights were calibrated with another camera.toml than the one beside them; run `weavelight calibrate lights` again.",
            calibration.folder.join(LIGHTS_FILE).display()
        )
    }))
}

/// A camera or lens other than the calibrated one, told once for the first frame that shows it.
fn other_optics(session: &Session, frames: &[Frame], calibration: &Calibration) -> Vec<String> {
    let differences = |frame: &Frame| calibration.optics.differences(&Optics::of(&frame.metadata));
    let first = session.frames.iter().zip(frames).find_map(|(entry, frame)| {
        let found = differences(frame);
        (!found.is_empty()).then_some((entry, found))
    });
    let Some((entry, found)) = first else { return vec![] };
    let file = entry.file.display();
    let tell = |what: &String| {
        format!(
            "{file}: {what}; where that is so, positions and shading are wrong: calibrate again."
        )
    };
    found.iter().map(tell).collect()
}

/// Where pictures of other programs clip, unless the calibration says.
fn find_ceiling(frames: &[Frame], calibration: &mut Calibration) -> Option<String> {
    if calibration.color.saturation_level.is_some() {
        return None;
    }
    let ceiling = Histogram::of(frames)?.ceiling()?;
    calibration.color.clip_level = Some(ceiling.level.into());
    Some(ceiling.sentence())
}

/// Levels that a frame's file does not state and the calibration neither; told for the first such frame.
fn assumed_levels(
    session: &Session,
    frames: &[Frame],
    calibration: &Calibration,
) -> Option<String> {
    let color = &calibration.color;
    let stated = [color.black_level.is_some(), color.saturation_level.is_some()];
    let place = calibration.folder.join(COLOR_FILE);
    session.frames.iter().zip(frames).find_map(|(entry, frame)| {
        let what = frame.assumed_levels(stated)?;
        Some(format!("{}: {what} in {}.", entry.file.display(), place.display()))
    })
}

/// Decodes every frame, several at once; in the manifest's order.
fn read_frames(
    session: &Session,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<Frame>, SolveError> {
    let finished = AtomicUsize::new(0);
    let total = session.frames.len();
    let read = |entry: &FrameEntry| {
        let frame = session.frame(entry);
        let done = finished.fetch_add(1, Ordering::Relaxed) + 1;
        progress(Progress { stage: Stage::Read, done, total });
        frame
    };
    let at_once = FILES_AT_ONCE.min(rayon::current_num_threads().max(1));
    let mut frames = Vec::with_capacity(total);
    for group in session.frames.chunks(at_once) {
        let decoded: Vec<Result<Frame, SessionError>> =
            group.par_iter().with_max_len(1).map(read).collect();
        let first = frames.is_empty();
        for frame in decoded {
            frames.push(frame?);
        }
        if let (true, Some(frame)) = (first, frames.first()) {
            check_room(frame, total)?;
        }
    }
    Ok(frames)
}

/// Bytes a photosite of the maps, and of what they are made of and encoded from.
const MAP_BYTES_PER_PX: u64 = 60;

/// What a solve will need is known from the first frame.
fn check_room(frame: &Frame, total: usize) -> Result<(), SolveError> {
    let samples = match &frame.samples {
        Samples::U16(values) => 2 * values.len() as u64,
        Samples::F32(values) => 4 * values.len() as u64,
    };
    let pixels = (frame.width * frame.height) as u64;
    let at_least = samples * (total as u64).saturating_sub(FILES_AT_ONCE as u64);
    let what = || format!("solving {total} frames of {} x {}", frame.width, frame.height);
    let remedy = format!(
        "close other programs, raise the limit, or make a preview ({} 4)",
        Setting("preview")
    );
    Ok(check_memory(what, at_least + MAP_BYTES_PER_PX * pixels, remedy)?)
}

fn exposure(session: &Session, entry: &FrameEntry, frame: Frame) -> Exposure {
    Exposure {
        frame,
        exposure_s: entry.exposure_s,
        iso: entry.iso,
        path: session.frame_path(entry),
    }
}

/// Frames by light and exposure, so that nothing depends on their order in the manifest.
fn arrange(
    session: &Session,
    calibration: Calibration,
    frames: Vec<(&FrameEntry, Frame)>,
) -> Scene {
    let (width, height, layout) = frames
        .first()
        .map_or((0, 0, crate::raw::Layout::Grey), |(_, f)| (f.width, f.height, f.layout));
    let mut ambient = vec![];
    let mut of_lights: Vec<Vec<Exposure>> = calibration.lights.iter().map(|_| vec![]).collect();
    for (entry, frame) in frames {
        let exposure = exposure(session, entry, frame);
        match entry.light {
            Some(light) => of_lights[light].push(exposure),
            None => ambient.push(exposure),
        }
    }
    let in_order = |exposures: &mut Vec<Exposure>| {
        exposures.sort_by(|a, b| {
            let seconds = a.seconds_at_iso_100().total_cmp(&b.seconds_at_iso_100());
            seconds.then(a.iso.total_cmp(&b.iso)).then_with(|| a.path.cmp(&b.path))
        });
    };
    in_order(&mut ambient);
    of_lights.iter_mut().for_each(in_order);
    let lights = calibration.lights.into_iter().zip(of_lights).enumerate();
    Scene {
        width,
        height,
        layout,
        lights: lights
            .filter(|(_, (_, exposures))| !exposures.is_empty())
            .map(|(index, (calibrated, exposures))| PhotographedLight {
                index,
                calibrated,
                exposures,
            })
            .collect(),
        ambient,
        camera: calibration.camera,
        plane: session.plane_or_table(),
        color: calibration.color,
        defects: calibration.defects,
        mask: None,
        origin: Origin { session: session.manifest_path(), calibration: calibration.folder },
    }
}

/// A picture of the frames' size; see [`decode_mask`].
pub(crate) fn read_mask(path: &Path, scene: &Scene) -> Result<Image<bool>, SolveError> {
    let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
        .map_err(|source| crate::files::FileError::read(path, source))?;
    let mask = decode_mask(&bytes)
        .map_err(|source| ReadError::Decode { path: path.to_owned(), source: source.into() })?;
    if (mask.width, mask.height) != scene.size_px() {
        return Err(SolveError::OtherMask {
            path: path.to_owned(),
            mask: format!("{} x {}", mask.width, mask.height),
            frames: format!("{} x {}", scene.width, scene.height),
        });
    }
    Ok(mask)
}
