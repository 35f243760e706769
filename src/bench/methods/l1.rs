//! Least sum of absolute residuals, exactly.
//!
//! The minimum lies where three residuals vanish. From one such point to the next: leave one of the three, walk along the
//! line on which the other two stay zero to that line's minimum, a weighted median; where none of the three lines leads
//! lower, a convex sum is at its least. Bloomfield and Steiger, "Least Absolute Deviations", 1983, chapter 1.

use super::photosite::Photosite;
use nalgebra::{Matrix3, Vector3};

/// A walk must lower the sum by this share to count.
const LEAST_GAIN: f64 = 1e-12;
/// Most walks; some five times as many as are ever needed.
const MOST_WALKS: usize = 200;
/// Least determinant of three unit vectors that count as independent.
const INDEPENDENT: f64 = 1e-9;

/// argmin over g of sum |y - l . g|.
pub(super) fn least_absolute(photosite: &Photosite) -> Option<Vector3<f64>> {
    let mut active = first_three(photosite)?;
    let mut g = through(photosite, active)?;
    let mut sum = sum_absolute(photosite, &g);
    let mut stuck = 0;
    for walk in 0..MOST_WALKS {
        let leaving = walk % 3;
        match step(photosite, active, leaving, &g) {
            Some((entering, next)) if sum_absolute(photosite, &next) < sum * (1.0 - LEAST_GAIN) => {
                active[leaving] = entering;
                g = next;
                sum = sum_absolute(photosite, &g);
                stuck = 0;
            }
            _ => stuck += 1,
        }
        if stuck == 3 {
            break;
        }
    }
    Some(g)
}

/// The brightest sample and the two after it whose lights are independent.
fn first_three(photosite: &Photosite) -> Option<[usize; 3]> {
    let lights = &photosite.lights;
    let mut order: Vec<usize> = (0..lights.len()).collect();
    order.sort_by(|&a, &b| photosite.y[b].total_cmp(&photosite.y[a]));
    let first = *order.first()?;
    let across = |k: usize| lights[first].cross(&lights[k]);
    let length = |k: usize| lights[k].norm();
    let second =
        *order.iter().find(|&&k| across(k).norm() > INDEPENDENT * length(first) * length(k))?;
    let third = *order.iter().find(|&&k| {
        let volume = across(second).dot(&lights[k]).abs();
        volume > INDEPENDENT * length(first) * length(second) * length(k)
    })?;
    Some([first, second, third])
}

/// The g at which three residuals vanish.
fn through(photosite: &Photosite, active: [usize; 3]) -> Option<Vector3<f64>> {
    let rows = active.map(|i| photosite.lights[i].transpose());
    let y = Vector3::from(active.map(|i| photosite.y[i]));
    Some(Matrix3::from_rows(&rows).try_inverse()? * y)
}

fn sum_absolute(photosite: &Photosite, g: &Vector3<f64>) -> f64 {
    photosite.lights.iter().zip(&photosite.y).map(|(l, y)| (y - l.dot(g)).abs()).sum()
}

/// The minimum along the line on which the other two residuals stay zero: the light whose residual vanishes there, and
/// where.
fn step(
    photosite: &Photosite,
    active: [usize; 3],
    leaving: usize,
    g: &Vector3<f64>,
) -> Option<(usize, Vector3<f64>)> {
    let lights = &photosite.lights;
    let [a, b] = [active[(leaving + 1) % 3], active[(leaving + 2) % 3]];
    let direction = lights[a].cross(&lights[b]).try_normalize(0.0)?;
    let place = |i: usize| {
        let slope = lights[i].dot(&direction);
        let level = slope.abs() > INDEPENDENT * lights[i].norm();
        level.then(|| ((photosite.y[i] - lights[i].dot(g)) / slope, slope.abs(), i))
    };
    let others = (0..lights.len()).filter(|&i| i != a && i != b);
    let mut places: Vec<(f64, f64, usize)> = others.filter_map(place).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * places.iter().map(|(_, weight, _)| weight).sum::<f64>();
    let mut passed = 0.0;
    let (t, _, entering) = *places.iter().find(|(_, weight, _)| {
        passed += weight;
        passed >= half
    })?;
    Some((entering, g + t * direction))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Kind, photosites};
    use super::*;

    /// Every three lights tried: the definition.
    fn of_all_threes(photosite: &Photosite) -> f64 {
        let n = photosite.lights.len();
        let threes = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        let threes = threes.flat_map(|(i, j)| (j + 1..n).map(move |k| [i, j, k]));
        let sums = threes.filter_map(|three| through(photosite, three));
        sums.map(|g| sum_absolute(photosite, &g)).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn walks_end_at_the_least_of_all_threes() {
        for kind in [Kind::Clean, Kind::Noisy, Kind::Spoilt(2), Kind::Spoilt(4)] {
            for lights in [3, 4, 5, 10, 16] {
                for (photosite, _) in photosites(40, lights, kind) {
                    let found = sum_absolute(&photosite, &least_absolute(&photosite).unwrap());
                    let least = of_all_threes(&photosite);
                    assert!(
                        found <= least * (1.0 + 1e-9) + 1e-12,
                        "{kind:?}, {lights} lights: {found} above {least}"
                    );
                }
            }
        }
    }
}
