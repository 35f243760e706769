//! Samples out of unpacked rows: bits, byte order, predictors.

use super::super::PictureError;
use super::directory::File;
use super::layout::{Format, Layout, SAVE_AS};
use super::segments::Segments;
use exr::prelude::f16;

/// A number that holds every sample of a picture.
pub(super) trait Stored: Copy + Default {
    fn from_number(number: u32) -> Self;
    fn number(self) -> u32;
}

macro_rules! stored {
    ($($kind:ty),*) => {$(
        impl Stored for $kind {
            fn from_number(number: u32) -> Self {
                number as $kind
            }

            fn number(self) -> u32 {
                self.into()
            }
        }
    )*};
}

stored!(u8, u16, u32);

/// Samples of all pixels as they are stored; floating point as the bits of an f32.
pub(super) fn read<T: Stored>(
    file: File,
    layout: &Layout,
    segments: &Segments,
) -> Result<Vec<T>, PictureError> {
    check_predictor(layout)?;
    let [columns, rows] = segments.size;
    let [across, down] = [layout.width.div_ceil(columns), layout.height.div_ceil(rows)];
    let together = layout.together();
    let row_samples = columns * together;
    let row_bytes = (row_samples * layout.bits as usize).div_ceil(8);
    let planes = layout.samples / together;
    let mut samples = vec![T::default(); layout.width * layout.height * layout.samples];
    let mut row = vec![0; row_samples];
    let mut swapped = vec![0; row_bytes];
    for i in 0..planes * across * down {
        let (plane, place) = (i / (across * down), i % (across * down));
        let (left, top) = (place % across * columns, place / across * rows);
        let (width, height) = (columns.min(layout.width - left), rows.min(layout.height - top));
        let bytes = segments.bytes(i, layout, row_bytes * height)?;
        for (y, packed) in (top..).zip(bytes.chunks_exact(row_bytes)) {
            unpack_row(file, layout, packed, &mut swapped, &mut row);
            let start = (y * layout.width + left) * layout.samples + plane;
            let pixels =
                samples[start..].chunks_mut(layout.samples).zip(row.chunks_exact(together));
            for (pixel, stored) in pixels.take(width) {
                let stored = stored.iter().map(|&number| T::from_number(number));
                pixel.iter_mut().zip(stored).for_each(|(sample, stored)| *sample = stored);
            }
        }
    }
    Ok(samples)
}

fn check_predictor(layout: &Layout) -> Result<(), PictureError> {
    let known = match layout.predictor {
        1 => true,
        2 => matches!(layout.bits, 8 | 16 | 32),
        3 => layout.format == Format::Float && matches!(layout.bits, 16 | 32),
        _ => false,
    };
    if known {
        return Ok(());
    }
    let what = format!("a TIFF of {} bits with predictor {}", layout.bits, layout.predictor);
    Err(PictureError::unsupported(what, SAVE_AS))
}

fn unpack_row(file: File, layout: &Layout, packed: &[u8], swapped: &mut [u8], row: &mut [u32]) {
    let (bits, together) = (layout.bits as usize, layout.together());
    let big_endian = match layout.predictor {
        3 => {
            undo_float_predictor(packed, swapped, bits / 8, together);
            true
        }
        _ => file.big_endian,
    };
    let packed = if layout.predictor == 3 { &*swapped } else { packed };
    match bits {
        8 => row.iter_mut().zip(packed).for_each(|(out, &byte)| *out = byte.into()),
        16 | 24 | 32 => {
            let bytes = bits / 8;
            for (out, packed) in row.iter_mut().zip(packed.chunks_exact(bytes)) {
                let add = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
                *out = if big_endian {
                    packed.iter().fold(0, add)
                } else {
                    packed.iter().rev().fold(0, add)
                };
            }
        }
        64 => {
            for (out, packed) in row.iter_mut().zip(packed.as_chunks().0) {
                let value = if big_endian {
                    f64::from_be_bytes(*packed)
                } else {
                    f64::from_le_bytes(*packed)
                };
                *out = (value as f32).to_bits();
            }
        }
        _ => unpack_bits(packed, layout.bits, row),
    }
    if layout.predictor == 2 {
        let mask = if bits == 32 { u32::MAX } else { (1 << bits) - 1 };
        for i in together..row.len() {
            row[i] = row[i].wrapping_add(row[i - together]) & mask;
        }
    }
    if layout.format == Format::Float && bits == 16 {
        row.iter_mut().for_each(|value| *value = f16::from_bits(*value as u16).to_f32().to_bits());
    }
}

/// TIFF 6.0: the most significant bit first, whatever the file's byte order.
fn unpack_bits(packed: &[u8], bits: u32, row: &mut [u32]) {
    let mut bytes = packed.iter();
    let (mut buffer, mut held) = (0_u32, 0);
    for sample in row {
        while held < bits {
            buffer = buffer << 8 | u32::from(bytes.next().copied().unwrap_or(0));
            held += 8;
        }
        held -= bits;
        *sample = buffer >> held & ((1 << bits) - 1);
    }
}

/// Adobe Photoshop TIFF Technical Note 3: the bytes of a row in planes, the most significant first, each stored as the difference
/// to the one `channels` before.
fn undo_float_predictor(packed: &[u8], out: &mut [u8], size: usize, channels: usize) {
    let mut bytes = packed.to_vec();
    for i in channels..bytes.len() {
        bytes[i] = bytes[i].wrapping_add(bytes[i - channels]);
    }
    let count = bytes.len() / size;
    for (k, value) in out.chunks_exact_mut(size).enumerate() {
        value.iter_mut().enumerate().for_each(|(place, byte)| *byte = bytes[place * count + k]);
    }
}
