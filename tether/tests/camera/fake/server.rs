//! The camera's end of the two channels, and what it does for each operation.

use super::dataset::{Dataset, DeviceInfo, card_info};
use super::packet::{Packet, kind, send, send_data, u16_at, u32_at};
use super::store::CARD;
use super::{Fault, Shared, code, locked, quality, response};
use std::io;
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::time::Duration;

/// Operations that the camera knows.
mod operation {
    pub(super) const DEVICE_INFO: u16 = 0x1001;
    pub(super) const OPEN_SESSION: u16 = 0x1002;
    pub(super) const CLOSE_SESSION: u16 = 0x1003;
    pub(super) const STORAGES: u16 = 0x1004;
    pub(super) const STORAGE_INFO: u16 = 0x1005;
    pub(super) const HANDLES: u16 = 0x1007;
    pub(super) const OBJECT_INFO: u16 = 0x1008;
    pub(super) const OBJECT: u16 = 0x1009;
    pub(super) const DELETE: u16 = 0x100B;
    pub(super) const DESCRIBE_PROPERTY: u16 = 0x1014;
    pub(super) const GET_PROPERTY: u16 = 0x1015;
    pub(super) const SET_PROPERTY: u16 = 0x1016;
    pub(super) const PART_OF_OBJECT: u16 = 0x101B;
    pub(super) const CAPTURE_IN_MEMORY: u16 = 0x90C0;
    pub(super) const EVENTS: u16 = 0x90C7;
    pub(super) const READY: u16 = 0x90C8;
    pub(super) const VENDOR_PROPERTIES: u16 = 0x90CA;
    pub(super) const CAPTURE: u16 = 0x9207;
}

const OPERATIONS: [u16; 18] = [
    operation::DEVICE_INFO,
    operation::OPEN_SESSION,
    operation::CLOSE_SESSION,
    operation::STORAGES,
    operation::STORAGE_INFO,
    operation::HANDLES,
    operation::OBJECT_INFO,
    operation::OBJECT,
    operation::DELETE,
    operation::DESCRIBE_PROPERTY,
    operation::GET_PROPERTY,
    operation::SET_PROPERTY,
    operation::PART_OF_OBJECT,
    operation::CAPTURE_IN_MEMORY,
    operation::EVENTS,
    operation::READY,
    operation::VENDOR_PROPERTIES,
    operation::CAPTURE,
];

/// Announcements that the camera makes.
mod event {
    pub(super) const OBJECT_ADDED: u16 = 0x4002;
    pub(super) const CAPTURE_COMPLETE: u16 = 0x400D;
    pub(super) const IN_MEMORY: u16 = 0xC101;
}

/// Second parameter of Nikon's capture operation: into the camera's memory.
const INTO_MEMORY: u32 = 1;
const FULL: u64 = 0;
const ROOMY: u64 = 8 << 30;

/// Takes connections until the camera is switched off.
pub(super) fn serve(listener: TcpListener, shared: Arc<Shared>) {
    std::thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            if locked(&shared.body).off {
                break;
            }
            let shared = Arc::clone(&shared);
            std::thread::spawn(move || greet(stream, &shared));
        }
    });
}

/// The first packet tells which of the two channels this is.
fn greet(mut stream: TcpStream, shared: &Arc<Shared>) {
    let _unset = stream.set_nodelay(true);
    let Ok(packet) = Packet::read(&mut stream) else { return };
    let fault = locked(&shared.body).fault;
    let ended = match (packet.kind, fault) {
        (_, Some(Fault::Asleep)) => wait_for_end(&mut stream),
        (kind::INIT_COMMAND_REQUEST, Some(Fault::Claimed)) => {
            send(&mut stream, kind::INIT_FAIL, &1_u32.to_le_bytes())
        }
        (kind::INIT_COMMAND_REQUEST, _) => commands(&mut stream, shared),
        (kind::INIT_EVENT_REQUEST, _) => {
            send(&mut stream, kind::INIT_EVENT_ACK, &[]).and_then(|()| wait_for_end(&mut stream))
        }
        _ => Ok(()),
    };
    // A host that goes away, as it may, ends the channel and nothing else.
    drop(ended);
}

