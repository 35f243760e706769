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

/// Weighted solves after the plain start; each takes its weights from the fit before it. The first two find which lights
/// stand behind the surface, the last settles the weights.
pub(crate) const REWEIGHTINGS: usize = 3;

/// Light vectors of a larger condition number count as lying in a plane: float32 samples carry no third component then.
pub(crate) const COPLANAR_CONDITION: f64 = 1e5;

/// Least standard deviation of a sample relative to the photosite's brightest: no light field is known better, and it
/// keeps weights finite where the noise model says zero.
pub(crate) const RELATIVE_FLOOR: f64 = 1e-5;
