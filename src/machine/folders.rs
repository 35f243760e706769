//! Where the user's desktop keeps a program's files (XDG base directories).

use etcetera::base_strategy::{BaseStrategy, Xdg};
use std::path::PathBuf;

/// What the program calls its folders.
const NAME: &str = "weavelight";

/// For settings, as in `~/.config/weavelight`; `None` where the user has no home.
pub fn config_folder() -> Option<PathBuf> {
    Some(Xdg::new().ok()?.config_dir().join(NAME))
}

/// For what can be made again, as in `~/.cache/weavelight`; `None` where the user has no home.
pub fn cache_folder() -> Option<PathBuf> {
    Some(Xdg::new().ok()?.cache_dir().join(NAME))
}

/// For what outlives a run, as in `~/.local/state/weavelight`; `None` where the user has no home.
pub fn state_folder() -> Option<PathBuf> {
    Some(Xdg::new().ok()?.state_dir()?.join(NAME))
}
