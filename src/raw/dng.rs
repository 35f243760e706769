//! DNG: Adobe, "Digital Negative (DNG) specification", version 1.7, 2023.
//!
//! The samples are read here, because the library that knows the cameras takes big-endian samples for little-endian ones,
//! reads only the first strip's place, cannot read uncompressed tiles nor lossless JPEG of one component, and leaves out
//! the linearisation table. The mosaic and the black levels count from the active area's top left (DNG, CFAPattern and
//! BlackLevelRepeatDim).

use super::error::CONVERT_TO_DNG;
use super::sensor::{self, Area, Stored};
use super::tags::{Directory, Tiff, tag};
use super::unpack::Storage;
use super::{DecodeError, Hint, Layout, Samples, float, kind, metadata};
use weavelight_calibration::description::Cfa;

/// What black levels may differ along rows or columns before that is refused, relative to the range: 0.02 % costs less
/// than 0.04 degrees of normal.
const BLACK_WAVE: f64 = 2e-4;

/// # Errors
/// A damaged file, or a kind of DNG that cannot be measured with.
pub(crate) fn decode(tiff: &Tiff, hint: &Hint) -> Result<Stored, DecodeError> {
    sensor::linear_only(hint, "a DNG")?;
    let directory =
        tiff.sensor().ok_or_else(|| DecodeError::damaged("it has no directory of sensor data"))?;
    let is_float = match directory.integer(tag::SAMPLE_FORMAT) {
        None | Some(1) => false,
        Some(3) => true,
        Some(_) => return Err(DecodeError::unsupported("a DNG of signed samples", CONVERT_TO_DNG)),
    };
    check_extras(directory)?;
    if let Some(how) = kind::compression(directory) {
        return Err(DecodeError::unsupported(format!("a DNG with {how}"), CONVERT_TO_DNG));
    }
    if directory.integer(tag::PLANAR_CONFIGURATION).unwrap_or(1) != 1 {
        return Err(DecodeError::unsupported("a DNG of separate colour planes", CONVERT_TO_DNG));
    }
    let storage = Storage::parse(tiff, directory)?;
    let visible = active_area(directory, &storage)?;
    let layout = layout_with(directory, &storage, hint, cfa(directory)?)?;
    let white = white_level(directory, storage.bits, is_float)?;
    let black = black_levels(directory, layout, white)?;
    let samples = if is_float {
        Samples::F32(float::unpack(&storage, tiff)?)
    } else {
        let mut samples = storage.unpack(tiff)?;
        linearize(directory, &mut samples)?;
        Samples::U16(samples)
    };
    Ok(Stored {
        width: storage.width,
        height: storage.height,
        samples,
        visible,
        layout,
        black,
        saturation: [white as f32; 4],
        metadata: metadata::from_tiff(tiff),
    })
}

/// Refuses what would change the samples' places or, beyond a factor each, their values. (Gains, lens corrections and lists of
/// bad pixels are left aside: an instrument calibrates these itself.)
fn check_extras(directory: &Directory) -> Result<(), DecodeError> {
    let refuse =
        |what: &str| Err(DecodeError::unsupported(format!("a DNG {what}"), CONVERT_TO_DNG));
    for tag in [tag::ROW_INTERLEAVE, tag::COLUMN_INTERLEAVE, tag::SUB_TILE_BLOCK] {
        if directory.integers(tag).is_some_and(|factors| factors.iter().any(|&factor| factor > 1)) {
            return refuse("with interleaved rows or columns");
        }
    }
    for tag in [tag::OPCODE_LIST_1, tag::OPCODE_LIST_2] {
        let list = directory.bytes(tag).unwrap_or_default();
        if let Some(name) = changing_opcode(list) {
            return refuse(&format!("whose samples its opcode {name} still has to change"));
        }
    }
    Ok(())
}

