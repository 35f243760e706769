//! `weavelight-tether`: holds libgphoto2 for `weavelight`, which starts it, talks to it in lines, and kills it when the library
//! blocks. The lines are described in `weavelight::device::camera::tethered::protocol`.

mod camera;
mod capture;
mod choice;
mod configure;
mod fault;
mod recent;
mod talk;

use camera::Camera;
use fault::Doing;
use std::io::BufRead;
use std::process::ExitCode;
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;
use talk::Outlet;
use weavelight::device::camera::tethered::protocol::{
    Answer, Call, Fault, PROTOCOL, Request, Versions,
};

/// How long the library may take to let the camera go after the parent has ended.
const GRACE: Duration = Duration::from_secs(2);

fn main() -> ExitCode {
    weavelight::files::survive_size_limits();
    recent::listen();
    let context = match gphoto2::Context::new() {
        Ok(context) => context,
        // The parent sees that its helper ended at once.
        Err(_) => return ExitCode::FAILURE,
    };
    let mut helper = Helper { context, camera: None, outlet: Outlet::new() };
    for call in calls() {
        helper.outlet.begin(call.id);
        recent::forget();
        let result = helper.answer(call.request);
        helper.outlet.end(result);
    }
    ExitCode::SUCCESS
}

/// The requests on standard input. They come from a thread of their own, which ends the process soon after the parent is gone,
/// whatever the library is waiting for.
fn calls() -> Receiver<Call> {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            // A line that is none of ours cannot be answered, having no number.
            let Ok(call) = serde_json::from_str(&line) else { continue };
            if sender.send(call).is_err() {
                return;
            }
        }
        drop(sender);
        std::thread::sleep(GRACE);
        std::process::exit(1);
    });
    receiver
}

struct Helper {
    context: gphoto2::Context,
    camera: Option<Camera>,
    outlet: Outlet,
}

impl Helper {
    fn answer(&mut self, request: Request) -> Result<Answer, Fault> {
        match request {
            Request::Hello => Ok(Answer::Hello(versions())),
            Request::List => camera::list(&self.context).map(Answer::Cameras),
            Request::Open { port } => {
                // A camera that is held cannot be taken hold of again.
                self.camera = None;
                let camera = Camera::open(&self.context, port.as_deref())?;
                let opened = camera.opened();
                self.camera = Some(camera);
                Ok(Answer::Opened(opened))
            }
            Request::Configure(setup) => {
                configure::configure(self.camera()?, &setup).map(Answer::Configured)
            }
            Request::Capture { file, exposure_s, picture_within_s } => {
                let camera = self.camera.as_ref().ok_or(Fault::NoCamera)?;
                let times = capture::Times::new(exposure_s, picture_within_s)?;
                capture::capture(camera, &file, times, &mut self.outlet)
                    .map_err(|fault| camera.blame_battery(fault))
                    .map(Answer::Captured)
            }
        }
    }

    fn camera(&self) -> Result<&Camera, Fault> {
        self.camera.as_ref().ok_or(Fault::NoCamera)
    }
}

fn versions() -> Versions {
    Versions {
        protocol: PROTOCOL,
        program: concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")).to_owned(),
        libgphoto2: gphoto2::library_version().unwrap_or("unknown").to_owned(),
    }
}

/// A result of libgphoto2 with its error translated.
fn told<T>(result: gphoto2::Result<T>, doing: Doing) -> Result<T, Fault> {
    result.map_err(|error| fault::of(&error, &recent::log(), doing))
}
