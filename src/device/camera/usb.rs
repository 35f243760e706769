//! Cameras on the USB as Linux shows them, for `doctor`: without opening any.

use super::CameraError;
use crate::files::read_input_text;
use std::fs;
use std::path::{Path, PathBuf};

/// USB's class of still-image devices: cameras that speak PTP.
const STILL_IMAGE: &str = "06";

/// A camera on the USB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsbCamera {
    /// Maker and model as the camera says.
    pub name: String,
    /// Its device file.
    pub device: PathBuf,
    /// A program that has it open, where that can be seen.
    pub held_by: Option<String>,
    /// Whether this user may open it.
    pub permitted: bool,
}

impl UsbCamera {
    /// Why it cannot be used.
    pub fn problem(&self) -> Option<CameraError> {
        if !self.permitted {
            Some(CameraError::Permission)
        } else {
            self.held_by.clone().map(|by| CameraError::Claimed { by: Some(by) })
        }
    }
}

/// Every camera on the USB, by name; empty on systems that do not show them.
pub fn usb_cameras() -> Vec<UsbCamera> {
    cameras_in(Path::new("/sys/bus/usb/devices"), Path::new("/dev/bus/usb"), Path::new("/proc"))
}

fn cameras_in(devices: &Path, files: &Path, processes: &Path) -> Vec<UsbCamera> {
    let folders = fs::read_dir(devices).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<UsbCamera> = folders
        .filter(|folder| is_camera(folder))
        .filter_map(|folder| {
            let device = device_file(&folder, files)?;
            Some(UsbCamera {
                name: name(&folder),
                held_by: holder(&device, processes),
                permitted: may_open(&device),
                device,
            })
        })
        .collect();
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}

/// A device's interfaces are folders in its own.
fn is_camera(device: &Path) -> bool {
    let interfaces = fs::read_dir(device).into_iter().flatten().flatten();
    interfaces
        .filter_map(|entry| text(&entry.path().join("bInterfaceClass")))
        .any(|class| class == STILL_IMAGE)
}

fn text(path: &Path) -> Option<String> {
    read_input_text(path).ok().map(|text| text.trim().to_owned())
}

fn name(device: &Path) -> String {
    let words =
        ["manufacturer", "product"].map(|file| text(&device.join(file)).unwrap_or_default());
    let name = words.join(" ").trim().to_owned();
    if name.is_empty() { "camera".to_owned() } else { name }
}

fn device_file(device: &Path, files: &Path) -> Option<PathBuf> {
    let number = |file: &str| text(&device.join(file))?.parse::<u32>().ok();
    Some(files.join(format!("{:03}", number("busnum")?)).join(format!("{:03}", number("devnum")?)))
}

/// The first process that has the file open; those of other users do not show.
fn holder(device: &Path, processes: &Path) -> Option<String> {
    let processes = fs::read_dir(processes).ok()?.flatten().map(|entry| entry.path());
    let holds = |process: &PathBuf| {
        let open = fs::read_dir(process.join("fd")).into_iter().flatten().flatten();
        open.filter_map(|entry| fs::read_link(entry.path()).ok()).any(|target| target == device)
    };
    processes.filter(holds).find_map(|process| text(&process.join("comm")))
}

#[cfg(unix)]
fn may_open(path: &Path) -> bool {
    use rustix::fs::Access;
    rustix::fs::access(path, Access::READ_OK | Access::WRITE_OK).is_ok()
}

#[cfg(not(unix))]
fn may_open(_path: &Path) -> bool {
    true
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    /// A tree as Linux shows it, with a hub and a camera.
    fn tree() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let write = |path: &str, content: &str| {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        };
        write("sys/1-1/bDeviceClass", "09\n");
        write("sys/1-1/1-1:1.0/bInterfaceClass", "09\n");
        for (file, content) in [
            ("manufacturer", "NIKON"),
            ("product", "NIKON DSC D5100"),
            ("busnum", "1"),
            ("devnum", "7"),
        ] {
            write(&format!("sys/1-2/{file}"), &format!("{content}\n"));
        }
        write("sys/1-2/1-2:1.0/bInterfaceClass", "06\n");
        write("proc/42/comm", "gvfsd-gphoto2\n");
        fs::create_dir_all(root.path().join("proc/42/fd")).unwrap();
        root
    }

    fn look(root: &Path) -> Vec<UsbCamera> {
        cameras_in(&root.join("sys"), &root.join("dev"), &root.join("proc"))
    }

    #[test]
    fn a_camera_is_found_and_what_is_wrong_with_it() {
        let root = tree();
        let device = root.path().join("dev/001/007");
        let found = look(root.path());
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].name.as_str(), &found[0].device), ("NIKON NIKON DSC D5100", &device));
        assert!(
            matches!(found[0].problem(), Some(CameraError::Permission)),
            "its file is not there"
        );
        fs::create_dir_all(device.parent().unwrap()).unwrap();
        fs::write(&device, "").unwrap();
        assert!(look(root.path())[0].problem().is_none());
        std::os::unix::fs::symlink(&device, root.path().join("proc/42/fd/9")).unwrap();
        let problem = look(root.path())[0].problem().unwrap().to_string();
        assert!(problem.contains("(gvfsd-gphoto2); close it"), "{problem}");
    }

    #[test]
    fn where_there_is_nothing_nothing_is_found() {
        assert_eq!(look(Path::new("/no/such/place")), []);
    }
}
