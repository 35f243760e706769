//! What killed runs left beside an output: folders under construction, and outputs that were being replaced.

use super::atomic::parent_of;
use super::exchange::ASIDE;
use super::hidden::{PARTIAL, RANDOM, hidden_name};
use super::lock::Lock;
use super::survey::Survey;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;

/// In a folder under construction: whose it will be. What holds it was never finished.
pub const UNFINISHED: &str = ".weavelight-partial";

/// Puts `target` back if a run was killed while it was being replaced, and takes away what killed runs left beside it: of this
/// output, of which the caller holds the lock, and of others that no running process works on.
pub(super) fn clean(target: &Path) {
    let parent = parent_of(target);
    let name = target.file_name().unwrap_or_default();
    let ours = hidden_name(name, PARTIAL);
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let (found, path) = (entry.file_name(), entry.path());
        if !entry.file_type().is_ok_and(|kind| kind.is_dir()) || !is_partial(&found) {
            continue;
        }
        let is_ours = found.as_encoded_bytes().starts_with(ours.as_encoded_bytes());
        match mark(&path) {
            Some(of) if of == name => remove_unfinished(&path),
            Some(of) => {
                if let Ok(_lock) = Lock::beside(&parent.join(of), "clean") {
                    remove_unfinished(&path);
                }
            }
            None if is_ours && found.as_encoded_bytes().ends_with(ASIDE.as_bytes()) => {
                put_back(&path, target);
            }
            None if is_ours && is_just_begun(&path) => remove_unfinished(&path),
            None if is_ours => remove_replaced(&path),
            None => {}
        }
    }
}

/// Whether the run was killed between making the mark and writing into it: nothing else is there yet.
fn is_just_begun(path: &Path) -> bool {
    let mut entries = fs::read_dir(path).into_iter().flatten();
    let only = (entries.next(), entries.next());
    matches!(only, (Some(Ok(mark)), None)
        if mark.file_name() == UNFINISHED && mark.metadata().is_ok_and(|data| data.len() == 0))
}

/// It was never anybody's: nothing is lost with it. The mark goes last: killed in between, the next run still knows it.
fn remove_unfinished(path: &Path) {
    for entry in fs::read_dir(path).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let _ = match entry.file_name() == UNFINISHED {
            true => Ok(()),
            false if is_folder => fs::remove_dir_all(entry.path()),
            false => fs::remove_file(entry.path()),
        };
    }
    let _ = fs::remove_dir_all(path);
}

fn put_back(aside: &Path, target: &Path) {
    if fs::symlink_metadata(target).is_err() {
        let _ = fs::rename(aside, target);
    } else {
        remove_replaced(aside);
    }
}

/// An output that another one took the place of, or an empty folder. Whatever in it is not the program's stays.
fn remove_replaced(path: &Path) {
    if let Ok(Some(survey)) = Survey::of(path, None)
        && survey.foreign.is_empty()
    {
        survey.delete(path);
    }
}

/// The name of the output that an unfinished folder was for.
fn mark(path: &Path) -> Option<OsString> {
    let text = fs::read(path.join(UNFINISHED)).ok()?;
    let name = name_of(text)?;
    (Path::new(&name).file_name() == Some(&*name)).then_some(name)
}

#[cfg(unix)]
fn name_of(text: Vec<u8>) -> Option<OsString> {
    Some(std::os::unix::ffi::OsStringExt::from_vec(text))
}

#[cfg(not(unix))]
fn name_of(text: Vec<u8>) -> Option<OsString> {
    String::from_utf8(text).ok().map(OsString::from)
}

/// `.NAME.partial-` and six letters or digits, and perhaps the ending of what was set aside.
fn is_partial(name: &OsStr) -> bool {
    let name = name.as_encoded_bytes();
    let name = name.strip_suffix(ASIDE.as_bytes()).unwrap_or(name);
    let Some((start, random)) = name.split_at_checked(name.len().wrapping_sub(RANDOM)) else {
        return false;
    };
    name.starts_with(b".")
        && start.ends_with(PARTIAL.as_bytes())
        && random.iter().all(u8::is_ascii_alphanumeric)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::file_list::FileList;

    fn folder(path: &Path, files: &[(&str, &str)]) {
        fs::create_dir(path).unwrap();
        for (name, content) in files {
            fs::write(path.join(name), content).unwrap();
        }
    }

    #[test]
    fn unfinished_and_replaced_outputs_go_and_nothing_else() {
        let home = tempfile::tempdir().unwrap();
        let at = |name: &str| home.path().join(name);
        folder(&at(".out.partial-abc123"), &[(UNFINISHED, "out"), ("normal.exr", "half")]);
        folder(&at(".out.partial-abc124"), &[]);
        folder(&at(".out.partial-abc130"), &[(UNFINISHED, "")]);
        folder(&at(".other.partial-abc125"), &[(UNFINISHED, "other"), ("x", "half")]);
        folder(&at(".out.partial-abc126"), &[("normal.exr", "old")]);
        FileList::of(&at(".out.partial-abc126"), &[])
            .unwrap()
            .write(&at(".out.partial-abc126"))
            .unwrap();
        // Under its name by chance, or edited, or being written.
        folder(&at(".out.partial-abc127"), &[("notes.txt", "mine")]);
        folder(&at(".out.partial-abc131"), &[(UNFINISHED, ""), ("notes.txt", "mine")]);
        folder(&at(".out.partial-abc128"), &[("normal.exr", "old")]);
        FileList::of(&at(".out.partial-abc128"), &[])
            .unwrap()
            .write(&at(".out.partial-abc128"))
            .unwrap();
        fs::write(at(".out.partial-abc128/normal.exr"), "edited").unwrap();
        folder(&at(".busy.partial-abc129"), &[(UNFINISHED, "busy")]);
        let lock = Lock::beside(&at("busy"), "test").unwrap();
        clean(&at("out"));
        drop(lock);
        let mut names: Vec<_> =
            fs::read_dir(home.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(
            names,
            [
                ".busy.partial-abc129",
                ".out.partial-abc127",
                ".out.partial-abc128",
                ".out.partial-abc131"
            ]
        );
    }

    #[test]
    fn what_was_set_aside_comes_back() {
        let home = tempfile::tempdir().unwrap();
        let (target, aside) =
            (home.path().join("out"), home.path().join(".out.partial-abc123.old"));
        folder(&aside, &[("normal.exr", "old")]);
        folder(&home.path().join(".out.partial-abc123"), &[(UNFINISHED, "out")]);
        clean(&target);
        assert_eq!(fs::read_to_string(target.join("normal.exr")).unwrap(), "old");
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
    }
}
