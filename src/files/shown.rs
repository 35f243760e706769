use super::hidden::{PARTIAL, RANDOM};
use std::ffi::{OsStr, OsString};
use std::path::{Component, Path, PathBuf};

/// Where a camera saves in a capture session while a scan runs; see [`shown`].
pub const WORK_FOLDER: &str = ".incoming";

/// A path for a message: without the hidden folder that a file is written in until its final place is ready for it.
/// `.maps.partial-a1b2c3/normal.exr` is `maps/normal.exr` to its user.
pub fn shown(path: &Path) -> PathBuf {
    let parts: Vec<Component> = path.components().collect();
    let at_work = parts.len().checked_sub(2).filter(|k| parts[*k].as_os_str() == WORK_FOLDER);
    let kept = parts.iter().enumerate().filter(|(k, _)| Some(*k) != at_work);
    kept.map(|(_, part)| part)
        .map(|part| match part {
            Component::Normal(name) => final_name(name).unwrap_or_else(|| (*name).to_owned()),
            other => other.as_os_str().to_owned(),
        })
        .collect()
}

/// The name of the output that a folder of this name is under construction for.
fn final_name(name: &OsStr) -> Option<OsString> {
    let text = name.to_str()?;
    let (start, random) = text.split_at_checked(text.len().checked_sub(RANDOM)?)?;
    let name = start.strip_prefix('.')?.strip_suffix(PARTIAL)?;
    let is_ours = !name.is_empty() && random.bytes().all(|byte| byte.is_ascii_alphanumeric());
    is_ours.then(|| name.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_final_place_is_shown() {
        let cases = [
            ("/a/.maps.partial-a1b2c3/normal.exr", "/a/maps/normal.exr"),
            ("/a/.rig.partial-a1b2c3/swatch/x.dng", "/a/rig/swatch/x.dng"),
            ("linen/.incoming/DSC_1.NEF", "linen/DSC_1.NEF"),
            ("/a/.maps.partial-a1b2/normal.exr", "/a/.maps.partial-a1b2/normal.exr"),
            ("./maps/normal.exr", "./maps/normal.exr"),
            ("../x/.hidden", "../x/.hidden"),
            (".partial-a1b2c3", ".partial-a1b2c3"),
        ];
        for (path, expected) in cases {
            assert_eq!(shown(Path::new(path)), PathBuf::from(expected), "{path}");
        }
    }
}
