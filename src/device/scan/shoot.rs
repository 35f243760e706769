//! One picture, with a look at the board's outputs when the shutter opens and closes.

use crate::device::board::wire::TRIGGER_BIT;
use crate::device::board::{Board, Outputs};
use crate::device::camera::{Applied, Camera, CameraError, Release, Settings, Shutter};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long the camera's remote contact is closed.
const TRIGGER_MS: u16 = 200;

/// One picture.
#[derive(Debug)]
pub(super) struct Shot {
    pub(super) path: PathBuf,
    /// `None`: set by hand, the file says how.
    pub(super) settings: Option<Settings>,
    /// Outputs at shutter open and close; `None`: could not be read.
    pub(super) open: Option<Outputs>,
    pub(super) close: Option<Outputs>,
    /// From open to close, and from then until the file was here.
    pub(super) exposing: Duration,
    pub(super) transfer: Duration,
}

/// What the camera was last told, so that it is told anew only where that changes: it takes cameras long.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Told(Option<(Settings, Applied)>);

/// Takes a picture into `folder` under whatever light is on. `waiting` hears what a camera that is released by hand waits for.
pub(super) fn shoot(
    board: &Board,
    camera: &mut dyn Camera,
    (wanted, told): (Settings, &mut Told),
    folder: &Path,
    waiting: &dyn Fn(&str),
) -> Result<Shot, CameraError> {
    // After an error the camera may be another one, or switched on anew.
    let applied = match told.0.take() {
        Some((before, applied)) if before == wanted => applied,
        _ => camera.configure(wanted)?,
    };
    let settings = match applied {
        Applied::Set(settings) => Some(settings),
        Applied::ByHand => None,
    };
    let release = camera.describe().release;
    let mut watch = Watch { board, release, waiting, open: None, close: None };
    let path = camera.capture(folder, &mut watch)?;
    told.0 = Some((wanted, applied));
    let end = Instant::now();
    let (opened, open) = watch.open.unwrap_or((end, None));
    let (closed, close) = watch.close.unwrap_or((end, None));
    let (exposing, transfer) = (closed.duration_since(opened), end.duration_since(closed));
    Ok(Shot { path, settings, open, close, exposing, transfer })
}

struct Watch<'a> {
    board: &'a Board,
    release: Release,
    waiting: &'a dyn Fn(&str),
    open: Option<(Instant, Option<Outputs>)>,
    close: Option<(Instant, Option<Outputs>)>,
}

impl Watch<'_> {
    fn outputs(&self) -> Option<Outputs> {
        self.board.outputs().ok().map(|shown| shown.outputs)
    }
}

impl Shutter for Watch<'_> {
    fn open(&mut self) {
        let outputs = self.outputs();
        self.open = Some((Instant::now(), outputs));
        if self.release == Release::Outside && self.board.identity().trigger {
            // Where it fails, or nothing hangs on the output, the shutter is released by hand.
            let _ = self.board.trigger(TRIGGER_MS);
        }
    }

    fn closed(&mut self) {
        let now = Instant::now();
        self.close = Some((now, self.outputs()));
    }

    fn lit(&self) -> Option<u32> {
        let (_, outputs) = self.open?;
        outputs.map(|outputs| outputs.pins & !(1 << TRIGGER_BIT))
    }

    fn waiting(&mut self, what: &str) {
        (self.waiting)(what);
    }
}
