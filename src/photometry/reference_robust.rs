//! The subset test in plain float64: every subset refitted from scratch.

use nalgebra::{Matrix3, Vector3};

use super::light_set::LightSet;
use super::method::{
    DARK_SHARE, DROP_PENALTY, FEWEST_KEPT, LEAST_DETERMINANT, MAX_LIGHTS, MOST_DROPPED,
    MOST_LIGHTS_EXACT, SEARCH_SAMPLES, chi_square_limit,
};
use super::reference::{Samples, Solution, variance};
use super::row::Outcome;
use super::tighten::{Schedule, tightened_weight};

/// Which lights something holds for.
pub(crate) type Lights = [bool; MAX_LIGHTS];

impl Samples<'_> {
    /// Solves with the subset test: min over subsets K of chi-square without K + 12 |K|, which is the same as
    /// min over g of sum min(w r^2, 12). First with weights from the median sample, as no fit can be trusted yet, and then
    /// with weights from the fit on the survivors. `None` where a solve fails.
    pub(crate) fn robust(&self, usable: &Lights) -> Option<(Solution, Outcome)> {
        let first = self.search(&self.first_weights(usable))?;
        let g = self.reweighted(&first)?.g;
        let second = self.search(&self.weights_at(&g, usable, true))?;
        let dropped = set_of(&second.dropped);
        let solution = self.settle_albedo(Solution { dropped, ..self.reweighted(&second)? });
        let outcome = self.judge(&solution, &second);
        Some((solution, outcome))
    }

    /// 1 / var at the median sample; samples in shadow are set aside.
    fn first_weights(&self, usable: &Lights) -> [f64; MAX_LIGHTS] {
        let median = self.median(usable);
        let mut bright = *usable;
        for (bright, &y) in bright.iter_mut().zip(self.y) {
            *bright &= y > DARK_SHARE * median;
        }
        if bright.iter().filter(|&&b| b).count() < SEARCH_SAMPLES {
            bright = *usable;
        }
        let least = self.least_variance();
        let mut weights = [0.0; MAX_LIGHTS];
        for (i, model) in self.variance.iter().enumerate().filter(|&(i, _)| bright[i]) {
            weights[i] = 1.0 / variance(model, median, self.noise_scale).max(least);
        }
        weights
    }

    /// The middle usable sample, the upper one of two.
    fn median(&self, usable: &Lights) -> f64 {
        let mut values: Vec<f64> =
            self.y.iter().zip(usable).filter(|(_, u)| **u).map(|(y, _)| *y).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    }

    /// The fit without the best subset, at fixed weights.
    fn search(&self, weights: &[f64; MAX_LIGHTS]) -> Option<Search> {
        let kept = if self.lights.len() <= MOST_LIGHTS_EXACT {
            self.best_subset(weights)?
        } else {
            self.tighten(weights)?
        };
        let survivors: Lights = std::array::from_fn(|i| weights[i] > 0.0 && kept[i]);
        let dropped = std::array::from_fn(|i| weights[i] > 0.0 && !kept[i]);
        let surviving = std::array::from_fn(|i| if survivors[i] { weights[i] } else { 0.0 });
        Some(Search { g: self.solve(surviving)?.g, survivors, dropped })
    }

    /// Lights that the best subset leaves, by trying all.
    fn best_subset(&self, weights: &[f64; MAX_LIGHTS]) -> Option<Lights> {
        let all: u64 =
            (0..self.lights.len()).filter(|&i| weights[i] > 0.0).fold(0, |set, i| set | 1 << i);
        let determinant = self.normal_matrix(weights, all).determinant();
        let mut best = (f64::INFINITY, all);
        for dropped in 0..=all {
            let count = dropped.count_ones() as usize;
            let inside = dropped & !all == 0 && count <= MOST_DROPPED;
            let kept = all & !dropped;
            if !inside || count > 0 && (kept.count_ones() as usize) < FEWEST_KEPT {
                continue;
            }
            if self.normal_matrix(weights, kept).determinant() < LEAST_DETERMINANT * determinant {
                continue;
            }
            let kept_lights = LightSet::from(kept);
            let only =
                std::array::from_fn(|i| if kept_lights.contains(i) { weights[i] } else { 0.0 });
            let Some(solution) = self.solve(only) else { continue };
            let cost = self.chi_square(&solution) + DROP_PENALTY * count as f64;
            if cost < best.0 {
                best = (cost, kept);
            }
        }
        let kept = LightSet::from(best.1);
        best.0.is_finite().then(|| std::array::from_fn(|i| kept.contains(i)))
    }

    fn normal_matrix(&self, weights: &[f64; MAX_LIGHTS], set: u64) -> Matrix3<f64> {
        let lights = self.lights.iter().enumerate().filter(|&(i, _)| set >> i & 1 == 1);
        lights.fold(Matrix3::zeros(), |sum, (i, l)| sum + weights[i] * l * l.transpose())
    }

    /// sum w r^2.
    pub(crate) fn chi_square(&self, solution: &Solution) -> f64 {
        let terms =
            self.lights.iter().zip(self.y).zip(&solution.weights).filter(|(_, w)| **w > 0.0);
        terms.map(|((l, y), w)| w * (y - solution.g.dot(l)).powi(2)).sum()
    }

    /// Lights that remain when the threshold is tightened step by step, see [`Schedule`].
    fn tighten(&self, weights: &[f64; MAX_LIGHTS]) -> Option<Lights> {
        let mut g = self.solve(*weights)?.g;
        let used = weights.iter().filter(|&&w| w > 0.0).count();
        let squares = |g: &Vector3<f64>| -> [f64; MAX_LIGHTS] {
            std::array::from_fn(|i| match self.lights.get(i) {
                Some(l) if weights[i] > 0.0 => weights[i] * (self.y[i] - g.dot(l)).powi(2),
                _ => 0.0,
            })
        };
        let mut square = squares(&g);
        let schedule =
            Schedule::from_largest_square(square.iter().fold(0.0, |a: f64, b| a.max(*b)));
        for mu in schedule {
            let trimmed = std::array::from_fn(|i| weights[i] * tightened_weight(square[i], mu));
            if trimmed.iter().filter(|&&w| w > 0.0).count() < FEWEST_KEPT.max(used / 2) {
                break;
            }
            let Some(solution) = self.solve(trimmed) else { break };
            g = solution.g;
            square = squares(&g);
        }
        Some(std::array::from_fn(|i| weights[i] > 0.0 && square[i] <= DROP_PENALTY))
    }

    /// One reweighted solve on what a search left.
    fn reweighted(&self, search: &Search) -> Option<Solution> {
        let lit = self.solve(self.weights_at(&search.g, &search.survivors, true));
        lit.or_else(|| self.solve(self.weights_at(&search.g, &search.survivors, false)))
    }

    /// What the samples that were dropped have in common.
    fn judge(&self, solution: &Solution, search: &Search) -> Outcome {
        let (mut dark, mut bright) = (false, false);
        for (i, l) in self.lights.iter().enumerate().filter(|&(i, _)| search.dropped[i]) {
            let above = self.y[i] > solution.g.dot(l);
            bright |= above;
            dark |= !above;
        }
        match (dark, bright) {
            (true, false) => Outcome::Shadow,
            (false, true) => Outcome::Highlight,
            (true, true) => Outcome::Other,
            (false, false) if self.fits(solution) => Outcome::Fitted,
            (false, false) => Outcome::Other,
        }
    }

    /// Whether the chi-square is one that noise explains.
    pub(crate) fn fits(&self, solution: &Solution) -> bool {
        let used = solution.weights.iter().filter(|&&w| w > 0.0).count();
        self.chi_square(solution) <= chi_square_limit(used.saturating_sub(3))
    }
}

fn set_of(lights: &Lights) -> LightSet {
    (0..MAX_LIGHTS).filter(|&light| lights[light]).collect()
}

/// What a search found: the fit without the samples it dropped.
struct Search {
    g: Vector3<f64>,
    survivors: Lights,
    dropped: Lights,
}
