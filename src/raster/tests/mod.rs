//! Files as other programs write them, built by hand.

mod exr;
mod jpeg;
mod png;
mod tiff;
mod tiff_kinds;
mod tiff_pages;

use super::{Picture, PictureError, Values, decode_picture};

fn numbers(values: &Values) -> Vec<f64> {
    match values {
        Values::U8(values) => values.iter().map(|&value| value.into()).collect(),
        Values::U16(values) => values.iter().map(|&value| value.into()).collect(),
        Values::F32(values) => values.iter().map(|&value| value.into()).collect(),
    }
}

/// Refused as a kind that is not read: named, with a remedy, and not called damaged.
fn check_unsupported(bytes: &[u8], expected: &str) {
    let error = decode_picture(bytes).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, PictureError::Unsupported { .. }), "{expected}: {text}");
    assert!(text.contains(expected) && text.contains("; "), "{expected}: {text}");
}

fn decoded(bytes: &[u8]) -> Picture {
    decode_picture(bytes).unwrap()
}
