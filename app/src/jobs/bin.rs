//! The system's bin: folders go there and come back as one.

use crate::jobs::holder::holder;
use std::path::PathBuf;

/// Folders that are in the bin, and how to find them there again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BinnedFolders {
    /// Where they lay.
    pub folders: Vec<PathBuf>,
    items: Vec<trash::TrashItem>,
}

/// Why it failed.
#[derive(Debug, thiserror::Error)]
pub enum BinError {
    /// There is no bin for this disk, or it cannot be written.
    #[error("{folder} cannot be moved to the system's bin: {why}")]
    NoBin {
        /// The folder.
        folder: String,
        /// The system's words.
        why: String,
    },
    /// Another program works with it.
    #[error("{folder} is in use by {holder}; wait until that is done, or stop it")]
    InUse {
        /// The folder.
        folder: String,
        /// Who, in words.
        holder: String,
    },
    /// Something stands where a folder is to come back to.
    #[error("{folder} is there again; delete or rename that one first")]
    InTheWay {
        /// The folder.
        folder: String,
    },
    /// It was emptied, or is another system's.
    #[error("{folder} is not in the system's bin any more")]
    Gone {
        /// The folder.
        folder: String,
    },
    /// The system does not give it back.
    #[error("{folder} does not come back out of the system's bin: {why}; look for it there")]
    Stuck {
        /// The folder.
        folder: String,
        /// The system's words.
        why: String,
    },
}

impl BinnedFolders {
    /// Moves folders to the bin: all that are there, or none.
    ///
    /// # Errors
    /// Where another program works with one of them, or the system does not take it; those before it are back then.
    pub fn put(folders: impl IntoIterator<Item = PathBuf>) -> Result<Self, BinError> {
        let folders: Vec<PathBuf> = folders.into_iter().collect();
        let held = |folder: &PathBuf| Some((folder.display().to_string(), holder(folder)?));
        if let Some((folder, holder)) = folders.iter().find_map(held) {
            return Err(BinError::InUse { folder, holder });
        }
        let mut binned = Self { folders: Vec::new(), items: Vec::new() };
        for folder in folders.into_iter().filter(|folder| folder.symlink_metadata().is_ok()) {
            let before = ids();
            let done = trash::delete(&folder);
            binned.items.extend(listed().into_iter().filter(|item| !before.contains(&item.id)));
            if let Err(error) = done {
                let (folder, why) = (folder.display().to_string(), error.to_string());
                // What comes back or not, the first error is the one to mend.
                let _ = binned.bring_back();
                return Err(BinError::NoBin { folder, why });
            }
            binned.folders.push(folder);
        }
        // Another program may have deleted something in the same moment.
        binned.items.retain(|item| {
            let name = |folder: &PathBuf| folder.file_name() == Some(&item.name);
            binned.folders.iter().any(name)
        });
        Ok(binned)
    }

    /// Takes them out again, to where they lay.
    ///
    /// # Errors
    /// Where something else is there by now, or they are not in the bin any more.
    pub fn bring_back(&self) -> Result<(), BinError> {
        let Some(first) = self.folders.first().map(|folder| folder.display().to_string()) else {
            return Ok(());
        };
        if let Some(there) = self.folders.iter().find(|folder| folder.symlink_metadata().is_ok()) {
            return Err(BinError::InTheWay { folder: there.display().to_string() });
        }
        let still = ids();
        if self.items.is_empty() || !self.items.iter().all(|item| still.contains(&item.id)) {
            return Err(BinError::Gone { folder: first });
        }
        for parent in self.folders.iter().filter_map(|folder| folder.parent()) {
            // Where it cannot be made, the system says so.
            let _ = std::fs::create_dir_all(parent);
        }
        restore(self.items.clone())
            .map_err(|error| BinError::Stuck { folder: first, why: error.to_string() })
    }
}

fn ids() -> Vec<std::ffi::OsString> {
    listed().into_iter().map(|item| item.id).collect()
}

/// What is in the bin.
#[cfg(not(target_os = "macos"))]
fn listed() -> Vec<trash::TrashItem> {
    trash::os_limited::list().unwrap_or_default()
}

#[cfg(not(target_os = "macos"))]
fn restore(items: Vec<trash::TrashItem>) -> Result<(), trash::Error> {
    trash::os_limited::restore_all(items)
}

/// There no program may look into the bin; the Finder puts things back.
#[cfg(target_os = "macos")]
fn listed() -> Vec<trash::TrashItem> {
    Vec::new()
}

#[cfg(target_os = "macos")]
fn restore(_items: Vec<trash::TrashItem>) -> Result<(), trash::Error> {
    Err(trash::Error::Unknown { description: "it can be put back in the Finder".into() })
}

#[cfg(all(test, not(target_os = "macos")))]
#[allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]
mod tests {
    use super::*;
    use std::path::Path;

    fn write(folder: &Path, text: &str) {
        std::fs::create_dir_all(folder).unwrap();
        std::fs::write(folder.join("file"), text).unwrap();
    }

    fn read(folder: &Path) -> Option<String> {
        std::fs::read_to_string(folder.join("file")).ok()
    }

    /// The same place twice, within a second: each one comes back as what it was.
    #[test]
    fn two_of_one_name_are_told_apart() {
        let home = tempfile::tempdir().unwrap();
        let (scan, solution) = (home.path().join("scans/a"), home.path().join("solutions/a"));
        let put = |text: &str| {
            write(&scan, text);
            write(&solution, text);
            BinnedFolders::put([scan.clone(), solution.clone(), home.path().join("not there")])
                .unwrap()
        };
        let (first, second) = (put("first"), put("second"));
        assert_eq!((first.folders.len(), read(&scan)), (2, None));
        first.bring_back().unwrap();
        assert_eq!([read(&scan), read(&solution)], [Some("first".into()), Some("first".into())]);
        let error = second.bring_back().unwrap_err().to_string();
        assert!(error.contains("scans/a is there again; delete or rename"), "{error}");
        assert_eq!(read(&scan).as_deref(), Some("first"));
        std::fs::remove_dir_all(home.path().join("scans")).unwrap();
        std::fs::remove_dir_all(&solution).unwrap();
        second.bring_back().unwrap();
        assert_eq!(read(&scan).as_deref(), Some("second"));
        let error = first.bring_back().unwrap_err().to_string();
        assert!(error.contains("there again"), "{error}");
        std::fs::remove_dir_all(&scan).unwrap();
        std::fs::remove_dir_all(&solution).unwrap();
        assert!(first.bring_back().unwrap_err().to_string().contains("not in the system's bin"));
    }
}
