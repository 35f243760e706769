use std::path::PathBuf;
use std::time::Duration;

/// What goes wrong with a camera. Each message says what, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// No camera is connected.
    #[error(
        "no camera found; connect it by USB and switch it on, or choose kind = \"watched\" in rig.toml if another program takes the pictures"
    )]
    NoneFound,
    /// It was there and does not answer.
    #[error(
        "the camera does not answer, as if asleep; wake it with its shutter button, and switch its standby timer off"
    )]
    Asleep,
    /// The battery is too low to go on.
    #[error("the camera's battery is low{}; charge or change it, or use a mains adapter", in_percent(*.percent))]
    BatteryLow {
        /// What is left, where the camera says so.
        percent: Option<u8>,
    },
    /// The mode dial is wrong: exposure cannot be set.
    #[error("the camera's mode dial is at {mode}, so exposures cannot be set; turn it to M")]
    WrongMode {
        /// As the camera says, as in "P" or "Auto".
        mode: String,
    },
    /// No room on the memory card.
    #[error("the camera's memory card is full; empty it, or put in another")]
    CardFull,
    /// The camera saves something else than RAW.
    #[error("the camera saves {found} instead of RAW; set its image quality to NEF (RAW)")]
    NotRaw {
        /// As in "JPEG".
        found: String,
    },
    /// The shutter was not released because nothing is in focus.
    #[error(
        "the camera does not find focus; focus by hand and set lens and camera to manual focus (M)"
    )]
    OutOfFocus,
    /// The shutter was released, but no picture came.
    #[error("the camera released its shutter, but no picture came within {} s; switch it off and on", .after.as_secs())]
    NoPicture {
        /// How long was waited.
        after: Duration,
    },
    /// The connection broke.
    #[error("the connection to the camera broke ({reason}); check its cable and plug it in again")]
    LinkLost {
        /// As the system says.
        reason: String,
    },
    /// A call took too long and was ended.
    #[error("the camera is not ready after {} s; switch it off and on", .after.as_secs())]
    NeverReady {
        /// How long was waited.
        after: Duration,
    },
    /// It does something else at the moment.
    #[error(
        "the camera is busy with something else; leave its menus, its playback and live view, then try again"
    )]
    Busy,
    /// It refused for a reason that has no name of its own here.
    #[error("the camera refused ({reason}); switch it off and on, then try again")]
    Refused {
        /// As its driver says.
        reason: String,
    },
    /// The program that holds a tethered camera cannot be used.
    #[error("{}: {why}", .helper.display())]
    Helper {
        /// Its executable.
        helper: PathBuf,
        /// What is wrong and what to do.
        why: String,
    },
    /// Another program has the camera.
    #[error("another program is using the camera{}; close it (desktops: eject the camera in the file manager), then try again", named(.by.as_deref()))]
    Claimed {
        /// Which, where known.
        by: Option<String>,
    },
    /// This user may not open the camera.
    #[error(
        "permission to use the camera is denied; install the udev rules of libgphoto2 (on Debian: sudo apt install libgphoto2-6), then plug it in again"
    )]
    Permission,
    /// A setting cannot be made.
    #[error("the camera cannot set {what} to {wanted}; it has {choices}")]
    Setting {
        /// As in "exposure time".
        what: &'static str,
        /// As in "0.5 s".
        wanted: String,
        /// What it has, shortened where there is much.
        choices: String,
    },
    /// The picture was not taken as asked.
    #[error(
        "the camera exposed {found} instead of {wanted}; set it to manual (M) with these values and leave them for the whole scan"
    )]
    Exposure {
        /// As the file says, as in "0.25 s at ISO 100".
        found: String,
        /// As asked.
        wanted: String,
    },
    /// The watched folder cannot be used.
    #[error("{}: the watched folder {what}", .folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What is wrong and what to do.
        what: String,
    },
    /// No file came into the watched folder.
    #[error("{}: no picture came within {} s; release the shutter when asked, and let the tethering program save RAW files here", .folder.display(), .after.as_secs())]
    NothingArrived {
        /// The folder.
        folder: PathBuf,
        /// How long was waited.
        after: Duration,
    },
    /// A file came into the watched folder sooner than this exposure can have ended.
    #[error("{}: a picture came before its exposure can have ended, so it is of an earlier light; release the shutter once a light, when asked", .folder.display())]
    TooEarly {
        /// The folder.
        folder: PathBuf,
    },
    /// What came shows the same as the picture of an earlier light.
    #[error("{}: shows the same as the picture of an earlier light, so it is a second picture of that light; release the shutter once a light, when asked", .file.display())]
    SamePicture {
        /// The file.
        file: PathBuf,
    },
    /// A file in the watched folder is of a kind that cannot be read.
    #[error("{}: {why}", .file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// What it is and what to do.
        why: String,
    },
    /// More than one picture came for one light.
    #[error("{}: {count} different pictures came for one light; release the shutter once a light, when asked", .folder.display())]
    SeveralArrived {
        /// The folder.
        folder: PathBuf,
        /// How many.
        count: usize,
    },
    /// A file in the watched folder stays incomplete.
    #[error("{}: this file is not complete after {} s ({reason}); check the tethering program and the disk", .file.display(), .after.as_secs())]
    Incomplete {
        /// The file.
        file: PathBuf,
        /// How long was waited.
        after: Duration,
        /// What is missing.
        reason: String,
    },
    /// The picture cannot be stored here.
    #[error(transparent)]
    File(#[from] crate::files::FileError),
    /// What lies before the simulated camera cannot be made out.
    #[error(transparent)]
    Scene(Box<crate::simulate::SimulateError>),
    /// Anything else: a sentence that says what to do.
    #[error("{what}")]
    Other {
        /// What is wrong; what to do.
        what: String,
    },
}

impl From<crate::simulate::SimulateError> for CameraError {
    fn from(error: crate::simulate::SimulateError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// What may help after an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cure {
    /// Trying again.
    Again,
    /// Somebody has to do something first.
    Hands,
}

impl CameraError {
    /// Whether trying again may help by itself, or somebody has to do something first.
    pub fn cure(&self) -> Cure {
        match self {
            Self::Asleep
            | Self::NoPicture { .. }
            | Self::LinkLost { .. }
            | Self::NeverReady { .. }
            | Self::Busy
            | Self::Refused { .. }
            | Self::NothingArrived { .. }
            | Self::TooEarly { .. }
            | Self::SeveralArrived { .. }
            | Self::SamePicture { .. }
            | Self::OutOfFocus
            | Self::Incomplete { .. } => Cure::Again,
            _ => Cure::Hands,
        }
    }
}

fn in_percent(percent: Option<u8>) -> String {
    percent.map(|percent| format!(" ({percent} %)")).unwrap_or_default()
}

fn named(program: Option<&str>) -> String {
    program.map(|program| format!(" ({program})")).unwrap_or_default()
}
