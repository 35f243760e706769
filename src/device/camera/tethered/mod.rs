//! A camera that libgphoto2 holds, in a process of its own: the library can block for minutes, and the camera is not worth a
//! capture session. The process is `weavelight-tether`, built with libgphoto2 and found beside this program; [`protocol`] is
//! what the two say to each other. When it blocks, it is killed; the next call starts another and sets the camera up again.

mod diagnose;
mod fault;
mod helper;
pub mod protocol;

pub use diagnose::{Diagnosis, FoundCamera, diagnose};

use super::{Applied, Camera, CameraError, Description, Release, Settings, Shutter};
use crate::files::FileError;
use crate::machine::state_folder;
use helper::{CallError, Helper};
use protocol::{Answer, Fault, Moment, Opened, PROTOCOL, Request, Setup};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the helper's executable.
const HELPER: &str = "weavelight-tether";

/// The helper of a scan that was killed lets the camera go within two seconds; a scan that resumes at once waits for it.
const HANDOVER: Duration = Duration::from_secs(3);

/// How a tethered camera is reached.
#[derive(Clone, Debug)]
pub struct Tether {
    /// libgphoto2's name of the camera's port, as in `usb:001,004`; the only camera there is, where absent.
    pub port: Option<String>,
    /// The helper's executable.
    pub helper: PathBuf,
    /// Folder for what libgphoto2 remembers from one run to the next.
    pub home: PathBuf,
    /// How long a call may take beyond the exposure before the helper counts as blocked.
    pub patience: Duration,
    /// How long a picture may take from the end of the exposure to its announcement.
    pub picture_within: Duration,
}

impl Tether {
    /// The helper beside this program, and the usual patience: cameras that subtract a dark frame of their own, or write to
    /// their card first, take seconds.
    pub fn new(port: Option<String>) -> Self {
        Self {
            port,
            helper: beside_this_program(),
            home: home(),
            patience: Duration::from_secs(30),
            picture_within: Duration::from_secs(15),
        }
    }

    /// Starts the helper and sees that it speaks this program's protocol.
    fn start(&self) -> Result<Helper, CameraError> {
        let unusable =
            |why: &str| CameraError::Helper { helper: self.helper.clone(), why: why.to_owned() };
        if !self.helper.is_file() {
            return Err(unusable(HELPER_MISSING));
        }
        std::fs::create_dir_all(&self.home)
            .map_err(|source| FileError::Write { path: self.home.clone(), source })?;
        let mut helper = Helper::start(&self.helper, &self.home)
            .map_err(|error| unusable(&format!("{error}; build it again with `make build`")))?;
        match helper.call(Request::Hello, self.patience, &mut |_| {}) {
            Ok(Answer::Hello(versions)) if versions.protocol == PROTOCOL => Ok(helper),
            Ok(_) => Err(unusable(
                "it is of another version than this program; build both with `make build`",
            )),
            Err(_) => Err(unusable(
                "it does not answer; install libgphoto2, and build it again with `make build`",
            )),
        }
    }
}

const HELPER_MISSING: &str = "tethered cameras need this program, which is not there; build it with `make build` (package libgphoto2-dev), or let another program save into a folder: kind = \"watched\" in rig.toml";

fn beside_this_program() -> PathBuf {
    let name = format!("{HELPER}{}", std::env::consts::EXE_SUFFIX);
    std::env::current_exe().map_or_else(|_| PathBuf::from(&name), |own| own.with_file_name(&name))
}

/// The home that libgphoto2 gets, so that it does not write into the user's own settings.
fn home() -> PathBuf {
    state_folder().unwrap_or_else(|| std::env::temp_dir().join("weavelight"))
}

/// A camera that libgphoto2 holds.
#[derive(Debug)]
pub struct TetheredCamera {
    tether: Tether,
    helper: Option<Helper>,
    opened: Opened,
    setup: Option<Setup>,
    taken: u64,
}

impl TetheredCamera {
    /// Takes hold of the camera.
    ///
    /// # Errors
    /// Where the helper is missing, and where there is no camera, several, one that another program holds, or one that does not answer.
    pub fn open(tether: Tether) -> Result<Self, CameraError> {
        let mut helper = tether.start()?;
        let opened = open(&mut helper, &tether)?;
        Ok(Self { tether, helper: Some(helper), opened, setup: None, taken: 0 })
    }

    /// What is known of the camera that is held.
    pub fn opened(&self) -> &Opened {
        &self.opened
    }

    /// Sees that a helper holds the camera, set up as before.
    fn revive(&mut self) -> Result<(), CameraError> {
        if self.helper.is_some() {
            return Ok(());
        }
        let mut helper = self.tether.start()?;
        self.opened = open(&mut helper, &self.tether)?;
        self.helper = Some(helper);
        match self.setup {
            Some(setup) => {
                self.ask(Request::Configure(setup), Duration::ZERO, &mut |_| {}).map(drop)
            }
            None => Ok(()),
        }
    }