fn wait_for_end(stream: &mut TcpStream) -> io::Result<()> {
    loop {
        Packet::read(stream)?;
    }
}

fn commands(stream: &mut TcpStream, shared: &Arc<Shared>) -> io::Result<()> {
    let name: Vec<u8> = "D5100\0".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let hello = [&1_u32.to_le_bytes()[..], &[0xD5; 16], &name, &0x1_0000_u32.to_le_bytes()];
    send(stream, kind::INIT_COMMAND_ACK, &hello.concat())?;
    loop {
        let request = Request::read(stream)?;
        if request.code == operation::CAPTURE {
            locked(&shared.body).operations.push(request.code);
            release(&request, shared, stream)?;
            continue;
        }
        if locked(&shared.body).is(Fault::Frozen) && request.code == operation::READY {
            return wait_for_end(stream);
        }
        let (code, data) = answer(&request, shared);
        if let Some(data) = data {
            let cut = cut_of(&request, shared);
            send_data(stream, request.transaction, &data, cut)?;
        }
        respond(stream, &request, code)?;
    }
}

/// After how many bytes the link shall break, if at all.
fn cut_of(request: &Request, shared: &Shared) -> Option<usize> {
    let mut body = locked(&shared.body);
    let picture = [operation::OBJECT, operation::PART_OF_OBJECT].contains(&request.code);
    match body.fault {
        Some(Fault::CutAfter(bytes)) if picture => {
            body.fault = None;
            Some(bytes)
        }
        _ => None,
    }
}

struct Request {
    code: u16,
    transaction: u32,
    parameters: [u32; 3],
    data: Vec<u8>,
}

/// The host's next packet carries data.
const DATA_FOLLOWS: u32 = 2;

impl Request {
    fn read(stream: &mut TcpStream) -> io::Result<Self> {
        loop {
            let packet = Packet::read(stream)?;
            if packet.kind == kind::REQUEST {
                let parameters = [10, 14, 18].map(|at| u32_at(&packet.body, at));
                let data = if u32_at(&packet.body, 0) == DATA_FOLLOWS {
                    read_data(stream)?
                } else {
                    Vec::new()
                };
                let (code, transaction) = (u16_at(&packet.body, 4), u32_at(&packet.body, 6));
                return Ok(Self { code, transaction, parameters, data });
            }
        }
    }
}

fn read_data(stream: &mut TcpStream) -> io::Result<Vec<u8>> {
    let mut data = Vec::new();
    loop {
        let packet = Packet::read(stream)?;
        if [kind::DATA, kind::END_DATA].contains(&packet.kind) {
            data.extend(packet.body.get(4..).unwrap_or_default());
        }
        if packet.kind == kind::END_DATA {
            return Ok(data);
        }
    }
}

fn respond(stream: &mut TcpStream, request: &Request, code: u16) -> io::Result<()> {
    let body = [&code.to_le_bytes()[..], &request.transaction.to_le_bytes()].concat();
    send(stream, kind::RESPONSE, &body)
}

type Answer = (u16, Option<Vec<u8>>);

fn some_or(data: Option<Vec<u8>>, otherwise: u16) -> Answer {
    data.map_or((otherwise, None), |data| (response::OK, Some(data)))
}

