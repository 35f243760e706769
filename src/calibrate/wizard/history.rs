//! Earlier calibrations with their pictures, and pictures that were taken again, in dated folders of the rig. Nothing is
//! deleted.

use super::rig_folder::RigFolder;
use super::task::Step;
use crate::files::{FileError, InputKind, copy_input, exchange, read_input};
use crate::instrument::{CAMERA_FILE, COLOR_FILE, LIGHTS_FILE};
use std::path::{Path, PathBuf};

/// A folder of the history.
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

/// What is kept, the newest first.
pub fn entries(home: &RigFolder) -> Vec<Entry> {
    let found = std::fs::read_dir(home.history()).into_iter().flatten().flatten();
    let names = found.filter_map(|entry| entry.file_name().into_string().ok());
    let mut entries: Vec<Entry> = names.filter_map(Entry::of).collect();
    entries.sort_unstable_by(|a, b| (&b.stamp, &b.name).cmp(&(&a.stamp, &a.name)));
    entries
}

/// A new entry's folder.
fn new_entry(home: &RigFolder, kept: Kept) -> Result<PathBuf, FileError> {
    let stamp = jiff::Timestamp::now().strftime("%Y-%m-%dT%H%M").to_string();
    let name = |k: usize| match k {
        1 => format!("{}{stamp}", kept.prefix()),
        k => format!("{}{stamp}-{k}", kept.prefix()),
    };
    let free = (1..).map(|k| home.history().join(name(k))).find(|path| !path.exists());
    let path = free.unwrap_or_else(|| home.history());
    std::fs::create_dir_all(&path).map_err(|error| FileError::write(&path, error))?;
    Ok(path)
}

/// Moves the pictures of a step to the history and returns their new folder; `None` where there were none.
///
/// # Errors
/// Where they cannot be moved.
pub fn put_away(home: &RigFolder, step: Step) -> Result<Option<PathBuf>, FileError> {
    let there = |name: &String| home.targets().join(name).exists();
    let names: Vec<String> = step.folders().into_iter().filter(there).collect();
    if names.is_empty() {
        return Ok(None);
    }
    let entry = new_entry(home, Kept::Pictures(step))?;
    for name in names {
        rename(&home.targets().join(&name), &entry.join(&name))?;
    }
    // Empty, it would say that a calibration has begun.
    let _ = std::fs::remove_dir(home.targets());
    Ok(Some(entry))
}

/// Brings back pictures of a step; returns where the pictures that they replace are now.
fn put_back(home: &RigFolder, entry: &Path, step: Step) -> Result<Option<PathBuf>, FileError> {
    let away = put_away(home, step)?;
    let targets = home.targets();
    std::fs::create_dir_all(&targets).map_err(|error| FileError::write(&targets, error))?;
    for name in step.folders().into_iter().filter(|name| entry.join(name).exists()) {
        rename(&entry.join(&name), &targets.join(&name))?;
    }
    // Other files in the folder stay.
    let _ = std::fs::remove_dir(entry);
    Ok(away)
}

/// Copies the calibration in use to the history and moves its pictures there; the calibration stays in use. Returns the new
/// folder; `None` where there was nothing.
///
/// # Errors
/// Where that cannot be written.
pub fn keep(home: &RigFolder) -> Result<Option<PathBuf>, FileError> {
    let (calibration, targets) = (home.calibration(), home.targets());
    if !calibration.exists() && !targets.exists() {
        return Ok(None);
    }
    let entry = new_entry(home, Kept::Calibration)?;
    if calibration.exists() {
        copy(&calibration, &entry.join("calibration"))?;
    }
    if targets.exists() {
        rename(&targets, &entry.join("targets"))?;
    }
    Ok(Some(entry))
}

/// Moves pictures that were refused to the history, where no step looks for them.
///
/// # Errors
/// Where they cannot be moved.
pub fn put_refused_away(home: &RigFolder, refused: &Path) -> Result<(), FileError> {
    let home = home.history();
    std::fs::create_dir_all(&home).map_err(|error| FileError::write(&home, error))?;
    let stamp = jiff::Timestamp::now().strftime("%Y-%m-%dT%H%M");
    let name = |k: usize| home.join(format!("refused-{stamp}-{k}"));
    let free = (1..).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(0));
    rename(refused, &free)
}

/// Brings back an earlier calibration with its pictures, or the pictures of a step. What they replace goes into the history;
/// returns where that is now.
///
/// # Errors
/// Where the entry is gone or cannot be moved.
pub fn restore(home: &RigFolder, entry: &Entry) -> Result<Option<PathBuf>, FileError> {
    let (kept, entry) = (entry.kept, home.history().join(&entry.name));
    if let Kept::Pictures(step) = kept {
        return put_back(home, &entry, step);
    }
    let whole = entry.join("calibration");
    if !whole.exists() {
        let what = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(FileError::read(&whole, what));
    }
    let (calibration, targets) = (home.calibration(), home.targets());
    let is_away = calibration.exists() || targets.exists();
    let away = is_away.then(|| new_entry(home, Kept::Calibration)).transpose()?;
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
    // Other files in the folder stay.
    let _ = std::fs::remove_dir(&entry);
    Ok(away)
}

