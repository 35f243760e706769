//! Cameras that no table knows, by their own tags.

use super::builder::{Entries, Value, tiff};
use super::dng::{HEIGHT, Kind, PLAIN, WIDTH, entries, samples};
use super::ljpeg;
use crate::raw::tags::{Order, tag};
use crate::raw::{Assumed, Frame, Hint, Layout, Samples, decode, metadata};
use weavelight_calibration::description::Cfa;

/// Makers and models that rawloader's table does not have; the last is nobody's.
const UNKNOWN: [(&str, &str); 5] = [
    ("NIKON CORPORATION", "NIKON Z 6"),
    ("SONY", "ILCE-7M4"),
    ("Canon", "Canon EOS R99"),
    ("Hasselblad", "X9D"),
    ("Acme", "TIFF/EP 1"),
];

/// A file whose first directory is a thumbnail and whose second one, below it, holds the sensor's data.
pub(super) fn container(
    order: Order,
    (make, model): (&'static str, &'static str),
    sensor: Entries,
) -> Vec<u8> {
    let long = |value: u32| Value::Long(vec![value]);
    let short = |value: u16| Value::Short(vec![value]);
    let first = vec![
        (tag::NEW_SUBFILE_TYPE, long(1)),
        (tag::WIDTH, long(8)),
        (tag::HEIGHT, long(6)),
        (tag::BITS_PER_SAMPLE, Value::Short(vec![8, 8, 8])),
        (tag::COMPRESSION, short(1)),
        (tag::PHOTOMETRIC, short(2)),
        (tag::MAKE, Value::Ascii(make)),
        (tag::MODEL, Value::Ascii(model)),
        (tag::STRIP_OFFSETS, Value::Blobs(vec![vec![9; 144]])),
        (tag::SAMPLES_PER_PIXEL, short(3)),
        (tag::ROWS_PER_STRIP, long(6)),
        (tag::STRIP_BYTE_COUNTS, long(144)),
        (tag::SUB_IFDS, Value::Directory(sensor)),
    ];
    tiff(order, &first)
}

/// Sensor data as the DNG tests store them, without what only DNG says.
pub(super) fn sensor(kind: Kind, extra: Entries) -> Entries {
    let mut found = entries(kind, extra);
    found.retain(|(tag, _)| {
        ![tag::DNG_VERSION, tag::MAKE, tag::MODEL, tag::ORIENTATION].contains(tag)
            && !(tag::BLACK_LEVEL_REPEAT..=tag::WHITE_LEVEL).contains(tag)
    });
    found
}

fn u16s(frame: &Frame) -> &[u16] {
    match &frame.samples {
        Samples::U16(samples) => samples,
        Samples::F32(_) => panic!("floating-point samples"),
    }
}

#[test]
fn every_maker_and_storage_gives_the_samples() {
    let mut kinds = Vec::new();
    for order in [Order::Little, Order::Big] {
        for segment in [[WIDTH, HEIGHT], [WIDTH, 5], [16, 16], [48, 32]] {
            kinds.extend([8, 10, 12, 14, 16].map(|bits| Kind { order, bits, segment, ..PLAIN }));
            kinds.extend([12, 14].map(|bits| Kind {
                order,
                bits,
                segment,
                compression: 7,
                ..PLAIN
            }));
            kinds.push(Kind { order, segment, compression: 8, ..PLAIN });
        }
    }
    for (i, kind) in kinds.into_iter().enumerate() {
        let camera = UNKNOWN[i % UNKNOWN.len()];
        let bytes = container(kind.order, camera, sensor(kind, vec![]));
        let frame = decode(&bytes, &Hint::default())
            .unwrap_or_else(|error| panic!("{camera:?} {kind:?}: {error}"));
        assert_eq!([frame.width, frame.height], [WIDTH, HEIGHT]);
        assert_eq!(frame.layout, Layout::Mosaic(Cfa::RGGB));
        assert_eq!(u16s(&frame), samples(kind.bits), "{camera:?} {kind:?}");
        let full = ((1_u32 << kind.bits) - 1) as f32;
        assert_eq!((frame.black, frame.saturation), ([0.0; 4], [full; 4]));
        assert_eq!(frame.metadata.assumed, Assumed { black: true, saturation: true });
        assert_eq!(metadata(&bytes).exposure_s, Some(1.0 / 125.0));
    }
}

