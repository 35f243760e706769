//! The cameras' own RAW formats, through rawloader; see [`super::dng`] and [`super::nef`] for what it must not decode.

use super::error::CONVERT_TO_DNG;
use super::sensor::{self, Area, Stored};
use super::tags::Tiff;
use super::{DecodeError, FRAMES, Hint, Layout, Metadata, Samples, kind, metadata};
use crate::raster::PictureError;
use crate::raster::guard::guarded_pool;
use rawloader::{RawImage, RawImageData};
use weavelight_calibration::description::{Cfa, Channel};

/// Cameras of which rawloader hides more than libraw does (raw-identify): model, stored size, and the visible size from
/// the top left.
const SEEN_MORE: [(&str, usize, usize, usize, usize); 3] = [
    ("D1", 2012, 1324, 2012, 1324),
    ("D5100", 4992, 3280, 4948, 3280),
    ("D7000", 4992, 3280, 4948, 3280),
];

/// Whether the samples are wanted or only what the camera table and the tags say.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Want {
    Everything,
    Description,
}

/// Decodes any RAW file that rawloader knows.
///
/// # Errors
/// Unknown or damaged files, and sensors other than 2 x 2 mosaics of red, green and blue, monochrome, or RGB.
pub(crate) fn decode(
    bytes: &[u8],
    tiff: Option<&Tiff>,
    hint: &Hint,
) -> Result<Stored, DecodeError> {
    let image = load(bytes, tiff, Want::Everything)?;
    sensor::linear_only(hint, "a RAW file")?;
    let mut stored = describe(&image, tiff, hint)?;
    let samples = integers(image.data)?;
    let found = samples.len();
    stored.samples = Samples::U16(samples);
    if found != stored.width * stored.height * stored.layout.channels() {
        return Err(DecodeError::damaged("its decoder returned another number of samples"));
    }
    Ok(stored)
}

/// rawloader's view of a file.
pub(crate) fn load(bytes: &[u8], tiff: Option<&Tiff>, want: Want) -> Result<RawImage, DecodeError> {
    let outcome = guarded_pool(|| {
        let mut reader = bytes;
        let image = match want {
            Want::Everything => rawloader::decode(&mut reader),
            Want::Description => rawloader::decode_dummy(&mut reader),
        };
        image.map_err(|error| refused(bytes, tiff, &error.to_string()))
    });
    // A decoder that gives up may have met a newer kind as well as damage.
    outcome.map_err(|error| match error {
        DecodeError::Picture(PictureError::Damaged { .. }) if kind::name(bytes, tiff).is_some() => {
            kind::refused(bytes, tiff, Some("that is damaged or of a newer kind"))
        }
        error => error,
    })
}

/// rawloader's own words are for its developers, run over several lines and name its issue tracker.
fn refused(bytes: &[u8], tiff: Option<&Tiff>, text: &str) -> DecodeError {
    if text.contains("Couldn't find a decoder") && kind::name(bytes, tiff).is_none() {
        return PictureError::NotAPicture { found: "a file of unknown kind", expected: FRAMES }
            .into();
    }
    let unknown = text.contains("Couldn't find camera");
    kind::refused(bytes, tiff, unknown.then_some("of a camera that is not known"))
}

/// Everything but the samples.
pub(crate) fn describe(
    image: &RawImage,
    tiff: Option<&Tiff>,
    hint: &Hint,
) -> Result<Stored, DecodeError> {
    let visible = visible_area(image)?;
    let (layout, channel_of_place) = match (image.cpp, image.cfa.is_valid()) {
        (3, _) => (sensor::no_mosaic(Layout::Rgb, hint, "an RGB picture")?, [0, 0, 0, 0]),
        (1, false) => {
            (sensor::no_mosaic(Layout::Grey, hint, "a monochrome picture")?, [0, 0, 0, 0])
        }
        (1, true) => visible_mosaic(image, visible, hint)?,
        (n, _) => {
            return Err(DecodeError::unsupported(
                format!("sensor data of {n} samples per pixel"),
                CONVERT_TO_DNG,
            ));
        }
    };
    Ok(Stored {
        width: image.width,
        height: image.height,
        samples: Samples::U16(Vec::new()),
        visible,
        layout,
        black: channel_of_place.map(|channel| image.blacklevels[channel].into()),
        saturation: channel_of_place.map(|channel| image.whitelevels[channel].into()),
        metadata: metadata_of(image, tiff),
    })
}

fn visible_area(image: &RawImage) -> Result<Area, DecodeError> {
    let stored = (image.clean_model.as_str(), image.width, image.height);
    if let Some(&(_, _, _, right, bottom)) =
        SEEN_MORE.iter().find(|seen| (seen.0, seen.1, seen.2) == stored)
    {
        return Ok(Area { top: 0, left: 0, bottom, right });
    }
    let [top, right, bottom, left] = image.crops;
    let edge = |whole: usize, crop| {
        whole
            .checked_sub(crop)
            .ok_or_else(|| DecodeError::damaged("its visible area exceeds the sensor"))
    };
    Ok(Area { top, left, bottom: edge(image.height, bottom)?, right: edge(image.width, right)? })
}

/// The mosaic from the visible area's top left, and rawloader's channel number (R, G, B, second green) of each place.
fn visible_mosaic(
    image: &RawImage,
    visible: Area,
    hint: &Hint,
) -> Result<(Layout, [usize; 4]), DecodeError> {
    let refuse = || {
        DecodeError::unsupported(
            "a colour-filter array other than 2 x 2 of red, green, blue",
            sensor::CONVERT_TO_RGB,
        )
    };
    if (image.cfa.width, image.cfa.height) != (2, 2) {
        return Err(refuse());
    }
    let places: [usize; 4] =
        std::array::from_fn(|i| image.cfa.color_at(visible.top + i / 2, visible.left + i % 2));
    if places.iter().any(|&channel| channel > 2) {
        return Err(refuse());
    }
    let cell = places.map(|channel| [Channel::R, Channel::G, Channel::B][channel]);
    Ok((sensor::mosaic(Some(Cfa { cell }), hint)?, places))
}

fn integers(data: RawImageData) -> Result<Vec<u16>, DecodeError> {
    match data {
        RawImageData::Integer(samples) => Ok(samples),
        RawImageData::Float(_) => {
            Err(DecodeError::unsupported("floating-point sensor data", CONVERT_TO_DNG))
        }
    }
}

fn metadata_of(image: &RawImage, tiff: Option<&Tiff>) -> Metadata {
    let from_tags = tiff.map(metadata::from_tiff).unwrap_or_default();
    let name = format!("{} {}", image.clean_make, image.clean_model);
    // The camera table holds the matrix in ten-thousandths.
    let matrix = [0, 1, 2].map(|i| image.xyz_to_cam[i].map(|value| f64::from(value) / 10_000.0));
    let known = matrix.iter().flatten().any(|&value| value != 0.0);
    Metadata {
        camera: Some(name.trim().to_owned()).filter(|name| !name.is_empty()),
        camera_from_xyz: known.then_some(matrix),
        ..from_tags
    }
}
