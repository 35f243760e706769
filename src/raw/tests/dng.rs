//! Every way to store a DNG's samples gives the same frame.

use super::builder::{Entries, Value, tiff};
use super::ljpeg;
use crate::raw::tags::{Order, tag};
use crate::raw::{DecodeError, Frame, Hint, Layout, Samples, decode, decode_uncropped};
use std::io::Write;
use weavelight_calibration::description::Cfa;

pub(super) const WIDTH: usize = 37;
pub(super) const HEIGHT: usize = 21;

/// How a test file stores its samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) order: Order,
    pub(super) bits: u32,
    /// Width and height of tiles; as wide as the picture for strips.
    pub(super) segment: [usize; 2],
    pub(super) compression: u16,
    pub(super) predictor: u16,
}

pub(super) const PLAIN: Kind =
    Kind { order: Order::Little, bits: 16, segment: [WIDTH, HEIGHT], compression: 1, predictor: 1 };

/// Samples that use all bits and differ everywhere.
pub(super) fn samples(bits: u32) -> Vec<u16> {
    (0..WIDTH * HEIGHT).map(|i| ((i as u32 * 40_503 % 65_521) & ((1 << bits) - 1)) as u16).collect()
}

/// Packs rows most significant bit first, by the book: one bit at a time.
fn packed(values: &[u16], kind: Kind) -> Vec<u8> {
    if kind.bits == 16 {
        let two = |&value: &u16| {
            if kind.order == Order::Little { value.to_le_bytes() } else { value.to_be_bytes() }
        };
        return values.iter().flat_map(two).collect();
    }
    let bits: Vec<u8> = values
        .iter()
        .flat_map(|value| (0..kind.bits).rev().map(move |i| (value >> i & 1) as u8))
        .collect();
    bits.chunks(8)
        .map(|eight| eight.iter().enumerate().fold(0, |byte, (i, bit)| byte | bit << (7 - i)))
        .collect()
}

fn segment(all: &[u16], kind: Kind, x0: usize, y0: usize) -> Vec<u8> {
    let [width, height] = kind.segment;
    // The last strip is short; tiles are padded to their full size.
    let rows = if width == WIDTH { height.min(HEIGHT - y0) } else { height };
    let mut bytes = Vec::new();
    let mut values = Vec::new();
    for y in y0..y0 + rows {
        let at = |x: usize| if x < WIDTH && y < HEIGHT { all[y * WIDTH + x] } else { 0x00aa };
        let mut row: Vec<u16> = (x0..x0 + width).map(at).collect();
        if kind.predictor == 2 {
            (1..width).rev().for_each(|x| row[x] = row[x].wrapping_sub(row[x - 1]));
        }
        bytes.extend(packed(&row, kind));
        values.extend(row);
    }
    if kind.compression == 7 {
        // Cameras call two neighbours the components of one column.
        let components = if width % 2 == 0 { 2 } else { 1 };
        return ljpeg::encode(&values, width / components, components, kind.bits as u8, 1);
    }
    if kind.compression == 1 {
        return bytes;
    }
    let mut deflate = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    deflate.write_all(&bytes).unwrap();
    deflate.finish().unwrap()
}

