//! PTP/IP: packets of a length, a type and a body over TCP (CIPA DC-005), little-endian as PTP is.

use std::io::{self, Read, Write};

/// Largest packet that is taken: nothing that a host sends to a camera comes near it.
const LARGEST: u32 = 1 << 20;
/// How much of a file goes into one packet.
const CHUNK: usize = 256 << 10;

/// Types of packets.
pub(super) mod kind {
    pub(crate) const INIT_COMMAND_REQUEST: u32 = 1;
    pub(crate) const INIT_COMMAND_ACK: u32 = 2;
    pub(crate) const INIT_EVENT_REQUEST: u32 = 3;
    pub(crate) const INIT_EVENT_ACK: u32 = 4;
    pub(crate) const INIT_FAIL: u32 = 5;
    pub(crate) const REQUEST: u32 = 6;
    pub(crate) const RESPONSE: u32 = 7;
    pub(crate) const START_DATA: u32 = 9;
    pub(crate) const DATA: u32 = 10;
    pub(crate) const END_DATA: u32 = 12;
}

/// One packet.
pub(super) struct Packet {
    pub(super) kind: u32,
    pub(super) body: Vec<u8>,
}

impl Packet {
    /// The next one.
    pub(super) fn read(from: &mut impl Read) -> io::Result<Self> {
        let mut head = [0; 8];
        from.read_exact(&mut head)?;
        let (length, kind) = (u32_at(&head, 0), u32_at(&head, 4));
        if !(8..=LARGEST).contains(&length) {
            return Err(io::Error::other(format!("a packet of {length} bytes")));
        }
        let mut body = vec![0; length as usize - 8];
        from.read_exact(&mut body)?;
        Ok(Self { kind, body })
    }
}

/// Sends a packet.
pub(super) fn send(to: &mut impl Write, kind: u32, body: &[u8]) -> io::Result<()> {
    let length = 8 + u32::try_from(body.len()).map_err(io::Error::other)?;
    let mut head = length.to_le_bytes().to_vec();
    head.extend(kind.to_le_bytes());
    to.write_all(&head)?;
    to.write_all(body)
}

/// Sends the data phase of a transaction; `cut_after`: only so many bytes of it.
pub(super) fn send_data(
    to: &mut impl Write,
    transaction: u32,
    data: &[u8],
    cut_after: Option<usize>,
) -> io::Result<()> {
    let mut start = transaction.to_le_bytes().to_vec();
    start.extend((data.len() as u64).to_le_bytes());
    send(to, kind::START_DATA, &start)?;
    let sent = &data[..cut_after.unwrap_or(data.len()).min(data.len())];
    for chunk in sent.chunks(CHUNK) {
        send(to, kind::DATA, &[&transaction.to_le_bytes(), chunk].concat())?;
    }
    if sent.len() < data.len() {
        return Err(io::Error::other("the link was cut on purpose"));
    }
    send(to, kind::END_DATA, &transaction.to_le_bytes())
}

/// A number at an offset; 0 beyond the end.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    let part = bytes.get(at..at + 4).and_then(|part| part.try_into().ok());
    part.map_or(0, u32::from_le_bytes)
}

/// A number at an offset; 0 beyond the end.
pub(super) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    let part = bytes.get(at..at + 2).and_then(|part| part.try_into().ok());
    part.map_or(0, u16::from_le_bytes)
}
