//! TIFF directories, as TIFF pictures, DNG, NEF and most cameras' RAW files have them.
//!
//! Adobe, "TIFF revision 6.0", 1992; "Digital Negative specification 1.7", 2023. Nothing is allocated that the file's own
//! length does not bound.

use super::DecodeError;
use crate::raster::PictureError;

/// Tags that frames need.
pub(crate) mod tag {
    pub(crate) const NEW_SUBFILE_TYPE: u16 = 0x00fe;
    pub(crate) const WIDTH: u16 = 0x0100;
    pub(crate) const HEIGHT: u16 = 0x0101;
    pub(crate) const BITS_PER_SAMPLE: u16 = 0x0102;
    pub(crate) const COMPRESSION: u16 = 0x0103;
    pub(crate) const PHOTOMETRIC: u16 = 0x0106;
    pub(crate) const FILL_ORDER: u16 = 0x010a;
    pub(crate) const MAKE: u16 = 0x010f;
    pub(crate) const MODEL: u16 = 0x0110;
    pub(crate) const STRIP_OFFSETS: u16 = 0x0111;
    pub(crate) const ORIENTATION: u16 = 0x0112;
    pub(crate) const SAMPLES_PER_PIXEL: u16 = 0x0115;
    pub(crate) const ROWS_PER_STRIP: u16 = 0x0116;
    pub(crate) const STRIP_BYTE_COUNTS: u16 = 0x0117;
    pub(crate) const PLANAR_CONFIGURATION: u16 = 0x011c;
    pub(crate) const PREDICTOR: u16 = 0x013d;
    pub(crate) const TILE_WIDTH: u16 = 0x0142;
    pub(crate) const TILE_HEIGHT: u16 = 0x0143;
    pub(crate) const TILE_OFFSETS: u16 = 0x0144;
    pub(crate) const TILE_BYTE_COUNTS: u16 = 0x0145;
    pub(crate) const SUB_IFDS: u16 = 0x014a;
    pub(crate) const SAMPLE_FORMAT: u16 = 0x0153;
    pub(crate) const CFA_REPEAT: u16 = 0x828d;
    pub(crate) const CFA_PATTERN: u16 = 0x828e;
    pub(crate) const EXPOSURE_TIME: u16 = 0x829a;
    pub(crate) const F_NUMBER: u16 = 0x829d;
    pub(crate) const EXIF_IFD: u16 = 0x8769;
    pub(crate) const ISO: u16 = 0x8827;
    pub(crate) const RECOMMENDED_EXPOSURE_INDEX: u16 = 0x8832;
    pub(crate) const SHUTTER_SPEED: u16 = 0x9201;
    pub(crate) const APERTURE: u16 = 0x9202;
    pub(crate) const FOCAL_LENGTH: u16 = 0x920a;
    pub(crate) const MAKER_NOTE: u16 = 0x927c;
    pub(crate) const LENS_MODEL: u16 = 0xa434;
    pub(crate) const DNG_VERSION: u16 = 0xc612;
    pub(crate) const CFA_LAYOUT: u16 = 0xc617;
    pub(crate) const LINEARIZATION_TABLE: u16 = 0xc618;
    pub(crate) const BLACK_LEVEL_REPEAT: u16 = 0xc619;
    pub(crate) const BLACK_LEVEL: u16 = 0xc61a;
    pub(crate) const BLACK_LEVEL_DELTA_H: u16 = 0xc61b;
    pub(crate) const BLACK_LEVEL_DELTA_V: u16 = 0xc61c;
    pub(crate) const WHITE_LEVEL: u16 = 0xc61d;
    pub(crate) const COLOR_MATRIX_1: u16 = 0xc621;
    pub(crate) const COLOR_MATRIX_2: u16 = 0xc622;
    pub(crate) const ILLUMINANT_1: u16 = 0xc65a;
    pub(crate) const ACTIVE_AREA: u16 = 0xc68d;
    pub(crate) const ROW_INTERLEAVE: u16 = 0xc71f;
    pub(crate) const SUB_TILE_BLOCK: u16 = 0xc71e;
    pub(crate) const OPCODE_LIST_1: u16 = 0xc740;
    pub(crate) const OPCODE_LIST_2: u16 = 0xc741;
    pub(crate) const COLUMN_INTERLEAVE: u16 = 0xcd43;
}

/// Directories beyond this number are a loop or an attack; cameras write about ten.
const MOST_DIRECTORIES: usize = 64;

/// Byte order of a TIFF structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// "II".
    Little,
    /// "MM".
    Big,
}

impl Order {
    pub(crate) fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Order::Little => u16::from_le_bytes(bytes),
            Order::Big => u16::from_be_bytes(bytes),
        }
    }

    pub(crate) fn u32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Order::Little => u32::from_le_bytes(bytes),
            Order::Big => u32::from_be_bytes(bytes),
        }
    }
}

/// A file (or a maker note inside one) with its byte order. Offsets count from the first byte.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) order: Order,
}

