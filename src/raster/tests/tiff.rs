//! A writer of small TIFF files, and what a plain one holds.

use super::{decoded, numbers};
use crate::raster::Values;

#[derive(Clone)]
pub(super) enum Value {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Bytes(Vec<u8>),
    Ratio(Vec<[u32; 2]>),
}

/// One picture: its tags but for the places of its strips (or tiles), and these.
#[derive(Clone)]
pub(super) struct Page {
    pub(super) tags: Vec<(u16, Value)>,
    pub(super) segments: Vec<Vec<u8>>,
}

impl Page {
    pub(super) fn new(
        size: [u16; 2],
        samples: u16,
        bits: u16,
        photometric: u16,
        data: Vec<u8>,
    ) -> Self {
        let tags = [
            (256, vec![size[0]]),
            (257, vec![size[1]]),
            (258, vec![bits; samples.into()]),
            (259, vec![1]),
            (262, vec![photometric]),
            (277, vec![samples]),
        ];
        let tags = tags.map(|(tag, values)| (tag, Value::Short(values)));
        Self { tags: tags.into(), segments: vec![data] }
    }

    /// With a tag added or replaced.
    pub(super) fn with(mut self, tag: u16, value: Value) -> Self {
        self.tags.retain(|(other, _)| *other != tag);
        self.tags.push((tag, value));
        self
    }

    pub(super) fn short(self, tag: u16, value: u16) -> Self {
        self.with(tag, Value::Short(vec![value]))
    }
}

/// Byte order and width of offsets.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    pub(super) big_endian: bool,
    pub(super) wide: bool,
}

pub(super) const PLAIN: Kind = Kind { big_endian: false, wide: false };

impl Kind {
    pub(super) fn number(self, value: u64, size: usize) -> Vec<u8> {
        if self.big_endian {
            value.to_be_bytes()[8 - size..].to_vec()
        } else {
            value.to_le_bytes()[..size].to_vec()
        }
    }

    fn value(self, value: &Value) -> (u64, u64, Vec<u8>) {
        match value {
            Value::Short(v) => {
                (3, v.len() as u64, v.iter().flat_map(|&v| self.number(v.into(), 2)).collect())
            }
            Value::Long(v) => {
                (4, v.len() as u64, v.iter().flat_map(|&v| self.number(v.into(), 4)).collect())
            }
            Value::Bytes(v) => (7, v.len() as u64, v.clone()),
            Value::Ratio(v) => (
                5,
                v.len() as u64,
                v.as_flattened().iter().flat_map(|&v| self.number(v.into(), 4)).collect(),
            ),
        }
    }

    pub(super) fn file(self, pages: &[Page]) -> Vec<u8> {
        let (head, field, offset) = if self.wide { (8, 8, 8) } else { (2, 4, 4) };
        let mut bytes = if self.big_endian { b"MM".to_vec() } else { b"II".to_vec() };
        bytes.extend(self.number(if self.wide { 43 } else { 42 }, 2));
        if self.wide {
            bytes.extend([self.number(8, 2), self.number(0, 2)].concat());
        }
        let mut link = bytes.len();
        bytes.extend(self.number(0, offset));
        for page in pages {
            let places: Vec<u32> = page
                .segments
                .iter()
                .map(|segment| {
                    bytes.extend(segment);
                    (bytes.len() - segment.len()) as u32
                })
                .collect();
            let lengths = page.segments.iter().map(|segment| segment.len() as u32).collect();
            let tiled = page.tags.iter().any(|(tag, _)| *tag == 322);
            let mut tags = page.tags.clone();
            tags.push((if tiled { 324 } else { 273 }, Value::Long(places)));
            tags.push((if tiled { 325 } else { 279 }, Value::Long(lengths)));
            tags.sort_by_key(|(tag, _)| *tag);
            let mut entries = self.number(tags.len() as u64, head);
            for (tag, value) in &tags {
                let (kind, count, mut data) = self.value(value);
                entries.extend(
                    [
                        self.number((*tag).into(), 2),
                        self.number(kind, 2),
                        self.number(count, field),
                    ]
                    .concat(),
                );
                if data.len() <= offset {
                    data.resize(offset, 0);
                    entries.extend(data);
                } else {
                    entries.extend(self.number(bytes.len() as u64, offset));
                    bytes.extend(data);
                }
            }
            let at = self.number(bytes.len() as u64, offset);
            bytes[link..link + offset].copy_from_slice(&at);
            bytes.extend(entries);
            link = bytes.len();
            bytes.extend(self.number(0, offset));
        }
        bytes
    }

