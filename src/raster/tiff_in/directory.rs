//! Directories of a TIFF or BigTIFF file. TIFF 6.0, section 2; "BigTIFF file format", libtiff. Nothing is allocated that the file's
//! own length does not bound.

use super::super::PictureError;

/// Tags that pictures need: TIFF 6.0, its supplements, and ICC.1.
pub(super) mod tag {
    pub(in super::super) const NEW_SUBFILE_TYPE: u16 = 254;
    pub(in super::super) const WIDTH: u16 = 256;
    pub(in super::super) const HEIGHT: u16 = 257;
    pub(in super::super) const BITS_PER_SAMPLE: u16 = 258;
    pub(in super::super) const COMPRESSION: u16 = 259;
    pub(in super::super) const PHOTOMETRIC: u16 = 262;
    pub(in super::super) const FILL_ORDER: u16 = 266;
    pub(in super::super) const STRIP_OFFSETS: u16 = 273;
    pub(in super::super) const SAMPLES_PER_PIXEL: u16 = 277;
    pub(in super::super) const ROWS_PER_STRIP: u16 = 278;
    pub(in super::super) const STRIP_BYTE_COUNTS: u16 = 279;
    pub(in super::super) const MAX_SAMPLE_VALUE: u16 = 281;
    pub(in super::super) const PLANAR_CONFIGURATION: u16 = 284;
    pub(in super::super) const GRAY_RESPONSE_CURVE: u16 = 291;
    pub(in super::super) const TRANSFER_FUNCTION: u16 = 301;
    pub(in super::super) const PREDICTOR: u16 = 317;
    pub(in super::super) const WHITE_POINT: u16 = 318;
    pub(in super::super) const PRIMARY_CHROMATICITIES: u16 = 319;
    pub(in super::super) const COLOR_MAP: u16 = 320;
    pub(in super::super) const TILE_WIDTH: u16 = 322;
    pub(in super::super) const TILE_HEIGHT: u16 = 323;
    pub(in super::super) const TILE_OFFSETS: u16 = 324;
    pub(in super::super) const TILE_BYTE_COUNTS: u16 = 325;
    pub(in super::super) const SUB_IFDS: u16 = 330;
    pub(in super::super) const EXTRA_SAMPLES: u16 = 338;
    pub(in super::super) const SAMPLE_FORMAT: u16 = 339;
    pub(in super::super) const S_MAX_SAMPLE_VALUE: u16 = 341;
    pub(in super::super) const XMP: u16 = 700;
    pub(in super::super) const IPTC: u16 = 33_723;
    pub(in super::super) const PHOTOSHOP: u16 = 34_377;
    pub(in super::super) const ICC_PROFILE: u16 = 34_675;
    pub(in super::super) const PHOTOSHOP_LAYERS: u16 = 37_724;
}

/// Directories beyond this number are a loop or an attack.
const MOST_DIRECTORIES: usize = 4096;

/// A file's bytes with its byte order.
#[derive(Clone, Copy)]
pub(super) struct File<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) big_endian: bool,
    /// 64-bit offsets.
    wide: bool,
}

impl<'a> File<'a> {
    /// `None` where it is no TIFF.
    pub(super) fn new(bytes: &'a [u8]) -> Option<Self> {
        let big_endian = match bytes.get(..2)? {
            b"II" => false,
            b"MM" => true,
            _ => return None,
        };
        let narrow = Self { bytes, big_endian, wide: false };
        let wide = match narrow.unsigned(2, 2)? {
            42 => false,
            43 => narrow.unsigned(4, 2)? == 8,
            _ => return None,
        };
        Some(Self { wide, ..narrow })
    }

    fn slice(&self, offset: u64, length: u64) -> Option<&'a [u8]> {
        let end = offset.checked_add(length)?;
        self.bytes.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?)
    }

    /// An unsigned integer of 1 to 8 bytes.
    pub(super) fn unsigned(&self, offset: u64, size: u64) -> Option<u64> {
        let bytes = self.slice(offset, size)?;
        let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        Some(if self.big_endian {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        })
    }

    /// Every directory: the chain, and those inside. The first of all first.
    pub(super) fn directories(self) -> Vec<Directory<'a>> {
        let (at, size) = if self.wide { (8, 8) } else { (4, 4) };
        let mut waiting: Vec<u64> = self.unsigned(at, size).into_iter().collect();
        let (mut seen, mut found) = (std::collections::HashSet::new(), Vec::new());
        while let Some(offset) = waiting.pop() {
            if offset == 0 || found.len() == MOST_DIRECTORIES || !seen.insert(offset) {
                continue;
            }
            let Some((directory, next)) = Directory::parse(self, offset) else { continue };
            waiting.push(next);
            let inside = directory.integers(tag::SUB_IFDS).unwrap_or_default();
            waiting.extend(inside.into_iter().take(MOST_DIRECTORIES).rev());
            found.push(directory);
        }
        found
    }
}

