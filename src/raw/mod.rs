//! Frames to linear mosaics, samples as the sensor wrote them.
//!
//! What a file is, its content says, not its name. Nothing is subtracted, clipped, scaled or rotated; the frame is the
//! visible area, with the mosaic's phase and the levels counted from its top left.

mod bits;
mod camera;
mod ceiling;
mod demosaic;
mod dng;
mod error;
mod float;
mod frame;
mod hint;
mod kind;
mod ljpeg;
mod metadata;
mod nef;
mod nikon_bits;
mod picture;
mod sensor;
mod tagged;
mod tags;
#[cfg(test)]
mod tests;
mod unpack;

pub use ceiling::{Ceiling, Histogram};
pub use demosaic::demosaic;
pub use error::{DecodeError, ReadError};
pub use frame::{Assumed, Frame, Layout, Metadata, Numbers, Samples};
pub use hint::{Encoding, Hint};
pub use picture::{contradictions, mixed_encodings};

use crate::raster::{Format, PictureError, not_a_picture};
use sensor::Stored;
use tags::{Tiff, tag};

/// What frames come in.
const FRAMES: &str = "a RAW, DNG, TIFF, PNG, JPEG or OpenEXR file";

/// Decodes a frame: RAW of any camera that rawloader knows, DNG, TIFF, PNG, JPEG or OpenEXR.
///
/// NaN and infinities of floating-point pictures are kept; they are no measurements and count as unusable.
///
/// # Errors
/// Whatever the bytes are, an error says what is wrong with them and what to do; never panics.
pub fn decode(bytes: &[u8], hint: &Hint) -> Result<Frame, DecodeError> {
    match Format::sniff(bytes) {
        Some(format @ (Format::Png | Format::Jpeg)) => {
            picture::decode(bytes, format, Metadata::default(), hint)
        }
        Some(Format::Exr) => picture::decode(bytes, Format::Exr, metadata::from_exr(bytes), hint),
        Some(Format::Tiff) if !is_big_tiff(bytes) => decode_tiff(bytes, hint),
        Some(Format::Tiff) => picture::decode(bytes, Format::Tiff, Metadata::default(), hint),
        None => decode_stored(bytes, hint)?.into_frame(),
    }
}

/// What a frame's file says of the camera, without decoding the picture; empty where it says nothing.
pub fn metadata(bytes: &[u8]) -> Metadata {
    match Format::sniff(bytes) {
        Some(Format::Png | Format::Jpeg) => metadata::from_exif_container(bytes),
        Some(Format::Exr) => metadata::from_exr(bytes),
        None if bytes.starts_with(kind::RAF) => metadata::from_raf(bytes),
        _ => Tiff::parse(bytes)
            .map_or_else(|_| Metadata::default(), |tiff| metadata::from_tiff(&tiff)),
    }
}

/// The whole sensor, masked borders included: width, height and samples row by row, as libraw's `raw_image`.
///
/// # Errors
/// As [`decode`]; pictures that are no RAW files have no more than their frame.
pub fn decode_uncropped(
    bytes: &[u8],
    hint: &Hint,
) -> Result<(usize, usize, Vec<u16>), DecodeError> {
    let stored = decode_stored(bytes, hint)?;
    match stored.samples {
        Samples::U16(samples) => Ok((stored.width, stored.height, samples)),
        Samples::F32(_) => {
            Err(DecodeError::unsupported("floating-point sensor data", error::CONVERT_TO_DNG))
        }
    }
}

fn is_big_tiff(bytes: &[u8]) -> bool {
    matches!(bytes, [_, _, 43, 0, ..] | [_, _, 0, 43, ..])
}

/// A TIFF is a RAW file if it says DNG, has a directory of sensor data, or is Canon's kind; else a picture.
fn decode_tiff(bytes: &[u8], hint: &Hint) -> Result<Frame, DecodeError> {
    let tiff = Tiff::parse(bytes)?;
    if tiff.with(tag::DNG_VERSION).is_some() || kind::is_container(bytes, &tiff) {
        decode_stored(bytes, hint)?.into_frame()
    } else {
        picture::decode(bytes, Format::Tiff, metadata::from_tiff(&tiff), hint)
    }
}

/// Sensor data by whichever decoder reads it right.
fn decode_stored(bytes: &[u8], hint: &Hint) -> Result<Stored, DecodeError> {
    let tiff = match Tiff::parse(bytes) {
        Ok(tiff) => tiff,
        Err(_) => return decode_other(bytes, hint),
    };
    if tiff.with(tag::DNG_VERSION).is_some() {
        return dng::decode(&tiff, hint);
    }
    if let Some(directory) = tiff.sensor() {
        tiff.check_extent(directory)?;
        if directory.integer(tag::COMPRESSION) == Some(nef::NIKON) {
            return nef::decode(&tiff, directory, hint);
        }
        return camera::decode(bytes, Some(&tiff), hint).or_else(|error| match error {
            DecodeError::Picture(
                PictureError::Unsupported { .. } | PictureError::NotAPicture { .. },
            ) => tagged::decode(&tiff, directory, hint),
            error => Err(error),
        });
    }
    camera::decode(bytes, Some(&tiff), hint)
}

/// RAW formats that are not built like TIFF. Those without a signature rawloader knows by their length.
fn decode_other(bytes: &[u8], hint: &Hint) -> Result<Stored, DecodeError> {
    if kind::is_compressed_raf(bytes) {
        return Err(kind::refused(bytes, None, Some("with compression")));
    }
    match not_a_picture(bytes, FRAMES) {
        PictureError::NotAPicture { found: "a file of unknown kind", .. } => {
            camera::decode(bytes, None, hint)
        }
        error => Err(error.into()),
    }
}
