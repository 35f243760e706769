use crate::files::FileError;
use std::path::Path;

/// Characters of a library's message that an error repeats.
const LONGEST_REASON: usize = 160;

/// Why bytes are no usable picture. The message says what is wrong and what to do; the caller that knows the path adds it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// No bytes at all.
    #[error("the file is empty; copy it again from where it came")]
    Empty,
    /// Something else under a picture's name.
    #[error("this is {found}, not a picture; give {expected}")]
    NotAPicture {
        /// As in "a text file".
        found: &'static str,
        /// As in "a PNG file".
        expected: &'static str,
    },
    /// Data that the file announces lies beyond its end.
    #[error(
        "the file is cut short: {what} reaches to byte {needed}, the file has {have}; copy it again from where it came"
    )]
    Truncated {
        /// As in "strip 3".
        what: String,
        /// Bytes the file would need.
        needed: u64,
        /// Bytes there are.
        have: u64,
    },
    /// The content contradicts itself.
    #[error("the file is damaged: {what}; copy it again from where it came")]
    Damaged {
        /// What contradicts.
        what: String,
    },
    /// A sound file of a kind that is not read.
    #[error("{what} cannot be read; {remedy}")]
    Unsupported {
        /// As in "a palette TIFF".
        what: String,
        /// What to do, as in "convert it to DNG".
        remedy: &'static str,
    },
    /// A mask that leaves nothing to measure.
    #[error("the mask is {all} everywhere; paint what is inside white, or leave the mask away")]
    EmptyMask {
        /// Black or transparent.
        all: &'static str,
    },
    /// Dimensions that no file of this length can fill.
    #[error(
        "the file claims {width} x {height} pixels, more than its {bytes} bytes can hold; copy it again from where it came"
    )]
    TooLarge {
        /// Claimed.
        width: u64,
        /// Claimed.
        height: u64,
        /// Length of the file.
        bytes: u64,
    },
    /// More memory than there is.
    #[error(transparent)]
    NoMemory(#[from] crate::machine::NoMemory),
}

impl PictureError {
    pub(crate) fn damaged(what: impl Into<String>) -> Self {
        // Libraries' messages may run over several lines, and list every value of a damaged tag.
        let what: String = what.into();
        let line = what.lines().next().unwrap_or_default().trim_end_matches('.');
        let mut short: String = line.chars().take(LONGEST_REASON).collect();
        let rest = if line.len() > short.len() { "..." } else { "" };
        // A quotation that was cut would stay open.
        if short.matches('"').count() % 2 == 1 {
            short.retain(|c| c != '"');
        }
        Self::Damaged { what: short + rest }
    }

    pub(crate) fn unsupported(what: impl Into<String>, remedy: &'static str) -> Self {
        Self::Unsupported { what: what.into(), remedy }
    }
}

/// Of a picture file that holds no usable picture.
pub(crate) fn content_error(path: &Path, source: &PictureError) -> FileError {
    FileError::Content { path: path.to_owned(), what: source.to_string() }
}