/// One entry.
#[derive(Clone, Copy)]
struct Entry {
    tag: u16,
    kind: u64,
    count: u64,
    offset: u64,
}

/// One directory: usually one picture.
pub(super) struct Directory<'a> {
    file: File<'a>,
    entries: Vec<Entry>,
    /// A tag whose values lie beyond the file's end.
    cut: Option<u16>,
}

fn size_of_kind(kind: u64) -> Option<u64> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16 | 17 | 18 => Some(8),
        _ => None,
    }
}

impl<'a> Directory<'a> {
    fn parse(file: File<'a>, offset: u64) -> Option<(Self, u64)> {
        let (head, size, field) = if file.wide { (8, 20, 8) } else { (2, 12, 4) };
        let count = file.unsigned(offset, head)?;
        let first = offset.checked_add(head)?;
        file.slice(first, count.checked_mul(size)?)?;
        let mut directory = Self { file, entries: Vec::new(), cut: None };
        for i in 0..count {
            let at = first + size * i;
            let (tag, kind) = (file.unsigned(at, 2)? as u16, file.unsigned(at + 2, 2)?);
            let count = file.unsigned(at + 4, field)?;
            let Some(length) = size_of_kind(kind).map(|size| size.saturating_mul(count)) else {
                continue;
            };
            let inline = at + 4 + field;
            let offset = if length <= field { inline } else { file.unsigned(inline, field)? };
            if file.slice(offset, length).is_some() {
                directory.entries.push(Entry { tag, kind, count, offset });
            } else {
                directory.cut = directory.cut.or(Some(tag));
            }
        }
        let next = file.unsigned(first + size * count, field).unwrap_or(0);
        Some((directory, next))
    }

    /// # Errors
    /// Values of a tag lie beyond the file's end.
    pub(super) fn check_whole(&self) -> Result<(), PictureError> {
        match self.cut {
            Some(tag) => Err(PictureError::damaged(format!(
                "the values of its tag {tag} lie beyond its end"
            ))),
            None => Ok(()),
        }
    }

    fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }

    pub(super) fn has(&self, tag: u16) -> bool {
        self.entry(tag).is_some()
    }

    /// The bytes of a tag.
    pub(super) fn bytes(&self, tag: u16) -> Option<&'a [u8]> {
        let entry = self.entry(tag)?;
        self.file.slice(entry.offset, size_of_kind(entry.kind)? * entry.count)
    }

    /// Unsigned integers of a tag; `None` where it is absent or of another type.
    pub(super) fn integers(&self, tag: u16) -> Option<Vec<u64>> {
        let entry = self.entry(tag)?;
        if !matches!(entry.kind, 1 | 3 | 4 | 7 | 13 | 16 | 18) {
            return None;
        }
        let size = size_of_kind(entry.kind)?;
        (0..entry.count).map(|i| self.file.unsigned(entry.offset + size * i, size)).collect()
    }

    /// The first unsigned integer of a tag.
    pub(super) fn integer(&self, tag: u16) -> Option<u64> {
        self.integers(tag)?.first().copied()
    }

    /// Ratios of a tag.
    pub(super) fn ratios(&self, tag: u16) -> Option<Vec<f64>> {
        let entry = self.entry(tag).filter(|entry| entry.kind == 5)?;
        let part = |i: u64, at: u64| self.file.unsigned(entry.offset + 8 * i + at, 4);
        (0..entry.count).map(|i| Some(part(i, 0)? as f64 / part(i, 4)? as f64)).collect()
    }

    /// Width and height; `None` for a directory that is no picture.
    pub(super) fn size(&self) -> Option<[u64; 2]> {
        let stored = self.has(tag::STRIP_OFFSETS) || self.has(tag::TILE_OFFSETS);
        let size = [self.integer(tag::WIDTH)?, self.integer(tag::HEIGHT)?];
        stored.then_some(size)
    }
}
