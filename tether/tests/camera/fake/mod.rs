//! A D5100 that speaks PTP/IP: what is needed to let the unmodified libgphoto2 set it up, release it and fetch its pictures.
//!
//! It keeps time as a camera does (busy for the exposure), looks at its [`Scene`] when the shutter opens and when it closes,
//! and fails in the ways of [`Fault`].

mod dataset;
mod packet;
mod properties;
mod server;
mod store;

pub(crate) use properties::{code, dial, quality};

use properties::Property;
use std::net::TcpListener;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use store::Store;

/// What the camera answers with.
pub(crate) mod response {
    pub(crate) const OK: u16 = 0x2001;
    pub(crate) const GENERAL_ERROR: u16 = 0x2002;
    pub(crate) const NOT_SUPPORTED: u16 = 0x2005;
    pub(crate) const BAD_HANDLE: u16 = 0x2009;
    pub(crate) const NO_SUCH_PROPERTY: u16 = 0x200A;
    pub(crate) const STORE_FULL: u16 = 0x200C;
    pub(crate) const ACCESS_DENIED: u16 = 0x200F;
    pub(crate) const BUSY: u16 = 0x2019;
    pub(crate) const BAD_FORMAT: u16 = 0x201B;
    pub(crate) const BAD_VALUE: u16 = 0x201C;
    pub(crate) const OUT_OF_FOCUS: u16 = 0xA002;
}

/// What the lens looks at.
pub(crate) trait Scene: Send {
    /// The shutter opens.
    fn opened(&mut self, exposure: Duration);
    /// The shutter closes; the file that the camera makes of it.
    fn closed(&mut self) -> Vec<u8>;
}

/// The same file every time.
pub(crate) struct Still(pub(crate) Vec<u8>);

impl Scene for Still {
    fn opened(&mut self, _exposure: Duration) {}

    fn closed(&mut self) -> Vec<u8> {
        self.0.clone()
    }
}

/// What goes wrong, until [`FakeCamera::repair`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    /// The autofocus finds nothing.
    OutOfFocus,
    /// No room on the card.
    CardFull,
    /// It releases, but no picture is ever announced.
    NoObject,
    /// It is busy for ever after the release.
    NeverReady,
    /// The link breaks after so many bytes of the next picture, once.
    CutAfter(usize),
    /// It reports an error instead of the picture.
    DownloadError,
    /// Whatever it is set to, it writes JPEG.
    Jpeg,
    /// It takes connections, but does not answer.
    Asleep,
    /// It belongs to another host.
    Claimed,
    /// It stops answering after the release.
    Frozen,
    /// Its pictures are announced so much later than they should be.
    Late(Duration),
}

/// The camera. It is switched off when this value is dropped.
pub(crate) struct FakeCamera {
    port: u16,
    shared: Arc<Shared>,
}

struct Shared {
    body: Mutex<Body>,
    scene: Mutex<Box<dyn Scene>>,
}

/// The camera's state.
struct Body {
    properties: Vec<Property>,
    store: Store,
    /// Codes and parameters of Nikon's event queue.
    events: Vec<(u16, u32)>,
    exposing: bool,
    fault: Option<Fault>,
    off: bool,
    /// Operations since the start.
    operations: Vec<u16>,
}

fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl FakeCamera {
    /// Switches one on that looks at `scene`.
    pub(crate) fn start(scene: impl Scene + 'static) -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a free port");
        let port = listener.local_addr().expect("its address").port();
        let body = Body {
            properties: properties::factory(),
            store: Store::new(),
            events: Vec::new(),
            exposing: false,
            fault: None,
            off: false,
            operations: Vec::new(),
        };
        let shared =
            Arc::new(Shared { body: Mutex::new(body), scene: Mutex::new(Box::new(scene)) });
        server::serve(listener, Arc::clone(&shared));
        Self { port, shared }
    }

    /// As libgphoto2 names it.
    pub(crate) fn port(&self) -> String {
        format!("ptpip:127.0.0.1:{0}:{0}", self.port)
    }

    /// Lets it fail.
    pub(crate) fn fail(&self, fault: Fault) {
        locked(&self.shared.body).fault = Some(fault);
    }

    /// Ends the failing.
    pub(crate) fn repair(&self) {
        let mut body = locked(&self.shared.body);
        body.fault = None;
        body.exposing = false;
    }

    /// A setting's value.
    pub(crate) fn setting(&self, code: u16) -> u32 {
        locked(&self.shared.body).property(code).expect("a setting of the camera").value
    }

    /// Changes a setting at the camera itself.
    pub(crate) fn turn(&self, code: u16, value: u32) {
        locked(&self.shared.body).property(code).expect("a setting of the camera").value = value;
    }

    /// Turns the mode dial: shutter and aperture can be set on M only.
    pub(crate) fn turn_dial(&self, mode: u32) {
        self.turn(code::PROGRAM, mode);
        let mut body = locked(&self.shared.body);
        for code in [code::SHUTTER, code::APERTURE] {
            body.property(code).expect("a setting of the camera").writable = mode == dial::MANUAL;
        }
    }

    /// How often it was asked to do `operation`.
    pub(crate) fn count(&self, operation: u16) -> usize {
        locked(&self.shared.body).operations.iter().filter(|done| **done == operation).count()
    }
}

impl Drop for FakeCamera {
    fn drop(&mut self) {
        locked(&self.shared.body).off = true;
        // The listener wakes up and sees it.
        let _woken = std::net::TcpStream::connect(("127.0.0.1", self.port));
    }
}

impl Body {
    fn property(&mut self, code: u16) -> Option<&mut Property> {
        self.properties.iter_mut().find(|property| property.code == code)
    }

    fn is(&self, fault: Fault) -> bool {
        self.fault == Some(fault)
    }
}
