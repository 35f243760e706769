//! One photosite looked at closely: which samples its normal rests on.

use super::Outcome;

/// One photosite, as the run solves it.
#[derive(Clone, Debug, PartialEq)]
pub struct Photosite {
    /// What became of it.
    pub outcome: Outcome,
    /// Unit normal, rig frame; zero where unsolved.
    pub normal: [f32; 3],
    /// Albedo under the photosite's own filter (of the grey value, for colour frames); zero where unsolved.
    pub albedo: f32,
    /// Expected RMS of the normal's total angular error, degrees; zero where unsolved.
    pub expected_error_deg: f32,
    /// Root of the residual's mean square over the lights used, in units of albedo.
    pub residual: f32,
    /// What each light says, by ascending index.
    pub samples: Vec<Sample>,
}

/// What one light says of a photosite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The light's number in the rig.
    pub light: usize,
    /// What was measured, in units of albedo times the light vector; `None` where it cannot be used.
    pub measured: Option<f32>,
    /// What normal and albedo predict; 0 where the surface turns away, `None` where it is unsolved.
    pub predicted: Option<f32>,
    /// Whether the normal rests on it.
    pub part: Part,
}

/// Whether a normal rests on a sample, and why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// It does.
    Used,
    /// Clipped, or the photosite is defective or masked.
    Unusable,
    /// The fit has the surface turned away from the light, or grazed by it: no light is expected, and what there is is within
    /// noise or far from what a surface turned so far would send. Set aside before anything is tested, so that it neither
    /// supports nor contradicts the fit.
    TurnedAway,
    /// Dropped as darker than the others predict: in shadow.
    TooDark,
    /// Dropped as brighter than the others predict: a highlight.
    TooBright,
    /// Nothing was solved.
    Unsolved,
}
