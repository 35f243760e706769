//! Damaged files of every kind: an error or a frame, never a panic, never a frame that contradicts itself.

use super::builder::{Value, tiff};
use super::nef::Random;
use super::{dng, nef, pictures, tagged};
use crate::raster::encode_exr;
use crate::raw::tags::{Order, tag};
use crate::raw::{Encoding, Frame, Hint, Samples, decode};
use image::ImageFormat;

/// Small sound files of every format with a decoder.
fn seeds() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    let plain = dng::PLAIN;
    seeds.push(dng::file(plain, vec![]));
    seeds.push(dng::file(
        dng::Kind { order: Order::Big, bits: 12, segment: [16, 16], ..plain },
        vec![],
    ));
    seeds.push(dng::file(
        dng::Kind { compression: 8, predictor: 2, segment: [37, 5], ..plain },
        vec![],
    ));
    seeds.push(dng::file(
        dng::Kind { compression: 7, bits: 14, segment: [16, 16], ..plain },
        vec![],
    ));
    for (bits, compression, predictor) in [(16, 8, 3), (24, 1, 1), (32, 8, 34_894)] {
        seeds.push(dng::float_file(bits, compression, predictor, Order::Little).0);
    }
    let unknown = ("SONY", "ILCE-7M4");
    for (bits, compression, segment) in
        [(12, 1, [37, 5]), (14, 1, [16, 16]), (14, 7, [16, 16]), (16, 8, [37, 21])]
    {
        let kind = dng::Kind { bits, compression, segment, ..plain };
        seeds.push(tagged::container(Order::Little, unknown, tagged::sensor(kind, vec![])));
    }
    seeds.extend(nef::KINDS.iter().map(|&kind| nef::file(kind, 1).0));
    let grey = image::ImageBuffer::from_fn(33, 17, |x, y| image::Luma([(x * y * 100) as u16]));
    let rgb =
        image::ImageBuffer::from_fn(33, 17, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        seeds.push(pictures::encoded(grey.clone(), format));
    }
    for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Jpeg] {
        seeds.push(pictures::encoded(rgb.clone(), format));
    }
    let float = image::ImageBuffer::from_fn(33, 17, |x, y| image::Rgb([x as f32, y as f32, 0.5]));
    seeds.push(pictures::encoded(float, ImageFormat::OpenExr));
    let mut exr = Vec::new();
    encode_exr(&mut exr, [33, 17], &["Y"], |_, y, row| row.fill(y as f32)).unwrap();
    seeds.push(exr);
    seeds
}

/// Files that lead into the decoders of other cameras, and then make no sense.
fn cameras() -> Vec<Vec<u8>> {
    let heads: [&[u8]; 9] = [
        b"FUJIFILMCCD-RAW 0201FF393102FinePix X100",
        b"\0MRM\0\0\x40\0\0PRD",
        b"IIU\0\x18\0\0\0",
        b"IIRO\x08\0\0\0",
        b"MMOR\0\0\0\x08",
        b"II\x1a\0\0\0HEAPCCDR",
        b"ARRI\0\x10\0\0",
        b"II*\0\x10\0\0\0CR\x02\0",
        b"IIII\x49\x49\x49\x49RawT",
    ];
    let mut random = Random(3);
    let body: Vec<u8> = (0..3000).map(|_| random.below(256) as u8).collect();
    let mut files: Vec<Vec<u8>> =
        heads.iter().map(|head| [head, body.as_slice()].concat()).collect();
    let makers = [
        ("Canon", "Canon EOS 5D"),
        ("SONY", "SLT-A77V"),
        ("PENTAX", "PENTAX K-5"),
        ("OLYMPUS IMAGING CORP.", "E-PL1"),
        ("Panasonic", "DMC-G1"),
        ("SAMSUNG", "NX300"),
        ("SEIKO EPSON CORP.", "R-D1"),
        ("Hasselblad", "Hasselblad H3D"),
        ("EASTMAN KODAK COMPANY", "EOSDCS1B"),
        ("Leaf", "Aptus 22(LF3779      )/Mamiya"),
        ("Mamiya-OP Co.,Ltd.", "MAMIYA ZD"),
        ("NIKON CORPORATION", "NIKON D90"),
        ("Phase One A/S", "P40+"),
        ("FUJIFILM", "X-T1"),
    ];
    for (make, model) in makers {
        for compression in [1, 7, 32_767, 32_769, 65_535] {
            let described = vec![
                (tag::MAKE, Value::Ascii(make)),
                (tag::MODEL, Value::Ascii(model)),
                (tag::COMPRESSION, Value::Short(vec![compression])),
            ];
            let mut entries = dng::entries(dng::PLAIN, described);
            entries.retain(|(tag, _)| *tag != tag::DNG_VERSION);
            files.push(tiff(Order::Little, &entries));
        }
    }
    files
}

