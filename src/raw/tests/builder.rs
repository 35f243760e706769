//! Builds small TIFF structures: DNG, NEF and pictures for tests.

use crate::raw::tags::Order;

/// The values of one entry.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Byte(Vec<u8>),
    Ascii(&'static str),
    Short(Vec<u16>),
    Long(Vec<u32>),
    Rational(Vec<[u32; 2]>),
    SignedRational(Vec<[i32; 2]>),
    Undefined(Vec<u8>),
    /// Pieces of data; the entry holds where each begins.
    Blobs(Vec<Vec<u8>>),
    /// A directory of its own; the entry holds where it begins.
    Directory(Entries),
}

pub(crate) type Entries = Vec<(u16, Value)>;

/// A whole file of one directory (and those inside it).
pub(crate) fn tiff(order: Order, entries: &Entries) -> Vec<u8> {
    let mut writer = Writer { order, bytes: Vec::new() };
    writer.bytes.extend(if order == Order::Little { b"II" } else { b"MM" });
    writer.u16(42);
    writer.u32(0);
    let first = writer.directory(entries);
    let first = writer.field(first);
    writer.bytes[4..8].copy_from_slice(&first);
    writer.bytes
}

struct Writer {
    order: Order,
    bytes: Vec<u8>,
}

impl Writer {
    fn u16(&mut self, value: u16) {
        let bytes =
            if self.order == Order::Little { value.to_le_bytes() } else { value.to_be_bytes() };
        self.bytes.extend(bytes);
    }

    fn u32(&mut self, value: u32) {
        let bytes = self.field(value);
        self.bytes.extend(bytes);
    }

    fn field(&self, value: u32) -> [u8; 4] {
        if self.order == Order::Little { value.to_le_bytes() } else { value.to_be_bytes() }
    }

    /// Writes what the entries point at, then the directory itself; returns where that is.
    fn directory(&mut self, entries: &Entries) -> u32 {
        let mut fields: Vec<(u16, u16, u32, Vec<u8>)> =
            entries.iter().map(|(tag, value)| self.entry(*tag, value)).collect();
        fields.sort_by_key(|field| field.0);
        self.align();
        let start = self.bytes.len() as u32;
        self.u16(fields.len() as u16);
        for (tag, kind, count, field) in fields {
            self.u16(tag);
            self.u16(kind);
            self.u32(count);
            self.bytes.extend(field);
        }
        self.u32(0);
        start
    }

    fn align(&mut self) {
        if self.bytes.len() % 2 == 1 {
            self.bytes.push(0);
        }
    }

    /// Tag, type, count and the four bytes of the entry.
    fn entry(&mut self, tag: u16, value: &Value) -> (u16, u16, u32, Vec<u8>) {
        let (kind, count, bytes) = self.encoded(value);
        let field = if bytes.len() <= 4 {
            let mut field = bytes;
            field.resize(4, 0);
            field
        } else {
            self.align();
            let at = self.bytes.len() as u32;
            self.bytes.extend(bytes);
            self.field(at).to_vec()
        };
        (tag, kind, count as u32, field)
    }

    fn encoded(&mut self, value: &Value) -> (u16, usize, Vec<u8>) {
        let longs = |this: &Self, values: &[u32]| {
            values.iter().flat_map(|&value| this.field(value)).collect()
        };
        match value {
            Value::Byte(bytes) => (1, bytes.len(), bytes.clone()),
            Value::Ascii(text) => (2, text.len() + 1, text.bytes().chain([0]).collect()),
            Value::Short(values) => {
                let mut inner = Writer { order: self.order, bytes: Vec::new() };
                values.iter().for_each(|&value| inner.u16(value));
                (3, values.len(), inner.bytes)
            }
            Value::Long(values) => (4, values.len(), longs(self, values)),
            Value::Rational(values) => (5, values.len(), longs(self, values.as_flattened())),
            Value::SignedRational(values) => {
                let flat: Vec<u32> =
                    values.as_flattened().iter().map(|&value| value as u32).collect();
                (10, values.len(), longs(self, &flat))
            }
            Value::Undefined(bytes) => (7, bytes.len(), bytes.clone()),
            Value::Blobs(blobs) => {
                let places: Vec<u32> = blobs.iter().map(|blob| self.blob(blob)).collect();
                (4, places.len(), longs(self, &places))
            }
            Value::Directory(entries) => {
                let at = self.directory(entries);
                (4, 1, longs(self, &[at]))
            }
        }
    }

    fn blob(&mut self, blob: &[u8]) -> u32 {
        self.align();
        let at = self.bytes.len() as u32;
        self.bytes.extend(blob);
        at
    }
}
