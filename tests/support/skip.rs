//! What a test needs beyond this repository. A test fails where that is missing, unless `WEAVELIGHT_SKIP` names it: a list of
//! `data` (real pictures), `board` (the simulated light board), `window` (Xvfb and its tools), `mount` and `unshare` (the right to mount
//! disks, and to do so in a namespace of one's own).

use std::path::{Path, PathBuf};

/// What was found; `None` where it is missing and `WEAVELIGHT_SKIP` names `part`.
pub fn need<T>(part: &str, found: Result<T, String>) -> Option<T> {
    match found {
        Ok(found) => Some(found),
        Err(missing) => {
            let skipped = std::env::var("WEAVELIGHT_SKIP").unwrap_or_default();
            let skips = skipped.split(',').any(|name| name.trim() == part);
            assert!(skips, "{missing}; WEAVELIGHT_SKIP={part} skips this test");
            println!("skipped: {missing}");
            None
        }
    }
}

/// A file or folder of the real pictures: below `WEAVELIGHT_DATA`, else `../shared/data` beside `root`.
pub fn real_pictures(root: &str, name: &str) -> Option<PathBuf> {
    let beside = || Path::new(root).join("../shared/data");
    let path = std::env::var_os("WEAVELIGHT_DATA").map_or_else(beside, PathBuf::from).join(name);
    let found = path.exists().then(|| path.clone());
    need("data", found.ok_or_else(|| format!("{} is missing; set WEAVELIGHT_DATA", path.display())))
}
