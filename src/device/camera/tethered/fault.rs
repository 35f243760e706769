//! From what the helper says to the errors of a camera.

use super::helper::CallError;
use super::protocol::Fault;
use crate::device::camera::{CameraError, usb_cameras};
use crate::files::FileError;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

/// After these the camera is where it was; after all others nobody knows, and it is taken hold of anew.
pub(super) fn leaves_the_camera_usable(error: &CallError) -> bool {
    match error {
        CallError::TimedOut(_) | CallError::Ended => false,
        CallError::Fault(fault) => !matches!(
            fault,
            Fault::Asleep
                | Fault::LinkCut
                | Fault::NoCamera
                | Fault::Claimed
                | Fault::Permission
                | Fault::Busy
                | Fault::Other { .. }
        ),
    }
}

/// `picture_within`: how long was waited for a picture.
pub(super) fn camera_error(error: CallError, picture_within: Duration) -> CameraError {
    match error {
        CallError::Fault(fault) => of_fault(fault, picture_within),
        CallError::TimedOut(after) => CameraError::NeverReady { after },
        CallError::Ended => CameraError::LinkLost { reason: "libgphoto2 stopped".to_owned() },
    }
}

fn of_fault(fault: Fault, picture_within: Duration) -> CameraError {
    match fault {
        Fault::NoCamera => CameraError::NoneFound,
        Fault::Several { found } => {
            let found: Vec<String> =
                found.iter().map(|camera| format!("{} at {}", camera.model, camera.port)).collect();
            other(format!(
                "several cameras are connected: {}; say which in rig.toml: [camera] port = \"...\"",
                found.join(", ")
            ))
        }
        Fault::Asleep => CameraError::Asleep,
        Fault::Claimed => {
            CameraError::Claimed { by: usb_cameras().into_iter().find_map(|camera| camera.held_by) }
        }
        Fault::Permission => CameraError::Permission,
        Fault::Dial { mode } => CameraError::WrongMode { mode },
        Fault::NotOffered { setting, wanted, offered } => {
            CameraError::Setting { what: plain(&setting), wanted, choices: listed(&offered) }
        }
        Fault::NotTaken { setting, wanted, read } => CameraError::Setting {
            what: plain(&setting),
            wanted,
            choices: format!("{read} and does not change it; look at its menus"),
        },
        Fault::Battery { percent } => CameraError::BatteryLow { percent: Some(percent) },
        Fault::CardFull => CameraError::CardFull,
        Fault::OutOfFocus => CameraError::OutOfFocus,
        Fault::NoPicture => CameraError::NoPicture { after: picture_within },
        Fault::NotRaw { name } => CameraError::NotRaw { found: kind_of(&name) },
        Fault::LinkCut => CameraError::LinkLost { reason: "in the middle of a call".to_owned() },
        Fault::Busy => CameraError::Busy,
        Fault::File { path, reason } => {
            let source = io::Error::other(reason);
            CameraError::File(FileError::Write { path: PathBuf::from(path), source })
        }
        Fault::Other { reason } => CameraError::Refused { reason },
    }
}

fn other(what: String) -> CameraError {
    CameraError::Other { what }
}

fn listed(offered: &[String]) -> String {
    if offered.is_empty() { "no such setting".to_owned() } else { offered.join(", ") }
}

/// The extension, as people write it.
fn kind_of(name: &str) -> String {
    match name.rsplit_once('.').map(|(_, extension)| extension.to_ascii_uppercase()) {
        Some(extension) if extension == "JPG" => "JPEG".to_owned(),
        Some(extension) => extension,
        None => name.to_owned(),
    }
}

/// libgphoto2's name of a setting in plain words.
fn plain(setting: &str) -> &'static str {
    match setting {
        "shutterspeed" => "its exposure",
        "iso" => "its ISO",
        "imagequality" | "imageformat" => "its image quality",
        "whitebalance" => "its white balance",
        "capturetarget" => "where pictures go",
        "capturemode" => "its release mode",
        "autoiso" => "automatic ISO",
        "longexpnr" => "long exposure noise reduction",
        "autofocus" => "its autofocus",
        _ => "a setting",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_says_what_to_do() {
        let check = |fault: Fault, expected: &str| {
            let error = of_fault(fault.clone(), Duration::from_secs(15)).to_string();
            assert!(error.contains(expected), "{fault:?}: {error}");
            assert!(error.lines().count() <= 2 && error.contains(';'), "{fault:?}: {error}");
        };
        check(Fault::NoCamera, "connect it by USB");
        check(Fault::Asleep, "wake it");
        check(Fault::Claimed, "close it");
        check(Fault::Permission, "udev");
        check(
            Fault::Dial { mode: "P".into() },
            "is at P, so exposures cannot be set; turn it to M",
        );
        check(Fault::Battery { percent: 4 }, "4 %");
        check(Fault::CardFull, "empty it");
        check(Fault::OutOfFocus, "manual focus");
        check(Fault::NoPicture, "within 15 s");
        check(Fault::NotRaw { name: "capt0000.jpg".into() }, "saves JPEG instead of RAW");
        check(Fault::LinkCut, "check its cable");
        check(Fault::Busy, "live view");
        check(
            Fault::NotOffered {
                setting: "shutterspeed".into(),
                wanted: "45 s".into(),
                offered: vec!["30.0000s".into()],
            },
            "cannot set its exposure to 45 s; it has 30.0000s",
        );
        check(Fault::Other { reason: "Unspecified error".into() }, "Unspecified error");
        let found = ["001,004", "001,005"].map(|port| super::super::protocol::Found {
            model: "Nikon DSC D5100 (PTP mode)".into(),
            port: format!("usb:{port}"),
        });
        check(Fault::Several { found: found.to_vec() }, "usb:001,005; say which");
    }
}