/// The first opcode of a list that must be applied and does more than multiply. DNG 1.7, chapter 7: big-endian, each with
/// its number, version, flags (bit 0: may be left out) and length.
fn changing_opcode(list: &[u8]) -> Option<&'static str> {
    let (count, mut rest) = list.split_first_chunk::<4>()?;
    for _ in 0..u32::from_be_bytes(*count) {
        let (head, after) = rest.split_first_chunk::<16>()?;
        let number =
            |at: usize| u32::from_be_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        let name = match number(0) {
            7 => Some("MapTable"),
            8 => Some("MapPolynomial"),
            10 => Some("DeltaPerRow"),
            11 => Some("DeltaPerColumn"),
            _ => None,
        };
        if name.is_some() && number(8) & 1 == 0 {
            return name;
        }
        rest = after.get(number(12) as usize..)?;
    }
    None
}

pub(crate) fn active_area(directory: &Directory, storage: &Storage) -> Result<Area, DecodeError> {
    let whole = || vec![0, 0, storage.height as u32, storage.width as u32];
    let area = directory.integers(tag::ACTIVE_AREA).unwrap_or_else(whole);
    let [top, left, bottom, right] = area[..] else {
        return Err(DecodeError::damaged(format!("its active area has {} numbers", area.len())));
    };
    let [top, left, bottom, right] = [top, left, bottom, right].map(|edge| edge as usize);
    Ok(Area { top, left, bottom, right })
}

/// What a pixel holds; `found` is the file's mosaic, where it says one.
pub(crate) fn layout_with(
    directory: &Directory,
    storage: &Storage,
    hint: &Hint,
    found: Option<Cfa>,
) -> Result<Layout, DecodeError> {
    let is_mosaic = directory.integer(tag::PHOTOMETRIC) == Some(32803);
    match (is_mosaic, storage.samples_per_pixel) {
        (true, 1) => {
            if !matches!(directory.integer(tag::CFA_LAYOUT), None | Some(1)) {
                return Err(DecodeError::unsupported(
                    "a staggered colour-filter array",
                    sensor::CONVERT_TO_RGB,
                ));
            }
            sensor::mosaic(found, hint)
        }
        (false, 1) => sensor::no_mosaic(Layout::Grey, hint, "a monochrome picture"),
        (false, 3) => sensor::no_mosaic(Layout::Rgb, hint, "an RGB picture"),
        (_, n) => Err(DecodeError::unsupported(
            format!("sensor data of {n} samples per pixel"),
            CONVERT_TO_DNG,
        )),
    }
}

/// `None` where the directory names no filter at all.
fn cfa(directory: &Directory) -> Result<Option<Cfa>, DecodeError> {
    let Some(codes) = directory.bytes(tag::CFA_PATTERN) else { return Ok(None) };
    let repeat = directory.integers(tag::CFA_REPEAT).unwrap_or_else(|| vec![2, 2]);
    sensor::cfa_from_codes(&repeat, codes).map(Some)
}

/// The lowest of the channels' white levels.
fn white_level(directory: &Directory, bits: u32, is_float: bool) -> Result<f64, DecodeError> {
    let full = if is_float { 1.0 } else { f64::from((1_u32 << bits.min(16)) - 1) };
    let levels = directory.numbers(tag::WHITE_LEVEL).unwrap_or_else(|| vec![full]);
    let lowest = levels.iter().copied().fold(f64::INFINITY, f64::min);
    if lowest > 0.0 && (lowest <= 65_535.0 || is_float && lowest.is_finite()) {
        Ok(lowest)
    } else {
        Err(DecodeError::damaged(format!("its white level is {lowest}")))
    }
}

