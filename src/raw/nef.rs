//! Nikon's compressed NEF (TIFF compression 34713), lossless and lossy, 12 and 14 bits.
//!
//! The samples are what the camera encoded; other decoders add noise to hide the steps of the lossy kind, which an
//! instrument must not. L. Clévy, "Inside Nikon NEF lossless compression"; tag names as in Exiftool's "Nikon Tags". A
//! row is two interleaved sequences (even and odd columns), each predicted from two samples to the left, at the row's start
//! from two rows above; the differences are Huffman-coded, and a curve maps the result to raw numbers.

use super::bits::Bits;
use super::error::CONVERT_TO_DNG;
use super::nikon_bits::Tree;
use super::sensor::{self, Area, Stored};
use super::tags::{Block, Directory, Tiff, tag};
use super::unpack::Storage;
use super::{Assumed, DecodeError, Hint, Metadata, Samples, camera, metadata};
use crate::raster::PictureError;

/// TIFF compression of Nikon's own.
pub(crate) const NIKON: u32 = 34713;

/// Maker-note tag of four black levels.
pub(crate) const BLACK_LEVEL: u16 = 0x003d;

/// Other maker-note tags.
mod note {
    pub(super) const COMPRESSION: u16 = 0x0093;
    pub(super) const LINEARIZATION: u16 = 0x0096;
}

/// Where a lossy file of version 0x44 0x20 says from which row the second tree holds.
const SPLIT_ROW_OFFSET: usize = 562;

/// By how much values may leave the curve after the split row, where differences are coarse.
const SPLIT_SLACK: i32 = 16;

/// Beginnings of compressed streams of kinds that share the tag's number.
const OTHER_KINDS: [(u32, &str); 3] =
    [(8, "a small-size NEF"), (13, "a high-efficiency NEF"), (14, "a high-efficiency* NEF")];

/// # Errors
/// A damaged file, or one of the kinds that hold no plain sensor data.
pub(crate) fn decode(
    tiff: &Tiff,
    directory: &Directory,
    hint: &Hint,
) -> Result<Stored, DecodeError> {
    sensor::linear_only(hint, "a NEF")?;
    let storage = Storage::parse(tiff, directory)?;
    let note =
        maker_note(tiff).ok_or_else(|| DecodeError::damaged("it has no Nikon maker note"))?;
    let kind = note.integer(note::COMPRESSION);
    if let Some((_, name)) = OTHER_KINDS.iter().find(|(number, _)| Some(*number) == kind) {
        return Err(DecodeError::unsupported(
            *name,
            "set the camera to lossless compressed RAW, or convert it to DNG with Adobe DNG Converter",
        ));
    }
    let coding = Coding::parse(&note, storage.bits)?;
    let mut stored = describe(tiff, directory, &note, &storage, hint)?;
    stored.samples = Samples::U16(decompress(tiff, directory, &storage, &coding)?);
    Ok(stored)
}

pub(crate) fn maker_note<'a>(tiff: &Tiff<'a>) -> Option<Directory<'a>> {
    let bytes = tiff.with(tag::MAKER_NOTE)?.bytes(tag::MAKER_NOTE)?;
    let inner = bytes.strip_prefix(b"Nikon\0")?.get(4..)?;
    let block = Block::new(inner)?;
    Some(Directory::parse(block, block.u32(4)? as usize)?.0)
}

/// How the samples are coded: maker-note tag 0x0096 and the depth.
#[derive(Debug)]
struct Coding {
    /// Tree to begin with, and the one from the split row on.
    tree: Tree,
    split: Option<(usize, Tree)>,
    /// Predictions of the first two columns of the first two rows: `[row][column]`.
    start: [[i32; 2]; 2],
    /// Raw number of each coded value.
    curve: Vec<u16>,
}