/// A picture without noise: samples in the wrong order of bits are rough.
fn smooth(bits: u32) -> Vec<u16> {
    let sample = |i: usize| (1 << (bits - 2)) + 9 * (i % WIDTH) + 4 * (i / WIDTH);
    (0..WIDTH * HEIGHT).map(|i| sample(i) as u16).collect()
}

/// Rows packed bit by bit, padded to whole bytes.
fn packed(values: &[u16], bits: u32, least_first: bool) -> Vec<u8> {
    let row = |row: &[u16]| -> Vec<u8> {
        let bit = |value: u16, k: u32| value >> (if least_first { k } else { bits - 1 - k }) & 1;
        let all: Vec<u16> =
            row.iter().flat_map(|&value| (0..bits).map(move |k| bit(value, k))).collect();
        let byte = |eight: &[u16]| {
            let place = |k: usize| if least_first { k } else { 7 - k };
            eight.iter().enumerate().fold(0, |byte, (k, &bit)| byte | (bit as u8) << place(k))
        };
        all.chunks(8).map(byte).collect()
    };
    values.chunks(WIDTH).flat_map(row).collect()
}

#[test]
fn bits_packed_either_way() {
    for bits in [10, 12, 14] {
        let most = packed(&smooth(bits), bits, false);
        let reversed: Vec<u8> = most.iter().map(|byte| byte.reverse_bits()).collect();
        let words: Vec<u8> = smooth(bits).iter().flat_map(|value| value.to_le_bytes()).collect();
        let stored = [
            (most, vec![]),
            (packed(&smooth(bits), bits, true), vec![]),
            (reversed, vec![(tag::FILL_ORDER, Value::Short(vec![2]))]),
            (words, vec![]),
        ];
        for (i, (data, mut extra)) in stored.into_iter().enumerate() {
            extra.push((tag::STRIP_BYTE_COUNTS, Value::Long(vec![data.len() as u32])));
            extra.push((tag::STRIP_OFFSETS, Value::Blobs(vec![data])));
            let kind = Kind { bits, ..PLAIN };
            let bytes = container(Order::Little, UNKNOWN[4], sensor(kind, extra));
            let frame = decode(&bytes, &Hint::default()).unwrap();
            assert_eq!(u16s(&frame), smooth(bits), "{bits} bits, way {i}");
        }
    }
}

