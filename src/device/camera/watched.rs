//! A folder into which another program saves: works with every tethering program, on any system.
//!
//! What is in the folder before the shutter opens is never taken; a name that comes again with other content is a new
//! picture. Folders below it are looked into: programs file pictures by job and date. A RAW file counts once it is whole,
//! stays as it is, and shows something else than the pictures under other lights: a second, late picture of one light is
//! left out.

mod earlier;
mod listing;
mod wait;

use super::{Applied, Camera, CameraError, Description, Release, Settings, Shutter};
use crate::files::FileError;
use earlier::Earlier;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use wait::Wait;

/// How long is waited, and how often looked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Waiting {
    /// For the first file after the light is on. Shorter than the board's longest on-time.
    pub arrival: Duration,
    /// For a file to become whole, since it last changed.
    pub completion: Duration,
    /// So long must a file stay as it is before it is read: programs write in pieces.
    pub rest: Duration,
    /// After a picture that is no RAW file: for the RAW file that may come with it. Cameras send the smaller file first, and
    /// the larger one up to half a minute later over a slow link.
    pub partner: Duration,
    /// After a picture that shows the same as an earlier light's: for the picture of this light.
    pub second: Duration,
    /// Between looks.
    pub look: Duration,
}

impl Default for Waiting {
    fn default() -> Self {
        Self {
            arrival: Duration::from_secs(50),
            completion: Duration::from_secs(15),
            rest: Duration::from_millis(150),
            partner: Duration::from_secs(30),
            second: Duration::from_secs(15),
            look: Duration::from_millis(25),
        }
    }
}

/// A camera that another program runs. Its shutter is released outside; its settings are made by hand.
#[derive(Debug)]
pub struct WatchedCamera {
    folder: PathBuf,
    model: String,
    waiting: Waiting,
    /// Shorter than this after the light came on, no picture of it can be there.
    exposure_s: f64,
    earlier: Earlier,
}

impl WatchedCamera {
    /// Watches `folder`; `model` is the camera's name, if known.
    pub fn new(folder: &Path, model: Option<&str>, waiting: Waiting) -> Self {
        let model = model.unwrap_or("camera of another program").to_owned();
        let earlier = Earlier::default();
        Self { folder: folder.to_owned(), model, waiting, exposure_s: 0.0, earlier }
    }

    /// Whether the folder can be watched.
    ///
    /// # Errors
    /// Where it is missing, is no folder or may not be read.
    pub fn check(&self) -> Result<(), CameraError> {
        listing::list(&self.folder, None).map(drop)
    }
}

impl Camera for WatchedCamera {
    fn describe(&self) -> Description {
        Description { model: self.model.clone(), release: Release::Outside }
    }

    fn configure(&mut self, wanted: Settings) -> Result<Applied, CameraError> {
        self.check()?;
        self.exposure_s = wanted.exposure_s;
        Ok(Applied::ByHand)
    }

    fn capture(
        &mut self,
        folder: &Path,
        shutter: &mut dyn Shutter,
    ) -> Result<PathBuf, CameraError> {
        let wait = Wait::begin(self, folder)?;
        shutter.open();
        let picture = wait.for_picture(shutter)?;
        let target = folder.join(picture.path.file_name().unwrap_or_default());
        fs::write(&target, &picture.bytes).map_err(|source| FileError::write(&target, source))?;
        Ok(target)
    }
}

#[cfg(test)]
mod tests;
