//! Strips and tiles: where they are, and their bytes unpacked.

use super::super::PictureError;
use super::directory::{Directory, File, tag};
use super::layout::{Layout, SAVE_AS};
use std::borrow::Cow;
use std::io::Read;

/// The strips or tiles of a picture.
pub(super) struct Segments<'a> {
    file: File<'a>,
    /// Columns and rows of one.
    pub(super) size: [usize; 2],
    /// Offset and length of each.
    places: Vec<[u64; 2]>,
}

impl<'a> Segments<'a> {
    /// # Errors
    /// Tags that are absent or contradict each other, or data beyond the file's end.
    pub(super) fn parse(
        file: File<'a>,
        page: &Directory,
        layout: &Layout,
    ) -> Result<Self, PictureError> {
        let tiled = page.has(tag::TILE_OFFSETS);
        let (offsets, counts, name) = if tiled {
            (tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS, "tile")
        } else {
            (tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS, "strip")
        };
        let side = |tag, absent: usize| {
            page.integer(tag).map_or(absent, |side| usize::try_from(side).unwrap_or(usize::MAX))
        };
        let size = if tiled {
            [side(tag::TILE_WIDTH, 0), side(tag::TILE_HEIGHT, 0)]
        } else {
            [layout.width, side(tag::ROWS_PER_STRIP, layout.height).min(layout.height)]
        };
        // A tile may be larger than the picture, but not absurdly so.
        if size.contains(&0) || size[0] > layout.width + 65_536 || size[1] > layout.height + 65_536
        {
            return Err(PictureError::damaged(format!(
                "its {name}s measure {} x {}",
                size[0], size[1]
            )));
        }
        let numbers = |tag| {
            page.integers(tag)
                .ok_or_else(|| PictureError::damaged("it does not say where its samples are"))
        };
        let places: Vec<[u64; 2]> = numbers(offsets)?
            .into_iter()
            .zip(numbers(counts)?)
            .map(|(at, length)| [at, length])
            .collect();
        let have = file.bytes.len() as u64;
        for (i, [offset, length]) in places.iter().enumerate() {
            let needed = offset.saturating_add(*length);
            if needed > have {
                return Err(PictureError::Truncated { what: format!("{name} {i}"), needed, have });
            }
        }
        let planes = if layout.planar { layout.samples } else { 1 };
        let [across, down] = [layout.width.div_ceil(size[0]), layout.height.div_ceil(size[1])];
        if places.len() < planes * across * down {
            let (found, needed) = (places.len(), planes * across * down);
            return Err(PictureError::damaged(format!("it has {found} of {needed} {name}s")));
        }
        Ok(Self { file, size, places })
    }

    /// The unpacked bytes of segment `i`: the first `needed`.
    ///
    /// # Errors
    /// Fewer than that, or a compression that is not read.
    pub(super) fn bytes(
        &self,
        i: usize,
        layout: &Layout,
        needed: usize,
    ) -> Result<Cow<'a, [u8]>, PictureError> {
        let [offset, length] = self.places[i].map(|number| number as usize);
        let packed = &self.file.bytes[offset..offset + length];
        let reversed = || Cow::Owned(packed.iter().map(|byte| byte.reverse_bits()).collect());
        let packed: Cow<[u8]> =
            if layout.lowest_bit_first { reversed() } else { Cow::Borrowed(packed) };
        let mut bytes = match layout.compression {
            1 => packed,
            5 => Cow::Owned(unpack_lzw(&packed, needed)?),
            8 | 32_946 => {
                Cow::Owned(read_exactly(flate2::read::ZlibDecoder::new(&*packed), needed)?)
            }
            32_773 => Cow::Owned(unpack_bits(&packed, needed)),
            50_000 => Cow::Owned(unpack_zstd(&packed, needed)?),
            other => return Err(refused(other)),
        };
        if bytes.len() < needed {
            let have = bytes.len();
            return Err(PictureError::damaged(format!("a strip has {have} of {needed} bytes")));
        }
        match &mut bytes {
            Cow::Borrowed(bytes) => *bytes = &bytes[..needed],
            Cow::Owned(bytes) => bytes.truncate(needed),
        }
        Ok(bytes)
    }
}

/// The compressions that are known by name only.
pub(super) fn refused(compression: u64) -> PictureError {
    let name = match compression {
        2..=4 => "fax compression",
        6 | 7 => "JPEG compression",
        32_809 => "ThunderScan compression",
        32_908 => "PIXAR compression",
        34_676 | 34_677 => "SGI LogLuv compression",
        33_003 | 33_004 | 33_005 | 34_712 => "JPEG 2000 compression",
        34_887 => "LERC compression",
        34_925 => "LZMA compression",
        50_001 => "WebP compression",
        50_002 | 52_546 => "JPEG XL compression",
        other => {
            return PictureError::unsupported(format!("a TIFF with compression {other}"), SAVE_AS);
        }
    };
    PictureError::unsupported(
        format!("a TIFF with {name}"),
        "save it uncompressed, or with LZW or ZIP",
    )
}

fn does_not_unpack() -> PictureError {
    PictureError::damaged("a compressed strip or tile does not unpack")
}

/// Up to `length` bytes; memory grows with what comes.
fn read_exactly(reader: impl Read, length: usize) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::new();
    reader.take(length as u64).read_to_end(&mut bytes).map_err(|_| does_not_unpack())?;
    Ok(bytes)
}

/// TIFF 6.0, section 13. Some old files have the other bit order of GIF; they begin with a clear code of theirs.
fn unpack_lzw(packed: &[u8], length: usize) -> Result<Vec<u8>, PictureError> {
    let mut decoder = match packed {
        [0, second, ..] if second & 1 == 1 => weezl::decode::Decoder::new(weezl::BitOrder::Lsb, 8),
        _ => weezl::decode::Decoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8),
    };
    let mut bytes = Vec::new();
    let mut rest = packed;
    let mut buffer = vec![0; 1 << 16];
    while bytes.len() < length {
        let step = decoder.decode_bytes(rest, &mut buffer);
        rest = &rest[step.consumed_in..];
        bytes.extend_from_slice(&buffer[..step.consumed_out]);
        match step.status {
            Ok(weezl::LzwStatus::Ok) if step.consumed_in + step.consumed_out > 0 => {}
            Ok(_) => break,
            Err(_) => return Err(does_not_unpack()),
        }
    }
    Ok(bytes)
}

/// TIFF 6.0, section 9.
fn unpack_bits(packed: &[u8], length: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = packed;
    while let ([head, tail @ ..], true) = (rest, bytes.len() < length) {
        let head = *head as i8;
        let count = 1 + usize::from(head.unsigned_abs());
        match (head, tail) {
            (-128, _) => rest = tail,
            (0.., _) => {
                let (copied, after) = tail.split_at(count.min(tail.len()));
                bytes.extend_from_slice(copied);
                rest = after;
            }
            (_, [value, after @ ..]) => {
                bytes.resize(bytes.len() + count, *value);
                rest = after;
            }
            (_, []) => break,
        }
    }
    bytes
}

fn unpack_zstd(packed: &[u8], length: usize) -> Result<Vec<u8>, PictureError> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(packed).map_err(|_| does_not_unpack())?;
    read_exactly(decoder, length)
}
