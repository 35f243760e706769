use super::{Pair, percentile};
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

/// Angles between two normal maps, degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NormalFigures {
    /// Mean.
    pub mean_deg: f64,
    /// Median.
    pub median_deg: f64,
    /// Root mean square.
    pub rms_deg: f64,
    /// 95 % are below.
    pub p95_deg: f64,
    /// Largest.
    pub max_deg: f64,
    /// Pixels that counted.
    pub pixels: u64,
}

/// The angle between two vectors of any length, degrees. By atan2, since acos loses everything below 0.02 degrees to
/// rounding in float32 data.
pub fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (Vector3::from(a), Vector3::from(b));
    a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
}

/// Figures over pixels that have a normal in both maps; `None` of nothing.
pub fn compare_normals(pairs: &[Pair]) -> Option<NormalFigures> {
    let mut angles: Vec<f64> = pairs.par_iter().map(|(a, b)| angle_deg(*a, *b)).collect();
    angles.par_sort_unstable_by(f64::total_cmp);
    let count = angles.len() as f64;
    Some(NormalFigures {
        median_deg: percentile(&angles, 0.5)?,
        p95_deg: percentile(&angles, 0.95)?,
        max_deg: *angles.last()?,
        mean_deg: angles.iter().sum::<f64>() / count,
        rms_deg: (angles.iter().map(|angle| angle * angle).sum::<f64>() / count).sqrt(),
        pixels: angles.len() as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilted(degrees: f64) -> [f64; 3] {
        [degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()]
    }

    #[test]
    fn angles_are_right_from_tiny_to_opposite() {
        for degrees in [0.0, 1e-9, 1e-5, 0.01, 1.0, 45.0, 90.0, 179.999_999, 180.0] {
            let found = angle_deg([0.0, 0.0, 2.5], tilted(degrees));
            assert!((found - degrees).abs() <= 1e-13 + 1e-12 * degrees, "{degrees}: {found}");
        }
    }

    #[test]
    fn figures_of_a_known_set() {
        let pairs: Vec<Pair> =
            [1.0, 2.0, 3.0, 4.0].map(|degrees| ([0.0, 0.0, 1.0], tilted(degrees))).to_vec();
        let found = compare_normals(&pairs).unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(found.mean_deg, 2.5);
        near(found.median_deg, 2.5);
        near(found.rms_deg, 7.5f64.sqrt());
        near(found.p95_deg, 3.85);
        near(found.max_deg, 4.0);
        assert_eq!(found.pixels, 4);
        assert_eq!(compare_normals(&[]), None);
    }
}
