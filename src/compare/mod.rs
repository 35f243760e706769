//! Error figures between two maps: angles between normals, colour differences between albedos.

mod color;
mod normal;
mod statistics;

pub use color::{ColorFigures, compare_colors};
pub use normal::{NormalFigures, angle_deg, compare_normals};
pub use statistics::percentile;

use crate::raster::{Exr, Values, decode_picture, read_exr};
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
    /// One map, EXR with channels R, G, B (or Y).
    pub a: PathBuf,
    /// The other, of the same size.
    pub b: PathBuf,
    /// A picture that is not 0 where to compare.
    pub mask: Option<PathBuf>,
    /// What the maps hold; guessed where absent, see [`guess_kind`].
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
    Picture(#[from] crate::raster::FileError),
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] crate::files::FileError),
    /// A map without colour channels.
    #[error("{}: has no channels R, G, B and no Y; give a map as EXR", .0.display())]
    Channels(PathBuf),
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
    let (a, b) = (read_map(&options.a)?, read_map(&options.b)?);
    check_size(&options.a, [a.width, a.height], &options.b, [b.width, b.height])?;
    let mask = options.mask.as_ref().map(|path| read_mask(path)).transpose()?;
    if let (Some(path), Some(mask)) = (&options.mask, &mask) {
        check_size(&options.a, [a.width, a.height], path, [mask.width, mask.height])?;
    }
    let kind = options.kind.unwrap_or_else(|| guess_kind(&options.a, &a.data, &b.data));
    let (pairs, left_out) =
        counted_pairs(&a.data, &b.data, mask.as_ref().map(|mask| &mask.data[..]));
    let figures = match kind {
        Kind::Normal => compare_normals(&pairs).map(Figures::Normal),
        Kind::Color => compare_colors(&pairs).map(Figures::Color),
    };
    let nothing = || CompareError::Nothing { a: options.a.clone(), b: options.b.clone() };
    Ok(Comparison { figures: figures.ok_or_else(nothing)?, left_out })
}

/// What maps hold that nobody named: normals if the file's name says so, or a value is negative, or every value is a unit
/// vector; else colours.
pub fn guess_kind(path: &Path, a: &[[f32; 3]], b: &[[f32; 3]]) -> Kind {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    if name.contains("normal") {
        return Kind::Normal;
    }
    if ["albedo", "color", "colour"].iter().any(|word| name.contains(word)) {
        return Kind::Color;
    }
    let negative = a.iter().chain(b).flatten().any(|value| *value < 0.0);
    let unit = |pixel: &[f32; 3]| {
        (pixel.iter().map(|value| value * value).sum::<f32>() - 1.0).abs() < 0.01
    };
    let mut values = a.iter().chain(b).filter(|pixel| has_value(pixel)).peekable();
    let some = values.peek().is_some();
    if negative || (some && values.all(unit)) { Kind::Normal } else { Kind::Color }
}

/// A pixel of both maps.
pub type Pair = ([f64; 3], [f64; 3]);

fn has_value(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|value| value.is_finite()) && pixel.iter().any(|value| *value != 0.0)
}

/// The pixels inside the mask with a value in both maps, and how many inside lack one.
fn counted_pairs(a: &[[f32; 3]], b: &[[f32; 3]], mask: Option<&[bool]>) -> (Vec<Pair>, u64) {
    let inside = |k: usize| mask.is_none_or(|mask| mask[k]);
    let mut left_out = 0;
    let mut pairs = Vec::new();
    for (_, (a, b)) in a.iter().zip(b).enumerate().filter(|(k, _)| inside(*k)) {
        if has_value(a) && has_value(b) {
            pairs.push((a.map(f64::from), b.map(f64::from)));
        } else {
            left_out += 1;
        }
    }
    (pairs, left_out)
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

/// Reads a map: EXR with channels R, G, B, or Y as grey.
///
/// # Errors
/// Where the file cannot be read or has other channels.
pub fn read_map(path: &Path) -> Result<Image<[f32; 3]>, CompareError> {
    let exr = read_exr(path)?;
    let [r, g, b] = channels(&exr).ok_or_else(|| CompareError::Channels(path.to_owned()))?;
    let data = r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect();
    Ok(Image { width: exr.width, height: exr.height, data })
}

fn channels(exr: &Exr) -> Option<[&[f32]; 3]> {
    match (exr.channel("R"), exr.channel("G"), exr.channel("B"), exr.channel("Y")) {
        (Some(r), Some(g), Some(b), _) => Some([r, g, b]),
        (None, None, None, Some(y)) => Some([y, y, y]),
        _ => None,
    }
}

fn read_mask(path: &Path) -> Result<Image<bool>, CompareError> {
    let bytes =
        std::fs::read(path).map_err(|source| crate::files::FileError::read(path, source))?;
    let picture = decode_picture(&bytes)
        .map_err(|source| crate::raster::FileError::Content { path: path.to_owned(), source })?;
    let data = match &picture.values {
        Values::U8(values) => not_black(values, picture.channels),
        Values::U16(values) => not_black(values, picture.channels),
        Values::F32(values) => not_black(values, picture.channels),
    };
    Ok(Image { width: picture.width, height: picture.height, data })
}

fn not_black<T: PartialOrd + Default>(values: &[T], channels: usize) -> Vec<bool> {
    values
        .chunks_exact(channels)
        .map(|pixel| pixel.iter().any(|value| *value > T::default()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_is_guessed_from_name_then_values() {
        let check = |name: &str, pixels: &[[f32; 3]], expected: Kind| {
            assert_eq!(guess_kind(Path::new(name), pixels, pixels), expected, "{name} {pixels:?}");
        };
        check("out/normal.exr", &[[0.5, 0.5, 0.5]], Kind::Normal);
        check("albedo.exr", &[[0.0, 0.0, 1.0]], Kind::Color);
        check("a.exr", &[[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0; 3]], Kind::Normal);
        check("a.exr", &[[0.5, -0.5, 0.5]], Kind::Normal);
        check("a.exr", &[[0.5, 0.5, 0.5], [0.0, 0.0, 1.0]], Kind::Color);
        check("a.exr", &[[0.0; 3]], Kind::Color);
    }

    #[test]
    fn only_pixels_with_a_value_in_both_count() {
        let a = [[1.0, 0.0, 0.0], [0.0; 3], [f32::NAN, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        let b = [
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0],
            [0.0, f32::INFINITY, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let (pairs, left_out) = counted_pairs(&a, &b, None);
        assert_eq!((pairs.len(), left_out), (2, 3));
        let (pairs, left_out) = counted_pairs(&a, &b, Some(&[false, true, true, false, true]));
        assert_eq!((pairs.len(), left_out), (1, 2));
    }
}
