use super::Encoding;
use weavelight_calibration::description::Cfa;

/// One decoded frame: the decoder's visible area, linear, nothing subtracted, nothing clipped.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Photosites in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What one pixel holds.
    pub layout: Layout,
    /// `width * height * layout.channels()` values, row by row, channels interleaved.
    pub samples: Samples,
    /// Black level in raw numbers of the repeating 2 x 2 cell, row-major from the top left (four equal values where the
    /// frame is no mosaic).
    pub black: [f32; 4],
    /// Raw number, black included, from which a sample counts as saturated; per place of the 2 x 2 cell. Infinite where the
    /// format has no ceiling (EXR).
    pub saturation: [f32; 4],
    /// What the file says of the camera; never used by the solve.
    pub metadata: Metadata,
}

impl Frame {
    /// Which levels were assumed, and what to do, as far as `stated` (black level, saturation) does not say them elsewhere; ends
    /// where the place to say them follows. `None` where all are known.
    pub fn assumed_levels(&self, stated: [bool; 2]) -> Option<String> {
        let Assumed { black, saturation } = self.metadata.assumed;
        let (black, saturation) = (black && !stated[0], saturation && !stated[1]);
        let full = self.saturation[0];
        Some(match (black, saturation) {
            (false, false) => return None,
            (true, false) => {
                "states no black level, which is taken as 0; set black_level".to_owned()
            }
            (false, true) => format!(
                "does not state where it saturates, which is taken as {full}; set saturation_level"
            ),
            (true, true) => format!(
                "states neither black level nor saturation, which are taken as 0 and {full}; set black_level and \
                 saturation_level"
            ),
        })
    }
}

/// What one pixel of a frame holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// One sample under a colour filter.
    Mosaic(Cfa),
    /// One sample, no filter.
    Grey,
    /// Three samples R, G, B.
    Rgb,
}

impl Layout {
    /// Samples per pixel.
    pub fn channels(self) -> usize {
        match self {
            Layout::Mosaic(_) | Layout::Grey => 1,
            Layout::Rgb => 3,
        }
    }
}

/// Sample values.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Integers as the sensor (or the file) has them.
    U16(Vec<u16>),
    /// EXR.
    F32(Vec<f32>),
}

/// What the file says of the camera, where it says it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Maker and model, as in "Nikon D5100".
    pub camera: Option<String>,
    /// Exposure time in seconds.
    pub exposure_s: Option<f64>,
    /// Sensitivity.
    pub iso: Option<f64>,
    /// The aperture: focal length over diameter.
    pub f_number: Option<f64>,
    /// Focal length in millimetres.
    pub focal_length_mm: Option<f64>,
    /// The lens, as the camera names it.
    pub lens: Option<String>,
    /// Row-major XYZ-to-camera matrix, scaled as usual (1.0 = 1), for illuminant D65 if there are several.
    pub camera_from_xyz: Option<[[f64; 3]; 3]>,
    /// Exif orientation; recorded, never applied.
    pub orientation: Option<u16>,
    /// What a picture file says of its numbers; of a RAW file nothing.
    pub numbers: Numbers,
    /// Levels that the file does not state and that were assumed; no frame that comes from rawloader's table has any.
    pub assumed: Assumed,
}

/// What a picture file says of its numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers {
    /// A picture of integers: its samples may clip below its full scale.
    pub may_clip_below: bool,
    /// Bits that carry information, where the file says that there are fewer than it stores, and the samples are as stored.
    pub significant_bits: Option<u8>,
    /// The curve that was undone, as in "sRGB"; empty for a RAW file.
    pub curve: String,
    /// The encoding that the file names and that was applied, where it is one of the two with a name.
    pub encoding: Option<Encoding>,
    /// Both words, where the declared encoding is not the file's, as in "its sRGB chunk says sRGB, declared is linear".
    pub contradiction: Option<String>,
    /// Linear Rec. 709 from the picture's linear RGB, three rows that sum to 1, where the file says its primaries.
    pub linear_srgb_from_rgb: Option<[[f64; 3]; 3]>,
}

/// Levels that were assumed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Assumed {
    /// Black as 0.
    pub black: bool,
    /// Saturation as the largest number of so many bits.
    pub saturation: bool,
}