    /// Samples packed row by row, each row from a whole byte on.
    pub(super) fn pack(self, samples: &[u32], row: usize, bits: u32) -> Vec<u8> {
        if matches!(bits, 16 | 24 | 32) {
            return samples
                .iter()
                .flat_map(|&s| self.number(s.into(), bits as usize / 8))
                .collect();
        }
        let mut bytes = Vec::new();
        for row in samples.chunks(row) {
            let all: Vec<bool> = row
                .iter()
                .flat_map(|&s| (0..bits).rev().map(move |bit| s >> bit & 1 == 1))
                .collect();
            bytes.extend(all.chunks(8).map(|byte| {
                byte.iter().enumerate().fold(0, |sum, (k, &bit)| sum | u8::from(bit) << (7 - k))
            }));
        }
        bytes
    }
}

pub(super) const KINDS: [Kind; 4] = [
    PLAIN,
    Kind { big_endian: true, wide: false },
    Kind { big_endian: false, wide: true },
    Kind { big_endian: true, wide: true },
];

/// Numbers that use all bits.
pub(super) fn ramp(count: usize, bits: u32) -> Vec<u32> {
    let full = u64::from(u32::MAX >> (32 - bits));
    let value = |k: usize| ((k as u64 * 2_654_435_761) ^ ((k as u64) << 7)) % (full + 1);
    let mut ramp: Vec<u32> = (0..count).map(|k| value(k) as u32).collect();
    ramp[count - 1] = full as u32;
    ramp
}

#[test]
fn every_depth_in_every_byte_order() {
    for kind in KINDS {
        for bits in (1..=16).chain([24, 32]) {
            let samples = ramp(7 * 5 * 3, bits);
            let data = kind.pack(&samples, 21, bits);
            let picture = decoded(&kind.file(&[Page::new([7, 5], 3, bits as u16, 2, data)]));
            assert_eq!((picture.width, picture.height, picture.channels), (7, 5, 3), "{bits}");
            let full = f64::from(u32::MAX >> (32 - bits));
            if bits > 16 {
                assert_eq!(picture.full_scale, 1.0);
                let expected = samples.iter().map(|&s| f64::from((f64::from(s) / full) as f32));
                assert_eq!(numbers(&picture.values), expected.collect::<Vec<_>>(), "{bits}");
            } else {
                assert_eq!(f64::from(picture.full_scale), full);
                let expected: Vec<f64> = samples.iter().map(|&s| s.into()).collect();
                assert_eq!(numbers(&picture.values), expected, "{bits}");
            }
            assert_eq!(matches!(picture.values, Values::U8(_)), bits <= 8);
        }
    }
}

#[test]
fn floating_point_of_every_size() {
    let values = [0.0_f32, 1.0, -2.5, 0.099_975_586, 65_504.0, f32::INFINITY];
    for kind in KINDS {
        let check = |bits: u16, data: Vec<u8>| {
            let page = Page::new([3, 2], 1, bits, 1, data).short(339, 3);
            let picture = decoded(&kind.file(&[page]));
            assert_eq!(picture.values, Values::F32(values.to_vec()), "{bits}");
            assert_eq!(picture.full_scale, f32::INFINITY);
        };
        let half = |v: f32| exr::prelude::f16::from_f32(v).to_bits().into();
        check(16, values.iter().flat_map(|&v| kind.number(half(v), 2)).collect());
        check(32, values.iter().flat_map(|&v| kind.number(v.to_bits().into(), 4)).collect());
        check(64, values.iter().flat_map(|&v| kind.number(f64::from(v).to_bits(), 8)).collect());
    }
}

#[test]
fn strips_tiles_and_planes() {
    let samples = ramp(7 * 5 * 3, 16);
    let expected: Vec<f64> = samples.iter().map(|&s| s.into()).collect();
    let rows = |from: usize, to: usize| PLAIN.pack(&samples[from * 21..to * 21], 21, 16);
    let mut strips = Page::new([7, 5], 3, 16, 2, vec![]).short(278, 2);
    strips.segments = vec![rows(0, 2), rows(2, 4), rows(4, 5)];
    assert_eq!(numbers(&decoded(&PLAIN.file(&[strips])).values), expected);
    let at = |x: usize, y: usize, c: usize| {
        if x < 7 && y < 5 { samples[(y * 7 + x) * 3 + c] } else { 9 }
    };
    let tile = |left: usize, top: usize| {
        let all = (0..16)
            .flat_map(|y| (0..16).flat_map(move |x| [0, 1, 2].map(|c| at(left + x, top + y, c))));
        PLAIN.pack(&all.collect::<Vec<_>>(), 48, 16)
    };
    let tiles = Page::new([7, 5], 3, 16, 2, tile(0, 0)).short(322, 16).short(323, 16);
    assert_eq!(numbers(&decoded(&PLAIN.file(&[tiles])).values), expected);
    let plane = |c: usize| {
        PLAIN.pack(&samples.iter().skip(c).step_by(3).copied().collect::<Vec<_>>(), 7, 16)
    };
    let mut planes = Page::new([7, 5], 3, 16, 2, vec![]).short(284, 2);
    planes.segments = [0, 1, 2].map(plane).into();
    assert_eq!(numbers(&decoded(&PLAIN.file(&[planes])).values), expected);
}
