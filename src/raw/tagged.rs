//! Sensor data of cameras that rawloader's table does not know, by what the file's own tags say: TIFF/EP (ISO 12234-2) and
//! makers' files that keep to it, uncompressed, deflated or lossless JPEG.
//!
//! Tag names of makers as in Exiftool's "Sony Tags" and "Nikon Tags".

use super::frame::Assumed;
use super::sensor::{self, Area, Stored};
use super::tags::{Directory, Tiff, tag};
use super::unpack::{Packing, Storage};
use super::{DecodeError, Hint, Samples, dng, kind, metadata, nef};
use weavelight_calibration::description::Cfa;

/// Sony's levels, in the directory of sensor data.
const SONY_BLACK: u16 = 0x7310;
const SONY_WHITE: u16 = 0x787f;

/// The colour-filter array in Exif.
const EXIF_CFA_PATTERN: u16 = 0xa302;

/// How much rougher the wrong order of packed bits is at least.
const ROUGHER: u64 = 2;

/// Rows that are looked at to find the order of packed bits.
const ROWS_LOOKED_AT: usize = 64;

/// # Errors
/// A damaged file, a storage that only its maker knows, or no colour-filter array where none is declared.
pub(crate) fn decode(
    tiff: &Tiff,
    directory: &Directory,
    hint: &Hint,
) -> Result<Stored, DecodeError> {
    if let Some(how) = kind::compression(directory) {
        return Err(kind::refused(tiff.block.bytes, Some(tiff), Some(&format!("with {how}"))));
    }
    sensor::linear_only(hint, "a RAW file")?;
    let mut storage = Storage::parse(tiff, directory)?;
    storage.blocks_of_four = true;
    let layout = dng::layout_with(directory, &storage, hint, cfa(tiff, directory)?)?;
    storage.packing = packing(tiff, directory, &storage)?;
    let samples = storage.unpack(tiff)?;
    let (white, white_known) = white(directory, &storage);
    let black = match directory.has(tag::BLACK_LEVEL) {
        true => Some(dng::black_levels(directory, layout, white)?),
        false => makers_black(tiff, directory, white),
    };
    let visible = match directory.has(tag::ACTIVE_AREA) {
        true => dng::active_area(directory, &storage)?,
        false => Area { top: 0, left: 0, bottom: storage.height, right: storage.width },
    };
    let assumed = Assumed { black: black.is_none(), saturation: !white_known };
    Ok(Stored {
        width: storage.width,
        height: storage.height,
        samples: Samples::U16(samples),
        visible,
        layout,
        black: black.unwrap_or_default(),
        saturation: [white as f32; 4],
        metadata: super::Metadata { assumed, ..metadata::from_tiff(tiff) },
    })
}

/// TIFF/EP's tags beside the data, else Exif's.
fn cfa(tiff: &Tiff, directory: &Directory) -> Result<Option<Cfa>, DecodeError> {
    if let Some(codes) = directory.bytes(tag::CFA_PATTERN) {
        let repeat = directory.integers(tag::CFA_REPEAT).unwrap_or_else(|| vec![2, 2]);
        return sensor::cfa_from_codes(&repeat, codes).map(Some);
    }
    let exif = tiff.with(EXIF_CFA_PATTERN).and_then(|exif| exif.bytes(EXIF_CFA_PATTERN));
    // Columns and rows of the cell, 16 bits each in either byte order, then its codes.
    match exif {
        Some([a, b, c, d, codes @ ..]) if (a | b, c | d) == (2, 2) && codes.len() == 4 => {
            sensor::cfa_from_codes(&[2, 2], codes).map(Some)
        }
        _ => Ok(None),
    }
}

/// The white level and whether the file states it.
fn white(directory: &Directory, storage: &Storage) -> (f64, bool) {
    let full = f64::from((1_u32 << storage.bits.min(16)) - 1);
    let stated = [tag::WHITE_LEVEL, SONY_WHITE].into_iter().find_map(|tag| {
        let levels = directory.numbers(tag)?;
        let lowest = levels.iter().copied().fold(f64::INFINITY, f64::min);
        (lowest > 0.0 && lowest <= full).then_some(lowest)
    });
    (stated.unwrap_or(full), stated.is_some())
}

/// Four levels of a maker's tag, where they leave a range.
fn makers_black(tiff: &Tiff, directory: &Directory, white: f64) -> Option<[f32; 4]> {
    let sony = directory.numbers(SONY_BLACK);
    let nikon = || nef::maker_note(tiff)?.numbers(nef::BLACK_LEVEL);
    let levels: [f64; 4] = sony.or_else(nikon)?.try_into().ok()?;
    let sound = levels.iter().all(|&level| level >= 0.0 && level < white);
    sound.then(|| levels.map(|level| level as f32))
}

/// The order of packed bits. TIFF's is most significant bit first; some cameras pack from the least, and do not say so: a
/// picture read in the wrong order is noise.
fn packing(tiff: &Tiff, directory: &Directory, storage: &Storage) -> Result<Packing, DecodeError> {
    let packed = storage.packing == Packing::MostFirst && !matches!(storage.bits, 8 | 16);
    if storage.compression != 1 || !packed {
        return Ok(storage.packing);
    }
    if directory.integer(tag::FILL_ORDER) == Some(2) {
        return Ok(Packing::Reversed);
    }
    let roughness = |packing| -> Result<u64, DecodeError> {
        let samples = storage.clone().with_packing(packing).unpack(tiff)?;
        let step = (storage.height / ROWS_LOOKED_AT).max(1);
        let rows = samples.chunks_exact(storage.width).step_by(step);
        // The next photosite of the same filter is the second next.
        let of_row = |row: &[u16]| -> u64 {
            let pairs = row.iter().zip(row.iter().skip(2));
            pairs.map(|(&a, &b)| u64::from(a.abs_diff(b))).sum()
        };
        Ok(rows.map(of_row).sum())
    };
    let (most, least) = (roughness(Packing::MostFirst)?, roughness(Packing::LeastFirst)?);
    Ok(if least.saturating_mul(ROUGHER) < most { Packing::LeastFirst } else { Packing::MostFirst })
}
