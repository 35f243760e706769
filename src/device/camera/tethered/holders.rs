//! Which program may be holding the camera: desktop environments take hold of every camera that is plugged in.

use std::fs;
use std::path::Path;

/// Programs that hold cameras, as the kernel abbreviates their names to 15 characters.
const HOLDERS: [&str; 12] = [
    "gvfsd-gphoto2",
    "gvfs-gphoto2-vo",
    "gvfsd-mtp",
    "gvfs-mtp-volume",
    "kiod5",
    "kiod6",
    "gphoto2",
    "darktable",
    "digikam",
    "entangle",
    "shotwell",
    "rapid-photo-dow",
];

/// One that is running, if any.
pub(super) fn holder() -> Option<String> {
    holder_in(Path::new("/proc"))
}

fn holder_in(processes: &Path) -> Option<String> {
    let names: Vec<String> = fs::read_dir(processes)
        .ok()?
        .filter_map(Result::ok)
        .filter_map(|process| fs::read_to_string(process.path().join("comm")).ok())
        .map(|name| name.trim().to_owned())
        .collect();
    HOLDERS
        .iter()
        .find(|holder| names.iter().any(|name| name == *holder))
        .map(|name| (*name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_holder_is_found_among_the_processes() {
        let processes = tempfile::tempdir().unwrap();
        let check = |expected: Option<&str>| {
            assert_eq!(holder_in(processes.path()).as_deref(), expected);
        };
        let add = |id: &str, name: &str| {
            fs::create_dir(processes.path().join(id)).unwrap();
            fs::write(processes.path().join(id).join("comm"), format!("{name}\n")).unwrap();
        };
        check(None);
        add("1", "systemd");
        check(None);
        add("70", "gvfsd-gphoto2");
        check(Some("gvfsd-gphoto2"));
        assert_eq!(holder_in(Path::new("/nowhere")), None);
    }
}
