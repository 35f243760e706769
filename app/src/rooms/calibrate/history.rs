//! What was before, in dated folders beside the rig: calibrations, each with the pictures it was made from, and pictures that
//! were taken again. Nothing is deleted.

use super::task::Step;
use crate::place::Place;
use std::path::{Path, PathBuf};
use weavelight::files::{FileError, InputKind, copy_input, exchange, read_input};
use weavelight::instrument::{CAMERA_FILE, COLOR_FILE, LIGHTS_FILE};

/// Something that is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its folder's name.
    pub name: String,
    /// What it is.
    pub kept: Kept,
    /// When it was put there, as in `2026-11-22T1648`; a second one of that minute ends in `-2`.
    pub stamp: String,
}

/// What is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// A calibration, with pictures where there were some.
    Calibration,
    /// A step's pictures.
    Pictures(Step),
}

impl Kept {
    const ALL: [Kept; 4] = [
        Kept::Calibration,
        Kept::Pictures(Step::Color),
        Kept::Pictures(Step::Lights),
        Kept::Pictures(Step::Check),
    ];

    /// How its folders' names begin. A camera's pictures are never alone: everything stands in the camera's frame.
    fn prefix(self) -> &'static str {
        match self {
            Kept::Calibration | Kept::Pictures(Step::Camera) => "calibration-",
            Kept::Pictures(Step::Color) => "pictures-color-",
            Kept::Pictures(Step::Lights) => "pictures-lights-",
            Kept::Pictures(Step::Check) => "pictures-check-",
        }
    }
}

impl Entry {
    fn of(name: String) -> Option<Self> {
        let stamp = |kept: Kept| Some((kept, name.strip_prefix(kept.prefix())?.to_owned()));
        let (kept, stamp) = Kept::ALL.into_iter().find_map(stamp)?;
        Some(Self { name, kept, stamp })
    }
}

/// Where all of them are.
pub(super) fn folder(place: &Place) -> PathBuf {
    place.folder.join("history")
}

/// What is kept, the newest first.
pub(super) fn entries(place: &Place) -> Vec<Entry> {
    let found = std::fs::read_dir(folder(place)).into_iter().flatten().flatten();
    let names = found.filter_map(|entry| entry.file_name().into_string().ok());
    let mut entries: Vec<Entry> = names.filter_map(Entry::of).collect();
    entries.sort_unstable_by(|a, b| (&b.stamp, &b.name).cmp(&(&a.stamp, &a.name)));
    entries
}

/// A new entry's folder.
fn new_entry(place: &Place, kept: Kept) -> Result<PathBuf, FileError> {
    let stamp = jiff::Timestamp::now().strftime("%Y-%m-%dT%H%M").to_string();
    let name = |k: usize| match k {
        1 => format!("{}{stamp}", kept.prefix()),
        k => format!("{}{stamp}-{k}", kept.prefix()),
    };
    let free = (1..).map(|k| folder(place).join(name(k))).find(|path| !path.exists());
    let path = free.unwrap_or_else(|| folder(place));
    std::fs::create_dir_all(&path).map_err(|error| FileError::write(&path, error))?;
    Ok(path)
}

/// Puts the pictures of a step away. Where they are now; `None` where there were none.
pub(super) fn put_away(place: &Place, step: Step) -> Result<Option<PathBuf>, FileError> {
    let there = |name: &String| place.targets().join(name).exists();
    let names: Vec<String> = step.folders().into_iter().filter(there).collect();
    if names.is_empty() {
        return Ok(None);
    }
    let entry = new_entry(place, Kept::Pictures(step))?;
    for name in names {
        rename(&place.targets().join(&name), &entry.join(&name))?;
    }
    // Empty, it would say that a calibration has begun.
    let _ = std::fs::remove_dir(place.targets());
    Ok(Some(entry))
}

/// Takes pictures that were put away back, in place of those of the same step. Where those are now.
fn put_back(place: &Place, entry: &Path, step: Step) -> Result<Option<PathBuf>, FileError> {
    let away = put_away(place, step)?;
    let targets = place.targets();
    std::fs::create_dir_all(&targets).map_err(|error| FileError::write(&targets, error))?;
    for name in step.folders().into_iter().filter(|name| entry.join(name).exists()) {
        rename(&entry.join(&name), &targets.join(&name))?;
    }
    // Whatever else somebody put there stays.
    let _ = std::fs::remove_dir(entry);
    Ok(away)
}