impl<'a> Block<'a> {
    /// A block that starts with "II" or "MM"; what follows is not checked.
    pub(crate) fn new(bytes: &'a [u8]) -> Option<Self> {
        let order = match bytes.get(..2)? {
            b"II" => Order::Little,
            b"MM" => Order::Big,
            _ => return None,
        };
        Some(Self { bytes, order })
    }

    pub(crate) fn slice(&self, offset: usize, length: usize) -> Option<&'a [u8]> {
        self.bytes.get(offset..offset.checked_add(length)?)
    }

    pub(crate) fn u16(&self, offset: usize) -> Option<u16> {
        self.slice(offset, 2)?.try_into().ok().map(|bytes| self.order.u16(bytes))
    }

    pub(crate) fn u32(&self, offset: usize) -> Option<u32> {
        self.slice(offset, 4)?.try_into().ok().map(|bytes| self.order.u32(bytes))
    }
}

/// One entry of a directory.
#[derive(Clone, Copy, Debug)]
struct Entry {
    tag: u16,
    kind: u16,
    count: usize,
    /// Where the values are, in the block.
    offset: usize,
}

/// Bytes of one value of a TIFF type; `None` for types that TIFF does not know.
fn size_of_kind(kind: u16) -> Option<usize> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 => Some(8),
        _ => None,
    }
}

/// One directory.
#[derive(Clone, Debug)]
pub(crate) struct Directory<'a> {
    pub(crate) block: Block<'a>,
    entries: Vec<Entry>,
    /// Tags whose values lie beyond the block's end.
    cut: Vec<u16>,
}

impl<'a> Directory<'a> {
    /// The directory at `offset`, and where the next one is (0: none). Entries of unknown type are left out.
    pub(crate) fn parse(block: Block<'a>, offset: usize) -> Option<(Self, usize)> {
        let count = usize::from(block.u16(offset)?);
        block.slice(offset, 2 + 12 * count)?;
        let mut directory = Self { block, entries: Vec::new(), cut: Vec::new() };
        for i in 0..count {
            let at = offset + 2 + 12 * i;
            let (tag, kind, count) =
                (block.u16(at)?, block.u16(at + 2)?, block.u32(at + 4)? as usize);
            let Some(length) = size_of_kind(kind).map(|size| size.saturating_mul(count)) else {
                continue;
            };
            let offset = if length <= 4 { at + 8 } else { block.u32(at + 8)? as usize };
            match block.slice(offset, length) {
                Some(_) => directory.entries.push(Entry { tag, kind, count, offset }),
                None => directory.cut.push(tag),
            }
        }
        let next = block.u32(offset + 2 + 12 * count).unwrap_or(0) as usize;
        Some((directory, next))
    }

    /// # Errors
    /// Some values lie beyond the end of the file.
    pub(crate) fn check_whole(&self) -> Result<(), DecodeError> {
        match self.cut.first() {
            Some(tag) => Err(DecodeError::damaged(format!(
                "the values of its tag {tag:#06x} lie beyond its end"
            ))),
            None => Ok(()),
        }
    }

    fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }

    /// Bytes of the file that the directory speaks of: its values, and the strips, tiles or JPEG it places.
    pub(crate) fn bytes_described(&self) -> usize {
        const JPEG_LENGTH: u16 = 0x0202;
        let values = self.entries.iter().filter_map(|e| size_of_kind(e.kind)?.checked_mul(e.count));
        let placed = [tag::STRIP_BYTE_COUNTS, tag::TILE_BYTE_COUNTS, JPEG_LENGTH]
            .into_iter()
            .filter_map(|tag| self.integers(tag))
            .flatten()
            .map(|length| length as usize);
        values.chain(placed).fold(0, usize::saturating_add)
    }

    pub(crate) fn has(&self, tag: u16) -> bool {
        self.entry(tag).is_some()
    }

    /// The bytes of a tag, whatever its type.
    pub(crate) fn bytes(&self, tag: u16) -> Option<&'a [u8]> {
        let entry = self.entry(tag)?;
        self.block.slice(entry.offset, size_of_kind(entry.kind)? * entry.count)
    }

    /// Unsigned integers of a tag; `None` where it is absent or of another type.
    pub(crate) fn integers(&self, tag: u16) -> Option<Vec<u32>> {
        let entry = self.entry(tag)?;
        let bytes = self.bytes(tag)?;
        match entry.kind {
            1 | 7 => Some(bytes.iter().map(|&byte| u32::from(byte)).collect()),
            3 => Some(
                bytes
                    .as_chunks()
                    .0
                    .iter()
                    .map(|&two| u32::from(self.block.order.u16(two)))
                    .collect(),
            ),
            4 | 13 => {
                Some(bytes.as_chunks().0.iter().map(|&four| self.block.order.u32(four)).collect())
            }
            _ => None,
        }
    }

    /// The first unsigned integer of a tag.
    pub(crate) fn integer(&self, tag: u16) -> Option<u32> {
        self.integers(tag)?.first().copied()
    }

    /// Numbers of a tag of any numeric type.
    pub(crate) fn numbers(&self, tag: u16) -> Option<Vec<f64>> {
        let order = self.block.order;
        let bytes = self.bytes(tag)?;
        let pairs = || bytes.as_chunks::<8>().0.iter().map(|b| b.as_chunks::<4>().0);
        let float = |b: &[u8; 8]| match order {
            Order::Little => f64::from_le_bytes(*b),
            Order::Big => f64::from_be_bytes(*b),
        };
        match self.entry(tag)?.kind {
            5 => Some(
                pairs().map(|p| f64::from(order.u32(p[0])) / f64::from(order.u32(p[1]))).collect(),
            ),
            10 => Some(
                pairs()
                    .map(|p| f64::from(order.u32(p[0]) as i32) / f64::from(order.u32(p[1]) as i32))
                    .collect(),
            ),
            8 => {
                Some(bytes.as_chunks().0.iter().map(|&b| f64::from(order.u16(b) as i16)).collect())
            }
            9 => {
                Some(bytes.as_chunks().0.iter().map(|&b| f64::from(order.u32(b) as i32)).collect())
            }
            11 => Some(
                bytes
                    .as_chunks()
                    .0
                    .iter()
                    .map(|&b| f64::from(f32::from_bits(order.u32(b))))
                    .collect(),
            ),
            12 => Some(bytes.as_chunks().0.iter().map(float).collect()),
            _ => Some(self.integers(tag)?.into_iter().map(f64::from).collect()),
        }
    }

    /// The first number of a tag, if finite and above zero.
    pub(crate) fn positive(&self, tag: u16) -> Option<f64> {
        self.numbers(tag)?.first().copied().filter(|value| value.is_finite() && *value > 0.0)
    }

    /// Text of a tag up to its first NUL, trimmed; `None` where nothing is left.
    pub(crate) fn text(&self, tag: u16) -> Option<String> {
        let bytes = self.bytes(tag)?.split(|&byte| byte == 0).next()?;
        let text = String::from_utf8_lossy(bytes).trim().to_owned();
        (!text.is_empty()).then_some(text)
    }
}

