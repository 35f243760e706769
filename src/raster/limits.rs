//! How large a picture a file may claim to hold. Decoders allocate by what the file claims, so this comes first.

use super::PictureError;
use crate::machine::check_memory;

/// More samples than any camera of the next years; 800 MB of u16.
const MOST_SAMPLES: u64 = 400_000_000;

/// Samples that one byte of a file can stand for. Deflate packs at most 1032 bytes into one (RFC 1951: 258 bytes from two
/// bits), LZW about 1400; a flat JPEG block of 64 samples takes six bits or more.
const MOST_SAMPLES_PER_BYTE: u64 = 1_500;

/// Pictures up to here need less memory than a limit that the program starts under leaves.
const SMALL_SAMPLES: u64 = 4_000_000;
/// The decoded numbers, and the same again while they are put into rows of another type.
const BYTES_PER_SAMPLE: u64 = 4;

/// Bytes that one byte of a deflated file can stand for.
const MOST_BYTES_PER_BYTE: u64 = 1_040;

/// [`check`] for deflated rows of `row_bytes` bytes, which may hold several pixels in a byte.
///
/// # Errors
/// As [`check`].
pub(crate) fn check_packed(
    [width, height]: [u64; 2],
    row_bytes: u64,
    bytes: usize,
) -> Result<(), PictureError> {
    let bytes = bytes as u64;
    let packed = row_bytes.saturating_mul(height) / MOST_BYTES_PER_BYTE;
    if width.saturating_mul(height) > MOST_SAMPLES || packed > bytes {
        return Err(PictureError::TooLarge { width, height, bytes });
    }
    check(width, height, 1, usize::MAX)
}

/// # Errors
/// No pixels at all, more than the file's length can hold, or more than there is memory for.
pub(crate) fn check(
    width: u64,
    height: u64,
    channels: usize,
    bytes: usize,
) -> Result<(), PictureError> {
    if width == 0 || height == 0 {
        return Err(PictureError::damaged(format!("it claims {width} x {height} pixels")));
    }
    let samples = width.saturating_mul(height).saturating_mul(channels as u64);
    let bytes = bytes as u64;
    if samples > MOST_SAMPLES || samples > bytes.saturating_mul(MOST_SAMPLES_PER_BYTE) {
        return Err(PictureError::TooLarge { width, height, bytes });
    }
    if samples < SMALL_SAMPLES {
        return Ok(());
    }
    let what = || format!("decoding {width} x {height} pixels");
    let remedy = "close other programs or raise the limit";
    Ok(check_memory(what, samples.saturating_mul(BYTES_PER_SAMPLE), remedy)?)
}