/// Keeps a copy of the calibration in use and puts the pictures beside it; what is in use stays in use. Where they are now;
/// `None` where there was nothing.
pub(super) fn keep(place: &Place) -> Result<Option<PathBuf>, FileError> {
    let (calibration, targets) = (place.calibration(), place.targets());
    if !calibration.exists() && !targets.exists() {
        return Ok(None);
    }
    let entry = new_entry(place, Kept::Calibration)?;
    if calibration.exists() {
        copy(&calibration, &entry.join("calibration"))?;
    }
    if targets.exists() {
        rename(&targets, &entry.join("targets"))?;
    }
    Ok(Some(entry))
}

/// Puts pictures that were refused away, where no step looks for them.
pub(super) fn put_refused_away(place: &Place, refused: &Path) -> Result<(), FileError> {
    let home = folder(place);
    std::fs::create_dir_all(&home).map_err(|error| FileError::write(&home, error))?;
    let stamp = jiff::Timestamp::now().strftime("%Y-%m-%dT%H%M");
    let name = |k: usize| home.join(format!("refused-{stamp}-{k}"));
    let free = (1..).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(0));
    rename(refused, &free)
}

/// Takes an earlier calibration back into use, with its pictures, or a step's pictures alone; what they take the place of goes
/// into the history. Where that is now.
pub(super) fn restore(place: &Place, entry: &Entry) -> Result<Option<PathBuf>, FileError> {
    let (kept, entry) = (entry.kept, folder(place).join(&entry.name));
    if let Kept::Pictures(step) = kept {
        return put_back(place, &entry, step);
    }
    let whole = entry.join("calibration");
    if !whole.exists() {
        let what = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(FileError::read(&whole, what));
    }
    let (calibration, targets) = (place.calibration(), place.targets());
    let is_away = calibration.exists() || targets.exists();
    let away = is_away.then(|| new_entry(place, Kept::Calibration)).transpose()?;
    match &away {
        // They change places, so that there is a calibration at any moment.
        Some(away) if calibration.exists() => {
            exchange(&whole, &calibration)
                .map_err(|error| FileError::write(&calibration, error))?;
            rename(&whole, &away.join("calibration"))?;
        }
        _ => rename(&whole, &calibration)?,
    }
    if let Some(away) = away.as_ref().filter(|_| targets.exists()) {
        rename(&targets, &away.join("targets"))?;
    }
    if entry.join("targets").exists() {
        rename(&entry.join("targets"), &targets)?;
    }
    // Whatever else somebody put there stays.
    let _ = std::fs::remove_dir(&entry);
    Ok(away)
}

/// Keeps a copy of the calibration in use before a fit replaces its part of it, unless the history has that part already.
pub(super) fn keep_before(place: &Place, step: Step) -> Result<(), FileError> {
    let Some(part) = part(step) else { return Ok(()) };
    let read = |calibration: &Path| read_input(&calibration.join(part), InputKind::Text).ok();
    let Some(now) = read(&place.calibration()) else { return Ok(()) };
    let kept = |entry: &Entry| {
        read(&folder(place).join(&entry.name).join("calibration")).as_ref() == Some(&now)
    };
    if entries(place).iter().any(kept) {
        return Ok(());
    }
    let entry = new_entry(place, Kept::Calibration)?;
    copy(&place.calibration(), &entry.join("calibration"))
}

/// The file of a calibration that a step writes.
fn part(step: Step) -> Option<&'static str> {
    match step {
        Step::Camera => Some(CAMERA_FILE),
        Step::Color => Some(COLOR_FILE),
        Step::Lights => Some(LIGHTS_FILE),
        Step::Check => None,
    }
}

fn rename(from: &Path, to: &Path) -> Result<(), FileError> {
    std::fs::rename(from, to).map_err(|error| FileError::write(to, error))
}

