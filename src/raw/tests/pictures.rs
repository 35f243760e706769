//! Pictures of other programs as frames.

use super::builder::{Value, tiff};
use crate::raster::{PngContent, encode_exr, encode_png_rgb8};
use crate::raw::tags::{Order, tag};
use crate::raw::{Encoding, Frame, Hint, Layout, Samples, decode};
use image::{DynamicImage, ImageFormat};
use std::io::Cursor;
use weavelight_calibration::description::{Cfa, Image};

pub(super) fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn ramp16(channels: usize) -> Vec<u16> {
    (0..24 * channels).map(|i| (i * 6553 % 65_536) as u16).collect()
}

fn ramp8(channels: usize) -> Vec<u8> {
    (0..24 * channels).map(|i| (i * 37 % 256) as u8).collect()
}

fn buffer<P: image::Pixel>(values: Vec<P::Subpixel>) -> image::ImageBuffer<P, Vec<P::Subpixel>> {
    image::ImageBuffer::from_raw(6, 4, values).unwrap()
}

const NOTHING: Hint = Hint { cfa: None, encoding: None };
const LINEAR: Hint = Hint { cfa: None, encoding: Some(Encoding::Linear) };
const SRGB: Hint = Hint { cfa: None, encoding: Some(Encoding::Srgb) };

fn check(bytes: &[u8], hint: Hint, layout: Layout, expected: Vec<u16>) {
    let frame = decode(bytes, &hint).unwrap();
    assert_eq!([frame.width, frame.height], [6, 4]);
    assert_eq!(frame.layout, layout);
    assert_eq!(frame.samples, Samples::U16(expected));
    assert_eq!((frame.black, frame.saturation), ([0.0; 4], [65_535.0; 4]));
}

#[test]
fn sixteen_bits_are_linear_as_they_are() {
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        let grey = encoded(buffer::<image::Luma<u16>>(ramp16(1)), format);
        let rgb = encoded(buffer::<image::Rgb<u16>>(ramp16(3)), format);
        let bggr = Cfa::parse("BGGR").unwrap();
        check(&grey, NOTHING, Layout::Grey, ramp16(1));
        check(&grey, Hint { cfa: Some(bggr), encoding: None }, Layout::Mosaic(bggr), ramp16(1));
        check(&rgb, LINEAR, Layout::Rgb, ramp16(3));
    }
}

#[test]
fn alpha_is_left_out() {
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        let rgba = encoded(buffer::<image::Rgba<u16>>(ramp16(4)), format);
        let expected = ramp16(4).chunks(4).flat_map(|pixel| pixel[..3].to_vec()).collect();
        check(&rgba, NOTHING, Layout::Rgb, expected);
    }
}

#[test]
fn eight_bits_must_say() {
    for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Jpeg] {
        let bytes = encoded(buffer::<image::Rgb<u8>>(ramp8(3)), format);
        let error = decode(&bytes, &NOTHING).unwrap_err().to_string();
        assert!(error.contains("encoding = \"linear\""), "{error}");
    }
    let bytes = encoded(buffer::<image::Luma<u8>>(ramp8(1)), ImageFormat::Png);
    check(
        &bytes,
        LINEAR,
        Layout::Grey,
        ramp8(1).into_iter().map(|value| u16::from(value) * 257).collect(),
    );
}

/// IEC 61966-2-1 in float64, rounded.
#[test]
fn srgb_is_decoded() {
    let linear = |encoded: f64| {
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    };
    let expected = |values: &[u8]| {
        values
            .iter()
            .map(|&value| (65_535.0 * linear(f64::from(value) / 255.0)).round() as u16)
            .collect::<Vec<_>>()
    };
    let values: Vec<u8> = (0..24).map(|i| (i * 11 + 2) as u8).collect();
    check(
        &encoded(buffer::<image::Luma<u8>>(values.clone()), ImageFormat::Png),
        SRGB,
        Layout::Grey,
        expected(&values),
    );
    let bytes = encode_png_rgb8(&Image::filled(6, 4, [0, 255, 128]), PngContent::Srgb).unwrap();
    check(&bytes, SRGB, Layout::Rgb, expected(&[0, 255, 128].repeat(24)));
}

