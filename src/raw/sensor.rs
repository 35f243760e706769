//! What turns stored sensor data into a frame: visible area, mosaic phase, levels.

use super::{DecodeError, Frame, Hint, Layout, Metadata, Samples};
use std::ops::Range;
use weavelight_calibration::description::{Cfa, Channel};

/// A rectangle of photosites; right and bottom are outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) top: usize,
    pub(crate) left: usize,
    pub(crate) bottom: usize,
    pub(crate) right: usize,
}

/// Sensor data as stored, masked borders included.
#[derive(Clone, Debug)]
pub(crate) struct Stored {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row, channels interleaved.
    pub(crate) samples: Samples,
    pub(crate) visible: Area,
    /// Phase and levels from the visible area's top left.
    pub(crate) layout: Layout,
    pub(crate) black: [f32; 4],
    pub(crate) saturation: [f32; 4],
    pub(crate) metadata: Metadata,
}

impl Stored {
    /// The visible area as a frame.
    ///
    /// # Errors
    /// Levels that leave no range between them, or a visible area outside the stored one.
    pub(crate) fn into_frame(self) -> Result<Frame, DecodeError> {
        let Area { top, left, bottom, right } = self.visible;
        if top >= bottom || left >= right || bottom > self.height || right > self.width {
            let what =
                format!("its visible area {left}..{right} x {top}..{bottom} is not inside it");
            return Err(DecodeError::damaged(what));
        }
        let mut levels = self.black.iter().zip(&self.saturation);
        if let Some((black, white)) =
            levels.find(|(black, white)| black >= white || black.is_nan() || white.is_nan())
        {
            return Err(DecodeError::damaged(format!(
                "black level {black} is not below white level {white}"
            )));
        }
        let whole = right - left == self.width && bottom - top == self.height;
        let channels = self.layout.channels();
        let (stride, rows, columns) =
            (self.width * channels, top..bottom, left * channels..right * channels);
        let samples = match self.samples {
            samples if whole => samples,
            Samples::U16(samples) => Samples::U16(cropped(&samples, stride, rows, columns)),
            Samples::F32(samples) => Samples::F32(cropped(&samples, stride, rows, columns)),
        };
        Ok(Frame {
            width: right - left,
            height: bottom - top,
            layout: self.layout,
            samples,
            black: self.black,
            saturation: self.saturation,
            metadata: self.metadata,
        })
    }
}

fn cropped<T: Copy>(
    samples: &[T],
    stride: usize,
    rows: Range<usize>,
    columns: Range<usize>,
) -> Vec<T> {
    let mut kept = Vec::with_capacity(rows.len() * columns.len());
    for row in samples.chunks_exact(stride).take(rows.end).skip(rows.start) {
        kept.extend_from_slice(&row[columns.clone()]);
    }
    kept
}

/// The colour-filter array of TIFF/EP codes (0 red, 1 green, 2 blue), row-major.
///
/// # Errors
/// A cell other than 2 x 2, or other colours.
pub(crate) fn cfa_from_codes(repeat: &[u32], codes: &[u8]) -> Result<Cfa, DecodeError> {
    let refuse = || {
        DecodeError::unsupported(
            "a colour-filter array other than 2 x 2 of red, green, blue",
            CONVERT_TO_RGB,
        )
    };
    let cell: [u8; 4] = codes.try_into().map_err(|_| refuse())?;
    if repeat != [2, 2] || cell.iter().any(|&code| code > 2) {
        return Err(refuse());
    }
    Ok(Cfa { cell: cell.map(|code| [Channel::R, Channel::G, Channel::B][usize::from(code)]) })
}

/// What to do with X-Trans and other exotic sensors.
pub(crate) const CONVERT_TO_RGB: &str =
    "convert it to a demosaiced linear DNG or a 16-bit linear TIFF";

/// The file's mosaic, or the declared one where the file has none.
///
/// # Errors
/// Both exist and differ, or neither exists.
pub(crate) fn mosaic(found: Option<Cfa>, hint: &Hint) -> Result<Layout, DecodeError> {
    match (found, hint.cfa) {
        (Some(found), Some(declared)) if found != declared => Err(DecodeError::CfaContradicted {
            declared: declared.name(),
            found: format!("the mosaic {}", found.name()),
        }),
        (Some(cfa), _) | (None, Some(cfa)) => Ok(Layout::Mosaic(cfa)),
        (None, None) => Err(DecodeError::unsupported(
            "a mosaic of unknown colours",
            "declare cfa = \"RGGB\" (when importing), or as the camera has it",
        )),
    }
}

/// Checks that nothing declares a mosaic for a picture that is none.
///
/// # Errors
/// The hint declares one.
pub(crate) fn no_mosaic(layout: Layout, hint: &Hint, found: &str) -> Result<Layout, DecodeError> {
    match hint.cfa {
        Some(declared) => {
            Err(DecodeError::CfaContradicted { declared: declared.name(), found: found.to_owned() })
        }
        None => Ok(layout),
    }
}

/// Refuses a RAW file that is declared to be sRGB-encoded.
pub(crate) fn linear_only(hint: &Hint, format: &'static str) -> Result<(), DecodeError> {
    match hint.encoding {
        Some(super::Encoding::Srgb) => Err(DecodeError::EncodingContradicted { format }),
        _ => Ok(()),
    }
}
