//! Error figures between two maps: angles between normals, colour differences between albedos.

mod color;
mod normal;
mod read;
mod statistics;
#[cfg(test)]
mod tests;

pub use color::{ColorFigures, ColorPairs, compare_colors};
pub use normal::{NormalFigures, angle_deg, compare_normals};
pub use statistics::percentile;

use self::read::{Source, Suggestion};
use crate::raster::read_mask;
use std::path::{Path, PathBuf};
use weavelight_calibration::description::Image;

/// What two maps hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Unit vectors.
    Normal,
    /// Linear RGB.
    Color,
}

/// Figures of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Figures {
    /// Between normals.
    Normal(NormalFigures),
    /// Between colours.
    Color(ColorFigures),
}

/// What to compare.
#[derive(Clone, Debug)]
pub struct Options {
    /// One map: OpenEXR, PNG, TIFF or JPEG.
    pub a: PathBuf,
    /// The other, of the same size.
    pub b: PathBuf,
    /// What is inside it is compared; see [`crate::raster::decode_mask`].
    pub mask: Option<PathBuf>,
    /// What the maps hold; guessed from their names and content where absent.
    pub kind: Option<Kind>,
}

/// Figures, and what was left out of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The figures.
    pub figures: Figures,
    /// Pixels inside the mask that are 0 or not finite in either map.
    pub left_out: u64,
}

/// What goes wrong with a comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A map cannot be read.
    #[error(transparent)]
    File(#[from] crate::files::FileError),
    /// Maps or mask of different size.
    #[error("{}: is {} x {}, but {} is {} x {}; give pictures of one size", .b.display(), .b_size[0], .b_size[1], .a.display(), .a_size[0], .a_size[1])]
    Size {
        /// The first map.
        a: PathBuf,
        /// Its width and height.
        a_size: [usize; 2],
        /// The other.
        b: PathBuf,
        /// Its width and height.
        b_size: [usize; 2],
    },
    /// No pixel has a value in both.
    #[error("{} and {}: no pixel has a value in both; check that the maps (and the mask) belong together", .a.display(), .b.display())]
    Nothing {
        /// The first map.
        a: PathBuf,
        /// The other.
        b: PathBuf,
    },
}

/// Compares two maps. Pixels that are 0 in every channel of either map (unsolved), not finite, or outside the mask do not
/// count.
///
/// # Errors
/// Where a file cannot be read, sizes differ, or no pixel counts.
pub fn run(options: &Options) -> Result<Comparison, CompareError> {
    let (a, b) = (Source::open(&options.a)?, Source::open(&options.b)?);
    check_size(&options.a, a.size(), &options.b, b.size())?;
    let mask = options.mask.as_ref().map(|path| read_mask(path)).transpose()?;
    if let (Some(path), Some(mask)) = (&options.mask, &mask) {
        check_size(&options.a, a.size(), path, [mask.width, mask.height])?;
    }
    let kind = options.kind.unwrap_or_else(|| guess_kind(&a, &b));
    let (a, b) = (a.map(kind)?, b.map(kind)?);
    let mask = mask.as_ref().map(|mask| &mask.data[..]);
    let (places, pairs) = counted_pairs(&a.data, &b.data, mask);
    let inside = mask.map_or(a.data.len(), |mask| mask.iter().filter(|inside| **inside).count());
    let left_out = (inside - pairs.len()) as u64;
    let figures = match kind {
        Kind::Normal => compare_normals(&pairs).map(Figures::Normal),
        Kind::Color => {
            compare_colors(&ColorPairs { width: a.width, places, pairs }).map(Figures::Color)
        }
    };
    let nothing = || CompareError::Nothing { a: options.a.clone(), b: options.b.clone() };
    Ok(Comparison { figures: figures.ok_or_else(nothing)?, left_out })
}

/// What maps hold that nobody named: what the first file's name says, or the second's, else what their numbers say.
fn guess_kind(a: &Source, b: &Source) -> Kind {
    let named = kind_of_name(a.path()).or_else(|| kind_of_name(b.path()));
    named.unwrap_or_else(|| match [a.suggests(), b.suggests()] {
        [Suggestion::Sure(kind), _] | [_, Suggestion::Sure(kind)] => kind,
        [Suggestion::Likely(a), Suggestion::Likely(b)] if a == b => a,
        _ => Kind::Normal,
    })
}

/// Normals or colours, where a file's name says so.
fn kind_of_name(path: &Path) -> Option<Kind> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    if name.contains("normal") {
        return Some(Kind::Normal);
    }
    let color = ["albedo", "color", "colour"].iter().any(|word| name.contains(word));
    color.then_some(Kind::Color)
}

/// A pixel of both maps.
pub type Pair = ([f64; 3], [f64; 3]);

fn has_value(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|value| value.is_finite()) && pixel.iter().any(|value| *value != 0.0)
}

fn is_unit(pixel: &[f32; 3]) -> bool {
    (pixel.iter().map(|value| value * value).sum::<f32>() - 1.0).abs() < 0.01
}

/// The pixels inside the mask with a value in both maps: their places and values.
fn counted_pairs(a: &[[f32; 3]], b: &[[f32; 3]], mask: Option<&[bool]>) -> (Vec<usize>, Vec<Pair>) {
    let inside = |k: usize| mask.is_none_or(|mask| mask[k]);
    let all = a.iter().zip(b).enumerate().filter(|(k, _)| inside(*k));
    all.filter(|(_, (a, b))| has_value(a) && has_value(b))
        .map(|(k, (a, b))| (k, (a.map(f64::from), b.map(f64::from))))
        .unzip()
}

fn check_size(
    a: &Path,
    a_size: [usize; 2],
    b: &Path,
    b_size: [usize; 2],
) -> Result<(), CompareError> {
    if a_size == b_size {
        return Ok(());
    }
    Err(CompareError::Size { a: a.to_owned(), a_size, b: b.to_owned(), b_size })
}

/// Reads a map that says by its name or its numbers what it holds.
///
/// # Errors
/// Where the file cannot be read or is no map.
pub fn read_map(path: &Path) -> Result<Image<[f32; 3]>, CompareError> {
    let source = Source::open(path)?;
    let kind = guess_kind(&source, &source);
    source.map(kind)
}
