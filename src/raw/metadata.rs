//! What a file says of the camera.

use super::Metadata;
use super::tags::{Directory, Tiff, tag};
use crate::raster::PictureError;
use crate::raster::guard::guarded;
use std::io::Cursor;

/// From the directories of a RAW file or TIFF.
pub(crate) fn from_tiff(tiff: &Tiff) -> Metadata {
    let positive = |tag| tiff.with(tag).and_then(|directory| directory.positive(tag));
    let text = |tag| tiff.with(tag).and_then(|directory| directory.text(tag));
    Metadata {
        camera: camera_name(text(tag::MAKE), text(tag::MODEL)),
        exposure_s: positive(tag::EXPOSURE_TIME)
            .or_else(|| apex(tiff, tag::SHUTTER_SPEED).map(|value| (-value).exp2())),
        f_number: positive(tag::F_NUMBER)
            .or_else(|| apex(tiff, tag::APERTURE).map(|value| (0.5 * value).exp2())),
        // Above 65535 the old tag is full and the newer one says the number.
        iso: positive(tag::ISO)
            .filter(|&iso| iso < 65_535.0)
            .or_else(|| positive(tag::RECOMMENDED_EXPOSURE_INDEX)),
        focal_length_mm: positive(tag::FOCAL_LENGTH),
        lens: text(tag::LENS_MODEL).filter(|lens| !lens.is_empty()),
        camera_from_xyz: color_matrix(tiff),
        orientation: tiff.directories[0]
            .integer(tag::ORIENTATION)
            .and_then(|value| value.try_into().ok()),
        ..Metadata::default()
    }
}

/// A logarithm to base 2 of Exif's additive system; numbers beyond any camera's are none.
fn apex(tiff: &Tiff, tag: u16) -> Option<f64> {
    let value = *tiff.with(tag)?.numbers(tag)?.first()?;
    (-20.0..=20.0).contains(&value).then_some(value)
}

/// "NIKON CORPORATION" and "NIKON D5100" make "NIKON D5100"; "Canon" and "EOS 5D" make "Canon EOS 5D".
fn camera_name(make: Option<String>, model: Option<String>) -> Option<String> {
    let (Some(make), Some(model)) = (make.clone(), model.clone()) else { return model.or(make) };
    let maker = make.split_whitespace().next().unwrap_or_default().to_lowercase();
    if model.to_lowercase().starts_with(&maker) {
        Some(model)
    } else {
        Some(format!("{make} {model}"))
    }
}

/// DNG's matrix for D65 (illuminant 21), else the second, else the first.
fn color_matrix(tiff: &Tiff) -> Option<[[f64; 3]; 3]> {
    let first = tiff.with(tag::COLOR_MATRIX_1)?;
    let illuminant = |tag| first.integer(tag);
    let tag = if illuminant(tag::ILLUMINANT_1) == Some(21) || !first.has(tag::COLOR_MATRIX_2) {
        tag::COLOR_MATRIX_1
    } else {
        tag::COLOR_MATRIX_2
    };
    matrix(first, tag)
}

fn matrix(directory: &Directory, tag: u16) -> Option<[[f64; 3]; 3]> {
    let numbers: [f64; 9] = directory.numbers(tag)?.try_into().ok()?;
    let [a, b, c, d, e, f, g, h, i] = numbers;
    numbers.iter().all(|value| value.is_finite()).then_some([[a, b, c], [d, e, f], [g, h, i]])
}

/// OpenEXR's standard attributes `expTime`, `isoSpeed` and `aperture`, of the first part.
pub(crate) fn from_exr(bytes: &[u8]) -> Metadata {
    use exr::meta::MetaData;
    let read = || {
        MetaData::read_from_buffered(Cursor::new(bytes), false)
            .map_err(|error| PictureError::damaged(error.to_string()))
    };
    let Ok(meta) = guarded(read) else { return Metadata::default() };
    let Some(part) = meta.headers.first() else { return Metadata::default() };
    let positive =
        |value: Option<f32>| value.map(f64::from).filter(|value| value.is_finite() && *value > 0.0);
    let attributes = &part.own_attributes;
    Metadata {
        exposure_s: positive(attributes.exposure),
        iso: positive(attributes.iso_speed),
        f_number: positive(attributes.aperture),
        ..Metadata::default()
    }
}

/// Fujifilm's RAF: a JPEG with Exif stands before the sensor data.
pub(crate) fn from_raf(bytes: &[u8]) -> Metadata {
    let number = |at: usize| {
        let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_be_bytes(four) as usize)
    };
    let place = number(84).zip(number(88));
    let jpeg = place.and_then(|(at, length)| bytes.get(at..at.checked_add(length)?));
    jpeg.map_or_else(Metadata::default, from_exif_container)
}

/// From the Exif block of a PNG or JPEG, as far as there is one.
pub(crate) fn from_exif_container(bytes: &[u8]) -> Metadata {
    let mut reader = exif::Reader::new();
    reader.continue_on_error(true);
    let exif = match reader.read_from_container(&mut Cursor::new(bytes)) {
        Ok(exif) => exif,
        Err(exif::Error::PartialResult(partial)) => partial.into_inner().0,
        Err(_) => return Metadata::default(),
    };
    from_tiff_bytes(exif.buf())
}

fn from_tiff_bytes(bytes: &[u8]) -> Metadata {
    Tiff::parse(bytes).map_or_else(|_| Metadata::default(), |tiff| from_tiff(&tiff))
}
