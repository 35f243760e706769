//! Earlier calibrations: dated folders beside the rig, each with the calibration and the pictures it was made from.

use crate::place::Place;
use std::path::{Path, PathBuf};
use weavelight::files::FileError;

const PREFIX: &str = "calibration-";

fn folder(place: &Place) -> PathBuf {
    place.folder.join("history")
}

/// Their names, the newest first.
pub(super) fn entries(place: &Place) -> Vec<String> {
    let found = std::fs::read_dir(folder(place)).into_iter().flatten().flatten();
    let names = found.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| name.starts_with(PREFIX)).collect();
    names.sort_unstable_by(|a, b| b.cmp(a));
    names
}

/// A new entry's folder.
fn new_entry(place: &Place) -> Result<PathBuf, FileError> {
    let stamp = jiff::Timestamp::now().strftime("%Y-%m-%dT%H%M").to_string();
    let name = |k: usize| match k {
        1 => format!("{PREFIX}{stamp}"),
        k => format!("{PREFIX}{stamp}-{k}"),
    };
    let free = (1..).map(|k| folder(place).join(name(k))).find(|path| !path.exists());
    let path = free.unwrap_or_else(|| folder(place));
    std::fs::create_dir_all(&path).map_err(|error| FileError::write(&path, error))?;
    Ok(path)
}

/// Keeps a copy of the calibration in use and puts the pictures beside it; what is in use stays in use.
pub(super) fn keep(place: &Place) -> Result<(), FileError> {
    let (calibration, targets) = (place.calibration(), place.targets());
    if !calibration.exists() && !targets.exists() {
        return Ok(());
    }
    let entry = new_entry(place)?;
    if calibration.exists() {
        copy(&calibration, &entry.join("calibration"))?;
    }
    if targets.exists() {
        rename(&targets, &entry.join("targets"))?;
    }
    Ok(())
}

/// Takes an earlier calibration back into use, with its pictures; what is in use goes into the history.
pub(super) fn restore(place: &Place, name: &str) -> Result<(), FileError> {
    let entry = folder(place).join(name);
    let whole = entry.join("calibration");
    if !whole.exists() {
        let what = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(FileError::read(&whole, what));
    }
    keep(place)?;
    let (calibration, aside) = (place.calibration(), place.folder.join(".calibration-before"));
    if calibration.exists() {
        rename(&calibration, &aside)?;
    }
    rename(&whole, &calibration)?;
    if entry.join("targets").exists() {
        rename(&entry.join("targets"), &place.targets())?;
    }
    // A copy is in the history, and the entry is empty: what cannot be removed is only litter.
    let _ = std::fs::remove_dir_all(&aside);
    let _ = std::fs::remove_dir(&entry);
    Ok(())
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
            std::fs::copy(&path, &target).map_err(|error| FileError::write(&target, error))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight::simulate;

    #[test]
    fn what_is_kept_can_be_restored() {
        let home = tempfile::tempdir().unwrap();
        let options = simulate::Options {
            out: home.path().join("rig"),
            size_px: Some([32, 32]),
            ..simulate::Options::default()
        };
        simulate::write_rig(&options).unwrap();
        let place = Place::open(&options.out).unwrap();
        keep(&place).unwrap();
        assert!(entries(&place).is_empty(), "nothing to keep");
        let write = |content: &str| {
            std::fs::create_dir_all(place.calibration().join("gain")).unwrap();
            std::fs::write(place.calibration().join("gain/map"), content).unwrap();
            std::fs::create_dir_all(place.targets().join("board")).unwrap();
        };
        let read = || std::fs::read_to_string(place.calibration().join("gain/map")).unwrap();
        write("first");
        keep(&place).unwrap();
        assert_eq!(read(), "first", "it stays in use");
        assert!(!place.targets().exists());
        write("second");
        let first = entries(&place);
        restore(&place, &first[0]).unwrap();
        assert_eq!(read(), "first");
        assert!(place.targets().join("board").exists());
        let second = entries(&place);
        assert_eq!(second.len(), 1, "{second:?}");
        restore(&place, &second[0]).unwrap();
        assert_eq!(read(), "second");
        assert!(restore(&place, "calibration-none").is_err());
        assert_eq!(read(), "second");
    }
}
