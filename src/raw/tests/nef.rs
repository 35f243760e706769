//! Compressed NEF: files made here, decoded by the description written out a second time.

use super::builder::{Entries, Value, tiff};
use crate::raw::tags::{Order, tag};
use crate::raw::{Hint, decode, decode_uncropped};
use weavelight_calibration::description::Cfa;

const WIDTH: usize = 53;
const HEIGHT: usize = 24;

/// Code lengths' counts and symbols, as in the description: lossy, lossy after the split, lossless.
type Code = (&'static [usize], &'static [u8]);
const LOSSY_12: Code =
    (&[0, 1, 5, 1, 1, 1, 1, 1, 1, 2], &[5, 4, 3, 6, 2, 7, 1, 0, 8, 9, 11, 10, 12]);
const SPLIT_12: Code = (
    &[0, 1, 5, 1, 1, 1, 1, 1, 1, 2],
    &[0x39, 0x5a, 0x38, 0x27, 0x16, 5, 4, 3, 2, 1, 0, 11, 12, 12],
);
const LOSSLESS_12: Code = (&[0, 1, 4, 2, 3, 1, 2], &[5, 4, 6, 3, 7, 2, 8, 1, 9, 0, 10, 11, 12]);
const LOSSY_14: Code =
    (&[0, 1, 4, 3, 1, 1, 1, 1, 1, 2], &[5, 6, 4, 7, 8, 3, 9, 2, 1, 0, 10, 11, 12, 13, 14]);
const SPLIT_14: Code = (
    &[0, 1, 5, 1, 1, 1, 1, 1, 1, 1, 2],
    &[8, 0x5c, 0x4b, 0x3a, 0x29, 7, 6, 5, 4, 3, 2, 1, 0, 13, 14],
);
const LOSSLESS_14: Code =
    (&[0, 1, 4, 2, 2, 3, 1, 2], &[7, 6, 8, 5, 9, 4, 10, 3, 11, 12, 2, 0, 1, 13, 14]);

/// A kind of compressed NEF.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) bits: u16,
    pub(super) version: [u8; 2],
    pub(super) code: Code,
    /// First row of the second code.
    pub(super) split: Option<(usize, Code)>,
}

pub(super) const KINDS: [Kind; 8] = [
    Kind { bits: 14, version: [0x46, 0x30], code: LOSSLESS_14, split: None },
    Kind { bits: 12, version: [0x46, 0x30], code: LOSSLESS_12, split: None },
    Kind { bits: 14, version: [0x44, 0x20], code: LOSSY_14, split: None },
    Kind { bits: 12, version: [0x44, 0x20], code: LOSSY_12, split: None },
    Kind { bits: 14, version: [0x44, 0x20], code: LOSSY_14, split: Some((10, SPLIT_14)) },
    Kind { bits: 12, version: [0x44, 0x20], code: LOSSY_12, split: Some((7, SPLIT_12)) },
    Kind { bits: 14, version: [0x44, 0x10], code: LOSSY_14, split: None },
    Kind { bits: 12, version: [0x44, 0x10], code: LOSSY_12, split: None },
];

/// Pseudo-random numbers; splitmix64 (Steele et al. 2014).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % limit as u64) as usize
    }
}

/// The code of each symbol: value and length.
fn codes((counts, symbols): Code) -> Vec<(u32, usize, u8)> {
    let mut next = 0;
    let mut found = Vec::new();
    let mut symbols = symbols.iter();
    for (i, &count) in counts.iter().enumerate() {
        next <<= 1;
        for symbol in symbols.by_ref().take(count) {
            found.push((next, i + 1, *symbol));
            next += 1;
        }
    }
    found
}

/// The difference that a symbol and its bits stand for, as the description writes it.
fn difference(symbol: u8, bits: i32) -> i32 {
    let (length, shift) = (i32::from(symbol & 15), i32::from(symbol >> 4));
    let mut difference = (((bits << 1) + 1) << shift) >> 1;
    if length > 0 && difference & (1 << (length - 1)) == 0 {
        difference -= (1 << length) - i32::from(shift == 0);
    }
    if length == 0 { 0 } else { difference }
}

/// A stream of bits, and the coded values it stands for.
fn stream(kind: Kind, start: i32, random: &mut Random) -> (Vec<u8>, Vec<i32>) {
    let (mut bits, mut values) = (Vec::new(), Vec::new());
    let mut push =
        |value: u32, length: usize| bits.extend((0..length).rev().map(|i| (value >> i & 1) as u8));
    let mut above = [[start; 2]; 2];
    let range = 0..1 << kind.bits;
    for y in 0..HEIGHT {
        let code = kind.split.filter(|(row, _)| y >= *row).map_or(kind.code, |(_, code)| code);
        let codes = codes(code);
        let mut left = [0; 2];
        for x in 0..WIDTH {
            let before = if x < 2 { above[y & 1][x] } else { left[x & 1] };
            let (value, pick, stored) = loop {
                let pick = codes[random.below(codes.len())];
                let length = usize::from(pick.2 & 15).saturating_sub(usize::from(pick.2 >> 4));
                let stored = random.below(1 << length) as u32;
                let value = before + difference(pick.2, stored as i32);
                if range.contains(&value) {
                    break (value, pick, (stored, length));
                }
            };
            push(pick.0, pick.1);
            push(stored.0, stored.1);
            if x < 2 {
                above[y & 1][x] = value;
            }
            left[x & 1] = value;
            values.push(value);
        }
    }
    (
        bits.chunks(8)
            .map(|eight| eight.iter().enumerate().fold(0, |byte, (i, bit)| byte | bit << (7 - i)))
            .collect(),
        values,
    )
}

