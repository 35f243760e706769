//! Which other program works with a rig or a scan.

use std::path::Path;
use weavelight::files::Lock;

/// Which other program holds a path, in words.
pub(crate) fn holder(path: &Path) -> Option<String> {
    Lock::holder(path).filter(|holder| !holder.is_this_process()).map(|holder| holder.to_string())
}
