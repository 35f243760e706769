//! Kinds of JPEG, and what they say of colour.

use super::{check_unsupported, decoded};
use crate::raster::{Curve, SaidCurve};
use image::ImageEncoder;

fn jpeg() -> Vec<u8> {
    let mut bytes = Vec::new();
    let data: Vec<u8> = (0..16 * 16 * 3).map(|k| k as u8).collect();
    image::codecs::jpeg::JpegEncoder::new(&mut bytes)
        .write_image(&data, 16, 16, image::ExtendedColorType::Rgb8)
        .unwrap();
    bytes
}

/// A segment put in behind the first marker.
fn with_segment(marker: u8, data: &[u8]) -> Vec<u8> {
    let jpeg = jpeg();
    let length = (data.len() as u16 + 2).to_be_bytes();
    [&jpeg[..2], &[0xff, marker], &length, data, &jpeg[2..]].concat()
}

#[test]
fn kinds_that_are_not_read_are_named() {
    let frame = |marker: u8, bits: u8, components: u8| {
        let mut bytes = jpeg();
        let at = bytes.windows(2).position(|two| two == [0xff, 0xc0]).unwrap();
        bytes[at + 1] = marker;
        (bytes[at + 4], bytes[at + 9]) = (bits, components);
        bytes
    };
    check_unsupported(&frame(0xc1, 12, 3), "a JPEG of 12 bits");
    check_unsupported(&frame(0xc0, 8, 4), "a CMYK JPEG");
    check_unsupported(&frame(0xc3, 8, 3), "a lossless JPEG");
    check_unsupported(&frame(0xc3, 14, 1), "a lossless JPEG");
    check_unsupported(&frame(0xc9, 8, 3), "a JPEG with arithmetic coding");
    check_unsupported(&frame(0xca, 8, 1), "a JPEG with arithmetic coding");
    check_unsupported(&frame(0xf7, 8, 1), "a JPEG-LS picture");
    check_unsupported(&frame(0xc0, 8, 2), "a JPEG of 2 components");
}

#[test]
fn a_profile_says_the_curve() {
    assert_eq!(decoded(&jpeg()).said.curve, SaidCurve::Silent);
    let profile = moxcms::ColorProfile::new_adobe_rgb().encode().unwrap();
    let data = [b"ICC_PROFILE\0\x01\x01".to_vec(), profile].concat();
    let said = decoded(&with_segment(0xe2, &data)).said;
    let SaidCurve::Known(curve) = &said.curve else { panic!("{said:?}") };
    assert!((curve.linear(0, 0.5) - 0.5_f64.powf(2.2)).abs() < 1e-3, "{curve:?}");
    assert!(said.linear_srgb_from_rgb.is_some());
}

/// Exif: one directory that points to another, which holds the colour space.
fn exif(space: u16) -> Vec<u8> {
    let entry = |tag: u16, kind: u16, value: u32| {
        let mut bytes = [tag.to_le_bytes(), kind.to_le_bytes()].concat();
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(value.to_le_bytes());
        bytes
    };
    let directory = |entry: Vec<u8>| [1_u16.to_le_bytes().to_vec(), entry, vec![0; 4]].concat();
    let head = b"Exif\0\0II*\0\x08\0\0\0".to_vec();
    [head, directory(entry(0x8769, 4, 26)), directory(entry(0xa001, 3, space.into()))].concat()
}

#[test]
fn a_camera_says_its_colour_space() {
    let curve = |space| decoded(&with_segment(0xe1, &exif(space))).said.curve;
    assert_eq!(curve(1), SaidCurve::Known(Curve::Srgb));
    assert_eq!(curve(65_535), SaidCurve::Silent);
    let SaidCurve::Known(adobe) = curve(2) else { panic!("silent") };
    assert!((adobe.linear(0, 0.5) - 0.5_f64.powf(563.0 / 256.0)).abs() < 1e-9);
}
