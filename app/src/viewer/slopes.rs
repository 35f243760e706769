//! How steep a cloth is: the distribution of slopes, and the angles between two solutions.

use crate::viewer::maps::normal_of;
use crate::viewer::pyramid::Pyramid;
use rayon::prelude::*;

/// Degrees from straight up: one count a degree.
pub const DEGREES: usize = 90;

/// Angles and how often they occur.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Photosites by angle: entry k holds k to k + 1 degrees.
    pub counts: Vec<u64>,
    /// Mean angle, degrees.
    pub mean_deg: f64,
    /// Half of the photosites lie below, degrees.
    pub median_deg: f64,
    /// 95 of 100 photosites lie below, degrees.
    pub p95_deg: f64,
}

/// Slopes of a surface; `None` where nothing is solved.
pub fn of_surface(surface: &Pyramid) -> Option<Distribution> {
    distribution(surface, |x, y| {
        let (n, _) = normal_of(surface.texel(x, y)?)?;
        Some(n[0].hypot(n[1]).atan2(n[2]).to_degrees())
    })
}

/// Angles between the normals of two surfaces of one size; `None` where none is solved in both.
pub fn between(a: &Pyramid, b: &Pyramid) -> Option<Distribution> {
    distribution(a, |x, y| {
        let ((n, _), (m, _)) = (normal_of(a.texel(x, y)?)?, normal_of(b.texel(x, y)?)?);
        let (n, m) = (nalgebra::Vector3::from(n), nalgebra::Vector3::from(m));
        Some(n.cross(&m).norm().atan2(n.dot(&m)).to_degrees())
    })
}

/// Angles counted in hundredths of a degree, so that the median is one.
const FINE: usize = 100;

fn distribution(
    surface: &Pyramid,
    angle_deg: impl Fn(usize, usize) -> Option<f32> + Sync,
) -> Option<Distribution> {
    let [width, height] = surface.size();
    let bins = 180 * FINE;
    let count_row = |mut bins: Vec<u64>, y: usize| {
        for angle in (0..width).filter_map(|x| angle_deg(x, y)) {
            let last = bins.len() - 1;
            bins[((angle * FINE as f32) as usize).min(last)] += 1;
        }
        bins
    };
    let add = |mut a: Vec<u64>, b: Vec<u64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let fine =
        (0..height).into_par_iter().fold(|| vec![0; bins], count_row).reduce(|| vec![0; bins], add);
    let total: u64 = fine.iter().sum();
    let degrees = |bin: usize| (bin as f64 + 0.5) / FINE as f64;
    let sum: f64 = fine.iter().enumerate().map(|(bin, n)| degrees(bin) * *n as f64).sum();
    let below = |share: f64| {
        let mut seen = 0;
        let reached = |n: &u64| {
            seen += n;
            seen as f64 >= share * total as f64
        };
        degrees(fine.iter().position(reached).unwrap_or(0))
    };
    (total > 0).then(|| Distribution {
        counts: fine.chunks(FINE).take(DEGREES).map(|degree| degree.iter().sum()).collect(),
        mean_deg: sum / total as f64,
        median_deg: below(0.5),
        p95_deg: below(0.95),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::maps::surface;

    fn tilted(degrees: f32) -> [f32; 3] {
        [degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()]
    }

    #[test]
    fn slopes_are_counted_by_degree() {
        let steep = |k: usize| if k < 10 { [0.0; 3] } else { tilted((k % 4) as f32 * 10.0 + 0.5) };
        let found = of_surface(&surface([20, 20], &steep, &|_| 0.0)).unwrap();
        assert_eq!(found.counts.iter().sum::<u64>(), 390);
        assert_eq!([0, 10, 20, 30].map(|k| found.counts[k] > 90), [true; 4]);
        // Half precision.
        assert!((found.median_deg - 20.5).abs() < 0.1 && (found.p95_deg - 30.5).abs() < 0.1);
        assert!((found.mean_deg - 15.5).abs() < 0.3, "{}", found.mean_deg);
    }

    #[test]
    fn surfaces_are_compared_where_both_are_solved() {
        let a = surface([8, 8], &|_| tilted(5.0), &|_| 0.0);
        let b = surface([8, 8], &|k| if k == 0 { [0.0; 3] } else { tilted(7.0) }, &|_| 0.0);
        let found = between(&a, &b).unwrap();
        assert!((found.mean_deg - 2.0).abs() < 0.06, "{}", found.mean_deg);
        assert_eq!(found.counts.iter().sum::<u64>(), 63);
        let nothing = surface([8, 8], &|_| [0.0; 3], &|_| 0.0);
        assert_eq!((of_surface(&nothing), between(&a, &nothing)), (None, None));
    }
}