impl Coding {
    fn parse(note: &Directory, bits: u32) -> Result<Self, DecodeError> {
        if !matches!(bits, 12 | 14) {
            return Err(DecodeError::unsupported(
                format!("a compressed NEF of {bits} bits"),
                CONVERT_TO_DNG,
            ));
        }
        let missing = || {
            DecodeError::damaged(
                "its linearisation table (maker note 0x0096) is missing or too short",
            )
        };
        let table = note.bytes(note::LINEARIZATION).ok_or_else(missing)?;
        let table = Block { bytes: table, order: note.block.order };
        let &[first, second, ..] = table.bytes else { return Err(missing()) };
        // Two versions have a longer head.
        let head = if first == 0x49 || second == 0x58 { 2 + 2110 } else { 2 };
        let number = |i: usize| table.u16(head + 2 * i).ok_or_else(missing);
        let start = [[number(0)?, number(1)?], [number(2)?, number(3)?]];
        let lossless = first == 0x46;
        let (curve, split_row) = match lossless {
            true => ((0..1 << bits).collect(), 0),
            false => lossy_curve(&table, [first, second], head + 8, bits).ok_or_else(missing)?,
        };
        let split =
            (split_row > 0).then(|| (usize::from(split_row), Tree::lossy_after_split(bits)));
        let tree = if lossless { Tree::lossless(bits) } else { Tree::lossy(bits) };
        Ok(Self { tree, split, start: start.map(|row| row.map(i32::from)), curve })
    }
}

/// The curve (raw number of each coded value) and the split row (0: none). `None` where the table is too short.
fn lossy_curve(table: &Block, version: [u8; 2], at: usize, bits: u32) -> Option<(Vec<u16>, u16)> {
    let points = usize::from(table.u16(at)?);
    let point = |i: usize| table.u16(at + 2 + 2 * i);
    let mut length = 1_usize << bits;
    let mut step = length / points.saturating_sub(1).max(1);
    let knots =
        version[0] == 0x44 && (version[1] == 0x20 || version[1] == 0x40 && step > 3) && points > 1;
    if knots && step > 0 {
        if version[1] == 0x40 {
            (step, length) = (step / 4, length / 4);
        }
        let knots: Vec<u16> = (0..points).map(point).collect::<Option<_>>()?;
        let split = table.u16(SPLIT_ROW_OFFSET)?;
        Some((interpolate(&knots, step, length), split))
    } else {
        if points == 0 || points > 0x4001 {
            return Some(((0..1 << bits).collect(), 0));
        }
        Some(((0..points).map(point).collect::<Option<_>>()?, 0))
    }
}

/// Knots every `step` values, straight in between, rounded down; constant beyond the last.
fn interpolate(knots: &[u16], step: usize, length: usize) -> Vec<u16> {
    let value = |i: usize| {
        let (knot, rest) = (i / step, i % step);
        let knot_value = |k: usize| usize::from(knots[k.min(knots.len() - 1)]);
        (knot_value(knot) * (step - rest) + knot_value(knot + 1) * rest) / step
    };
    (0..length).map(|i| value(i) as u16).collect()
}

/// What the camera table says; for cameras it does not know, what the file says.
fn describe(
    tiff: &Tiff,
    directory: &Directory,
    note: &Directory,
    storage: &Storage,
    hint: &Hint,
) -> Result<Stored, DecodeError> {
    let stored = match camera::load(tiff.block.bytes, Some(tiff), camera::Want::Description) {
        Ok(image) => camera::describe(&image, Some(tiff), hint)?,
        Err(_) => describe_from_tags(tiff, directory, note, storage, hint)?,
    };
    if [stored.width, stored.height] != [storage.width, storage.height] {
        return Err(DecodeError::damaged(format!(
            "its sensor is {} x {}, the camera's is {} x {}",
            storage.width, storage.height, stored.width, stored.height
        )));
    }
    Ok(stored)
}