/// The entries of a DNG with these samples; `extra` replaces or adds.
pub(super) fn entries(kind: Kind, extra: Entries) -> Entries {
    let all = samples(kind.bits);
    let places = (0..HEIGHT)
        .step_by(kind.segment[1])
        .flat_map(|y| (0..WIDTH).step_by(kind.segment[0]).map(move |x| (x, y)));
    let blobs: Vec<Vec<u8>> = places.map(|(x, y)| segment(&all, kind, x, y)).collect();
    let counts = Value::Long(blobs.iter().map(|blob| blob.len() as u32).collect());
    let long = |value: usize| Value::Long(vec![value as u32]);
    let short = |value: u16| Value::Short(vec![value]);
    let mut entries = vec![
        (tag::NEW_SUBFILE_TYPE, long(0)),
        (tag::WIDTH, long(WIDTH)),
        (tag::HEIGHT, long(HEIGHT)),
        (tag::BITS_PER_SAMPLE, short(kind.bits as u16)),
        (tag::COMPRESSION, short(kind.compression)),
        (tag::PREDICTOR, short(kind.predictor)),
        (tag::PHOTOMETRIC, short(32803)),
        (tag::MAKE, Value::Ascii("Weavelight")),
        (tag::MODEL, Value::Ascii("Bench")),
        (tag::ORIENTATION, short(6)),
        (tag::SAMPLES_PER_PIXEL, short(1)),
        (tag::CFA_REPEAT, Value::Short(vec![2, 2])),
        (tag::CFA_PATTERN, Value::Byte(vec![0, 1, 1, 2])),
        (tag::DNG_VERSION, Value::Byte(vec![1, 4, 0, 0])),
        (tag::BLACK_LEVEL_REPEAT, Value::Short(vec![2, 2])),
        (tag::BLACK_LEVEL, Value::Rational(vec![[10, 1], [21, 2], [11, 1], [12, 1]])),
        (tag::WHITE_LEVEL, long((1 << kind.bits) - 10)),
        (
            tag::EXIF_IFD,
            Value::Directory(vec![
                (tag::EXPOSURE_TIME, Value::Rational(vec![[1, 125]])),
                (tag::ISO, short(200)),
                (tag::FOCAL_LENGTH, Value::Rational(vec![[350, 10]])),
                (tag::LENS_MODEL, Value::Ascii("Bench 35 mm")),
            ]),
        ),
    ];
    if kind.segment[0] == WIDTH {
        entries.push((tag::ROWS_PER_STRIP, long(kind.segment[1])));
        entries.push((tag::STRIP_OFFSETS, Value::Blobs(blobs)));
        entries.push((tag::STRIP_BYTE_COUNTS, counts));
    } else {
        entries.push((tag::TILE_WIDTH, long(kind.segment[0])));
        entries.push((tag::TILE_HEIGHT, long(kind.segment[1])));
        entries.push((tag::TILE_OFFSETS, Value::Blobs(blobs)));
        entries.push((tag::TILE_BYTE_COUNTS, counts));
    }
    entries.retain(|(tag, _)| extra.iter().all(|(other, _)| other != tag));
    entries.extend(extra);
    entries
}

pub(super) fn file(kind: Kind, extra: Entries) -> Vec<u8> {
    tiff(kind.order, &entries(kind, extra))
}

fn frame(kind: Kind, extra: Entries) -> Result<Frame, DecodeError> {
    decode(&file(kind, extra), &Hint::default())
}

fn u16s(frame: &Frame) -> &[u16] {
    match &frame.samples {
        Samples::U16(samples) => samples,
        Samples::F32(_) => panic!("floating-point samples"),
    }
}

fn check_samples(kind: Kind) {
    let frame = frame(kind, vec![]).unwrap_or_else(|error| panic!("{kind:?}: {error}"));
    assert_eq!([frame.width, frame.height], [WIDTH, HEIGHT]);
    assert_eq!(u16s(&frame), samples(kind.bits), "{kind:?}");
    assert_eq!(frame.black, [10.0, 10.5, 11.0, 12.0]);
    assert_eq!(frame.saturation, [((1 << kind.bits) - 10) as f32; 4]);
}

#[test]
fn every_storage_gives_the_same_samples() {
    for order in [Order::Little, Order::Big] {
        for segment in [[WIDTH, HEIGHT], [WIDTH, 5], [16, 16], [48, 32]] {
            for bits in [8, 10, 12, 14, 16] {
                check_samples(Kind { order, bits, segment, compression: 1, predictor: 1 });
            }
            for (bits, predictor) in [(16, 1), (16, 2), (8, 2)] {
                check_samples(Kind { order, bits, segment, compression: 8, predictor });
            }
        }
    }
}

#[test]
fn lossless_jpeg_gives_the_same_samples() {
    for order in [Order::Little, Order::Big] {
        for segment in [[WIDTH, HEIGHT], [WIDTH, 5], [16, 16], [48, 32], [15, 9]] {
            for bits in [8, 12, 14, 16] {
                check_samples(Kind { order, bits, segment, compression: 7, predictor: 1 });
            }
        }
    }
}

