//! Real camera files decode to what libraw returns.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

#[allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "test programs share it")]
#[path = "support/skip.rs"]
mod skip;

use sha2::{Digest, Sha256};
use weavelight::raw::{Hint, Layout, Samples, decode, decode_uncropped};
use weavelight_calibration::description::Cfa;

/// A file of the real pictures; `None` where their tests are to be skipped.
fn data(name: &str) -> Option<Vec<u8>> {
    let path = skip::real_pictures(env!("CARGO_MANIFEST_DIR"), name)?;
    Some(std::fs::read(path).unwrap())
}

fn sha256_le(samples: &[u16]) -> String {
    let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

struct Expected {
    stored: [usize; 2],
    visible: [usize; 2],
    cfa: &'static str,
    white: f32,
    camera: &'static str,
    exposure_s: f64,
    sha256: &'static str,
}

fn check(name: &str, expected: &Expected) {
    let Some(bytes) = data(name) else { return };
    let (width, height, samples) = decode_uncropped(&bytes, &Hint::default()).unwrap();
    assert_eq!([width, height], expected.stored, "{name}");
    assert_eq!(sha256_le(&samples), expected.sha256, "{name}");
    let frame = decode(&bytes, &Hint::default()).unwrap();
    assert_eq!([frame.width, frame.height], expected.visible, "{name}");
    assert_eq!(frame.layout, Layout::Mosaic(Cfa::parse(expected.cfa).unwrap()), "{name}");
    assert_eq!((frame.black, frame.saturation), ([0.0; 4], [expected.white; 4]), "{name}");
    assert_eq!(frame.metadata.camera.as_deref(), Some(expected.camera));
    assert_eq!(frame.metadata.exposure_s, Some(expected.exposure_s));
    let Samples::U16(visible) = &frame.samples else { panic!("{name}: floating point") };
    for (row, whole) in visible.chunks(frame.width).zip(samples.chunks(width)) {
        assert_eq!(
            row,
            &whole[..frame.width],
            "{name}: the visible area starts at the sensor's top left"
        );
    }
}

#[test]
fn nikon_d1_uncompressed() {
    check(
        "raw/nikon-d1-uncompressed.nef",
        &Expected {
            stored: [2012, 1324],
            visible: [2012, 1324],
            cfa: "BGGR",
            white: 4095.0,
            camera: "Nikon D1",
            exposure_s: 0.004,
            sha256: "a58b8e6da8d595da0e13ba7eab4d64e94352c4533ad2543a7e700a258bd31b4a",
        },
    );
}

#[test]
fn nikon_lossless() {
    check(
        "raw/d5100-lossless-synthetic.nef",
        &Expected {
            stored: [4992, 3280],
            visible: [4948, 3280],
            cfa: "RGGB",
            white: 15892.0,
            camera: "Nikon D5100",
            exposure_s: 0.008,
            sha256: "06dcda74b9ce82939b209c0f2aef6f94f32bd08e1063a486842f26a6564ed228",
        },
    );
}

#[test]
fn nikon_lossy() {
    check(
        "raw/d5100-lossy-synthetic.nef",
        &Expected {
            stored: [4992, 3280],
            visible: [4948, 3280],
            cfa: "RGGB",
            white: 15892.0,
            camera: "Nikon D5100",
            exposure_s: 0.008,
            sha256: "498592383c7f13c79a3a4da84dde57156bea9e3425f55b3a6391bd8a86213d08",
        },
    );
}