/// Sony's lossless files: JPEG tiles of four components, the samples of a block of 2 x 2.
#[test]
fn lossless_blocks_of_four() {
    let all = samples(14);
    let at = |x: usize, y: usize| if x < WIDTH && y < HEIGHT { all[y * WIDTH + x] } else { 7 };
    let mut tiles = Vec::new();
    for y0 in (0..HEIGHT).step_by(16) {
        for x0 in (0..WIDTH).step_by(16) {
            let block = |y, x| [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            let rows = (y0..y0 + 16).step_by(2);
            let values: Vec<u16> = rows
                .flat_map(|y| (x0..x0 + 16).step_by(2).flat_map(move |x| block(y, x)))
                .collect();
            tiles.push(ljpeg::encode(&values, 8, 4, 14, 1));
        }
    }
    let counts = tiles.iter().map(|tile| tile.len() as u32).collect();
    let extra = vec![
        (tag::TILE_OFFSETS, Value::Blobs(tiles)),
        (tag::TILE_BYTE_COUNTS, Value::Long(counts)),
        (0x7310, Value::Short(vec![512, 513, 513, 514])),
        (0x787f, Value::Short(vec![16_300, 16_300, 16_300])),
    ];
    let kind = Kind { bits: 14, segment: [16, 16], compression: 7, ..PLAIN };
    let bytes = container(Order::Little, UNKNOWN[1], sensor(kind, extra));
    let frame = decode(&bytes, &Hint::default()).unwrap();
    assert_eq!(u16s(&frame), all);
    assert_eq!(frame.black, [512.0, 513.0, 513.0, 514.0]);
    assert_eq!(frame.saturation, [16_300.0; 4]);
    assert_eq!(frame.metadata.assumed, Assumed::default());
}

#[test]
fn a_mosaic_that_is_not_stated_is_asked_for() {
    let mut entries = sensor(PLAIN, vec![]);
    entries.retain(|(tag, _)| *tag != tag::CFA_PATTERN && *tag != tag::CFA_REPEAT);
    let bytes = container(Order::Little, UNKNOWN[4], entries);
    let error = decode(&bytes, &Hint::default()).unwrap_err().to_string();
    assert!(error.contains("cfa = \"RGGB\""), "{error}");
    let hint = Hint { cfa: Cfa::parse("BGGR"), encoding: None };
    assert_eq!(decode(&bytes, &hint).unwrap().layout, Layout::Mosaic(hint.cfa.unwrap()));
}

/// Every camera's own format by its name, never as damaged, and never as the thumbnail in it.
#[test]
fn what_is_not_read_has_its_name() {
    let check = |bytes: &[u8], expected: &str| {
        for encoding in [None, Some(crate::raw::Encoding::Linear), Some(crate::raw::Encoding::Srgb)]
        {
            let error = decode(bytes, &Hint { cfa: None, encoding }).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}, not {expected}");
            assert!(error.contains("cannot be read; ") && error.lines().count() == 1, "{error}");
            assert!(
                error.matches('"').count().is_multiple_of(2) && !error.contains("RawLoader"),
                "{error}"
            );
        }
    };
    let padded = |head: &[u8]| [head, &[0x5a; 3000]].concat();
    check(&padded(b"\0\0\0\x18ftypcrx \0\0\0\x01crx isom"), "a Canon CR3 file");
    check(&padded(b"FOVb\x01\0\x03\0"), "a Sigma X3F file");
    check(&padded(b"II\x1a\0\0\0HEAPCCDR"), "a Canon CRW file");
    let mut raf = padded(b"FUJIFILMCCD-RAW 0201FF393102X-T99\0\0\0");
    check(&raf, "a Fujifilm RAF file (X-T99)");
    // A compressed one: a directory that says where the data are, and these begin with "IS".
    raf[100..104].copy_from_slice(&200_u32.to_be_bytes());
    let inner = tiff(
        Order::Little,
        &vec![(
            0xf000,
            Value::Directory(vec![(0xf007, Value::Blobs(vec![b"IS\x01\x10".to_vec()]))]),
        )],
    );
    raf.splice(200..200 + inner.len(), inner);
    check(&raf, "a Fujifilm RAF file (X-T99) with compression");
    for (compression, expected) in [
        (32_767, "a Sony ARW file (ILCE-7M4) with Sony's lossy compression"),
        (34_892, "a Sony ARW file (ILCE-7M4) with lossy JPEG compression"),
    ] {
        let extra = vec![(tag::COMPRESSION, Value::Short(vec![compression]))];
        check(&container(Order::Little, UNKNOWN[1], sensor(PLAIN, extra)), expected);
    }
    // Phase One's: the sensor's data are nowhere in the directories.
    let long = |value: u32| Value::Long(vec![value]);
    let thumbnail = vec![
        (tag::WIDTH, long(1)),
        (tag::HEIGHT, long(1)),
        (tag::BITS_PER_SAMPLE, Value::Short(vec![8, 8, 8])),
        (tag::PHOTOMETRIC, Value::Short(vec![2])),
        (tag::MAKE, Value::Ascii("Phase One")),
        (tag::MODEL, Value::Ascii("IQ4 150MP")),
        (tag::SAMPLES_PER_PIXEL, Value::Short(vec![3])),
        (tag::STRIP_OFFSETS, Value::Blobs(vec![vec![9; 3]])),
        (tag::STRIP_BYTE_COUNTS, long(3)),
    ];
    let mut iiq = tiff(Order::Little, &thumbnail);
    iiq.resize(200_000, 0x5a);
    check(&iiq, "a Phase One IIQ file (IQ4 150MP)");
    iiq.truncate(2000);
    iiq[8..12].copy_from_slice(b"IIII");
    check(&iiq, "a Phase One IIQ file");
}