/// The maker note's table: version, predictions, knots or curve, and the split row at its place.
fn table(kind: Kind, start: u16) -> (Vec<u8>, Vec<u16>) {
    let mut bytes = kind.version.to_vec();
    (0..4).for_each(|_| bytes.extend(start.to_be_bytes()));
    let full = 1_usize << kind.bits;
    let squared = |i: usize| (i * i / full) as u16;
    let curve: Vec<u16> = match kind.version {
        [0x46, _] => (0..full as u32).map(|i| i as u16).collect(),
        [0x44, 0x20] => {
            let step = full / 256;
            let knots: Vec<u16> = (0..=256).map(|k| squared(k * step)).collect();
            bytes.extend(257_u16.to_be_bytes());
            bytes.extend(knots.iter().flat_map(|knot| knot.to_be_bytes()));
            let between = |i: usize| {
                let (a, b) = (usize::from(knots[i / step]), usize::from(knots[i / step + 1]));
                ((a * (step - i % step) + b * (i % step)) / step) as u16
            };
            (0..full).map(between).collect()
        }
        _ => {
            let curve: Vec<u16> = (0..full).map(squared).collect();
            bytes.extend((full as u16).to_be_bytes());
            bytes.extend(curve.iter().flat_map(|value| value.to_be_bytes()));
            curve
        }
    };
    bytes.resize(bytes.len().max(600), 0);
    if let Some((row, _)) = kind.split {
        bytes[562..564].copy_from_slice(&(row as u16).to_be_bytes());
    }
    (bytes, curve)
}

/// A NEF and the samples it holds.
pub(super) fn file(kind: Kind, seed: u64) -> (Vec<u8>, Vec<u16>) {
    let start = 1 << (kind.bits - 2);
    let (table, curve) = table(kind, start);
    let (packed, values) = stream(kind, start.into(), &mut Random(seed));
    // A maker note is a TIFF structure of its own, counted from its own first byte.
    let note =
        tiff(Order::Big, &vec![(0x0093, Value::Short(vec![3])), (0x0096, Value::Undefined(table))]);
    let note = [b"Nikon\0\x02\x10\0\0".as_slice(), &note].concat();
    let samples = values.iter().map(|&value| curve[value as usize]).collect();
    (tiff(Order::Big, &entries(kind, packed, note)), samples)
}

fn entries(kind: Kind, packed: Vec<u8>, note: Vec<u8>) -> Entries {
    let long = |value: usize| Value::Long(vec![value as u32]);
    let sensor = vec![
        (tag::NEW_SUBFILE_TYPE, long(0)),
        (tag::WIDTH, long(WIDTH)),
        (tag::HEIGHT, long(HEIGHT)),
        (tag::BITS_PER_SAMPLE, Value::Short(vec![kind.bits])),
        (tag::COMPRESSION, Value::Short(vec![34713])),
        (tag::PHOTOMETRIC, Value::Short(vec![32803])),
        (tag::SAMPLES_PER_PIXEL, Value::Short(vec![1])),
        (tag::ROWS_PER_STRIP, long(HEIGHT)),
        (tag::STRIP_BYTE_COUNTS, long(packed.len())),
        (tag::STRIP_OFFSETS, Value::Blobs(vec![packed])),
        (tag::CFA_REPEAT, Value::Short(vec![2, 2])),
        (tag::CFA_PATTERN, Value::Byte(vec![1, 0, 2, 1])),
    ];
    vec![
        (tag::MAKE, Value::Ascii("NIKON CORPORATION")),
        (tag::MODEL, Value::Ascii("NIKON OF THE FUTURE")),
        (tag::SUB_IFDS, Value::Directory(sensor)),
        (tag::EXIF_IFD, Value::Directory(vec![(tag::MAKER_NOTE, Value::Undefined(note))])),
    ]
}

#[test]
fn every_kind_decodes() {
    for kind in KINDS {
        for seed in 0..3 {
            let (bytes, expected) = file(kind, seed);
            let found = decode_uncropped(&bytes, &Hint::default());
            let (width, height, samples) =
                found.unwrap_or_else(|error| panic!("{kind:?}: {error}"));
            assert_eq!([width, height], [WIDTH, HEIGHT]);
            assert_eq!(samples, expected, "{kind:?}");
        }
    }
}

#[test]
fn an_unknown_camera_is_described_by_its_tags() {
    let frame = decode(&file(KINDS[0], 1).0, &Hint::default()).unwrap();
    assert_eq!(frame.layout, crate::raw::Layout::Mosaic(Cfa::parse("GRBG").unwrap()));
    assert_eq!((frame.black, frame.saturation), ([0.0; 4], [16_383.0; 4]));
    assert_eq!(frame.metadata.camera.as_deref(), Some("NIKON OF THE FUTURE"));
}

#[test]
fn a_damaged_stream_is_noticed() {
    for kind in KINDS {
        let (mut bytes, _) = file(kind, 5);
        // The stream is the first blob: from byte 8 on. All ones is the longest code, of the largest difference.
        bytes[8..300].fill(0xff);
        let error = decode(&bytes, &Hint::default()).unwrap_err().to_string();
        assert!(error.contains("goes wrong in row"), "{kind:?}: {error}");
    }
}
