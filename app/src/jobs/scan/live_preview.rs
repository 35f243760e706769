//! Live preview of a scan: a thumbnail of each frame, and maps from the frames so far. Runs in its own thread, so that the next
//! light does not wait; ends with the scan.

use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::scan::Event;
use crate::model::project::Project;
use crate::texts::shell::{no_thread, threads};
use crate::viewer::geometry::Geometry;
use crate::viewer::maps::Maps;
use crate::viewer::picture::{Thumb, thumb};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::sync::mpsc::{Receiver, Sender};
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

/// A frame that is on the disk.
#[derive(Debug)]
pub(crate) struct KeptFrame {
    pub(crate) light: Option<usize>,
    pub(crate) drift_check: bool,
    pub(crate) file: PathBuf,
    pub(crate) settings: Settings,
    /// What the manifest says of it.
    pub(crate) hint: Hint,
}

/// Makes previews of frames as they arrive.
pub(crate) struct LivePreview {
    frames: Option<Sender<KeptFrame>>,
    thread: Option<JoinHandle<()>>,
}

/// Preview maps have about so many columns: as many as the window shows.
const COLUMNS: usize = 800;

impl LivePreview {
    pub(crate) fn open(project: &Project, folder: &Path, out: &Outbox) -> Self {
        let (frames, inbox) = mpsc::channel();
        let (project, folder, out) = (project.clone(), folder.to_owned(), out.clone());
        let problems = out.clone();
        let thread = spawn("previews", move || watch(&inbox, &project, &folder, &out));
        // Without a thread there are no previews; the scan goes on.
        let thread = thread.inspect_err(|error| {
            problems.warn(crate::texts::rooms::SCAN, &[no_thread(threads::PREVIEWS, error)]);
        });
        let thread = thread.ok();
        Self { frames: Some(frames), thread }
    }

    pub(crate) fn add(&self, kept: KeptFrame) {
        // Where the thread has failed on a frame, the scan goes on without previews.
        let _ = self.frames.as_ref().map(|frames| frames.send(kept));
    }
}

impl Drop for LivePreview {
    fn drop(&mut self) {
        self.frames = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn watch(inbox: &Receiver<KeptFrame>, project: &Project, folder: &Path, out: &Outbox) {
    let calibration = Calibration::load(&project.calibration()).ok();
    let mut sums: Option<Sums> = None;
    for kept in inbox {
        let Some(frame) = read(&kept) else { continue };
        let picture = thumb(&frame, kept.light, calibration.as_ref());
        let (light, drift_check) = (kept.light, kept.drift_check);
        out.send(Update::Scan(Event::Frame(Box::new(Thumb { light, drift_check, picture }))));
        let Some(calibration) = &calibration else { continue };
        let sums = sums.get_or_insert_with(|| Sums::new(calibration, folder, &frame));
        if !drift_check
            && sums.add(kept, frame).is_some()
            && let Some(maps) = sums.maps()
        {
            out.send(Update::Scan(Event::Maps(Box::new(maps))));
        }
    }
}

fn read(kept: &KeptFrame) -> Option<Frame> {
    decode(&read_input(&kept.file, InputKind::Picture).ok()?, &kept.hint).ok()
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

    /// A frame that does not fit is left out here; the solve reports it with its remedy.
    fn add(&mut self, kept: KeptFrame, frame: Frame) -> Option<()> {
        let Settings { exposure_s, iso } = kept.settings;
        let exposure = Exposure { frame, exposure_s, iso, path: kept.file };
        match kept.light {
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

/// The frames that are there show in the strip, and their light counts in the maps.
pub(crate) fn look_at_what_is_there(folder: &Path, preview: &LivePreview) {
    let Ok(session) = Session::load(folder) else { return };
    for entry in &session.frames {
        // What was altered is taken again.
        if session.read_frame(entry).is_ok() {
            preview.add(KeptFrame {
                light: entry.light,
                drift_check: entry.drift_check,
                file: session.frame_path(entry),
                settings: Settings { exposure_s: entry.exposure_s, iso: entry.iso },
                hint: entry.hint(),
            });
        }
    }
}
