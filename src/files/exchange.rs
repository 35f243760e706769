//! Two folders change places.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// What the earlier folder is named while the file system cannot exchange two names at once.
pub(super) const ASIDE: &str = ".old";

/// Where `target` stands for a moment while `partial` takes its name.
pub(super) fn aside(partial: &Path) -> PathBuf {
    let mut name = partial.file_name().unwrap_or_default().to_owned();
    name.push(ASIDE);
    partial.with_file_name(name)
}

/// Gives the folder `partial` the name of `target` and the other way round: in one step where the file system can, so that under
/// the name of `target` there is always one of the two.
///
/// # Errors
/// Where one of them is not there, or may not be renamed.
pub fn exchange(partial: &Path, target: &Path) -> io::Result<()> {
    match at_once(partial, target) {
        Err(error) if is_unknown(&error) => step_by_step(partial, target),
        result => result,
    }
}

#[cfg(any(target_os = "linux", target_os = "macos"))]
fn at_once(partial: &Path, target: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, partial, CWD, target, RenameFlags::EXCHANGE).map_err(io::Error::from)
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
fn at_once(_partial: &Path, _target: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Old kernels, network disks and FUSE know no exchange.
fn is_unknown(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::InvalidInput)
}

/// Killed on the way, the next run finds the earlier folder under its name aside, and puts it back.
pub(super) fn step_by_step(partial: &Path, target: &Path) -> io::Result<()> {
    let aside = aside(partial);
    fs::rename(target, &aside)?;
    if let Err(error) = fs::rename(partial, target) {
        fs::rename(&aside, target)?;
        return Err(error);
    }
    fs::rename(&aside, partial)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_come_to_the_same() {
        for way in [exchange, step_by_step] {
            let home = tempfile::tempdir().unwrap();
            let (partial, target) = (home.path().join("partial"), home.path().join("target"));
            for folder in [&partial, &target] {
                fs::create_dir(folder).unwrap();
                fs::write(folder.join("name"), folder.to_str().unwrap()).unwrap();
            }
            way(&partial, &target).unwrap();
            assert!(fs::read_to_string(target.join("name")).unwrap().ends_with("partial"));
            assert!(fs::read_to_string(partial.join("name")).unwrap().ends_with("target"));
            assert_eq!(fs::read_dir(home.path()).unwrap().count(), 2);
        }
    }
}
