//! Samples out of the strips or tiles of a TIFF directory: uncompressed at 8 to 16 bits, deflated,
//! or lossless JPEG.

use super::error::CONVERT_TO_DNG;
use super::tags::{Directory, Order, Tiff, tag};
use super::{DecodeError, ljpeg};
use crate::raster::limits;
use std::borrow::Cow;
use std::io::Read;

/// How a directory stores its samples.
#[derive(Clone, Debug)]
pub(crate) struct Storage {
    /// Pixels in a row, as stored.
    pub(crate) width: usize,
    /// Rows, as stored.
    pub(crate) height: usize,
    /// Samples of a pixel, interleaved.
    pub(crate) samples_per_pixel: usize,
    pub(crate) bits: u32,
    pub(crate) compression: u32,
    pub(crate) predictor: u32,
    /// Size of a strip (as wide as the picture) or a tile, pixels.
    segment: [usize; 2],
    /// Offset and length of each strip or tile, bytes.
    places: Vec<[usize; 2]>,
}

impl Storage {
    /// Reads the tags and checks them against each other and against the length of the file.
    ///
    /// # Errors
    /// Absent or contradictory tags, absurd dimensions, data beyond the file's end.
    pub(crate) fn parse(tiff: &Tiff, directory: &Directory) -> Result<Self, DecodeError> {
        directory.check_whole()?;
        let require = |tag, name: &str| {
            directory
                .integer(tag)
                .ok_or_else(|| DecodeError::damaged(format!("its {name} is missing")))
        };
        let [width, height] = [require(tag::WIDTH, "width")?, require(tag::HEIGHT, "height")?];
        let samples_per_pixel = directory.integer(tag::SAMPLES_PER_PIXEL).unwrap_or(1) as usize;
        let compression = directory.integer(tag::COMPRESSION).unwrap_or(1);
        let bits = directory.integers(tag::BITS_PER_SAMPLE).unwrap_or_else(|| vec![1]);
        if bits.iter().any(|&other| other != bits[0]) || bits.is_empty() {
            return Err(DecodeError::unsupported(
                "a picture whose channels differ in depth",
                CONVERT_TO_DNG,
            ));
        }
        if samples_per_pixel == 0 || samples_per_pixel > 4 {
            return Err(DecodeError::damaged(format!(
                "it claims {samples_per_pixel} samples per pixel"
            )));
        }
        limits::check(width.into(), height.into(), samples_per_pixel, tiff.block.bytes.len())?;
        tiff.check_extent(directory)?;
        let (width, height) = (width as usize, height as usize);
        let (segment, places) = segments(directory, width, height)?;
        let predictor = directory.integer(tag::PREDICTOR).unwrap_or(1);
        Ok(Self {
            width,
            height,
            samples_per_pixel,
            bits: bits[0],
            compression,
            predictor,
            segment,
            places,
        })
    }

    /// `width * height * samples_per_pixel` samples, row by row.
    ///
    /// # Errors
    /// A kind of storage that only other decoders know, or too few bytes in a strip or tile.
    pub(crate) fn unpack(&self, tiff: &Tiff) -> Result<Vec<u16>, DecodeError> {
        self.check_kind()?;
        let across = self.width.div_ceil(self.segment[0]);
        let needed = across * self.height.div_ceil(self.segment[1]);
        if self.places.len() < needed {
            return Err(DecodeError::damaged(format!(
                "it has {} of {needed} strips or tiles",
                self.places.len()
            )));
        }
        let plain = self.compression == 1
            && self.bits == 16
            && across == 1
            && self.segment[0] == self.width;
        if plain && tiff.block.order == Order::Little {
            return self.unpack_plain(tiff);
        }
        let mut samples = vec![0; self.width * self.height * self.samples_per_pixel];
        let mut row = vec![0; self.segment[0] * self.samples_per_pixel];
        for (i, &place) in self.places[..needed].iter().enumerate() {
            self.unpack_segment(tiff, place, [i % across, i / across], &mut samples, &mut row)?;
        }
        Ok(samples)
    }

    fn check_kind(&self) -> Result<(), DecodeError> {
        let Self { compression, bits, predictor, .. } = *self;
        let known = match compression {
            1 => (8..=16).contains(&bits) && predictor == 1,
            7 => (8..=16).contains(&bits),
            8 | 32946 => matches!(bits, 8 | 16) && matches!(predictor, 1 | 2),
            _ => false,
        };
        let what = || {
            format!(
                "sensor data with compression {compression}, {bits} bits, predictor {predictor}"
            )
        };
        if known { Ok(()) } else { Err(DecodeError::unsupported(what(), CONVERT_TO_DNG)) }
    }

    /// Little-endian 16-bit strips, as fast as memory allows: what the simulated rig and many cameras write.
    fn unpack_plain(&self, tiff: &Tiff) -> Result<Vec<u16>, DecodeError> {
        let row_bytes = self.width * self.samples_per_pixel * 2;
        let mut samples = Vec::with_capacity(self.width * self.height * self.samples_per_pixel);
        let mut rows_left = self.height;
        for &[offset, length] in &self.places {
            let rows = rows_left.min(self.segment[1]);
            let bytes = self.bytes_of(tiff, [offset, length], rows * row_bytes)?;
            samples.extend(bytes.as_chunks().0.iter().map(|&two| u16::from_le_bytes(two)));
            rows_left -= rows;
        }
        Ok(samples)
    }

