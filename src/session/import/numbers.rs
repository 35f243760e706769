//! What pictures say of their numbers, gathered over a set: encoding, primaries, and where samples clip.

use crate::instrument::Color;
use crate::raw::{self, Ceiling, Histogram, Numbers, contradictions, mixed_encodings};
use crate::session::Encoding;
use nalgebra::Matrix3;
use std::path::{Path, PathBuf};

/// Elements of two pictures' matrices that are this close are the same primaries.
const SAME_PRIMARIES: f64 = 1e-3;

/// What the pictures so far say.
#[derive(Default)]
pub(super) struct Gathered {
    pictures: Vec<(PathBuf, Numbers)>,
    histogram: Option<Histogram>,
}

impl Gathered {
    pub(super) fn add(&mut self, path: &Path, numbers: &Numbers, histogram: Option<Histogram>) {
        self.pictures.push((path.to_owned(), numbers.clone()));
        self.histogram = match (self.histogram.take(), histogram) {
            (Some(sum), Some(one)) => Some(sum.with(one)),
            (sum, one) => sum.or(one),
        };
    }

    /// Sentences for the user.
    pub(super) fn warnings(&self) -> Vec<String> {
        let pictures = || self.pictures.iter().map(|(path, numbers)| (path.as_path(), numbers));
        let mixed = self.primaries().is_err().then(|| {
            "The pictures differ in their primaries: no colour matrix is written, and colours stay those of the pictures."
                .to_owned()
        });
        let ceiling = self.ceiling().map(|ceiling| ceiling.sentence());
        let of_curves = contradictions(pictures()).into_iter().chain(mixed_encodings(pictures()));
        of_curves.chain(mixed).chain(ceiling).collect()
    }

    /// What a calibration should say of them.
    pub(super) fn color(&self) -> Color {
        // nalgebra takes columns; these are rows.
        let matrix = self.primaries().ok().flatten().map(|rows| Matrix3::from(rows).transpose());
        Color {
            camera_to_linear_srgb: matrix,
            saturation_level: self.ceiling().map(|ceiling| ceiling.level.into()),
            ..Color::default()
        }
    }

    fn ceiling(&self) -> Option<Ceiling> {
        self.histogram.as_ref()?.ceiling()
    }

    /// The matrix that all pictures share, if they say one.
    fn primaries(&self) -> Result<Option<[[f64; 3]; 3]>, Mixed> {
        let mut matrices = self.pictures.iter().map(|(_, numbers)| numbers.linear_srgb_from_rgb);
        let Some(first) = matrices.next() else { return Ok(None) };
        let same = |other: Option<[[f64; 3]; 3]>| match (first, other) {
            (None, None) => true,
            (Some(a), Some(b)) => {
                let pairs = a.as_flattened().iter().zip(b.as_flattened());
                pairs.fold(true, |same, (a, b)| same & ((a - b).abs() <= SAME_PRIMARIES))
            }
            _ => false,
        };
        if matrices.all(same) { Ok(first) } else { Err(Mixed) }
    }
}

/// Pictures of several primaries.
struct Mixed;

/// The encoding that a picture's file names, for the manifest.
pub(super) fn encoding_of(numbers: &Numbers) -> Option<Encoding> {
    numbers.encoding.map(|encoding| match encoding {
        raw::Encoding::Linear => Encoding::Linear,
        raw::Encoding::Srgb => Encoding::Srgb,
    })
}
