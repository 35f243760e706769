//! PTP data sets (ISO 15740), as a camera writes them.

/// A data set as it grows.
#[derive(Default)]
pub(super) struct Dataset(Vec<u8>);

impl Dataset {
    pub(super) fn u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    pub(super) fn u16(mut self, value: u16) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub(super) fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub(super) fn u64(mut self, value: u64) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Length with the final zero, then UTF-16; an empty one is the length 0.
    pub(super) fn text(mut self, text: &str) -> Self {
        if text.is_empty() {
            return self.u8(0);
        }
        let units: Vec<u16> = text.encode_utf16().chain([0]).collect();
        self.0.push(u8::try_from(units.len()).expect("a short text"));
        units.into_iter().fold(self, Self::u16)
    }

    pub(super) fn u16s(self, values: &[u16]) -> Self {
        let counted = self.u32(u32::try_from(values.len()).expect("a short list"));
        values.iter().copied().fold(counted, Self::u16)
    }

    pub(super) fn u32s(self, values: &[u32]) -> Self {
        let counted = self.u32(u32::try_from(values.len()).expect("a short list"));
        values.iter().copied().fold(counted, Self::u32)
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }
}

/// What the camera says of itself.
pub(super) struct DeviceInfo<'a> {
    pub(super) operations: &'a [u16],
    pub(super) events: &'a [u16],
    pub(super) properties: &'a [u16],
    pub(super) model: &'a str,
}

/// Nikon's number among the vendors of PTP extensions.
const NIKON: u32 = 0x0A;
const JPEG: u16 = 0x3801;
const UNDEFINED: u16 = 0x3000;

impl DeviceInfo<'_> {
    pub(super) fn encode(&self) -> Vec<u8> {
        Dataset::default()
            .u16(100)
            .u32(NIKON)
            .u16(100)
            .text("")
            .u16(0)
            .u16s(self.operations)
            .u16s(self.events)
            .u16s(self.properties)
            .u16s(&[JPEG])
            .u16s(&[UNDEFINED, JPEG])
            .text("Nikon Corporation")
            .text(self.model)
            .text("V1.02")
            .text("00000000000000000000000006001234")
            .finish()
    }
}

/// An object of the camera's store, or of its memory.
#[derive(Clone)]
pub(super) struct ObjectInfo {
    pub(super) storage: u32,
    pub(super) format: u16,
    pub(super) size: u32,
    pub(super) parent: u32,
    pub(super) name: String,
}

impl ObjectInfo {
    pub(super) const FOLDER: u16 = 0x3001;

    /// Of a picture; its name tells the format.
    pub(super) fn picture(storage: u32, parent: u32, name: &str, size: usize) -> Self {
        let format = if name.ends_with(".JPG") { JPEG } else { UNDEFINED };
        let size = u32::try_from(size).expect("a picture below 4 GB");
        Self { storage, format, size, parent, name: name.to_owned() }
    }

    pub(super) fn folder(storage: u32, parent: u32, name: &str) -> Self {
        Self { storage, format: Self::FOLDER, size: 0, parent, name: name.to_owned() }
    }

    pub(super) fn encode(&self) -> Vec<u8> {
        let start = Dataset::default().u32(self.storage).u16(self.format).u16(0).u32(self.size);
        let thumbnail = start.u16(JPEG).u32(0).u32(160).u32(120);
        let picture = thumbnail.u32(4928).u32(3264).u32(14).u32(self.parent);
        let association = u16::from(self.format == Self::FOLDER);
        let order = picture.u16(association).u32(0).u32(0);
        order.text(&self.name).text("20261122T101500").text("20261122T101500").text("").finish()
    }
}

/// The memory card.
pub(super) fn card_info(free_bytes: u64) -> Vec<u8> {
    let free_pictures = u32::try_from(free_bytes / (20 << 20)).unwrap_or(u32::MAX);
    Dataset::default()
        .u16(4) // removable RAM
        .u16(3) // folders as a camera makes them
        .u16(0)
        .u64(16 << 30)
        .u64(free_bytes)
        .u32(free_pictures)
        .text("")
        .text("NIKON D5100")
        .finish()
}
