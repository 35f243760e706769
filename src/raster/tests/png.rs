//! What PNG chunks say of the numbers.

use super::decoded;
use crate::raster::{Curve, PngContent, Said, SaidCurve, Tone, encode_png_rgb8, write_png_rgb16};
use weavelight_calibration::description::Image;

/// PNG specification, annex D.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 { 0xedb8_8320 ^ crc >> 1 } else { crc >> 1 }
        })
    })
}

/// A file with chunks put in behind its header.
pub(crate) fn with_chunks(png: &[u8], chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut bytes = png[..33].to_vec();
    for (name, data) in chunks {
        let named = [&name[..], data].concat();
        bytes.extend((data.len() as u32).to_be_bytes());
        bytes.extend(&named);
        bytes.extend(crc32(&named).to_be_bytes());
    }
    bytes.extend(&png[33..]);
    bytes
}

fn png16() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    write_png_rgb16(&path, [3, 2], PngContent::Data, |_, row| row.fill([1000, 2000, 3000]))
        .unwrap();
    std::fs::read(&path).unwrap()
}

fn said(chunks: &[(&[u8; 4], Vec<u8>)]) -> Said {
    decoded(&with_chunks(&png16(), chunks)).said
}

fn numbers(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn icc(profile: &moxcms::ColorProfile) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(&profile.encode().unwrap()).unwrap();
    [b"name\0\0".to_vec(), encoder.finish().unwrap()].concat()
}

#[test]
fn each_chunk_says_its_curve() {
    assert_eq!(said(&[]).curve, SaidCurve::Silent);
    let check = |chunks: &[(&[u8; 4], Vec<u8>)], curve: Curve, by: &str| {
        let said = said(chunks);
        assert_eq!(said.curve, SaidCurve::Known(curve));
        assert!(said.by.starts_with(by), "{}", said.by);
    };
    check(&[(b"sRGB", vec![0])], Curve::Srgb, "its sRGB chunk");
    check(&[(b"gAMA", numbers(&[45_455]))], Curve::Srgb, "its gAMA chunk");
    check(&[(b"gAMA", numbers(&[100_000]))], Curve::Linear, "its gAMA chunk");
    let gamma = Curve::Tone(Box::new([(); 3].map(|()| Tone::Gamma(100_000.0 / 55_556.0))));
    check(&[(b"gAMA", numbers(&[55_556]))], gamma, "its gAMA chunk");
    check(&[(b"iCCP", icc(&moxcms::ColorProfile::new_srgb()))], Curve::Srgb, "its ICC profile");
    check(&[(b"cICP", vec![1, 13, 0, 1])], Curve::Srgb, "its cICP chunk");
    check(&[(b"cICP", vec![9, 8, 0, 1])], Curve::Linear, "its cICP chunk");
    // What says more goes first.
    check(&[(b"gAMA", numbers(&[100_000])), (b"sRGB", vec![0])], Curve::Srgb, "its sRGB chunk");
    let linear = icc(&moxcms::ColorProfile::new_gray_with_gamma(1.0));
    check(&[(b"gAMA", numbers(&[45_455])), (b"iCCP", linear)], Curve::Linear, "its ICC profile");
}

#[test]
fn what_cannot_be_applied_is_said() {
    let check = |chunk: (&[u8; 4], Vec<u8>), why: &str| match said(&[chunk]).curve {
        SaidCurve::Unreadable(found) => assert!(found.contains(why), "{found}"),
        other => panic!("{other:?}"),
    };
    check((b"cICP", vec![9, 16, 0, 1]), "PQ");
    check((b"cICP", vec![9, 18, 0, 1]), "HLG");
    check((b"cICP", vec![1, 13, 0, 0]), "narrow range");
    check((b"iCCP", icc(&moxcms::ColorProfile::new_lab())), "Lab");
}

#[test]
fn primaries() {
    let srgb = numbers(&[31_270, 32_900, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000]);
    assert_eq!(said(&[(b"cHRM", srgb)]).linear_srgb_from_rgb, Some(IDENTITY));
    assert_eq!(said(&[(b"sRGB", vec![1])]).linear_srgb_from_rgb, Some(IDENTITY));
    assert_eq!(said(&[(b"gAMA", numbers(&[45_455]))]).linear_srgb_from_rgb, None);
    let p3 = said(&[(b"cICP", vec![12, 13, 0, 1])]).linear_srgb_from_rgb.unwrap();
    assert!((p3[0][0] - 1.224_94).abs() < 1e-4, "{p3:?}");
}

#[test]
fn significant_bits() {
    let bits = |data: Vec<u8>| decoded(&with_chunks(&png16(), &[(b"sBIT", data)])).significant_bits;
    assert_eq!(bits(vec![12, 12, 12]), Some(12));
    assert_eq!(bits(vec![10, 12, 11]), Some(12));
    assert_eq!(bits(vec![16, 16, 16]), None);
}

#[test]
fn what_we_write_says_what_it_is() {
    let image = Image::filled(2, 2, [1, 2, 3]);
    let said = |content| decoded(&encode_png_rgb8(&image, content).unwrap()).said;
    assert_eq!(said(PngContent::Srgb).curve, SaidCurve::Known(Curve::Srgb));
    assert_eq!(said(PngContent::Data).curve, SaidCurve::Silent);
}

/// A white mask of a whole sensor, in one bit a pixel: 2 MB of rows in 2 kB.
#[test]
fn a_file_may_be_small_because_it_is_plain() {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4928, 3264);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![0xff; 616 * 3264]).unwrap();
    writer.finish().unwrap();
    let picture = decoded(&bytes);
    assert_eq!((picture.width, picture.height, picture.channels), (4928, 3264, 1));
}