fn copy(from: &Path, to: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(to).map_err(|error| FileError::write(to, error))?;
    let entries = std::fs::read_dir(from).map_err(|error| FileError::read(from, error))?;
    for entry in entries.flatten() {
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy(&path, &target)?;
        } else {
            copy_input(&path, &target).map_err(|error| FileError::write(&target, error))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight::simulate;

    /// A rig in a folder of its own.
    fn rig(home: &Path) -> Place {
        let options = simulate::Options {
            out: home.join("rig"),
            size_px: Some([32, 32]),
            ..simulate::Options::default()
        };
        simulate::write_rig(&options).unwrap();
        Place::open(&options.out).unwrap()
    }

    fn write(path: &Path, content: &str) {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }

    #[test]
    fn what_is_kept_can_be_restored() {
        let home = tempfile::tempdir().unwrap();
        let place = rig(home.path());
        assert_eq!(keep(&place).unwrap(), None);
        assert!(entries(&place).is_empty(), "nothing to keep");
        let map = place.calibration().join("gain/map");
        let read = || std::fs::read_to_string(&map).unwrap();
        write(&map, "first");
        write(&place.targets().join("board/session.toml"), "");
        assert!(keep(&place).unwrap().is_some());
        assert_eq!(read(), "first", "it stays in use");
        assert!(!place.targets().exists());
        write(&map, "second");
        let first = entries(&place);
        restore(&place, &first[0]).unwrap();
        assert_eq!(read(), "first");
        assert!(place.targets().join("board").exists());
        let second = entries(&place);
        assert_eq!(second.len(), 1, "{second:?}");
        restore(&place, &second[0]).unwrap();
        assert_eq!(read(), "second");
        let gone = Entry::of("calibration-none".to_owned()).unwrap();
        assert!(restore(&place, &gone).is_err());
        assert_eq!(read(), "second");
    }

    #[test]
    fn pictures_that_are_taken_again_are_put_away_and_come_back() {
        let home = tempfile::tempdir().unwrap();
        let place = rig(home.path());
        let picture = |name: &str| place.targets().join(name).join("light-00.dng");
        let read = |name: &str| std::fs::read_to_string(picture(name)).ok();
        assert_eq!(put_away(&place, Step::Lights).unwrap(), None);
        for name in ["grey", "white-flat", "white-tilt-2", "check-tilt"] {
            write(&picture(name), "first");
        }
        let away = put_away(&place, Step::Lights).unwrap().unwrap();
        assert!(away.join("white-tilt-2/light-00.dng").exists());
        let there =
            ["grey", "white-flat", "white-tilt-2", "check-tilt"].map(|name| read(name).is_some());
        assert_eq!(there, [true, false, false, true], "only this step's");
        // Begun again, then thought better of.
        write(&picture("white-raised"), "second");
        let [entry] = entries(&place).try_into().unwrap();
        assert_eq!(entry.kept, Kept::Pictures(Step::Lights));
        assert!(restore(&place, &entry).unwrap().is_some());
        let there = ["white-flat", "white-raised", "white-tilt-2"].map(read);
        assert_eq!(there, [Some("first".to_owned()), None, Some("first".to_owned())]);
        let [entry] = entries(&place).try_into().unwrap();
        restore(&place, &entry).unwrap();
        assert_eq!(read("white-raised"), Some("second".to_owned()));
        for step in [Step::Color, Step::Check] {
            put_away(&place, step).unwrap();
        }
        assert_eq!(entries(&place).len(), 3);
    }

    #[test]
    fn a_fit_leaves_a_copy_of_what_it_writes_over() {
        let home = tempfile::tempdir().unwrap();
        let place = rig(home.path());
        let lights = place.calibration().join(LIGHTS_FILE);
        keep_before(&place, Step::Lights).unwrap();
        assert!(entries(&place).is_empty(), "there is nothing yet");
        write(&lights, "from elsewhere");
        for _ in 0..2 {
            keep_before(&place, Step::Lights).unwrap();
            keep_before(&place, Step::Color).unwrap();
            keep_before(&place, Step::Check).unwrap();
        }
        let [entry] = entries(&place).try_into().unwrap();
        write(&lights, "fitted here");
        restore(&place, &entry).unwrap();
        assert_eq!(std::fs::read_to_string(&lights).unwrap(), "from elsewhere");
        let [entry] = entries(&place).try_into().unwrap();
        restore(&place, &entry).unwrap();
        assert_eq!(std::fs::read_to_string(&lights).unwrap(), "fitted here");
    }

    #[test]
    fn the_newest_is_first_whatever_it_is() {
        let home = tempfile::tempdir().unwrap();
        let place = rig(home.path());
        for name in [
            "calibration-2026-01-02T1000",
            "pictures-check-2026-03-01T0900",
            "calibration-2026-04-01T0900-2",
            "calibration-2026-04-01T0900",
            "notes",
        ] {
            std::fs::create_dir_all(folder(&place).join(name)).unwrap();
        }
        let stamps: Vec<_> = entries(&place).into_iter().map(|entry| entry.stamp).collect();
        assert_eq!(
            stamps,
            ["2026-04-01T0900-2", "2026-04-01T0900", "2026-03-01T0900", "2026-01-02T1000"]
        );
    }
}