/// Copies the calibration in use to the history before a fit replaces a part of it, unless the history has that part already.
///
/// # Errors
/// Where that cannot be written.
pub fn keep_before(home: &RigFolder, step: Step) -> Result<(), FileError> {
    let Some(part) = part(step) else { return Ok(()) };
    let read = |calibration: &Path| read_input(&calibration.join(part), InputKind::Text).ok();
    let Some(now) = read(&home.calibration()) else { return Ok(()) };
    let kept = |entry: &Entry| {
        read(&home.history().join(&entry.name).join("calibration")).as_ref() == Some(&now)
    };
    if entries(home).iter().any(kept) {
        return Ok(());
    }
    let entry = new_entry(home, Kept::Calibration)?;
    copy(&home.calibration(), &entry.join("calibration"))
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
    use crate::simulate;

    /// A rig in a folder of its own.
    fn rig(home: &Path) -> RigFolder {
        let options = simulate::Options {
            out: home.join("rig"),
            size_px: Some([32, 32]),
            ..simulate::Options::default()
        };
        simulate::write_rig(&options).unwrap();
        RigFolder::open(&options.out).unwrap()
    }

    fn write(path: &Path, content: &str) {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }

    #[test]
    fn what_is_kept_can_be_restored() {
        let home = tempfile::tempdir().unwrap();
        let home = rig(home.path());
        assert_eq!(keep(&home).unwrap(), None);
        assert!(entries(&home).is_empty(), "nothing to keep");
        let map = home.calibration().join("gain/map");
        let read = || std::fs::read_to_string(&map).unwrap();
        write(&map, "first");
        write(&home.targets().join("board/session.toml"), "");
        assert!(keep(&home).unwrap().is_some());
        assert_eq!(read(), "first", "it stays in use");
        assert!(!home.targets().exists());
        write(&map, "second");
        let first = entries(&home);
        restore(&home, &first[0]).unwrap();
        assert_eq!(read(), "first");
        assert!(home.targets().join("board").exists());
        let second = entries(&home);
        assert_eq!(second.len(), 1, "{second:?}");
        restore(&home, &second[0]).unwrap();
        assert_eq!(read(), "second");
        let gone = Entry::of("calibration-none".to_owned()).unwrap();
        assert!(restore(&home, &gone).is_err());
        assert_eq!(read(), "second");
    }

    #[test]
    fn pictures_that_are_taken_again_are_put_away_and_come_back() {
        let home = tempfile::tempdir().unwrap();
        let home = rig(home.path());
        let picture = |name: &str| home.targets().join(name).join("light-00.dng");
        let read = |name: &str| std::fs::read_to_string(picture(name)).ok();
        assert_eq!(put_away(&home, Step::Lights).unwrap(), None);
        for name in ["grey", "white-flat", "white-tilt-2", "check-tilt"] {
            write(&picture(name), "first");
        }
        let away = put_away(&home, Step::Lights).unwrap().unwrap();
        assert!(away.join("white-tilt-2/light-00.dng").exists());
        let there =
            ["grey", "white-flat", "white-tilt-2", "check-tilt"].map(|name| read(name).is_some());
        assert_eq!(there, [true, false, false, true], "only this step's");
        // Taken again, then the first ones are wanted back.
        write(&picture("white-raised"), "second");
        let [entry] = entries(&home).try_into().unwrap();
        assert_eq!(entry.kept, Kept::Pictures(Step::Lights));
        assert!(restore(&home, &entry).unwrap().is_some());
        let there = ["white-flat", "white-raised", "white-tilt-2"].map(read);
        assert_eq!(there, [Some("first".to_owned()), None, Some("first".to_owned())]);
        let [entry] = entries(&home).try_into().unwrap();
        restore(&home, &entry).unwrap();
        assert_eq!(read("white-raised"), Some("second".to_owned()));
        for step in [Step::Color, Step::Check] {
            put_away(&home, step).unwrap();
        }
        assert_eq!(entries(&home).len(), 3);
    }

    #[test]
    fn a_fit_leaves_a_copy_of_what_it_writes_over() {
        let home = tempfile::tempdir().unwrap();
        let home = rig(home.path());
        let lights = home.calibration().join(LIGHTS_FILE);
        keep_before(&home, Step::Lights).unwrap();
        assert!(entries(&home).is_empty(), "there is nothing yet");
        write(&lights, "from elsewhere");
        for _ in 0..2 {
            keep_before(&home, Step::Lights).unwrap();
            keep_before(&home, Step::Color).unwrap();
            keep_before(&home, Step::Check).unwrap();
        }
        let [entry] = entries(&home).try_into().unwrap();
        write(&lights, "fitted here");
        restore(&home, &entry).unwrap();
        assert_eq!(std::fs::read_to_string(&lights).unwrap(), "from elsewhere");
        let [entry] = entries(&home).try_into().unwrap();
        restore(&home, &entry).unwrap();
        assert_eq!(std::fs::read_to_string(&lights).unwrap(), "fitted here");
    }

    #[test]
    fn the_newest_is_first_whatever_it_is() {
        let home = tempfile::tempdir().unwrap();
        let home = rig(home.path());
        for name in [
            "calibration-2026-01-02T1000",
            "pictures-check-2026-03-01T0900",
            "calibration-2026-04-01T0900-2",
            "calibration-2026-04-01T0900",
            "notes",
        ] {
            std::fs::create_dir_all(home.history().join(name)).unwrap();
        }
        let stamps: Vec<_> = entries(&home).into_iter().map(|entry| entry.stamp).collect();
        assert_eq!(
            stamps,
            ["2026-04-01T0900-2", "2026-04-01T0900", "2026-03-01T0900", "2026-01-02T1000"]
        );
    }
}
