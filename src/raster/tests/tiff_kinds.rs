//! Compressions, colours, and what is refused by name.

use super::tiff::{KINDS, Kind, PLAIN, Page, Value, ramp};
use super::{check_unsupported, decoded, numbers};
use crate::raster::{Curve, PictureError, SaidCurve, Values, decode_picture};
use std::io::Write;

fn deflated(data: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

fn packed_bits(data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x80];
    for piece in data.chunks(5) {
        bytes.push(piece.len() as u8 - 1);
        bytes.extend(piece);
    }
    bytes
}

fn compressed(compression: u16, data: &[u8]) -> Vec<u8> {
    match compression {
        5 => weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
            .encode(data)
            .unwrap(),
        8 | 32_946 => deflated(data),
        32_773 => packed_bits(data),
        50_000 => {
            ruzstd::encoding::compress_to_vec(data, ruzstd::encoding::CompressionLevel::Fastest)
        }
        _ => data.to_vec(),
    }
}

#[test]
fn every_lossless_compression_with_and_without_differences() {
    for kind in KINDS {
        for compression in [1, 5, 8, 32_946, 32_773, 50_000] {
            for (bits, predictor) in [(8, 1), (8, 2), (12, 1), (16, 1), (16, 2), (32, 2)] {
                // Four channels, so that differences over three would be seen.
                let samples = ramp(9 * 6 * 4, bits);
                let full = u32::MAX >> (32 - bits);
                let stored: Vec<u32> = match predictor {
                    2 => samples
                        .chunks(36)
                        .flat_map(|row| {
                            (0..36).map(|i| {
                                if i < 4 { row[i] } else { row[i].wrapping_sub(row[i - 4]) & full }
                            })
                        })
                        .collect(),
                    _ => samples.clone(),
                };
                let data = compressed(compression, &kind.pack(&stored, 36, bits));
                let page = Page::new([9, 6], 4, bits as u16, 2, data)
                    .short(259, compression)
                    .short(317, predictor)
                    .short(338, 2);
                let picture = decoded(&kind.file(&[page]));
                let pixels = samples.chunks(4);
                let scale = if bits == 32 { f64::from(full) } else { 1.0 };
                let expected: Vec<f64> = pixels
                    .flat_map(|pixel| &pixel[..3])
                    .map(|&s| f64::from((f64::from(s) / scale) as f32))
                    .collect();
                assert_eq!(numbers(&picture.values), expected, "{compression} {bits} {predictor}");
                let alpha = picture.alpha.unwrap();
                assert!(!alpha.premultiplied);
                assert_eq!(alpha.values[0], (f64::from(samples[3]) / f64::from(full)) as f32);
            }
        }
    }
}

/// Technical note 3, applied forward.
#[test]
fn the_floating_point_predictor() {
    let values: Vec<f32> = (0..24).map(|k| (k as f32 - 7.0) * 0.37).collect();
    for kind in KINDS {
        let row = |values: &[f32]| {
            let bytes: Vec<[u8; 4]> = values.iter().map(|v| v.to_bits().to_be_bytes()).collect();
            let planes: Vec<u8> = (0..4).flat_map(|k| bytes.iter().map(move |b| b[k])).collect();
            (0..planes.len())
                .map(|i| if i < 3 { planes[i] } else { planes[i].wrapping_sub(planes[i - 3]) })
                .collect::<Vec<u8>>()
        };
        let data: Vec<u8> = values.chunks(12).flat_map(row).collect();
        let page =
            Page::new([4, 2], 3, 32, 2, deflated(&data)).short(259, 8).short(317, 3).short(339, 3);
        assert_eq!(decoded(&kind.file(&[page])).values, Values::F32(values.clone()));
    }
}

#[test]
fn white_as_zero_is_turned_over() {
    let data = PLAIN.pack(&[0, 1, 4095, 95], 2, 12);
    let picture = decoded(&PLAIN.file(&[Page::new([2, 2], 1, 12, 0, data)]));
    assert_eq!(picture.values, Values::U16(vec![4095, 4094, 0, 4000]));
    let bits = decoded(&PLAIN.file(&[Page::new([3, 1], 1, 1, 0, vec![0b0100_0000])]));
    assert_eq!(bits.values, Values::U8(vec![1, 0, 1]));
    // Fax machines' bit order.
    let page = Page::new([3, 1], 1, 1, 1, vec![0b0000_0010]).short(266, 2);
    assert_eq!(decoded(&PLAIN.file(&[page])).values, Values::U8(vec![0, 1, 0]));
}

#[test]
fn palettes_are_expanded() {
    let table = |step: u16| {
        let mut table = vec![0; 48];
        (table[2], table[16 + 2], table[32 + 2]) = (10 * step, 200 * step, 255 * step);
        Value::Short(table)
    };
    for step in [1, 257] {
        let page = Page::new([2, 1], 1, 4, 3, vec![0x20]).with(320, table(step));
        let picture = decoded(&PLAIN.file(&[page]));
        assert_eq!(
            (picture.channels, picture.values),
            (3, Values::U8(vec![10, 200, 255, 0, 0, 0]))
        );
    }
    let error = decode_picture(&PLAIN.file(&[Page::new([2, 1], 1, 4, 3, vec![0x20])])).unwrap_err();
    assert!(matches!(error, PictureError::Damaged { .. }), "{error}");
}

