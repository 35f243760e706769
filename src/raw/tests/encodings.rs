//! What picture files say of their numbers, as frames.

use crate::raster::{PngContent, encode_png_rgb8, srgb};
use crate::raw::{DecodeError, Encoding, Frame, Hint, Layout, Samples, decode};
use weavelight_calibration::description::Image;

const NOTHING: Hint = Hint { cfa: None, encoding: None };
const LINEAR: Hint = Hint { cfa: None, encoding: Some(Encoding::Linear) };
const SRGB: Hint = Hint { cfa: None, encoding: Some(Encoding::Srgb) };

/// 16-bit RGB of one colour, with chunks.
fn png16(color: [u16; 3], info: impl Fn(&mut png::Info)) -> Vec<u8> {
    let mut header = png::Info::with_size(2, 1);
    (header.bit_depth, header.color_type) = (png::BitDepth::Sixteen, png::ColorType::Rgb);
    info(&mut header);
    let mut bytes = Vec::new();
    let mut writer = png::Encoder::with_info(&mut bytes, header).unwrap().write_header().unwrap();
    let data: Vec<u8> = [color; 2].as_flattened().iter().flat_map(|v| v.to_be_bytes()).collect();
    writer.write_image_data(&data).unwrap();
    writer.finish().unwrap();
    bytes
}

fn tagged(info: &mut png::Info) {
    info.srgb = Some(png::SrgbRenderingIntent::Perceptual);
}

fn first(frame: &Frame) -> [u16; 3] {
    let Samples::U16(samples) = &frame.samples else { panic!("floats") };
    [samples[0], samples[1], samples[2]]
}

fn light(stored: u16) -> u16 {
    (65_535.0 * srgb::decode(f32::from(stored) / 65_535.0)).round() as u16
}

#[test]
fn the_files_word_is_used_where_nothing_is_declared() {
    let color = [1000, 30_000, 65_535];
    let frame = decode(&png16(color, tagged), &NOTHING).unwrap();
    assert_eq!(first(&frame), color.map(light));
    assert_eq!(frame.metadata.numbers.encoding, Some(Encoding::Srgb));
    assert_eq!(frame.metadata.numbers.contradiction, None);
    assert!(frame.metadata.numbers.linear_srgb_from_rgb.is_some());
    let silent = decode(&png16(color, |_| ()), &NOTHING).unwrap();
    assert_eq!((first(&silent), silent.metadata.numbers.encoding), (color, None));
    assert_eq!(silent.metadata.numbers.linear_srgb_from_rgb, None);
    let gamma =
        |info: &mut png::Info| info.source_gamma = Some(png::ScaledFloat::from_scaled(50_000));
    let squared = decode(&png16([32_768, 0, 65_535], gamma), &NOTHING).unwrap();
    assert_eq!(first(&squared), [16_384, 0, 65_535]);
    // 8 bits need not be declared where the file says.
    let image = Image::filled(2, 2, [128; 3]);
    let eight = decode(&encode_png_rgb8(&image, PngContent::Srgb).unwrap(), &NOTHING).unwrap();
    assert_eq!((eight.layout, first(&eight)[0]), (Layout::Rgb, light(128 * 257)));
}

#[test]
fn what_is_declared_goes_first_and_the_contradiction_is_told() {
    let color = [1000, 30_000, 65_535];
    let frame = decode(&png16(color, tagged), &LINEAR).unwrap();
    assert_eq!(first(&frame), color);
    let told = frame.metadata.numbers.contradiction.unwrap();
    assert_eq!(told, "its sRGB chunk says sRGB, declared is linear");
    let same = decode(&png16(color, tagged), &SRGB).unwrap();
    assert_eq!(same.metadata.numbers.contradiction, None);
    let linear =
        |info: &mut png::Info| info.source_gamma = Some(png::ScaledFloat::from_scaled(100_000));
    let told =
        decode(&png16(color, linear), &SRGB).unwrap().metadata.numbers.contradiction.unwrap();
    assert_eq!(told, "its gAMA chunk says linear, declared is sRGB");
}

#[test]
fn a_curve_that_cannot_be_applied_asks_for_a_declaration() {
    let lab = |info: &mut png::Info| {
        info.icc_profile = Some(moxcms::ColorProfile::new_lab().encode().unwrap().into());
    };
    let bytes = png16([9; 3], lab);
    let error = decode(&bytes, &NOTHING).unwrap_err();
    assert!(matches!(error, DecodeError::EncodingUnreadable { .. }), "{error}");
    assert!(
        error.to_string().contains("its ICC profile") && error.to_string().contains("; declare"),
        "{error}"
    );
    assert_eq!(first(&decode(&bytes, &LINEAR).unwrap()), [9; 3]);
}

#[test]
fn an_adobe_rgb_profile_is_applied_with_its_primaries() {
    let adobe = |info: &mut png::Info| {
        info.icc_profile = Some(moxcms::ColorProfile::new_adobe_rgb().encode().unwrap().into());
    };
    let frame = decode(&png16([32_768; 3], adobe), &NOTHING).unwrap();
    let expected = 65_535.0 * 0.5_f64.powf(563.0 / 256.0);
    assert!((f64::from(first(&frame)[1]) - expected).abs() < 20.0, "{:?}", first(&frame));
    let matrix = frame.metadata.numbers.linear_srgb_from_rgb.unwrap();
    assert!((matrix[0][0] - 1.398).abs() < 2e-3, "{matrix:?}");
}
