//! Cameras: one trait, and what stands behind it.
//!
//! A camera takes one picture at a time into a folder and says when its shutter opens and closes, so that whoever scans can
//! look at the lights at both moments. It knows nothing of lights and plans.

mod error;
mod remembered;
mod simulated;
pub mod tethered;
mod usb;
mod watched;

pub use error::{CameraError, Cure};
pub use simulated::{Eyes, SimulatedCamera};
pub use tethered::{Tether, TetheredCamera};
pub use usb::{UsbCamera, usb_cameras};
pub use watched::{Waiting, WatchedCamera};

use std::path::{Path, PathBuf};

/// A camera. Implementations bring their own time limits: no call blocks for ever.
pub trait Camera: Send {
    /// Who it is, and how its shutter is released.
    fn describe(&self) -> Description;

    /// Sets manual exposure, RAW and whatever else a measurement needs, and says what is set then: the nearest value that the
    /// camera has.
    ///
    /// # Errors
    /// Where the camera is not there or will not; where nothing within a third of a stop can be set.
    fn configure(&mut self, wanted: Settings) -> Result<Applied, CameraError>;

    /// Takes one picture: its file, as the camera wrote it and whole, is then in `folder` (which exists) under the name
    /// that is returned. `shutter` is told right before the shutter may open and as soon as it has closed (with a watched
    /// folder, when the file arrives).
    ///
    /// # Errors
    /// What went wrong; nothing in `folder` counts then.
    fn capture(&mut self, folder: &Path, shutter: &mut dyn Shutter)
    -> Result<PathBuf, CameraError>;
}

/// Who a camera is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// As in "Nikon D5100".
    pub model: String,
    /// How its shutter is released.
    pub release: Release,
}

/// How a shutter is released.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Release {
    /// By [`Camera::capture`].
    Itself,
    /// By somebody else, after [`Shutter::open`]: a finger, another program, the light board's trigger output.
    Outside,
}

/// What a measurement asks of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Exposure time in seconds.
    pub exposure_s: f64,
    /// Sensitivity.
    pub iso: f64,
}

/// What a camera made of the settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Applied {
    /// These are set.
    Set(Settings),
    /// They are set by hand at the camera; its files say what they are.
    ByHand,
}

/// Hears of the shutter, and knows the lights.
pub trait Shutter {
    /// It is about to open.
    fn open(&mut self);
    /// It has closed.
    fn closed(&mut self);
    /// The light board's outputs since [`Shutter::open`], bit n for output n; `None` where they are not known. Pictures under
    /// other outputs must differ.
    fn lit(&self) -> Option<u32> {
        None
    }
    /// The camera waits for something that the user may have to do, or would want to know: a sentence without its full stop.
    fn waiting(&mut self, _what: &str) {}
}

/// Hears nothing.
impl Shutter for () {
    fn open(&mut self) {}
    fn closed(&mut self) {}
}