    /// The first `needed` bytes of a strip or tile.
    fn bytes_of<'a>(
        &self,
        tiff: &Tiff<'a>,
        [offset, length]: [usize; 2],
        needed: usize,
    ) -> Result<&'a [u8], DecodeError> {
        let bytes = tiff.block.slice(offset, length).and_then(|bytes| bytes.get(..needed));
        bytes.ok_or_else(|| DecodeError::damaged(format!("a strip has {length} of {needed} bytes")))
    }

    fn unpack_segment(
        &self,
        tiff: &Tiff,
        place: [usize; 2],
        [column, line]: [usize; 2],
        samples: &mut [u16],
        row: &mut [u16],
    ) -> Result<(), DecodeError> {
        let rows = self.segment[1].min(self.height - line * self.segment[1]);
        let stride = self.width * self.samples_per_pixel;
        let first = column * row.len();
        let kept = row.len().min(stride - first);
        let start = |y: usize| (line * self.segment[1] + y) * stride + first;
        if self.compression == 7 {
            let counts = [row.len() * self.segment[1], row.len() * rows];
            let values = ljpeg::decode(self.bytes_of(tiff, place, place[1])?, counts)?;
            for (y, values) in values.chunks_exact(row.len()).take(rows).enumerate() {
                samples[start(y)..start(y) + kept].copy_from_slice(&values[..kept]);
            }
            return Ok(());
        }
        let row_bytes = (row.len() * self.bits as usize).div_ceil(8);
        let bytes = match self.compression {
            1 => Cow::Borrowed(self.bytes_of(tiff, place, rows * row_bytes)?),
            _ => Cow::Owned(inflate(self.bytes_of(tiff, place, place[1])?, rows * row_bytes)?),
        };
        for (y, packed) in bytes.chunks_exact(row_bytes).enumerate() {
            unpack_row(packed, self.bits, tiff.block.order, row);
            if self.predictor == 2 {
                undo_differences(row, self.samples_per_pixel, self.bits);
            }
            samples[start(y)..start(y) + kept].copy_from_slice(&row[..kept]);
        }
        Ok(())
    }
}

/// Size of the strips or tiles and where each is.
fn segments(
    directory: &Directory,
    width: usize,
    height: usize,
) -> Result<([usize; 2], Vec<[usize; 2]>), DecodeError> {
    let tiled = directory.has(tag::TILE_OFFSETS);
    let (size, offsets, counts) = if tiled {
        let side = |tag| directory.integer(tag).unwrap_or(0) as usize;
        let size = [side(tag::TILE_WIDTH), side(tag::TILE_HEIGHT)];
        (size, directory.integers(tag::TILE_OFFSETS), directory.integers(tag::TILE_BYTE_COUNTS))
    } else {
        let rows = directory
            .integer(tag::ROWS_PER_STRIP)
            .map_or(height, |rows| (rows as usize).min(height));
        (
            [width, rows],
            directory.integers(tag::STRIP_OFFSETS),
            directory.integers(tag::STRIP_BYTE_COUNTS),
        )
    };
    let (Some(offsets), Some(counts)) = (offsets, counts) else {
        return Err(DecodeError::damaged("it does not say where its samples are"));
    };
    // A tile may be larger than the picture, but not absurdly so: its row is a buffer.
    if size.contains(&0) || size[0] > width + 65_536 || size[1] > height + 65_536 {
        return Err(DecodeError::damaged(format!(
            "its strips or tiles measure {} x {}",
            size[0], size[1]
        )));
    }
    Ok((
        size,
        offsets
            .iter()
            .zip(&counts)
            .map(|(&offset, &count)| [offset as usize, count as usize])
            .collect(),
    ))
}

/// Samples of one packed row. TIFF 6.0: most significant bit first, except whole bytes in the file's order.
fn unpack_row(packed: &[u8], bits: u32, order: Order, row: &mut [u16]) {
    match bits {
        8 => row.iter_mut().zip(packed).for_each(|(sample, &byte)| *sample = byte.into()),
        16 => row
            .iter_mut()
            .zip(packed.as_chunks().0)
            .for_each(|(sample, &two)| *sample = order.u16(two)),
        _ => unpack_bits(packed, bits, row),
    }
}

fn unpack_bits(packed: &[u8], bits: u32, row: &mut [u16]) {
    let mut bytes = packed.iter();
    let (mut buffer, mut held) = (0_u32, 0);
    for sample in row {
        while held < bits {
            buffer = buffer << 8 | u32::from(bytes.next().copied().unwrap_or(0));
            held += 8;
        }
        held -= bits;
        *sample = (buffer >> held & ((1 << bits) - 1)) as u16;
    }
}

/// TIFF 6.0 section 14: each sample is stored as the difference to the same channel of the pixel before.
fn undo_differences(row: &mut [u16], channels: usize, bits: u32) {
    let mask = if bits == 8 { 0xff } else { 0xffff };
    for i in channels..row.len() {
        row[i] = row[i].wrapping_add(row[i - channels]) & mask;
    }
}

/// Exactly `length` bytes out of a zlib stream.
fn inflate(packed: &[u8], length: usize) -> Result<Vec<u8>, DecodeError> {
    let damaged = || DecodeError::damaged("a deflated strip does not unpack");
    // RFC 1951: one byte stands for at most 1032.
    if length > packed.len().saturating_mul(1032) {
        return Err(damaged());
    }
    let mut bytes = vec![0; length];
    flate2::read::ZlibDecoder::new(packed).read_exact(&mut bytes).map_err(|_| damaged())?;
    Ok(bytes)
}
