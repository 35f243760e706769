//! The worker's part of the Scans room.

use super::list::list;
use super::{Ask, Entry, Told};
use crate::place::Place;
use crate::rooms::scan::picture::thumb;
use crate::texts::scans as texts;
use crate::worker::{Outbox, Tools, Update};
use eframe::egui::ColorImage;
use std::path::{Path, PathBuf};
use weavelight::files::{FileError, StagedFolder, copy_input};
use weavelight::instrument::Calibration;
use weavelight::raw::{Hint, decode};
use weavelight::session::Session;
use weavelight::solution::OUTPUT;

pub(super) fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    match ask {
        Ask::List(place) => tell_list(&place, out),
        Ask::Thumbnail(place, folder) => {
            if let Some(picture) = thumbnail(&place, &folder) {
                out.tell(Update::Scans(Told::Thumbnail(folder, picture)));
            }
        }
        Ask::Delete(entry) => delete(entry, out),
        Ask::BringBack(entry) => bring_back(entry, out),
        Ask::Export { solution, to } => export(&solution, &to, out),
    }
    // What was deleted or brought back changes the list.
    if let Some(place) = &tools.place {
        tell_list(place, out);
    }
}

fn tell_list(place: &Place, out: &Outbox) {
    out.tell(Update::Scans(Told::List(place.folder.clone(), list(place))));
}

/// The first light's frame made small; kept as a file beside the scans, for the next time.
fn thumbnail(place: &Place, folder: &Path) -> Option<ColorImage> {
    let kept = kept_thumbnail(place, folder);
    if let Ok(picture) = image::open(&kept) {
        let rgb = picture.to_rgb8();
        let size = [rgb.width() as usize, rgb.height() as usize];
        return Some(ColorImage::from_rgb(size, rgb.as_raw()));
    }
    let session = Session::load(folder).ok()?;
    let entry = session.frames.iter().find(|frame| frame.light.is_some())?;
    let frame = decode(&session.read_frame(entry).ok()?, &Hint::default()).ok()?;
    let calibration = Calibration::load(&place.calibration()).ok();
    let picture = thumb(&frame, entry.light, calibration.as_ref());
    keep(&picture, &kept);
    Some(picture)
}

/// By the folder's name and age: a scan that was taken again has another picture.
fn kept_thumbnail(place: &Place, folder: &Path) -> PathBuf {
    let modified = folder.metadata().and_then(|metadata| metadata.modified()).ok();
    let since = modified.and_then(|when| when.duration_since(std::time::UNIX_EPOCH).ok());
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let file = format!("{name}.{}.png", since.unwrap_or_default().as_millis());
    place.folder.join(".thumbnails").join(file)
}

/// A thumbnail that cannot be kept is made again.
fn keep(picture: &ColorImage, file: &Path) {
    let rgb = picture.pixels.iter().flat_map(|pixel| [pixel.r(), pixel.g(), pixel.b()]).collect();
    let [width, height] = picture.size.map(|side| u32::try_from(side).unwrap_or(0));
    let _ = file.parent().map(std::fs::create_dir_all);
    let _ = image::RgbImage::from_raw(width, height, rgb).map(|image| image.save(file));
}

fn delete(entry: Entry, out: &Outbox) {
    match trash::delete_all(folders(&entry)) {
        Ok(()) => out.tell(Update::Scans(Told::Deleted(entry))),
        Err(error) => out.fail(texts::DELETING, &in_words(&entry, &error)),
    }
}

/// The scan, and its solution where there is one.
fn folders(entry: &Entry) -> impl Iterator<Item = &PathBuf> {
    std::iter::once(&entry.folder).chain(&entry.solution)
}

fn in_words(entry: &Entry, error: &trash::Error) -> String {
    format!("{}: {error}; look into the system's bin", entry.folder.display())
}

fn bring_back(entry: Entry, out: &Outbox) {
    match restore(&entry) {
        Ok(()) => out.tell(Update::Scans(Told::BroughtBack(entry))),
        Err(error) => out.fail(texts::BRINGING_BACK, &in_words(&entry, &error)),
    }
}

/// What lay under the entry's names and was deleted last.
#[cfg(not(target_os = "macos"))]
fn restore(entry: &Entry) -> Result<(), trash::Error> {
    let bin = trash::os_limited::list()?;
    let newest = |folder: &PathBuf| {
        // The bin knows places without links on the way.
        let parent = folder.parent()?.canonicalize().ok()?;
        let place = parent.join(folder.file_name()?);
        let of_it = bin.iter().filter(|item| item.original_path() == place);
        of_it.max_by_key(|item| item.time_deleted).cloned()
    };
    let items: Vec<trash::TrashItem> = folders(entry).filter_map(newest).collect();
    match items.is_empty() {
        true => Err(trash::Error::Unknown { description: "it is not in the bin any more".into() }),
        false => trash::os_limited::restore_all(items),
    }
}

/// There no program may take things out of the bin.
#[cfg(target_os = "macos")]
fn restore(_entry: &Entry) -> Result<(), trash::Error> {
    Err(trash::Error::Unknown { description: "it can be put back in the Finder".into() })
}

/// Copies a solution; it stands under its name only when whole.
fn export(solution: &Path, to: &Path, out: &Outbox) {
    let copied = out.job(texts::EXPORTING, || -> Result<(), FileError> {
        let staged = StagedFolder::create(to, OUTPUT)?;
        let files: Vec<PathBuf> = std::fs::read_dir(solution)
            .map_err(|source| FileError::read(solution, source))?
            .flatten()
            .map(|entry| entry.path())
            .collect();
        for (k, file) in files.iter().enumerate() {
            let name = file.file_name().unwrap_or_default();
            out.tick(k as f64 / files.len() as f64, &name.to_string_lossy());
            let target = staged.path().join(name);
            copy_input(file, &target).map_err(|source| FileError::write(&target, source))?;
        }
        staged.commit()
    });
    if copied.is_ok() {
        out.tell(Update::Scans(Told::Exported(to.to_owned())));
    }
}
