//! The cameras' own RAW formats, through rawloader; see [`super::dng`] and [`super::nef`] for what it must not decode.

use super::error::CONVERT_TO_DNG;
use super::sensor::{self, Area, Stored};
use super::tags::Tiff;
use super::{DecodeError, Hint, Layout, Metadata, metadata};
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
    sensor::linear_only(hint, "a RAW file")?;
    let image = load(bytes, Want::Everything)?;
    let mut stored = describe(&image, tiff, hint)?;
    stored.samples = integers(image.data)?;
    if stored.samples.len() != stored.width * stored.height * stored.layout.channels() {
        return Err(DecodeError::damaged("its decoder returned another number of samples"));
    }
    Ok(stored)
}

/// rawloader's view of a file.
pub(crate) fn load(bytes: &[u8], want: Want) -> Result<RawImage, DecodeError> {
    guarded_pool(|| {
        let mut reader = bytes;
        let image = match want {
            Want::Everything => rawloader::decode(&mut reader),
            Want::Description => rawloader::decode_dummy(&mut reader),
        };
        // rawloader's own words run over several lines and name its issue tracker.
        image.map_err(|error| {
            let text = error.to_string();
            let line = text.lines().next().unwrap_or_default();
            let reason: String = line.trim_end_matches('.').chars().take(160).collect();
            DecodeError::unsupported(format!("this RAW file ({reason})"), CONVERT_TO_DNG)
        })
    })
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
        samples: Vec::new(),
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