#[test]
fn sixteen_bits_may_be_srgb() {
    let bytes = encoded(buffer::<image::Luma<u16>>(vec![32_896; 24]), ImageFormat::Png);
    check(&bytes, SRGB, Layout::Grey, vec![14_146; 24]);
}

fn exr(names: &[&str], values: [f32; 3]) -> Result<Frame, crate::raw::DecodeError> {
    let mut bytes = Vec::new();
    encode_exr(&mut bytes, [6, 4], names, |channel, _, row| row.fill(values[channel])).unwrap();
    decode(&bytes, &NOTHING)
}

#[test]
fn exr_has_no_ceiling_and_keeps_what_is_no_number() {
    let frame = exr(&["R", "G", "B"], [0.25, f32::NAN, f32::INFINITY]).unwrap();
    assert_eq!((frame.layout, frame.saturation), (Layout::Rgb, [f32::INFINITY; 4]));
    let Samples::F32(samples) = &frame.samples else { panic!("integers") };
    assert!(samples[0] == 0.25 && samples[1].is_nan() && samples[2] == f32::INFINITY);
    assert_eq!(exr(&["Y"], [1.5; 3]).unwrap().layout, Layout::Grey);
    let error = exr(&["U", "V"], [0.0; 3]).unwrap_err().to_string();
    assert!(error.contains("channels U, V"), "{error}");
}

/// Found by damaging files: the library lists all values of the tag in its message.
#[test]
fn messages_are_short() {
    let entries = vec![
        (tag::WIDTH, Value::Short(vec![6])),
        (tag::HEIGHT, Value::Short(vec![4])),
        (tag::BITS_PER_SAMPLE, Value::Short(vec![16])),
        (tag::PHOTOMETRIC, Value::Short(vec![1])),
        (tag::SAMPLE_FORMAT, Value::Short((0..100).collect())),
        (tag::STRIP_OFFSETS, Value::Blobs(vec![vec![0; 48]])),
        (tag::STRIP_BYTE_COUNTS, Value::Short(vec![48])),
    ];
    let error = decode(&tiff(Order::Little, &entries), &NOTHING).unwrap_err().to_string();
    assert!(error.len() < 300 && error.lines().count() == 1, "{error}");
}

fn check_refused(bytes: &[u8], hint: Hint, expected: &str) {
    let error = decode(bytes, &hint).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}, not {expected}");
    assert!(error.lines().count() <= 2 && error.contains("; "), "no remedy: {error}");
}

#[test]
fn what_is_no_picture_is_refused() {
    check_refused(b"", NOTHING, "empty");
    check_refused(b"these are my notes on linen\nand more\n", NOTHING, "a text file");
    check_refused("Notizen über Köper, nicht über Leinen".as_bytes(), NOTHING, "a text file");
    check_refused(&[0; 5000], NOTHING, "a file of unknown kind, not a picture");
    check_refused(b"II*\0", NOTHING, "damaged");
    check_refused(b"\x89PNG\r\n\x1a\n", NOTHING, "damaged");
    check_refused(b"\xff\xd8\xff\xe0", NOTHING, "damaged");
    check_refused(b"\x76\x2f\x31\x01", NOTHING, "damaged");
}

#[test]
fn contradictions_are_refused() {
    let rgb = encoded(buffer::<image::Rgb<u16>>(ramp16(3)), ImageFormat::Png);
    check_refused(&rgb, Hint { cfa: Some(Cfa::RGGB), encoding: None }, "an RGB picture");
    let mut bytes = Vec::new();
    encode_exr(&mut bytes, [2, 2], &["Y"], |_, _, row| row.fill(1.0)).unwrap();
    check_refused(&bytes, SRGB, "linear values");
}

/// A PNG header of 50000 x 50000 pixels and nothing behind it must not cost its memory.
#[test]
fn claims_beyond_the_file_are_refused() {
    let mut bytes = encoded(buffer::<image::Luma<u16>>(ramp16(1)), ImageFormat::Png);
    bytes[16..24].copy_from_slice(&[0, 0, 0xc3, 0x50, 0, 0, 0xc3, 0x50]);
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    check_refused(&bytes, NOTHING, "50000 x 50000");
}

/// PNG specification, annex D.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 { 0xedb8_8320 ^ crc >> 1 } else { crc >> 1 }
        })
    })
}