    /// Asks the helper; `longer`: beyond the usual patience. A helper whose camera is in an unknown state is ended.
    fn ask(
        &mut self,
        request: Request,
        longer: Duration,
        moment: &mut dyn FnMut(Moment),
    ) -> Result<Answer, CameraError> {
        self.revive()?;
        let Some(helper) = self.helper.as_mut() else { return Err(CameraError::Asleep) };
        let limit = self.tether.patience + longer;
        let result = helper.call(request, limit, moment);
        result.map_err(|error| {
            if !fault::leaves_the_camera_usable(&error) {
                self.helper = None;
            }
            fault::camera_error(error, self.tether.picture_within)
        })
    }

    fn capture_to(
        &mut self,
        part: &Path,
        shutter: &mut dyn Shutter,
    ) -> Result<String, CameraError> {
        let exposure_s = self.setup.map_or(0.0, |setup| setup.exposure_s);
        let within = self.tether.picture_within;
        let request = Request::Capture {
            file: std::path::absolute(part).unwrap_or_else(|_| part.to_owned()),
            exposure_s,
            picture_within_s: within.as_secs_f64(),
        };
        let exposure = Duration::try_from_secs_f64(exposure_s).unwrap_or_default();
        // The camera may subtract a dark frame of its own, which takes as long again.
        let longer = 2 * exposure + within;
        self.revive()?;
        // Before the helper hears of it: whatever the listener looks at is seen before the shutter can move.
        shutter.open();
        let answer = self.ask(request, longer, &mut |moment| match moment {
            Moment::ShutterClosed => shutter.closed(),
        })?;
        match answer {
            Answer::Captured(captured) => Ok(captured.name),
            _ => Err(self.confused()),
        }
    }

    /// The helper answered something else than was asked.
    fn confused(&mut self) -> CameraError {
        self.helper = None;
        fault::camera_error(CallError::Ended, self.tether.picture_within)
    }
}

fn open(helper: &mut Helper, tether: &Tether) -> Result<Opened, CameraError> {
    let deadline = Instant::now() + HANDOVER;
    let mut call = || {
        let request = Request::Open { port: tether.port.clone() };
        helper.call(request, tether.patience, &mut |_| {})
    };
    let mut result = call();
    while result == Err(CallError::Fault(Fault::Claimed)) && Instant::now() < deadline {
        std::thread::sleep(HANDOVER / 10);
        result = call();
    }
    match result {
        Ok(Answer::Opened(opened)) => Ok(opened),
        Ok(_) => Err(fault::camera_error(CallError::Ended, tether.picture_within)),
        // A camera that blocks the library while it is being connected does not answer.
        Err(CallError::TimedOut(_)) => Err(CameraError::Asleep),
        Err(error) => Err(fault::camera_error(error, tether.picture_within)),
    }
}

/// # Errors
/// Where it is no exposure at all.
fn setup(Settings { exposure_s, iso }: Settings) -> Result<Setup, CameraError> {
    if [exposure_s, iso].iter().all(|value| value.is_finite() && *value > 0.0) {
        return Ok(Setup { exposure_s, iso });
    }
    Err(CameraError::Setting {
        what: "its exposure",
        wanted: format!("{exposure_s} s at ISO {iso}"),
        choices: "times and ISO above 0 only".to_owned(),
    })
}

impl Camera for TetheredCamera {
    fn describe(&self) -> Description {
        Description { model: self.opened.model.clone(), release: Release::Itself }
    }

    fn configure(&mut self, wanted: Settings) -> Result<Applied, CameraError> {
        let setup = setup(wanted)?;
        // Setting up anew must not first set up as before.
        self.setup = None;
        match self.ask(Request::Configure(setup), Duration::ZERO, &mut |_| {})? {
            Answer::Configured(made) => {
                self.setup = Some(Setup { exposure_s: made.exposure_s, iso: made.iso });
                Ok(Applied::Set(Settings { exposure_s: made.exposure_s, iso: made.iso }))
            }
            _ => Err(self.confused()),
        }
    }

    fn capture(
        &mut self,
        folder: &Path,
        shutter: &mut dyn Shutter,
    ) -> Result<PathBuf, CameraError> {
        self.taken += 1;
        // No other scan's helper, on its last legs, writes to the same.
        let part = folder.join(format!(".tethered-{}-{:04}.part", std::process::id(), self.taken));
        remove_left(&part)?;
        let name = self.capture_to(&part, shutter).inspect_err(|_| {
            let _left = remove_left(&part);
        })?;
        let extension = Path::new(&name).extension().and_then(|e| e.to_str()).unwrap_or("raw");
        let file = folder.join(format!("tethered-{:04}.{}", self.taken, extension.to_lowercase()));
        std::fs::rename(&part, &file)
            .map_err(|source| FileError::Write { path: file.clone(), source })?;
        Ok(file)
    }
}

/// Of a capture that was cut off.
fn remove_left(part: &Path) -> Result<(), CameraError> {
    match std::fs::remove_file(part) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(FileError::Write { path: part.to_owned(), source }.into())
        }
        _ => Ok(()),
    }
}
