use std::path::{Component, Path, PathBuf};

/// A file name that a manifest gives and that stays inside the manifest's folder.
///
/// # Errors
/// What is wrong with it and what to write, to follow the key's name.
pub fn inside_folder(name: &str) -> Result<PathBuf, String> {
    let path = Path::new(name);
    let plain =
        path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if name.is_empty()
        || name.contains(['\\', '\0', '\n', '\r'])
        || !plain
        || path.file_name().is_none()
    {
        return Err(format!(
            "is {name:?}; name a file inside this folder, without .. or a leading /"
        ));
    }
    Ok(path.to_owned())
}
