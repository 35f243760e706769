use crate::files::{FileError, Setting};
use crate::instrument::LIGHT_COUNT;
use crate::session::SessionError;
use std::path::PathBuf;

/// What goes wrong with an import. Each message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The capture session that was to be written.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// An 8-bit picture whose encoding is not declared.
    #[error("{}: has 8 bits and does not say how they encode light; add {encoding} srgb (most cameras) or {encoding} linear", .0.display(), encoding = Setting("encoding"))]
    EncodingUnknown(PathBuf),
    /// A picture whose file names a curve that cannot be applied.
    #[error("{}: {by} says how it encodes light, but {why}; add {encoding} srgb or {encoding} linear, or save it as sRGB or linear", .path.display(), encoding = Setting("encoding"))]
    EncodingUnreadable {
        /// The picture.
        path: PathBuf,
        /// As in "its ICC profile".
        by: String,
        /// As in "it holds lookup tables instead of a curve".
        why: String,
    },
    /// Directions and pictures do not pair.
    #[error("{}: {lights} directions, but {what}; give one picture for each direction", .path.display())]
    Count {
        /// The list.
        path: PathBuf,
        /// Directions in it.
        lights: usize,
        /// What there is of the other.
        what: String,
    },
    /// A RAW or floating-point picture that is said to be sRGB-encoded.
    #[error("{}: {format} holds linear values; leave out {} srgb", .path.display(), Setting("encoding"))]
    EncodingContradicted {
        /// The picture.
        path: PathBuf,
        /// As in "a RAW file".
        format: &'static str,
    },
    /// A picture that is no mosaic, or another than the one given.
    #[error("{}: {cfa} {declared} is given, but this file holds {found}; leave out {cfa}, or correct it", .path.display(), cfa = Setting("cfa"))]
    CfaContradicted {
        /// The picture.
        path: PathBuf,
        /// As in "RGGB".
        declared: String,
        /// From the file.
        found: String,
    },
    /// Exposures of which some are known and differ, and some are not.
    #[error("{}: states no {what}, but the others state {low} to {high}; give pictures that all state it, or {} if all were equally exposed", .path.display(), Setting("same-exposure"))]
    ExposureMixed {
        /// The picture that is silent.
        path: PathBuf,
        /// What is not stated.
        what: &'static str,
        /// The least that others state.
        low: String,
        /// The most that others state.
        high: String,
    },
    /// Pictures of several apertures.
    #[error("{}: was taken at f/{found}, but {} at f/{expected}; take all pictures at one aperture, or give {} if they were normalised already", .path.display(), .first.display(), Setting("same-exposure"))]
    Aperture {
        /// The odd one.
        path: PathBuf,
        /// Its f-number.
        found: f64,
        /// The first one.
        first: PathBuf,
        /// Its f-number.
        expected: f64,
    },
    /// A picture that the list names for two lights.
    #[error("{}:{line}: names {name}, {place}", .path.display())]
    NamedTwice {
        /// The list.
        path: PathBuf,
        /// Line of the second.
        line: usize,
        /// The picture.
        name: String,
        /// Which was the first, and what to do.
        place: String,
    },
    /// A picture that the list names is not there.
    #[error("{}:{line}: names {name}, which is not {place}; correct the list or give that picture", .path.display())]
    NamedMissing {
        /// The list.
        path: PathBuf,
        /// Its line.
        line: usize,
        /// The picture.
        name: String,
        /// Where it was looked for.
        place: String,
    },
    /// Too few or too many lights.
    #[error("{}: {what}; a solve takes {} to {}", .path.display(), LIGHT_COUNT.start(), LIGHT_COUNT.end())]
    LightCount {
        /// The list.
        path: PathBuf,
        /// How many there are.
        what: String,
    },
    /// Pictures of different size.
    #[error("{}: is {} x {}, but {} is {} x {}; all pictures must be of one size", .path.display(), .size[0], .size[1], .first.display(), .expected[0], .expected[1])]
    Size {
        /// The odd one.
        path: PathBuf,
        /// Its width and height.
        size: [usize; 2],
        /// The first one.
        first: PathBuf,
        /// Its width and height.
        expected: [usize; 2],
    },
}
