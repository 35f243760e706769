//! What is said between this program and `weavelight-tether`, the process that holds libgphoto2.
//!
//! One JSON object per line: requests on its standard input, one at a time, and for each, on its standard output, any number of
//! [`Said::Moment`] and then one [`Said::Done`] or [`Said::Failed`], all with the request's number. It ends when its standard input does.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Version of this protocol; both ends must speak the same.
pub const PROTOCOL: u32 = 1;

/// A request with its number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Call {
    /// Counts up.
    pub id: u64,
    /// What is asked.
    #[serde(flatten)]
    pub request: Request,
}

/// What the helper is asked to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Request {
    /// Say who you are.
    Hello,
    /// List the cameras that are connected.
    List,
    /// Take hold of a camera.
    Open {
        /// libgphoto2's name of the port; the only camera there is, where absent.
        port: Option<String>,
    },
    /// Set the camera up for measuring: manual exposure, RAW, fixed ISO and white balance, single frames, no autofocus.
    Configure(Setup),
    /// Take a frame and save it.
    Capture {
        /// Where to; nothing is there yet.
        #[serde(with = "any_path")]
        file: PathBuf,
        /// The exposure that was set, seconds.
        exposure_s: f64,
        /// How long the picture may take to be announced after the end of the exposure, seconds.
        picture_within_s: f64,
    },
}

/// A path as text, or as its bytes where it is not UTF-8: JSON holds text only.
mod any_path {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::path::{Path, PathBuf};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Any {
        Text(String),
        Bytes(Vec<u8>),
    }

    pub(super) fn serialize<S: Serializer>(path: &Path, to: S) -> Result<S::Ok, S::Error> {
        match path.to_str() {
            Some(text) => to.serialize_str(text),
            None => path.as_os_str().as_encoded_bytes().serialize(to),
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<PathBuf, D::Error> {
        match Any::deserialize(from)? {
            Any::Text(text) => Ok(text.into()),
            Any::Bytes(bytes) => of_bytes(bytes).ok_or_else(|| D::Error::custom("no path")),
        }
    }

    #[cfg(unix)]
    fn of_bytes(bytes: Vec<u8>) -> Option<PathBuf> {
        use std::os::unix::ffi::OsStringExt;
        Some(std::ffi::OsString::from_vec(bytes).into())
    }

    #[cfg(not(unix))]
    fn of_bytes(bytes: Vec<u8>) -> Option<PathBuf> {
        String::from_utf8(bytes).ok().map(PathBuf::from)
    }
}

/// What a capture session fixes at the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Exposure, seconds. The camera's nearest value within a few per cent is taken.
    pub exposure_s: f64,
    /// Sensitivity.
    pub iso: f64,
}

/// A line from the helper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Of the request that it belongs to.
    pub id: u64,
    /// What is said.
    #[serde(flatten)]
    pub said: Said,
}

/// What the helper says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Said {
    /// The request goes on; this has just happened.
    Moment(Moment),
    /// The request is done.
    Done(Answer),
    /// The request failed.
    Failed(Fault),
}

/// What happens in the course of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// The shutter has closed; the transfer begins.
    ShutterClosed,
}

/// What a request brought.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// To [`Request::Hello`].
    Hello(Versions),
    /// To [`Request::List`].
    Cameras(Vec<Found>),
    /// To [`Request::Open`].
    Opened(Opened),
    /// To [`Request::Configure`].
    Configured(Configured),
    /// To [`Request::Capture`].
    Captured(Captured),
}

/// Who the helper is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Versions {
    /// See [`PROTOCOL`].
    pub protocol: u32,
    /// Name and version of the helper.
    pub program: String,
    /// Version of libgphoto2.
    pub libgphoto2: String,
}

/// A camera that is connected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Found {
    /// As libgphoto2 calls it.
    pub model: String,
    /// libgphoto2's name of the port.
    pub port: String,
}

/// A camera that was taken hold of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Opened {
    /// As the camera says.
    pub model: String,
    /// libgphoto2's name of the port.
    pub port: String,
    /// Charge of the battery, if the camera tells.
    pub battery_percent: Option<u8>,
}

/// What the camera was set to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Configured {
    /// Exposure as the camera names it, seconds.
    pub exposure_s: f64,
    /// Sensitivity.
    pub iso: f64,
    /// Every setting that was made, by libgphoto2's name of it.
    pub settings: Vec<(String, String)>,
}

/// A frame that was saved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Captured {
    /// The camera's name of it; its extension tells the kind of RAW.
    pub name: String,
    /// Size of the file.
    pub bytes: u64,
}

/// Why a request failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "fault", rename_all = "snake_case")]
pub enum Fault {
    /// No camera is connected, or none at the port.
    NoCamera,
    /// Several, and the port was not said.
    Several {
        /// Which.
        found: Vec<Found>,
    },
    /// The camera is there and does not answer.
    Asleep,
    /// Another program holds the camera.
    Claimed,
    /// This user may not use the USB device.
    Permission,
    /// The dial is not on M.
    Dial {
        /// Where it is.
        mode: String,
    },
    /// The camera does not offer a value that is needed.
    NotOffered {
        /// libgphoto2's name of the setting.
        setting: String,
        /// The value.
        wanted: String,
        /// What there is, the nearest.
        offered: Vec<String>,
    },
    /// The camera did not take a value that it offers.
    NotTaken {
        /// libgphoto2's name of the setting.
        setting: String,
        /// The value.
        wanted: String,
        /// What it reads instead.
        read: String,
    },
    /// The battery is too low to go on.
    Battery {
        /// Its charge.
        percent: u8,
    },
    /// No room on the card, or no card.
    CardFull,
    /// The autofocus found nothing.
    OutOfFocus,
    /// It released, but no picture came.
    NoPicture,
    /// The picture is no RAW file.
    NotRaw {
        /// The camera's name of it.
        name: String,
    },
    /// The link broke.
    LinkCut,
    /// The camera is busy with something else.
    Busy,
    /// The file could not be written.
    File {
        /// The file.
        path: String,
        /// As the system says.
        reason: String,
    },
    /// What has no name of its own.
    Other {
        /// As libgphoto2 says.
        reason: String,
    },
}