/// The fast path against the library whose samples are right for this one kind.
#[test]
fn plain_strips_equal_rawloader() {
    let bytes = file(PLAIN, vec![]);
    let image = rawloader::decode(&mut bytes.as_slice()).unwrap();
    let rawloader::RawImageData::Integer(expected) = image.data else { panic!("floating point") };
    let (width, height, samples) = decode_uncropped(&bytes, &Hint::default()).unwrap();
    assert_eq!((width, height), (image.width, image.height));
    assert_eq!(samples, expected);
}

/// DNG: mosaic and black levels count from the active area, so an odd corner does not change the phase.
#[test]
fn the_active_area_is_the_frame() {
    let area = Value::Long(vec![3, 1, 20, 36]);
    let frame = frame(PLAIN, vec![(tag::ACTIVE_AREA, area)]).unwrap();
    assert_eq!([frame.width, frame.height], [35, 17]);
    assert_eq!(frame.layout, Layout::Mosaic(Cfa::RGGB));
    assert_eq!(frame.black, [10.0, 10.5, 11.0, 12.0]);
    let whole = samples(16);
    for (i, &sample) in u16s(&frame).iter().enumerate() {
        assert_eq!(sample, whole[(i / 35 + 3) * WIDTH + i % 35 + 1], "sample {i}");
    }
}

#[test]
fn the_linearisation_table_is_applied() {
    let table: Vec<u16> = (0..200).map(|i| i * i).collect();
    let frame =
        frame(PLAIN, vec![(tag::LINEARIZATION_TABLE, Value::Short(table.clone()))]).unwrap();
    let expected: Vec<u16> =
        samples(16).iter().map(|&sample| table[usize::from(sample).min(199)]).collect();
    assert_eq!(u16s(&frame), expected);
}

#[test]
fn metadata_is_read_and_orientation_not_applied() {
    let matrix: Vec<[i32; 2]> = (0..9).map(|i| [i * 1000 - 2000, 10_000]).collect();
    let extra = vec![
        (tag::COLOR_MATRIX_1, Value::SignedRational(matrix)),
        (tag::ILLUMINANT_1, Value::Short(vec![21])),
    ];
    let metadata = frame(PLAIN, extra).unwrap().metadata;
    assert_eq!(metadata.camera.as_deref(), Some("Weavelight Bench"));
    assert_eq!(metadata.exposure_s, Some(1.0 / 125.0));
    assert_eq!((metadata.iso, metadata.focal_length_mm), (Some(200.0), Some(35.0)));
    assert_eq!(metadata.lens.as_deref(), Some("Bench 35 mm"));
    assert_eq!(metadata.orientation, Some(6));
    assert_eq!(metadata.camera_from_xyz.unwrap()[0], [-0.2, -0.1, 0.0]);
    assert_eq!(metadata.camera_from_xyz.unwrap()[2], [0.4, 0.5, 0.6]);
}

#[test]
fn average_black_deltas_are_folded_in() {
    let deltas =
        |count: usize| Value::Rational((0..count).map(|i| [1 + 2 * (i as u32 % 2), 2]).collect());
    let extra =
        vec![(tag::BLACK_LEVEL_DELTA_H, deltas(WIDTH)), (tag::BLACK_LEVEL_DELTA_V, deltas(HEIGHT))];
    assert_eq!(frame(PLAIN, extra).unwrap().black, [11.0, 12.5, 13.0, 15.0]);
}

fn check_refused(extra: Entries, expected: &str) {
    let error = frame(PLAIN, extra).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}, not {expected}");
    assert!(error.lines().count() == 1 && error.contains("; "), "no remedy: {error}");
}

