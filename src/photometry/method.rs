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
pub const MAX_LIGHTS: usize = 256;

/// Weighted solves after the plain start, each with the weights of the fit before it, where noise does not explain the first
/// with every sample. (Where it does, one is enough: a second lets the noise of dim samples choose their weights, which
/// biases albedo.)
pub(crate) const REWEIGHTINGS: usize = 2;

/// The plain start of such a solve leaves out samples below this share of the photosite's brightest: at a steep
/// tilt nearly half of the lights stand behind the surface and would pull the start far off.
pub(crate) const START_LEVEL: f64 = 0.05;

/// Fewest samples that such a start may rest on.
pub(crate) const START_SAMPLES: usize = 4;

/// Whether a light counts as in front of the surface: it does where the fit predicts a signal. Where the fit predicts
/// none, a sample well above the noise floor (in standard deviations) still shows that the light does arrive, unless the
/// fit is so far behind the surface that noise cannot explain it: by this share of the brightest sample and this many
/// standard deviations of it.
///
/// At 3 deviations, where one dark sample in 740 stands, twice as many clean photosites would ask for the subset test.
pub(crate) const LIT_ABOVE_FLOOR: f64 = 3.5;
pub(crate) const BEHIND_LEVEL: f64 = 0.02;
pub(crate) const BEHIND_DEVIATIONS: f64 = 3.0;

/// Where some lights may stand behind the surface, albedo comes from those that the fit predicts this many standard deviations
/// of the noise floor or more, if enough of them are left. Whether a dimmer light counts as in front depends on noise, and one
/// that counts although it is behind lengthens the vector: by 0.4 % at albedo 0.02 and 75 degrees, against 0.05 % so.
pub(crate) const CLEAR_DEVIATIONS: f64 = 2.0;

/// Normal equations only correct an earlier fit there, so a larger condition is carried than where they make it.
pub(crate) const WEIGHTED_CONDITION_SQUARED: f32 = 1e4;

/// The length of a noisy vector is longer than the vector: albedo is less by half the relative variance across the
/// normal. At most this much is taken off.
pub(crate) const MOST_LENGTHENING: f64 = 0.5;

/// Light vectors of a larger condition number count as lying in a plane: float32 samples carry no third component then.
pub(crate) const COPLANAR_CONDITION: f64 = 1e5;

/// Least standard deviation of a sample relative to the photosite's brightest: no light field is known better, and it
/// keeps weights finite where the noise model says zero.
pub(crate) const RELATIVE_FLOOR: f64 = 1e-5;

/// What dropping a sample must save of the chi-square to pay: between 3 and 4 standard deviations.
pub(crate) const DROP_PENALTY: f64 = 12.0;

/// Most samples that the exact search drops, and fewest that it leaves.
pub(crate) const MOST_DROPPED: usize = 4;
pub(crate) const FEWEST_KEPT: usize = 4;

/// Up to this many lights every subset is tried (1471 of them); beyond, thresholds are tightened step by step.
pub(crate) const MOST_LIGHTS_EXACT: usize = 14;

/// A subset must leave this much of the determinant of sum w l l^T, or the rest would nearly lie in a plane. So little,
/// because a dim sample weighs a thousand times a bright one, and up to four may go.
pub(crate) const LEAST_DETERMINANT: f64 = 1e-10;

/// The first search sets aside what is darker than this share of the photosite's median: shadow, cast or attached.
pub(crate) const DARK_SHARE: f64 = 0.1;

/// Fewest samples that the first search may start from.
pub(crate) const SEARCH_SAMPLES: usize = 5;

/// Chi-square that a good fit stays below with probability 0.999, by degrees of freedom (lights kept minus 3). No degree
/// of freedom, no test.
pub(crate) fn chi_square_limit(freedom: usize) -> f64 {
    match freedom {
        0 => f64::INFINITY,
        _ => {
            CHI_SQUARE_999.get(freedom - 1).copied().unwrap_or_else(|| chi_square_of_many(freedom))
        }
    }
}

/// The same beyond the table, to 0.001: Goldberg and Levine, "Approximate Formulas for the Percentage Points and
/// Normalization of t and chi-square", Annals of Mathematical Statistics 17, 1946.
fn chi_square_of_many(freedom: usize) -> f64 {
    /// The standard normal's quantile of 0.999.
    const Z: f64 = 3.090_232_306;
    let k = freedom as f64;
    let root = (2.0 * k).sqrt();
    let [z2, z3, z4, z5] = [Z.powi(2), Z.powi(3), Z.powi(4), Z.powi(5)];
    k + Z * root + 2.0 / 3.0 * (z2 - 1.0) + (z3 - 7.0 * Z) / (9.0 * root)
        - (6.0 * z4 + 14.0 * z2 - 32.0) / (405.0 * k)
        + (9.0 * z5 + 256.0 * z3 - 433.0 * Z) / (4860.0 * root * k)
}

#[rustfmt::skip]
const CHI_SQUARE_999: [f64; 61] = [
    10.8276, 13.8155, 16.2662, 18.4668, 20.5150, 22.4577, 24.3219, 26.1245,
    27.8772, 29.5883, 31.2641, 32.9095, 34.5282, 36.1233, 37.6973, 39.2524,
    40.7902, 42.3124, 43.8202, 45.3147, 46.7970, 48.2679, 49.7282, 51.1786,
    52.6197, 54.0520, 55.4760, 56.8923, 58.3012, 59.7031, 61.0983, 62.4872,
    63.8701, 65.2472, 66.6188, 67.9852, 69.3465, 70.7029, 72.0547, 73.4020,
    74.7449, 76.0838, 77.4186, 78.7495, 80.0767, 81.4003, 82.7204, 84.0371,
    85.3506, 86.6608, 87.9680, 89.2722, 90.5734, 91.8718, 93.1675, 94.4605,
    95.7510, 97.0388, 98.3242, 99.6072, 100.8879,
];

impl Method {
    const ALL: [Self; 4] = [Self::Auto, Self::LeastSquares, Self::Weighted, Self::Robust];

    /// As reports and the command line have it.
    pub fn name(self) -> &'static str {
        match self {
            Method::LeastSquares => "least-squares",
            Method::Weighted => "weighted",
            Method::Robust => "robust",
            Method::Auto => "auto",
        }
    }

    /// The method of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles by bisection of the incomplete gamma function; the table and the series meet without a step.
    #[test]
    fn limits_beyond_the_table_are_those_of_the_distribution() {
        assert!((chi_square_of_many(61) - 100.8879).abs() < 1e-3);
        assert!((chi_square_of_many(20) - 45.3147).abs() < 5e-3);
        for (freedom, expected) in
            [(62, 102.1662), (93, 140.8931), (128, 183.1864), (253, 328.2456)]
        {
            let found = chi_square_limit(freedom);
            assert!((found - expected).abs() < 1e-3, "{freedom}: {found}, not {expected}");
        }
        assert!((61..253).all(|k| chi_square_limit(k) < chi_square_limit(k + 1)));
    }
}
