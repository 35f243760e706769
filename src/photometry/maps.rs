//! What comes out of the kernels, as pictures.

use super::Outcome;
use weavelight_calibration::description::{Cfa, Image};

/// The solved maps, on the sensor's own grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    /// Unit normals, rig frame; zero where unsolved.
    pub normal: Image<[f32; 3]>,
    /// Albedo; zero where unsolved.
    pub albedo: Albedo,
    /// Expected RMS of the total angular error, degrees; zero where unsolved.
    pub expected_error_deg: Image<f32>,
    /// What became of each photosite.
    pub outcome: Image<Outcome>,
    /// How many of each.
    pub counts: Counts,
}

/// Albedo as the layout of the frames has it, relative to a perfect white diffuser under each light's own colour.
#[derive(Clone, Debug, PartialEq)]
pub enum Albedo {
    /// Of each photosite under its own filter.
    Mosaic(Image<f32>, Cfa),
    /// Without filters.
    Grey(Image<f32>),
    /// R, G, B of every pixel.
    Rgb(Image<[f32; 3]>),
}

/// How many photosites took which way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Per [`Outcome`], in the order of its variants.
    pub outcomes: [usize; OUTCOMES],
    /// At least one sample clipped.
    pub saturated: usize,
    /// Sum over solved photosites of the residual's mean square.
    pub residual_squares: f64,
}

/// Variants of [`Outcome`].
pub const OUTCOMES: usize = 9;

impl Counts {
    /// How many photosites came to `outcome`.
    pub fn of(&self, outcome: Outcome) -> usize {
        self.outcomes[outcome as usize]
    }

    /// How many have a normal.
    pub fn solved(&self) -> usize {
        self.of(Outcome::Fitted) + self.robust()
    }

    /// How many the subset test changed.
    pub fn robust(&self) -> usize {
        self.of(Outcome::Shadow) + self.of(Outcome::Highlight) + self.of(Outcome::Other)
    }

    /// Root mean square of the residuals of all solved photosites, in units of albedo; 0 where nothing is solved.
    pub fn residual_rms(&self) -> f64 {
        match self.solved() {
            0 => 0.0,
            solved => (self.residual_squares / solved as f64).sqrt(),
        }
    }

    /// Counts a row.
    pub(crate) fn add_row(&mut self, outcome: &[Outcome], residual: &[f32]) {
        // One pass per variant: each compares bytes, a vector at a time.
        for (variant, count) in self.outcomes.iter_mut().enumerate() {
            *count += outcome.iter().filter(|outcome| **outcome as usize == variant).count();
        }
        // Sixteen sums that do not wait for each other, always the same ones.
        let (groups, rest) = residual.as_chunks::<16>();
        let mut sums = [0.0_f64; 16];
        for group in groups {
            sums.iter_mut().zip(group).for_each(|(sum, r)| *sum += f64::from(*r) * f64::from(*r));
        }
        let rest: f64 = rest.iter().map(|r| f64::from(*r) * f64::from(*r)).sum();
        self.residual_squares += sums.iter().sum::<f64>() + rest;
    }

    /// Adds the counts of another part of the picture.
    pub(crate) fn add(&mut self, other: &Counts) {
        self.outcomes.iter_mut().zip(other.outcomes).for_each(|(sum, n)| *sum += n);
        self.saturated += other.saturated;
        self.residual_squares += other.residual_squares;
    }
}

/// True where an outcome comes with a normal.
pub fn is_solved(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Fitted | Outcome::Shadow | Outcome::Highlight | Outcome::Other)
}