#[test]
fn what_cannot_be_measured_with_is_refused() {
    let short = |value| Value::Short(vec![value]);
    let long = |values: &[u32]| Value::Long(values.to_vec());
    check_refused(vec![(tag::COMPRESSION, short(34892))], "lossy JPEG");
    check_refused(vec![(tag::SAMPLE_FORMAT, short(2))], "signed");
    check_refused(
        vec![(tag::BITS_PER_SAMPLE, short(64)), (tag::SAMPLE_FORMAT, short(3))],
        "a floating-point DNG of 64 bits",
    );
    check_refused(vec![(tag::COMPRESSION, short(52_546))], "JPEG XL");
    check_refused(vec![(tag::ROW_INTERLEAVE, short(2))], "interleaved");
    check_refused(vec![(tag::OPCODE_LIST_2, Value::Undefined(opcode(8, 0)))], "MapPolynomial");
    check_refused(vec![(tag::BITS_PER_SAMPLE, short(32))], "32 bits");
    check_refused(vec![(tag::SAMPLES_PER_PIXEL, short(4))], "4 samples");
    check_refused(vec![(tag::CFA_REPEAT, Value::Short(vec![6, 6]))], "2 x 2");
    check_refused(vec![(tag::CFA_PATTERN, Value::Byte(vec![0, 1, 3, 2]))], "2 x 2");
    check_refused(vec![(tag::CFA_LAYOUT, short(2))], "staggered");
    check_refused(vec![(tag::PHOTOMETRIC, short(2))], "no directory of sensor data");
    check_refused(vec![(tag::WIDTH, long(&[0]))], "0 x 21");
    check_refused(vec![(tag::WIDTH, long(&[2_000_000_000]))], "2000000000 x 21");
    check_refused(vec![(tag::WIDTH, long(&[38]))], "strip");
    check_refused(vec![(tag::STRIP_OFFSETS, long(&[9_000]))], "cut short");
    check_refused(vec![(tag::STRIP_BYTE_COUNTS, long(&[12]))], "12 of");
    check_refused(vec![(tag::ROWS_PER_STRIP, long(&[0]))], "37 x 0");
    check_refused(vec![(tag::ROWS_PER_STRIP, long(&[7]))], "1 of 3");
    check_refused(vec![(tag::ACTIVE_AREA, long(&[0, 0, 22, 37]))], "visible area");
    check_refused(vec![(tag::ACTIVE_AREA, long(&[5, 0, 5, 37]))], "visible area");
    check_refused(vec![(tag::ACTIVE_AREA, long(&[5, 0]))], "2 numbers");
    check_refused(vec![(tag::WHITE_LEVEL, long(&[11]))], "not below white level");
    check_refused(vec![(tag::WHITE_LEVEL, long(&[0]))], "white level is 0");
    check_refused(vec![(tag::BLACK_LEVEL, Value::Rational(vec![[1, 0]; 4]))], "black levels");
    check_refused(vec![(tag::BLACK_LEVEL, long(&[1, 2]))], "2 black levels, not 4");
    check_refused(vec![(tag::BLACK_LEVEL_REPEAT, Value::Short(vec![1, 4]))], "repeats over 4 x 1");
    let ramp = (0..HEIGHT as u32).map(|y| [y * 10, 1]).collect();
    check_refused(vec![(tag::BLACK_LEVEL_DELTA_V, Value::Rational(ramp))], "varies along");
    check_refused(vec![(tag::LINEARIZATION_TABLE, long(&[70_000]))], "linearisation");
}

/// A list of a gain map and this opcode, with its flags.
fn opcode(number: u32, flags: u32) -> Vec<u8> {
    let gain_map = [9_u32, 0x0103_0000, 0, 4, 1234];
    let words = [2].into_iter().chain(gain_map).chain([number, 0x0103_0000, flags, 0]);
    words.flat_map(u32::to_be_bytes).collect()
}

#[test]
fn opcodes_that_may_be_left_out_or_only_multiply_are_left_aside() {
    for (number, flags) in [(8, 1), (9, 0), (12, 0), (4, 0)] {
        let list = Value::Undefined(opcode(number, flags));
        assert!(frame(PLAIN, vec![(tag::OPCODE_LIST_2, list)]).is_ok(), "opcode {number}");
    }
}

/// Bytes of a number with so many bits of exponent and mantissa, by the book.
fn short_float(value: f32, bits: u32) -> u32 {
    let (exponent_bits, mantissa_bits) = match bits {
        16 => (5, 10),
        24 => (7, 16),
        _ => return value.to_bits(),
    };
    let exponent = (value.to_bits() >> 23 & 0xff) as i32 - 127 + (1 << (exponent_bits - 1)) - 1;
    let mantissa = value.to_bits() & 0x007f_ffff;
    (exponent as u32) << mantissa_bits | mantissa >> (23 - mantissa_bits)
}

