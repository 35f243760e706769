//! Taking a frame: release, wait for the shutter to close, wait for the picture, save it.

use crate::camera::Camera;
use crate::fault::Doing;
use crate::talk::Outlet;
use crate::told;
use gphoto2::camera::CameraEvent;
use gphoto2::file::CameraFilePath;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};
use weavelight::device::camera::tethered::protocol::{Captured, Fault, Moment};

/// How often the camera is asked for news.
const POLL: Duration = Duration::from_millis(10);
/// More announcements than these at once are a camera gone mad.
const STALE: usize = 64;

/// How long things take.
#[derive(Clone, Copy)]
pub(crate) struct Times {
    exposure: Duration,
    picture_within: Duration,
}

impl Times {
    /// In seconds.
    pub(crate) fn new(exposure_s: f64, picture_within_s: f64) -> Result<Self, Fault> {
        let of = |seconds| {
            Duration::try_from_secs_f64(seconds)
                .map_err(|error| Fault::Other { reason: error.to_string() })
        };
        Ok(Self { exposure: of(exposure_s)?, picture_within: of(picture_within_s)? })
    }
}

/// Takes a frame and saves it to `file`.
pub(crate) fn capture(
    camera: &Camera,
    file: &Path,
    times: Times,
    outlet: &mut Outlet,
) -> Result<Captured, Fault> {
    drop_stale(camera)?;
    let start = Instant::now();
    told(camera.held.trigger_capture().wait(), Doing::Using)?;
    // Most cameras are busy until the shutter has closed; some return at once.
    std::thread::sleep(times.exposure.saturating_sub(start.elapsed()));
    outlet.moment(Moment::ShutterClosed);
    let picture = announced(camera, Instant::now() + times.picture_within)?;
    let name = picture.name().into_owned();
    let saved = if is_jpeg(&name) {
        Err(Fault::NotRaw { name: name.clone() })
    } else {
        save(camera, &picture, file)
    };
    // The camera must not fill; a picture that cannot be deleted is only in its way.
    let _left = camera.held.fs().delete_file(&picture.folder(), &name).wait();
    Ok(Captured { name, bytes: saved? })
}

/// Pictures of earlier, failed captures that were announced late must not pass for this one.
fn drop_stale(camera: &Camera) -> Result<(), Fault> {
    for _ in 0..STALE {
        match told(camera.held.wait_event(Duration::ZERO).wait(), Doing::Using)? {
            CameraEvent::Timeout => return Ok(()),
            CameraEvent::NewFile(picture) => {
                let _left = camera.held.fs().delete_file(&picture.folder(), &picture.name()).wait();
            }
            _ => {}
        }
    }
    Err(Fault::Busy)
}

fn announced(camera: &Camera, deadline: Instant) -> Result<CameraFilePath, Fault> {
    while Instant::now() < deadline {
        if let CameraEvent::NewFile(picture) =
            told(camera.held.wait_event(POLL).wait(), Doing::Using)?
        {
            return Ok(picture);
        }
    }
    Err(Fault::NoPicture)
}

fn is_jpeg(name: &str) -> bool {
    let extension = Path::new(name).extension().unwrap_or_default();
    extension.eq_ignore_ascii_case("jpg") || extension.eq_ignore_ascii_case("jpeg")
}

/// Through memory: the library's own errors do not tell a full disk from a broken link.
fn save(camera: &Camera, picture: &CameraFilePath, file: &Path) -> Result<u64, Fault> {
    let download = camera.held.fs().download(&picture.folder(), &picture.name());
    let downloaded = told(download.wait(), Doing::Using)?;
    let data = told(downloaded.get_data(&camera.held).wait(), Doing::Using)?;
    let written = File::create_new(file).and_then(|mut file| {
        file.write_all(&data)?;
        file.sync_all()
    });
    written.map(|()| data.len() as u64).map_err(|error| Fault::File {
        path: file.display().to_string(),
        reason: error.to_string(),
    })
}