/// All directories of a TIFF-like file: the chain, then sub-directories and Exif in the order they are found.
#[derive(Clone, Debug)]
pub(crate) struct Tiff<'a> {
    pub(crate) block: Block<'a>,
    pub(crate) directories: Vec<Directory<'a>>,
}

impl<'a> Tiff<'a> {
    /// Reads the directories of a classic TIFF structure, whatever number follows the byte order (42; cameras have their
    /// own).
    ///
    /// # Errors
    /// The first directory lies outside the file.
    pub(crate) fn parse(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        let missing = || DecodeError::damaged("it has no TIFF directory");
        let block = Block::new(bytes).ok_or_else(missing)?;
        let mut waiting = vec![block.u32(4).ok_or_else(missing)? as usize];
        let mut seen = Vec::new();
        let mut directories = Vec::new();
        while let Some(offset) = waiting.pop() {
            if offset == 0 || seen.contains(&offset) || directories.len() == MOST_DIRECTORIES {
                continue;
            }
            seen.push(offset);
            let Some((directory, next)) = Directory::parse(block, offset) else { continue };
            for tag in [tag::EXIF_IFD, tag::SUB_IFDS] {
                let offsets = directory.integers(tag).unwrap_or_default();
                waiting.extend(
                    offsets.iter().take(MOST_DIRECTORIES).rev().map(|&offset| offset as usize),
                );
            }
            waiting.push(next);
            directories.push(directory);
        }
        if directories.is_empty() { Err(missing()) } else { Ok(Self { block, directories }) }
    }

    /// The first directory that has a tag.
    pub(crate) fn with(&self, tag: u16) -> Option<&Directory<'a>> {
        self.directories.iter().find(|directory| directory.has(tag))
    }

    /// The full-resolution directory of sensor data: a colour-filter array, or demosaiced but linear.
    pub(crate) fn sensor(&self) -> Option<&Directory<'a>> {
        let sensor = |directory: &&Directory| {
            matches!(directory.integer(tag::PHOTOMETRIC), Some(32803 | 34892))
                && directory.integer(tag::NEW_SUBFILE_TYPE).unwrap_or(0) == 0
        };
        self.directories.iter().find(sensor)
    }

    /// Every strip and tile of a directory lies inside the file.
    ///
    /// # Errors
    /// Names the first that does not.
    pub(crate) fn check_extent(&self, directory: &Directory) -> Result<(), DecodeError> {
        for (offsets, counts, name) in [
            (tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS, "strip"),
            (tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS, "tile"),
        ] {
            let offsets = directory.integers(offsets).unwrap_or_default();
            let counts = directory.integers(counts).unwrap_or_default();
            for (i, (&offset, &count)) in offsets.iter().zip(&counts).enumerate() {
                let needed = u64::from(offset) + u64::from(count);
                let have = self.block.bytes.len() as u64;
                if needed > have {
                    return Err(PictureError::Truncated {
                        what: format!("{name} {i}"),
                        needed,
                        have,
                    }
                    .into());
                }
            }
        }
        Ok(())
    }
}