/// A floating-point DNG of values with few digits, all of which every kind holds.
pub(super) fn float_file(
    bits: u32,
    compression: u16,
    predictor: u16,
    order: Order,
) -> (Vec<u8>, Vec<f32>) {
    let values: Vec<f32> =
        (0..WIDTH * HEIGHT).map(|i| (0.25 + (i * 37 % 512) as f32 / 512.0) * 0.5).collect();
    let bytes = bits as usize / 8;
    let row = |row: &[f32]| -> Vec<u8> {
        let number = |value: &f32| short_float(*value, bits).to_be_bytes()[4 - bytes..].to_vec();
        if predictor == 1 {
            let in_order = |mut number: Vec<u8>| {
                if order == Order::Little {
                    number.reverse();
                }
                number
            };
            return row.iter().map(number).flat_map(in_order).collect();
        }
        let numbers: Vec<Vec<u8>> = row.iter().map(number).collect();
        let mut plane: Vec<u8> =
            (0..bytes).flat_map(|k| numbers.iter().map(move |number| number[k])).collect();
        let distance = match predictor {
            34_894 => 2,
            34_895 => 4,
            _ => 1,
        };
        (distance..plane.len())
            .rev()
            .for_each(|i| plane[i] = plane[i].wrapping_sub(plane[i - distance]));
        plane
    };
    let mut data: Vec<u8> = values.chunks(WIDTH).flat_map(row).collect();
    if compression == 8 {
        let mut deflate = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        deflate.write_all(&data).unwrap();
        data = deflate.finish().unwrap();
    }
    let extra = vec![
        (tag::BITS_PER_SAMPLE, Value::Short(vec![bits as u16])),
        (tag::SAMPLE_FORMAT, Value::Short(vec![3])),
        (tag::COMPRESSION, Value::Short(vec![compression])),
        (tag::PREDICTOR, Value::Short(vec![predictor])),
        (tag::STRIP_BYTE_COUNTS, Value::Long(vec![data.len() as u32])),
        (tag::STRIP_OFFSETS, Value::Blobs(vec![data])),
        (tag::BLACK_LEVEL, Value::Rational(vec![[1, 100]; 4])),
    ];
    let mut entries = entries(Kind { order, ..PLAIN }, extra);
    entries.retain(|(tag, _)| *tag != tag::WHITE_LEVEL);
    (tiff(order, &entries), values)
}

#[test]
fn floating_point_samples_of_every_storage() {
    for order in [Order::Little, Order::Big] {
        for bits in [16, 24, 32] {
            for (compression, predictor) in [(1, 1), (8, 1), (8, 3), (8, 34_894), (8, 34_895)] {
                let (bytes, values) = float_file(bits, compression, predictor, order);
                let frame = decode(&bytes, &Hint::default()).unwrap();
                let Samples::F32(found) = &frame.samples else { panic!("integers") };
                assert_eq!(found, &values, "{bits} bits, {compression}, {predictor}");
                assert_eq!((frame.black, frame.saturation), ([0.01; 4], [1.0; 4]));
                assert_eq!(frame.layout, Layout::Mosaic(Cfa::RGGB));
            }
        }
    }
}

#[test]
fn the_hint_must_agree() {
    let bytes = file(PLAIN, vec![]);
    let hint = |cfa| Hint { cfa: Cfa::parse(cfa), encoding: None };
    assert!(decode(&bytes, &hint("RGGB")).is_ok());
    let error = decode(&bytes, &hint("GRBG")).unwrap_err().to_string();
    assert!(error.contains("GRBG") && error.contains("RGGB"), "{error}");
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let bytes = file(PLAIN, vec![]);
    // The last four bytes only say that no directory follows.
    for length in 0..bytes.len() - 4 {
        assert!(decode(&bytes[..length], &Hint::default()).is_err(), "{length} of {}", bytes.len());
    }
}