/// One of: flipped bits, extreme numbers, a cut, a piece copied elsewhere, a piece taken out. Most hits go to the first
/// or last 700 bytes, where headers and directories are.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        if bytes.len() < 8 {
            return;
        }
        let reach = if random.below(4) == 0 { bytes.len() } else { bytes.len().min(700) };
        let from_end = random.below(2) == 0;
        let place = random.below(reach);
        let at = if from_end { bytes.len() - 1 - place } else { place };
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.below(256) as u8,
            2 => {
                let extreme = [0, 1, 0x7f, 0x80, 0xff][random.below(5)];
                let end = bytes.len().min(at + [1, 2, 4, 8][random.below(4)]);
                bytes[at..end].fill(extreme);
            }
            3 => bytes.truncate(at),
            4 => {
                let length = 1 + random.below(16).min(bytes.len() - at - 1);
                let to = random.below(bytes.len() - length + 1);
                bytes.copy_within(at..at + length, to);
            }
            _ => {
                let end = bytes.len().min(at + 1 + random.below(16));
                bytes.drain(at..end);
            }
        }
    }
}

fn is_consistent(frame: &Frame) -> bool {
    let length = match &frame.samples {
        Samples::U16(samples) => samples.len(),
        Samples::F32(samples) => samples.len(),
    };
    let levels = frame.black.iter().zip(&frame.saturation);
    length == frame.width * frame.height * frame.layout.channels()
        && length > 0
        && levels.into_iter().all(|(black, white)| black < white)
}

/// Decodes `rounds` damaged files. A panic that nobody fenced in fails the test by itself.
fn run(seeds: &[Vec<u8>], rounds: usize, seed: u64) {
    let mut random = Random(seed);
    let hint = Hint { cfa: None, encoding: Some(Encoding::Linear) };
    for round in 0..rounds {
        let mut bytes = seeds[random.below(seeds.len())].clone();
        mutate(&mut bytes, &mut random);
        match decode(&bytes, &hint) {
            Ok(frame) => assert!(is_consistent(&frame), "seed {seed}, round {round}"),
            Err(error) => {
                let text = error.to_string();
                assert!(
                    text.lines().count() <= 2 && text.len() < 400,
                    "seed {seed}, round {round}: {text}"
                );
            }
        }
    }
}

#[test]
fn sound_files_are_sound() {
    let hint = Hint { cfa: None, encoding: Some(Encoding::Linear) };
    for (i, seed) in seeds().iter().enumerate() {
        assert!(decode(seed, &hint).is_ok_and(|frame| is_consistent(&frame)), "seed {i}");
    }
}

#[test]
fn damaged_files_are_errors_or_frames() {
    run(&seeds(), 4_000, 1);
}

#[test]
fn damaged_files_of_other_cameras_too() {
    run(&cameras(), 1_500, 2);
}

/// For an hour's leisure: WEAVELIGHT_FUZZ_ROUNDS=1000000 cargo nextest run --release --run-ignored only mutations
#[test]
#[ignore = "runs for as long as it is told"]
fn many_damaged_files() {
    let number = |name, default| {
        std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
    };
    let all = [seeds(), cameras()].concat();
    run(&all, number("WEAVELIGHT_FUZZ_ROUNDS", 100_000), number("WEAVELIGHT_FUZZ_SEED", 7) as u64);
}
