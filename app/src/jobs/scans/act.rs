//! The worker's part of the Scans room.

use crate::jobs::bin::BinnedFolders;
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::scan;
use crate::jobs::scans::list::list;
use crate::jobs::scans::{Command, Deleted, Event};
use crate::jobs::tools::Tools;
use crate::model::names::free_path;
use crate::model::project::{Project, same};
use crate::model::scan_entry::ScanEntry;
use crate::texts::scans as texts;
use crate::viewer::picture::thumb;
use eframe::egui::ColorImage;
use std::path::{Path, PathBuf};
use weavelight::files::{FileError, LIST_FILE, OutputKind, StagedFolder, copy_input};
use weavelight::instrument::Calibration;
use weavelight::session::Session;

pub(crate) fn act(command: Command, tools: &mut Tools, out: &Outbox) {
    match command {
        Command::List(project) => tell_list(&project, out),
        Command::Thumbnail(project, folder) => {
            if let Some(picture) = thumbnail(&project, &folder) {
                out.send(Update::Scans(Event::Thumbnail(folder, picture)));
            }
        }
        Command::Solve { scan, settings, reuse } => {
            if let Some(outcome) = scan::solve::solve(&scan, (settings, reuse), tools, out) {
                // This room has no place for a report.
                let name = scan.file_name().unwrap_or_default().to_string_lossy();
                out.warn(&name, &outcome.report.warnings);
                out.send(Update::Scans(Event::Solved(scan, outcome.up_to_date)));
            }
        }
        Command::Delete(entry) => delete(entry, out),
        Command::BringBack(deleted) => bring_back(deleted, out),
        Command::Export { solution, to } => export(&solution, &to, out),
    }
    // What was deleted or brought back changes the list.
    if let Some(project) = &tools.project {
        tell_list(project, out);
    }
}

fn tell_list(project: &Project, out: &Outbox) {
    out.send(Update::Scans(Event::List(project.folder.clone(), list(project))));
    out.send(Update::Scan(scan::Event::Names(project.folder.clone(), project.names())));
}

/// The first light's frame made small; kept as a file beside the scans, for the next time.
fn thumbnail(project: &Project, folder: &Path) -> Option<ColorImage> {
    let kept = kept_thumbnail(project, folder);
    if let Ok(picture) = image::open(&kept) {
        let rgb = picture.to_rgb8();
        let size = [rgb.width() as usize, rgb.height() as usize];
        return Some(ColorImage::from_rgb(size, rgb.as_raw()));
    }
    let session = Session::load(folder).ok()?;
    let entry = session.frames.iter().find(|frame| frame.light.is_some())?;
    let frame = session.frame(entry).ok()?;
    let calibration = Calibration::load(&project.calibration()).ok();
    let picture = thumb(&frame, entry.light, calibration.as_ref());
    keep(&picture, &kept);
    Some(picture)
}

/// By the folder's name and age: a scan that was taken again has another picture.
fn kept_thumbnail(project: &Project, folder: &Path) -> PathBuf {
    let modified = folder.metadata().and_then(|metadata| metadata.modified()).ok();
    let since = modified.and_then(|when| when.duration_since(std::time::UNIX_EPOCH).ok());
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let file = format!("{name}.{}.png", since.unwrap_or_default().as_millis());
    project.folder.join(".thumbnails").join(file)
}

/// A thumbnail that cannot be kept is made again.
fn keep(picture: &ColorImage, file: &Path) {
    let rgb = picture.pixels.iter().flat_map(|pixel| [pixel.r(), pixel.g(), pixel.b()]).collect();
    let [width, height] = picture.size.map(|side| u32::try_from(side).unwrap_or(0));
    let _ = file.parent().map(std::fs::create_dir_all);
    let _ = image::RgbImage::from_raw(width, height, rgb).map(|image| image.save(file));
}

fn delete(entry: ScanEntry, out: &Outbox) {
    let ScanEntry { name, folder, solution, .. } = entry;
    match BinnedFolders::put(std::iter::once(folder.clone()).chain(solution)) {
        // It was deleted already, by a click too many or by hand.
        Ok(binned) if binned.folders.is_empty() => {}
        Ok(binned) => {
            out.send(Update::Scans(Event::Deleted(Deleted { name, folder, binned })));
        }
        Err(error) => out.fail(texts::DELETING, &error),
    }
}

fn bring_back(deleted: Deleted, out: &Outbox) {
    match deleted.binned.bring_back() {
        Ok(()) => out.send(Update::Scans(Event::BroughtBack(deleted))),
        Err(error) => out.fail(texts::BRINGING_BACK, &error),
    }
}

/// Why maps are not exported.
#[derive(Debug, thiserror::Error)]
enum ExportError {
    #[error(transparent)]
    File(#[from] FileError),
    /// It would depend on where the program was started.
    #[error("{path} is a relative path; give the whole one, as in /home/me/maps")]
    Relative { path: String },
    /// The copy would be copied.
    #[error("{path} lies in the solution itself; choose a folder outside of it")]
    Inside { path: String },
}

/// Copies a solution; it stands under its name only when whole. Where something is already, it goes beside it, under the next
/// number.
fn export(solution: &Path, to: &Path, out: &Outbox) {
    let copied = out.job(texts::EXPORTING, || copy_solution(solution, to, out));
    if let Ok(to) = copied {
        out.send(Update::Scans(Event::Exported { solution: solution.to_owned(), to }));
    }
}

fn copy_solution(solution: &Path, to: &Path, out: &Outbox) -> Result<PathBuf, ExportError> {
    let path = to.display().to_string();
    if !to.is_absolute() || to.file_name().is_none() {
        return Err(ExportError::Relative { path });
    }
    if to.ancestors().any(|above| same(above, solution)) {
        return Err(ExportError::Inside { path });
    }
    let files = files_of(solution)?;
    let to = free_path(to);
    // One that came there meanwhile is not replaced either.
    let kind = OutputKind { name: "folder of exported maps", marker: None };
    let staged = StagedFolder::create(&to, kind)?;
    for (k, file) in files.iter().enumerate() {
        let name = file.file_name().unwrap_or_default();
        out.tick(k as f64 / files.len() as f64, &name.to_string_lossy());
        let target = staged.path().join(name);
        copy_input(file, &target).map_err(|source| FileError::write(&target, source))?;
    }
    staged.commit()?;
    Ok(to)
}

/// The files of a solution. Folders, pipes and devices that a user put there are not copied.
fn files_of(solution: &Path) -> Result<Vec<PathBuf>, FileError> {
    let failed = |source| FileError::read(solution, source);
    let entries = std::fs::read_dir(solution).map_err(failed)?;
    let mut files = entries
        .map(|entry| Ok(entry.map_err(failed)?.path()))
        .collect::<Result<Vec<_>, FileError>>()?;
    // The copy gets a list of its own.
    let ours = |path: &PathBuf| path.file_name().is_some_and(|name| name == LIST_FILE);
    files.retain(|path| path.is_file() && !ours(path));
    files.sort();
    Ok(files)
}
