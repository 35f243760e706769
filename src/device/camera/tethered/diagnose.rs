//! What `doctor` tells of tethered cameras.

use super::protocol::{Answer, Request};
use super::{Tether, fault, open};
use crate::device::camera::CameraError;

/// What was found.
#[derive(Debug)]
pub struct Diagnosis {
    /// The version of libgphoto2, or why tethering does not work at all: a sentence that says what to do.
    pub libgphoto2: Result<String, CameraError>,
    /// The cameras, and what is wrong with them; empty: none is connected.
    pub cameras: Vec<FoundCamera>,
}

/// A camera that is connected.
#[derive(Debug)]
pub struct FoundCamera {
    /// libgphoto2's name of the port.
    pub port: String,
    /// As the camera says, or as libgphoto2 calls it.
    pub model: String,
    /// Charge of its battery, where it tells.
    pub battery_percent: Option<u8>,
    /// What is wrong and what to do.
    pub problem: Option<CameraError>,
}

/// Takes hold of the camera at `tether.port`, or of each that is connected, for a moment. Nothing is set or released.
pub fn diagnose(tether: &Tether) -> Diagnosis {
    let none = |error| Diagnosis { libgphoto2: Err(error), cameras: Vec::new() };
    let mut helper = match tether.start() {
        Ok(helper) => helper,
        Err(error) => return none(error),
    };
    let version = match helper.call(Request::Hello, tether.patience, &mut |_| {}) {
        Ok(Answer::Hello(versions)) => versions.libgphoto2,
        Ok(_) => "unknown".to_owned(),
        Err(error) => return none(fault::camera_error(error, tether.picture_within)),
    };
    let cameras = match &tether.port {
        Some(port) => vec![(String::new(), port.clone())],
        None => match helper.call(Request::List, tether.patience, &mut |_| {}) {
            Ok(Answer::Cameras(found)) => {
                found.into_iter().map(|camera| (camera.model, camera.port)).collect()
            }
            Ok(_) => Vec::new(),
            Err(error) => return none(fault::camera_error(error, tether.picture_within)),
        },
    };
    drop(helper);
    let cameras = cameras.into_iter().map(|(model, port)| look_at(tether, model, port)).collect();
    Diagnosis { libgphoto2: Ok(version), cameras }
}

/// Each with a helper of its own: one that blocks does not hide the others.
fn look_at(tether: &Tether, model: String, port: String) -> FoundCamera {
    let tether = Tether { port: Some(port.clone()), ..tether.clone() };
    match tether.start().and_then(|mut helper| open(&mut helper, &tether)) {
        Ok(opened) => FoundCamera {
            port,
            model: opened.model,
            battery_percent: opened.battery_percent,
            problem: None,
        },
        Err(error) => FoundCamera { port, model, battery_percent: None, problem: Some(error) },
    }
}
