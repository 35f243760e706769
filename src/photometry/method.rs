//! Which estimator, and the numbers that define each of them for the reference and the fast path alike.

/// How a photosite is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// Plain least squares: every usable sample, all of equal weight.
    LeastSquares,
    /// Weighted by the noise model at the fitted value; lights behind the surface left out; no test for outliers.
    Weighted,
    /// Weighted, with the subset test on every photosite.
    Robust,
    /// Weighted, with the subset test where the residual asks for it.
    #[default]
    Auto,
}

/// Most lights of a rig.
pub const MAX_LIGHTS: usize = 64;

/// Weighted solves after the plain start; each takes its weights from the fit before it.
pub(crate) const REWEIGHTINGS: usize = 2;

/// The plain start of a weighted solve leaves out samples below this share of the photosite's brightest: at a steep
/// tilt nearly half of the lights stand behind the surface and would pull the start far off.
pub(crate) const START_LEVEL: f64 = 0.05;

/// Fewest samples that such a start may rest on.
pub(crate) const START_SAMPLES: usize = 4;

/// Whether a light counts as in front of the surface: it does where the fit predicts a signal. Where the fit predicts
/// none, a sample well above the noise floor (in standard deviations) still shows that the light does arrive, unless the
/// fit is so far behind the surface that noise cannot explain it: by this share of the brightest sample and this many
/// standard deviations of it.
pub(crate) const LIT_ABOVE_FLOOR: f64 = 3.0;
pub(crate) const BEHIND_LEVEL: f64 = 0.02;
pub(crate) const BEHIND_DEVIATIONS: f64 = 3.0;

/// The length of a noisy vector is longer than the vector: albedo is less by half the relative variance across the
/// normal. At most this much is taken off.
pub(crate) const MOST_LENGTHENING: f64 = 0.5;

/// Light vectors of a larger condition number count as lying in a plane: float32 samples carry no third component then.
pub(crate) const COPLANAR_CONDITION: f64 = 1e5;

/// Least standard deviation of a sample relative to the photosite's brightest: no light field is known better, and it
/// keeps weights finite where the noise model says zero.
pub(crate) const RELATIVE_FLOOR: f64 = 1e-5;
