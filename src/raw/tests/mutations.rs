//! Damaged files of every kind: an error or a frame, never a panic, never a frame that contradicts itself.

use super::nef::Random;
use super::{dng, nef, pictures};
use crate::raster::encode_exr;
use crate::raw::tags::Order;
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
fn run(rounds: usize, seed: u64) {
    let seeds = seeds();
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
    run(6_000, 1);
}

/// For an hour's leisure: WEAVELIGHT_FUZZ_ROUNDS=1000000 cargo nextest run --release --run-ignored only mutations
#[test]
#[ignore = "runs for as long as it is told"]
fn many_damaged_files() {
    let number = |name, default| {
        std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
    };
    run(number("WEAVELIGHT_FUZZ_ROUNDS", 100_000), number("WEAVELIGHT_FUZZ_SEED", 7) as u64);
}