fn answer(request: &Request, shared: &Shared) -> Answer {
    let mut body = locked(&shared.body);
    body.operations.push(request.code);
    let [first, second, third] = request.parameters;
    let failing = body.is(Fault::DownloadError);
    match request.code {
        operation::OPEN_SESSION | operation::CLOSE_SESSION => (response::OK, None),
        operation::DEVICE_INFO => (response::OK, Some(device_info())),
        operation::VENDOR_PROPERTIES => {
            let codes = [code::AUTO_ISO, code::LONG_EXPOSURE_NOISE];
            (response::OK, Some(Dataset::default().u16s(&codes).finish()))
        }
        operation::STORAGES => (response::OK, Some(Dataset::default().u32s(&[CARD]).finish())),
        operation::STORAGE_INFO => {
            let free = if body.is(Fault::CardFull) { FULL } else { ROOMY };
            (response::OK, Some(card_info(free)))
        }
        operation::HANDLES => {
            (response::OK, Some(Dataset::default().u32s(&body.store.handles(third)).finish()))
        }
        operation::OBJECT_INFO => some_or(body.store.info(first), response::BAD_HANDLE),
        operation::OBJECT | operation::PART_OF_OBJECT if failing => (response::GENERAL_ERROR, None),
        operation::OBJECT => some_or(body.store.part(first, 0, usize::MAX), response::BAD_HANDLE),
        operation::PART_OF_OBJECT => {
            let part = body.store.part(first, second as usize, third as usize);
            some_or(part, response::BAD_HANDLE)
        }
        operation::DELETE if body.store.delete(first) => (response::OK, None),
        operation::DELETE => (response::BAD_HANDLE, None),
        operation::READY if body.exposing => (response::BUSY, None),
        operation::READY => (response::OK, None),
        operation::EVENTS => (response::OK, Some(take_events(&mut body.events))),
        operation::DESCRIBE_PROPERTY | operation::GET_PROPERTY | operation::SET_PROPERTY => {
            let Ok(Some(property)) = u16::try_from(first).map(|code| body.property(code)) else {
                return (response::NO_SUCH_PROPERTY, None);
            };
            match request.code {
                operation::DESCRIBE_PROPERTY => (response::OK, Some(property.describe())),
                operation::GET_PROPERTY => (response::OK, Some(property.encode_value())),
                _ => (property.set(&request.data).err().unwrap_or(response::OK), None),
            }
        }
        _ => (response::NOT_SUPPORTED, None),
    }
}

fn device_info() -> Vec<u8> {
    let properties: Vec<u16> =
        super::properties::factory().iter().map(|property| property.code).collect();
    let plain: Vec<u16> = properties.into_iter().filter(|code| *code < 0xD000).collect();
    let events = [event::OBJECT_ADDED, event::CAPTURE_COMPLETE, event::IN_MEMORY];
    DeviceInfo { operations: &OPERATIONS, events: &events, properties: &plain, model: "D5100" }
        .encode()
}

fn take_events(events: &mut Vec<(u16, u32)>) -> Vec<u8> {
    let count = u16::try_from(events.len()).expect("a short list");
    let list = Dataset::default().u16(count);
    events.drain(..).fold(list, |list, (code, parameter)| list.u16(code).u32(parameter)).finish()
}

/// Nikon's capture: the response comes at once, the exposure takes its time, the picture is announced at its end.
fn release(request: &Request, shared: &Arc<Shared>, stream: &mut TcpStream) -> io::Result<()> {
    let mut body = locked(&shared.body);
    let refused = match body.fault {
        Some(Fault::OutOfFocus) => Some(response::OUT_OF_FOCUS),
        Some(Fault::CardFull) => Some(response::STORE_FULL),
        _ if body.exposing => Some(response::BUSY),
        _ => None,
    };
    if let Some(code) = refused {
        drop(body);
        return respond(stream, request, code);
    }
    body.exposing = true;
    let tenths_ms = body.property(code::SHUTTER).map_or(0, |shutter| shutter.value);
    drop(body);
    let on_card = request.parameters[1] != INTO_MEMORY;
    let shared = Arc::clone(shared);
    let exposure = Duration::from_micros(100 * u64::from(tenths_ms));
    std::thread::spawn(move || expose(&shared, exposure, on_card));
    respond(stream, request, response::OK)
}

fn expose(shared: &Shared, exposure: Duration, on_card: bool) {
    locked(&shared.scene).opened(exposure);
    std::thread::sleep(exposure);
    let file = locked(&shared.scene).closed();
    let mut body = locked(&shared.body);
    if body.is(Fault::NeverReady) {
        return;
    }
    body.exposing = false;
    if body.is(Fault::NoObject) {
        return;
    }
    if let Some(Fault::Late(delay)) = body.fault {
        drop(body);
        std::thread::sleep(delay);
        body = locked(&shared.body);
    }
    let jpeg = body.is(Fault::Jpeg)
        || body.property(code::QUALITY).is_some_and(|quality| quality.value < quality::NEF);
    let handle = body.store.add(file, jpeg, on_card);
    let announced = if on_card { event::OBJECT_ADDED } else { event::IN_MEMORY };
    body.events.extend([(announced, handle), (event::CAPTURE_COMPLETE, 0)]);
}
