//! What can be seen of a scan while it goes on: each frame made small, and the maps from the frames so far. A thread of its
//! own, so that the next light does not wait for it; it ends with the scan.

use super::Told;
use super::picture::{Thumb, thumb};
use crate::place::Place;
use crate::rooms::look::view::{Geometry, Maps};
use crate::texts::shell::{no_thread, threads};
use crate::worker::{Outbox, Update};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::JoinHandle;
use weavelight::device::camera::Settings;
use weavelight::files::{InputKind, read_input};
use weavelight::instrument::Calibration;
use weavelight::linear::Exposure;
use weavelight::live::Accumulator;
use weavelight::machine::spawn;
use weavelight::raw::{Frame, Hint, decode};
use weavelight::session::Session;
use weavelight::solution::Scale;
use weavelight_calibration::description::{Camera, Plane};

/// A frame that is safe.
#[derive(Debug)]
pub(super) struct Sight {
    pub(super) light: Option<usize>,
    pub(super) drift_check: bool,
    pub(super) file: PathBuf,
    pub(super) settings: Settings,
    /// What the manifest says of it.
    pub(super) hint: Hint,
}

/// Looks at frames as they come.
pub(super) struct Eyes {
    sights: Option<Sender<Sight>>,
    thread: Option<JoinHandle<()>>,
}

/// Preview maps have about so many columns: as many as the window shows.
const COLUMNS: usize = 800;

impl Eyes {
    pub(super) fn open(place: &Place, folder: &Path, out: &Outbox) -> Self {
        let (sights, inbox) = mpsc::channel();
        let (place, folder, out) = (place.clone(), folder.to_owned(), out.clone());
        let told = out.clone();
        let thread = spawn("previews", move || watch(&inbox, &place, &folder, &out));
        // Without a thread there are no previews; the scan goes on.
        let thread = thread.inspect_err(|error| {
            told.warn(crate::texts::rooms::SCAN, &[no_thread(threads::PREVIEWS, error)]);
        });
        let thread = thread.ok();
        Self { sights: Some(sights), thread }
    }

    pub(super) fn look_at(&self, sight: Sight) {
        // A thread that stumbled over a frame leaves the scan alone.
        let _ = self.sights.as_ref().map(|sights| sights.send(sight));
    }
}

impl Drop for Eyes {
    fn drop(&mut self) {
        self.sights = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn watch(inbox: &Receiver<Sight>, place: &Place, folder: &Path, out: &Outbox) {
    let calibration = Calibration::load(&place.calibration()).ok();
    let mut sums: Option<Sums> = None;
    for sight in inbox {
        let Some(frame) = read(&sight) else { continue };
        let picture = thumb(&frame, sight.light, calibration.as_ref());
        let (light, drift_check) = (sight.light, sight.drift_check);
        out.tell(Update::Scan(Told::Frame(Box::new(Thumb { light, drift_check, picture }))));
        let Some(calibration) = &calibration else { continue };
        let sums = sums.get_or_insert_with(|| Sums::new(calibration, folder, &frame));
        if !drift_check
            && sums.add(sight, frame).is_some()
            && let Some(maps) = sums.maps()
        {
            out.tell(Update::Scan(Told::Maps(Box::new(maps))));
        }
    }
}

fn read(sight: &Sight) -> Option<Frame> {
    decode(&read_input(&sight.file, InputKind::Picture).ok()?, &sight.hint).ok()
}

/// The maps so far, and where their pixels are.
struct Sums {
    sums: Accumulator,
    camera: Option<Camera>,
    plane: Plane,
    scale: Scale,
}

impl Sums {
    fn new(calibration: &Calibration, folder: &Path, like: &Frame) -> Self {
        let plane = Session::load(folder).map(|session| session.plane_or_table());
        let plane = plane.unwrap_or_else(|_| Plane::table());
        let scale = match like.width.div_ceil(COLUMNS) {
            0..2 => Scale::Full,
            2..3 => Scale::Half,
            3..6 => Scale::Quarter,
            _ => Scale::Eighth,
        };
        let sums = Accumulator::new(calibration.clone(), plane.clone(), like, scale);
        Self { sums, camera: calibration.camera.clone(), plane, scale }
    }

    /// What does not fit is told by the solve, with its remedy.
    fn add(&mut self, sight: Sight, frame: Frame) -> Option<()> {
        let Settings { exposure_s, iso } = sight.settings;
        let exposure = Exposure { frame, exposure_s, iso, path: sight.file };
        match sight.light {
            Some(light) => self.sums.add(light, exposure).ok(),
            None => self.sums.add_ambient(exposure).ok(),
        }
    }

    fn maps(&self) -> Option<Maps> {
        let preview = self.sums.preview().ok()??;
        let size = [preview.normal.width, preview.normal.height];
        let (camera, plane) = (self.camera.clone(), self.plane.clone());
        let geometry = Geometry::new(size, camera, plane, self.scale as usize);
        Some(Maps::of_preview(&preview, geometry))
    }
}
