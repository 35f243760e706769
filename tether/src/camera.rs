//! Finding a camera and taking hold of it.

use crate::fault::{self, Doing};
use crate::{recent, told};
use gphoto2::Context;
use gphoto2::error::ErrorKind;
use gphoto2::list::CameraDescriptor;
use gphoto2::widget::{TextWidget, Widget};
use weavelight::device::camera::tethered::protocol::{Fault, Found, Opened};

/// libgphoto2's driver for whatever speaks PTP over a network.
const NETWORK_MODEL: &str = "PTP/IP Camera";
/// Below this a camera stops in the middle of a capture session, or refuses to release.
const LOW_BATTERY_PERCENT: u8 = 10;

/// The cameras that are connected. Card readers and serial ports, which the library lists too, are none.
pub(crate) fn list(context: &Context) -> Result<Vec<Found>, Fault> {
    let found = told(context.list_cameras().wait(), Doing::Opening)?;
    let cameras = found.map(|camera| Found { model: camera.model, port: camera.port });
    Ok(cameras.filter(|camera| is_camera(&camera.port)).collect())
}

fn is_camera(port: &str) -> bool {
    port.starts_with("usb:") || port.starts_with("ptpip:")
}

fn choose(context: &Context, port: Option<&str>) -> Result<Found, Fault> {
    let model = NETWORK_MODEL.to_owned();
    if let Some(port) = port.filter(|port| port.starts_with("ptpip:")) {
        return Ok(Found { model, port: port.to_owned() });
    }
    let mut found = list(context)?;
    if let Some(port) = port {
        found.retain(|camera| camera.port == port);
    }
    match found.len() {
        0 => Err(Fault::NoCamera),
        1 => Ok(found.remove(0)),
        _ => Err(Fault::Several { found }),
    }
}

/// The library's answer for a setting that the camera does not have.
fn is_missing(error: &gphoto2::Error) -> bool {
    matches!(error.kind(), ErrorKind::BadParameters | ErrorKind::NotSupported)
}

/// A camera that is held.
pub(crate) struct Camera {
    pub(crate) held: gphoto2::Camera,
    model: String,
    port: String,
}

impl Camera {
    /// Takes hold of the camera at `port`, or of the only one.
    pub(crate) fn open(context: &Context, port: Option<&str>) -> Result<Self, Fault> {
        let Found { model, port } = choose(context, port)?;
        let descriptor = CameraDescriptor { model: model.clone(), port: port.clone() };
        let held = told(context.get_camera(&descriptor).wait(), Doing::Opening)?;
        // The library connects with the first call that needs the camera, whether or not it has such a setting.
        match held.config_key::<Widget>("cameramodel").wait() {
            Err(error) if !is_missing(&error) => {
                return Err(fault::of(&error, &recent::log(), Doing::Opening));
            }
            _ => {}
        }
        let mut camera = Self { held, model, port };
        camera.model = camera.text("cameramodel").unwrap_or(camera.model);
        Ok(camera)
    }

    pub(crate) fn opened(&self) -> Opened {
        let battery_percent = self.battery_percent();
        Opened { model: self.model.clone(), port: self.port.clone(), battery_percent }
    }

    /// A setting of that name, if the camera has it.
    pub(crate) fn widget(&self, name: &str) -> Option<Widget> {
        self.held.config_key::<Widget>(name).wait().ok()
    }

    fn text(&self, name: &str) -> Option<String> {
        let widget: TextWidget = self.widget(name)?.try_into().ok()?;
        Some(widget.value())
    }

    fn battery_percent(&self) -> Option<u8> {
        self.text("batterylevel")?.trim().trim_end_matches('%').parse().ok()
    }

    /// # Errors
    /// Where the battery will not last.
    pub(crate) fn check_battery(&self) -> Result<(), Fault> {
        match self.battery_percent() {
            Some(percent) if percent < LOW_BATTERY_PERCENT => Err(Fault::Battery { percent }),
            _ => Ok(()),
        }
    }

    /// A camera with a low battery fails in many ways, none of which names it.
    pub(crate) fn blame_battery(&self, fault: Fault) -> Fault {
        match fault {
            Fault::Other { .. } | Fault::NoPicture => self.check_battery().err().unwrap_or(fault),
            named => named,
        }
    }
}
