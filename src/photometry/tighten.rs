//! Many lights have too many subsets to try. min over g of sum min(w r^2, 12) is then approached by a family of smoother
//! costs that tightens towards it, from the plain fit on.
//!
//! Graduated non-convexity with the truncated square: Yang, Antonante, Tzoumas and Carlone, "Graduated Non-Convexity for
//! Robust Spatial Perception", IEEE Robotics and Automation Letters 5(2), 2020, equations 11 to 14.

use multiversion::multiversion;

use super::light_set::LightSet;
use super::method::{DROP_PENALTY, FEWEST_KEPT};
use super::subset::{WIDE, WIDE_ZERO, Whitened, Wide, wide_times};

/// Solves from the loosest cost to the truncated square itself.
const STEPS: usize = 14;

/// Solves with the truncated square, until which samples are dropped no longer changes.
const LAST_STEPS: usize = 3;

/// From this mu on the cost counts as the truncated square.
const LAST_MU: f64 = 1e3;

/// The values of mu, loosest first.
pub(crate) struct Schedule {
    mu: f64,
    factor: f64,
    step: usize,
}

impl Schedule {
    /// Starts where the cost is convex for the largest w r^2 of the plain fit.
    pub(crate) fn from_largest_square(largest: f64) -> Self {
        let loosest = DROP_PENALTY / (2.0 * largest - DROP_PENALTY);
        let mu = if loosest > 0.0 { loosest.clamp(1e-12, LAST_MU) } else { LAST_MU };
        Self { mu, factor: (LAST_MU / mu).powf(1.0 / STEPS as f64), step: 0 }
    }
}

impl Iterator for Schedule {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let mu = self.mu;
        self.step += 1;
        self.mu = (self.mu * self.factor).min(LAST_MU);
        (self.step <= STEPS + LAST_STEPS).then_some(mu)
    }
}

/// Weight of a sample with `square` = w r^2 in the cost of `mu`, 0 to 1.
pub(crate) fn tightened_weight(square: f64, mu: f64) -> f64 {
    if square >= (mu + 1.0) / mu * DROP_PENALTY {
        0.0
    } else if square <= mu / (mu + 1.0) * DROP_PENALTY {
        1.0
    } else {
        ((DROP_PENALTY / square * mu * (mu + 1.0)).sqrt() - mu).clamp(0.0, 1.0)
    }
}

/// Per photosite the set of lights that remain outside when the cost has been tightened.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(crate) fn tighten(samples: &Whitened) -> [LightSet; WIDE] {
    let sums = samples.sums(|i| samples.used[i]);
    let mut g = wide_times(&sums.inverse(), &sums.right);
    let mut running = [true; WIDE];
    let mut schedule = largest_squares(samples, &g).map(Schedule::from_largest_square);
    for _ in 0..STEPS + LAST_STEPS {
        let mu = schedule.each_mut().map(|s| s.next().unwrap_or(LAST_MU));
        let mut left = WIDE_ZERO;
        let trim = |i: usize| {
            let residual = samples.residual(i, &g);
            let mut weight = WIDE_ZERO;
            for k in 0..WIDE {
                weight[k] = samples.used[i][k] * tightened_weight(residual[k] * residual[k], mu[k]);
            }
            weight
        };
        for i in 0..samples.y.len() {
            let weight = trim(i);
            for k in 0..WIDE {
                left[k] += if weight[k] > 0.0 { 1.0 } else { 0.0 };
            }
        }
        let sums = samples.sums(trim);
        let next = wide_times(&sums.inverse(), &sums.right);
        for k in 0..WIDE {
            let enough = left[k] >= f64::max(FEWEST_KEPT as f64, (0.5 * samples.count[k]).floor());
            running[k] &= enough && next.iter().all(|c| c[k].is_finite());
            if running[k] {
                (g[0][k], g[1][k], g[2][k]) = (next[0][k], next[1][k], next[2][k]);
            }
        }
    }
    outside(samples, &g)
}

#[inline(always)]
fn largest_squares(samples: &Whitened, g: &[Wide; 3]) -> Wide {
    let mut largest = WIDE_ZERO;
    for i in 0..samples.y.len() {
        let residual = samples.residual(i, g);
        for k in 0..WIDE {
            largest[k] = largest[k].max(residual[k] * residual[k]);
        }
    }
    largest
}

fn outside(samples: &Whitened, g: &[Wide; 3]) -> [LightSet; WIDE] {
    let mut dropped = [LightSet::NONE; WIDE];
    for i in 0..samples.y.len() {
        let residual = samples.residual(i, g);
        for k in 0..WIDE {
            let drop = samples.used[i][k] > 0.0 && residual[k] * residual[k] > DROP_PENALTY;
            dropped[k].insert_if(i, drop);
        }
    }
    dropped
}