/// BlackLevel plus what BlackLevelDeltaH and BlackLevelDeltaV add on average to even and odd columns and rows.
pub(crate) fn black_levels(
    directory: &Directory,
    layout: Layout,
    white: f64,
) -> Result<[f32; 4], DecodeError> {
    let cell = black_cell(directory, layout)?;
    let largest = cell.iter().copied().fold(0.0, f64::max);
    let wave = BLACK_WAVE * (white - largest).max(0.0);
    let columns =
        parity_means(&directory.numbers(tag::BLACK_LEVEL_DELTA_H).unwrap_or_default(), wave)?;
    let rows =
        parity_means(&directory.numbers(tag::BLACK_LEVEL_DELTA_V).unwrap_or_default(), wave)?;
    let black: [f64; 4] = std::array::from_fn(|i| cell[i] + rows[i / 2] + columns[i % 2]);
    if layout.channels() == 3 && columns[0] + rows[0] != columns[1] + rows[1] {
        return Err(DecodeError::unsupported(
            "an RGB picture whose black level alternates",
            CONVERT_TO_DNG,
        ));
    }
    Ok(black.map(|level| level as f32))
}

/// BlackLevel over the 2 x 2 cell; its own repeat may be smaller, or larger if it only repeats that cell.
fn black_cell(directory: &Directory, layout: Layout) -> Result<[f64; 4], DecodeError> {
    let repeat = directory.integers(tag::BLACK_LEVEL_REPEAT).unwrap_or_else(|| vec![1, 1]);
    let [rows, columns] = repeat[..] else {
        return Err(DecodeError::damaged("its black levels' repeat is no pair"));
    };
    let (rows, columns, channels) = (rows as usize, columns as usize, layout.channels());
    let count = rows.saturating_mul(columns).saturating_mul(channels);
    let levels = directory.numbers(tag::BLACK_LEVEL).unwrap_or_else(|| vec![0.0; count.min(4096)]);
    if count == 0 || levels.len() != count || levels.iter().any(|level| !level.is_finite()) {
        return Err(DecodeError::damaged(format!(
            "it has {} black levels, not {count}",
            levels.len()
        )));
    }
    let level = |x: usize, y: usize, c| levels[(y % rows * columns + x % columns) * channels + c];
    let cell = std::array::from_fn(|i| level(i % 2, i / 2, 0));
    let repeats = (0..2 * rows).all(|y| {
        (0..2 * columns).all(|x| (0..channels).all(|c| level(x, y, c) == cell[y % 2 * 2 + x % 2]))
    });
    if repeats && (channels == 1 || cell == [cell[0]; 4]) {
        Ok(cell)
    } else {
        let what = format!(
            "a black level that repeats over {columns} x {rows} pixels and {channels} channels"
        );
        Err(DecodeError::unsupported(what, CONVERT_TO_DNG))
    }
}

/// Means of the even and of the odd deltas.
fn parity_means(deltas: &[f64], wave: f64) -> Result<[f64; 2], DecodeError> {
    let means = [0, 1].map(|parity| {
        let (sum, count) = deltas
            .iter()
            .skip(parity)
            .step_by(2)
            .fold((0.0, 0.0), |(sum, count), delta| (sum + delta, count + 1.0));
        if count == 0.0 { 0.0 } else { sum / count }
    });
    let within = |(i, delta): (usize, &f64)| (delta - means[i % 2]).abs() <= wave;
    if deltas.iter().enumerate().all(within) {
        Ok(means)
    } else {
        Err(DecodeError::unsupported(
            "a black level that varies along rows or columns",
            CONVERT_TO_DNG,
        ))
    }
}

/// DNG, LinearizationTable: looks every stored value up; values beyond the table take its last entry.
fn linearize(directory: &Directory, samples: &mut [u16]) -> Result<(), DecodeError> {
    let Some(table) = directory.integers(tag::LINEARIZATION_TABLE) else { return Ok(()) };
    let Some(&last) = table.last().filter(|_| table.iter().all(|&entry| entry <= 65_535)) else {
        return Err(DecodeError::damaged("its linearisation table is empty or exceeds 16 bits"));
    };
    let full: Vec<u16> = (0..65_536).map(|i| *table.get(i).unwrap_or(&last) as u16).collect();
    samples.iter_mut().for_each(|sample| *sample = full[usize::from(*sample)]);
    Ok(())
}