fn describe_from_tags(
    tiff: &Tiff,
    directory: &Directory,
    note: &Directory,
    storage: &Storage,
    hint: &Hint,
) -> Result<Stored, DecodeError> {
    let repeat = directory.integers(tag::CFA_REPEAT).unwrap_or_else(|| vec![2, 2]);
    let found = directory
        .bytes(tag::CFA_PATTERN)
        .map(|codes| sensor::cfa_from_codes(&repeat, codes))
        .transpose()?;
    let black = match note.integers(BLACK_LEVEL).as_deref() {
        Some(&[a, b, c, d]) => Some([a, b, c, d].map(|level| level as f32)),
        _ => None,
    };
    let assumed = Assumed { black: black.is_none(), saturation: true };
    Ok(Stored {
        width: storage.width,
        height: storage.height,
        samples: Samples::U16(Vec::new()),
        visible: Area { top: 0, left: 0, bottom: storage.height, right: storage.width },
        layout: sensor::mosaic(found, hint)?,
        black: black.unwrap_or_default(),
        saturation: [((1_u32 << storage.bits) - 1) as f32; 4],
        metadata: Metadata { assumed, ..metadata::from_tiff(tiff) },
    })
}

fn decompress(
    tiff: &Tiff,
    directory: &Directory,
    storage: &Storage,
    coding: &Coding,
) -> Result<Vec<u16>, DecodeError> {
    let places =
        (directory.integers(tag::STRIP_OFFSETS), directory.integers(tag::STRIP_BYTE_COUNTS));
    let (Some([offset]), Some([length])) = (places.0.as_deref(), places.1.as_deref()) else {
        return Err(DecodeError::unsupported("a compressed NEF in several strips", CONVERT_TO_DNG));
    };
    let packed = tiff.block.slice(*offset as usize, *length as usize).unwrap_or_default();
    // The shortest code is two bits long.
    let samples = storage.width * storage.height;
    if samples.div_ceil(4) > packed.len() || storage.samples_per_pixel != 1 {
        return Err(PictureError::TooLarge {
            width: storage.width as u64,
            height: storage.height as u64,
            bytes: tiff.block.bytes.len() as u64,
        }
        .into());
    }
    let mut image = vec![0; samples];
    decode_rows(packed, coding, storage.width, &mut image)?;
    Ok(image)
}

fn decode_rows(
    packed: &[u8],
    coding: &Coding,
    width: usize,
    image: &mut [u16],
) -> Result<(), DecodeError> {
    let mut bits = Bits::new(packed);
    let mut above = coding.start;
    let (split_row, split_tree) = match &coding.split {
        Some((row, tree)) => (*row, tree),
        None => (usize::MAX, &coding.tree),
    };
    for (y, row) in image.chunks_exact_mut(width).enumerate() {
        let (tree, slack) =
            if y < split_row { (&coding.tree, 0) } else { (split_tree, SPLIT_SLACK) };
        let inside = decode_row(&mut bits, tree, &coding.curve, slack, &mut above[y % 2], row);
        if !inside || bits.overrun() {
            return Err(DecodeError::damaged(format!("its compressed data goes wrong in row {y}")));
        }
    }
    Ok(())
}

/// One row; `above` holds the first two values of the row two above and becomes this row's. Returns whether all values
/// lay on the curve.
fn decode_row(
    bits: &mut Bits,
    tree: &Tree,
    curve: &[u16],
    slack: i32,
    above: &mut [i32; 2],
    row: &mut [u16],
) -> bool {
    let mut left = *above;
    let last = curve.len() as i32 - 1;
    let (mut lowest, mut highest) = (0, 0);
    for (x, pair) in row.chunks_mut(2).enumerate() {
        for (value, sample) in left.iter_mut().zip(pair) {
            // Differences have 16 bits at most, so a row cannot overflow i32 unless it is wrong anyway.
            *value = value.wrapping_add(tree.next(bits));
            (lowest, highest) = (lowest.min(*value), highest.max(*value));
            *sample = curve[(*value).clamp(0, last) as usize];
        }
        if x == 0 {
            *above = left;
        }
    }
    lowest >= -slack && highest <= last + slack
}
