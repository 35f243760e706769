use crate::raster::PictureError;
use std::path::PathBuf;

/// Why bytes are no usable frame. The message says what is wrong and what to do; whoever knows the path adds it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DecodeError {
    /// No usable picture at all.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// 8-bit pictures encode light in either of two ways.
    #[error(
        "an 8-bit picture does not say how it encodes light; declare encoding = \"linear\" or \"srgb\""
    )]
    EncodingUndeclared,
    /// The file names a curve that cannot be applied.
    #[error(
        "{by} says how the picture encodes light, but {why}; declare encoding = \"linear\" or \"srgb\", or save the picture as \
         sRGB or linear"
    )]
    EncodingUnreadable {
        /// As in "its ICC profile".
        by: String,
        /// As in "it holds lookup tables instead of a curve".
        why: String,
    },
    /// A declared encoding that the format excludes.
    #[error("{format} holds linear values; remove encoding = \"srgb\"")]
    EncodingContradicted {
        /// As in "a RAW file".
        format: &'static str,
    },
    /// A declared mosaic that the file contradicts.
    #[error("cfa = \"{declared}\" is declared, but the file holds {found}; remove or correct cfa")]
    CfaContradicted {
        /// From the hint.
        declared: String,
        /// From the file.
        found: String,
    },
}

impl DecodeError {
    pub(crate) fn damaged(what: impl Into<String>) -> Self {
        PictureError::damaged(what).into()
    }

    pub(crate) fn unsupported(what: impl Into<String>, remedy: &'static str) -> Self {
        PictureError::unsupported(what, remedy).into()
    }
}

/// What to do with a RAW file of an unusual kind.
pub(crate) const CONVERT_TO_DNG: &str =
    "convert it to DNG with Adobe DNG Converter or dnglab, without lossy compression";

/// Why a frame's file gave no frame.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is there but is no usable frame.
    #[error("{}: {source}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// Why.
        source: DecodeError,
    },
}
