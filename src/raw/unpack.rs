//! Samples out of the strips or tiles of a TIFF directory: uncompressed at 8 to 16 bits, deflated,
//! or lossless JPEG.

use super::error::CONVERT_TO_DNG;
use super::tags::{Directory, Order, Tiff, tag};
use super::{DecodeError, ljpeg};
use crate::raster::limits;
use std::borrow::Cow;
use std::io::Read;

/// How samples of other than 8 or 16 bits stand in their bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    /// TIFF's: the most significant bit first.
    MostFirst,
    /// The least significant bit first.
    LeastFirst,
    /// TIFF's FillOrder 2: as the first, with the bits of each byte reversed.
    Reversed,
    /// Not packed: each sample in two bytes of the file's order.
    Words,
}

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
    pub(crate) packing: Packing,
    /// Whether lossless JPEG of four components holds blocks of 2 x 2 samples, as Sony's does.
    pub(crate) blocks_of_four: bool,
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
        let stored_pixels = match directory.has(tag::TILE_OFFSETS) {
            true => {
                width.div_ceil(segment[0]) * height.div_ceil(segment[1]) * segment[0] * segment[1]
            }
            false => width * height,
        };
        let stored = places.iter().fold(0, |sum: usize, place| sum.saturating_add(place[1]));
        // Fewer bits than 16, but two bytes for each sample: not packed at all.
        let words = (9..16).contains(&bits[0])
            && compression == 1
            && stored >= stored_pixels.saturating_mul(2 * samples_per_pixel);
        Ok(Self {
            packing: if words { Packing::Words } else { Packing::MostFirst },
            blocks_of_four: false,
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
            && self.stored_bits() == 16
            && across == 1
            && self.segment[0] == self.width;
        if plain && tiff.block.order == Order::Little {
            return self.unpack_plain(tiff);
        }
        let mut samples = vec![0; self.width * self.height * self.samples_per_pixel];
        if self.compression == 7 {
            for (i, &place) in self.places[..needed].iter().enumerate() {
                self.unpack_jpeg(tiff, place, [i % across, i / across], &mut samples)?;
            }
            return Ok(samples);
        }
        self.each_row(tiff, &mut samples, |packed, row| {
            self.unpack_row(packed, tiff.block.order, row);
            if self.predictor == 2 {
                undo_differences(row, self.samples_per_pixel, self.bits);
            }
        })?;
        Ok(samples)
    }

    /// The same, packed in another way.
    pub(crate) fn with_packing(self, packing: Packing) -> Self {
        Self { packing, ..self }
    }

    /// Bits that a sample takes up.
    fn stored_bits(&self) -> u32 {
        if self.packing == Packing::Words { 16 } else { self.bits }
    }

    /// Calls `unpack` with the bytes of every row of every strip or tile and a row of samples to fill, of which the part that
    /// lies in the picture is kept.
    ///
    /// # Errors
    /// Too few strips or tiles, or too few bytes in one.
    pub(crate) fn each_row<T: Copy + Default>(
        &self,
        tiff: &Tiff,
        samples: &mut [T],
        unpack: impl Fn(&[u8], &mut [T]),
    ) -> Result<(), DecodeError> {
        let across = self.width.div_ceil(self.segment[0]);
        let needed = across * self.height.div_ceil(self.segment[1]);
        let places = self.places.get(..needed).ok_or_else(|| {
            DecodeError::damaged(format!(
                "it has {} of {needed} strips or tiles",
                self.places.len()
            ))
        })?;
        let mut row = vec![T::default(); self.segment[0] * self.samples_per_pixel];
        let row_bytes = (row.len() * self.stored_bits() as usize).div_ceil(8);
        for (i, &place) in places.iter().enumerate() {
            let within = self.part([i % across, i / across]);
            let length = within.rows * row_bytes;
            let bytes = match self.compression {
                1 => Cow::Borrowed(self.bytes_of(tiff, place, length)?),
                _ => Cow::Owned(inflate(self.bytes_of(tiff, place, place[1])?, length)?),
            };
            for (y, packed) in bytes.chunks_exact(row_bytes).enumerate() {
                unpack(packed, &mut row);
                within.keep(y, &row, samples);
            }
        }
        Ok(())
    }

    /// Where a strip or tile stands in the picture.
    fn part(&self, [column, line]: [usize; 2]) -> Part {
        let stride = self.width * self.samples_per_pixel;
        let row = self.segment[0] * self.samples_per_pixel;
        Part {
            rows: self.segment[1].min(self.height - line * self.segment[1]),
            start: line * self.segment[1] * stride + column * row,
            kept: row.min(stride - column * row),
            stride,
        }
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

    fn unpack_jpeg(
        &self,
        tiff: &Tiff,
        place: [usize; 2],
        at: [usize; 2],
        samples: &mut [u16],
    ) -> Result<(), DecodeError> {
        let within = self.part(at);
        let row = self.segment[0] * self.samples_per_pixel;
        let counts = [row * self.segment[1], row * within.rows];
        let jpeg = ljpeg::decode(self.bytes_of(tiff, place, place[1])?, counts)?;
        let blocks = self.blocks_of_four
            && jpeg.components == 4
            && 2 * jpeg.columns == row
            && 2 * jpeg.rows >= within.rows;
        let values = if blocks { from_blocks(&jpeg.samples, row) } else { jpeg.samples };
        for (y, values) in values.chunks_exact(row).take(within.rows).enumerate() {
            within.keep(y, values, samples);
        }
        Ok(())
    }

    /// Samples of one row. TIFF 6.0: most significant bit first, except whole bytes in the file's order.
    fn unpack_row(&self, packed: &[u8], order: Order, row: &mut [u16]) {
        match (self.stored_bits(), self.packing) {
            (8, _) => row.iter_mut().zip(packed).for_each(|(sample, &byte)| *sample = byte.into()),
            (16, _) => row
                .iter_mut()
                .zip(packed.as_chunks().0)
                .for_each(|(sample, &two)| *sample = order.u16(two)),
            (bits, Packing::LeastFirst) => unpack_from_least(packed, bits, row),
            (bits, Packing::Reversed) => {
                unpack_bits(packed.iter().map(|byte| byte.reverse_bits()), bits, row);
            }
            (bits, _) => unpack_bits(packed.iter().copied(), bits, row),
        }
    }
}

/// A strip's or tile's place among the samples.
struct Part {
    /// Rows that lie in the picture.
    rows: usize,
    /// Index of its first sample.
    start: usize,
    /// Samples of a row that lie in the picture.
    kept: usize,
    stride: usize,
}

impl Part {
    fn keep<T: Copy>(&self, y: usize, row: &[T], samples: &mut [T]) {
        let start = self.start + y * self.stride;
        samples[start..start + self.kept].copy_from_slice(&row[..self.kept]);
    }
}

/// Rows of blocks of 2 x 2 samples, as rows of `width` samples.
fn from_blocks(blocks: &[u16], width: usize) -> Vec<u16> {
    let mut samples = Vec::with_capacity(blocks.len());
    for row in blocks.chunks_exact(2 * width) {
        for half in [0, 2] {
            samples.extend(row.chunks_exact(4).flat_map(|four| [four[half], four[half + 1]]));
        }
    }
    samples
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

fn unpack_from_least(packed: &[u8], bits: u32, row: &mut [u16]) {
    let mut bytes = packed.iter();
    let (mut buffer, mut held) = (0_u32, 0);
    for sample in row {
        while held < bits {
            buffer |= u32::from(bytes.next().copied().unwrap_or(0)) << held;
            held += 8;
        }
        *sample = (buffer & ((1 << bits) - 1)) as u16;
        buffer >>= bits;
        held -= bits;
    }
}

fn unpack_bits(mut bytes: impl Iterator<Item = u8>, bits: u32, row: &mut [u16]) {
    let (mut buffer, mut held) = (0_u32, 0);
    for sample in row {
        while held < bits {
            buffer = buffer << 8 | u32::from(bytes.next().unwrap_or(0));
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