#[test]
fn alpha_and_other_channels() {
    let rgba = |kind: u16| Page::new([1, 1], 4, 8, 2, vec![10, 20, 30, 128]).short(338, kind);
    let alpha =
        |kind: u16| decoded(&PLAIN.file(&[rgba(kind)])).alpha.map(|alpha| alpha.premultiplied);
    assert_eq!([0, 1, 2].map(alpha), [None, Some(true), Some(false)]);
    let unnamed =
        |alpha: u8| decoded(&PLAIN.file(&[Page::new([1, 1], 4, 8, 2, vec![9, 9, 9, alpha])]));
    assert_eq!(unnamed(51).alpha.unwrap().values, vec![0.2]);
    assert_eq!(unnamed(0).alpha, None);
    let grey = Page::new([1, 1], 2, 8, 1, vec![7, 0]).short(338, 2);
    let grey = decoded(&PLAIN.file(&[grey]));
    assert_eq!((grey.values, grey.alpha.unwrap().values), (Values::U8(vec![7]), vec![0.0]));
    let bands = Page::new([1, 1], 5, 8, 1, vec![1, 2, 3, 4, 5]);
    check_unsupported(&PLAIN.file(&[bands]), "a TIFF of 5 channels that are no colours");
}

#[test]
fn what_is_not_read_is_named() {
    let grey = |bits: u16| Page::new([2, 1], 1, bits, 1, vec![0; 32]);
    let check = |page: Page, expected: &str| check_unsupported(&PLAIN.file(&[page]), expected);
    check(grey(16).short(339, 2), "a TIFF of signed 16-bit numbers");
    check(grey(24).short(339, 3), "a TIFF of 24-bit floating point");
    check(grey(64).short(339, 6), "a TIFF of complex numbers");
    check(grey(20), "a TIFF of 20 bits");
    check(Page::new([2, 1], 4, 8, 5, vec![0; 8]), "a CMYK TIFF");
    check(Page::new([2, 1], 3, 8, 6, vec![0; 6]), "a YCbCr TIFF");
    check(Page::new([2, 1], 3, 8, 8, vec![0; 6]), "a Lab TIFF");
    check(Page::new([2, 1], 1, 16, 32_844, vec![0; 4]), "a LogL TIFF");
    check(Page::new([2, 1], 3, 16, 32_845, vec![0; 12]), "a LogLuv TIFF");
    check(grey(1).short(262, 4), "transparency mask");
    for (compression, name) in [
        (3, "fax"),
        (4, "fax"),
        (6, "JPEG"),
        (34_676, "SGI LogLuv"),
        (34_712, "JPEG 2000"),
        (34_887, "LERC"),
        (34_925, "LZMA"),
        (50_001, "WebP"),
        (50_002, "JPEG XL"),
        (33_333, "compression 33333"),
    ] {
        check(grey(8).short(259, compression), name);
    }
    check(grey(12).short(317, 2), "a TIFF of 12 bits with predictor 2");
    let mixed = Page::new([2, 1], 3, 8, 2, vec![0; 6]).with(258, Value::Short(vec![5, 6, 5]));
    check(mixed, "channels of different depth");
}

#[test]
fn damage_is_called_damage() {
    let page = Page::new([4, 4], 1, 16, 1, vec![0; 32]);
    let whole = PLAIN.file(std::slice::from_ref(&page));
    let check = |bytes: &[u8], expected: &str| {
        let error = decode_picture(bytes).unwrap_err().to_string();
        assert!(
            error.contains(expected) && error.ends_with("copy it again from where it came"),
            "{error}"
        );
    };
    check(&whole[..6], "damaged");
    let mut short = page.clone();
    short.segments[0].truncate(30);
    check(&PLAIN.file(&[short]), "a strip has 30 of 32 bytes");
    let beyond = Kind::file(PLAIN, std::slice::from_ref(&page));
    let mut beyond = beyond;
    let at = beyond.windows(4).position(|four| four == [0x11, 1, 4, 0]).unwrap();
    beyond[at + 8..at + 12].copy_from_slice(&500_000_u32.to_le_bytes());
    check(&beyond, "the file is cut short: strip 0");
    check(&PLAIN.file(&[page.clone().short(259, 8)]), "does not unpack");
    check(&PLAIN.file(&[page.clone().short(259, 50_000)]), "does not unpack");
    check(&PLAIN.file(&[page.short(278, 1)]), "it has 1 of 4 strips");
}

#[test]
fn encodings_of_a_tiff() {
    let page = || Page::new([1, 1], 3, 16, 2, vec![0; 6]);
    let said = |page: Page| decoded(&PLAIN.file(&[page])).said;
    assert_eq!(said(page()).curve, SaidCurve::Silent);
    let profile = moxcms::ColorProfile::new_srgb().encode().unwrap();
    let srgb = said(page().with(34_675, Value::Bytes(profile)));
    assert_eq!(srgb.curve, SaidCurve::Known(Curve::Srgb));
    assert!(srgb.by.starts_with("its ICC profile"), "{}", srgb.by);
    let junk = said(page().with(34_675, Value::Bytes(vec![1; 200])));
    assert!(matches!(junk.curve, SaidCurve::Unreadable(_)), "{junk:?}");
    let linear: Vec<u16> = (0..=u16::MAX).collect();
    let table = said(page().with(301, Value::Short(linear)));
    assert_eq!(table.curve, SaidCurve::Known(Curve::Linear));
    let corners = [64, 33, 30, 60, 15, 6].map(|v| [v, 100]).to_vec();
    let primaries = page()
        .with(318, Value::Ratio(vec![[3127, 10_000], [3290, 10_000]]))
        .with(319, Value::Ratio(corners));
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(said(primaries).linear_srgb_from_rgb, Some(identity));
    let grey = Page::new([1, 1], 1, 8, 1, vec![0]).short(291, 100);
    assert!(matches!(said(grey).curve, SaidCurve::Unreadable(_)));
    let bits = |tag| decoded(&PLAIN.file(&[page().short(tag, 4095)])).significant_bits;
    assert_eq!([281, 341, 280].map(bits), [Some(12), Some(12), None]);
}
