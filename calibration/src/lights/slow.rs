//! Slow errors: what differs from light to light and varies slowly over a sheet. Unknowns of their own, with a Gaussian prior
//! whose size the pictures tell.
//!
//! Every light has, on every sheet, a polynomial over the frame: its level (an LED that drifts), low degrees (the paper's
//! lobe, stray light) and higher ones; and one that is the same on all sheets (its own lobe, a flare). Sizes are found by
//! MacKay's fixed point ("Bayesian interpolation", Neural Computation 4(3), 1992): the square sum of a kind's coefficients
//! over how many of them the pictures determine, with a few more that a good bench is known for, so that where pictures say
//! nothing (one flat sheet) it is not taken for none.

use super::basis::{degrees, legendre_products, normalised};
use super::observation::{Cell, Sheet};
use std::ops::Range;

/// Degree of the polynomials, and of those that all sheets share.
const DEGREE: usize = 5;
const FIXED_DEGREE: usize = 3;
/// Degrees that count as low.
const LOW_DEGREE: usize = 2;
/// Beyond this many lights lower degrees are enough of a load.
const MANY_LIGHTS: usize = 12;
const DEGREE_FOR_MANY: usize = 4;
const VERY_MANY_LIGHTS: usize = 24;
const DEGREE_FOR_VERY_MANY: usize = 2;
/// RMS that is thought possible: below the first they do not matter, above the last it is no white sheet.
const POSSIBLE: (f64, f64) = (1e-6, 0.05);

/// A kind of slow error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    /// One level a light and sheet.
    Drift,
    Low,
    High,
    /// The same on all sheets.
    Fixed,
}

pub(super) const GROUPS: [Group; 4] = [Group::Drift, Group::Low, Group::High, Group::Fixed];

impl Group {
    /// RMS of a good bench, and how many coefficients that knowledge is worth.
    fn usual(self) -> (f64, f64) {
        match self {
            Self::Drift => (4e-4, 1.0),
            Self::Low => (8e-4, 3.0),
            Self::High => (2e-4, 1.0),
            Self::Fixed => (4e-4, 2.0),
        }
    }
}

/// The prior of all of them.
#[derive(Clone, Debug)]
pub(super) struct SlowErrors {
    degree: usize,
    fixed_degree: usize,
    /// RMS by kind, in the order of [`GROUPS`], relative.
    pub(super) rms: [f64; 4],
}

/// What the pictures say of one kind: square sum of its coefficients in units of their shares, and how many of them they
/// determine.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    pub(super) square: f64,
    pub(super) determined: f64,
}

impl SlowErrors {
    pub(super) fn for_lights(lights: usize) -> Self {
        let degree = match lights {
            lights if lights <= MANY_LIGHTS => DEGREE,
            lights if lights <= VERY_MANY_LIGHTS => DEGREE_FOR_MANY,
            _ => DEGREE_FOR_VERY_MANY,
        };
        let rms = GROUPS.map(|group| group.usual().0);
        Self { degree, fixed_degree: FIXED_DEGREE.min(degree), rms }
    }

    /// Shared out over the kinds as on a usual bench.
    pub(super) fn set_total(&mut self, rms: f64) {
        let usual = GROUPS.map(|group| group.usual().0);
        let total = usual.iter().map(|rms| rms * rms).sum::<f64>().sqrt();
        self.rms = usual.map(|part| part / total * rms);
    }

    /// RMS of all together, the level aside: it leaves a sheet as it is.
    pub(super) fn total(&self) -> f64 {
        self.rms[1..].iter().map(|rms| rms * rms).sum::<f64>().sqrt()
    }

    /// Coefficients of one light on one sheet, by degree from 0 on.
    pub(super) fn per_light(&self) -> usize {
        degrees(0, self.degree).count()
    }

    /// Which of them a light has once more, the same for all sheets.
    pub(super) fn fixed(&self) -> Range<usize> {
        1..degrees(0, self.fixed_degree).count()
    }

    /// Their basis in a cell.
    pub(super) fn at(&self, sheet: &Sheet, cell: &Cell) -> Vec<f64> {
        legendre_products(normalised(cell.place, sheet.grid), 0, self.degree)
    }

    fn group_of(degree: usize) -> Group {
        match degree {
            0 => Group::Drift,
            1..=LOW_DEGREE => Group::Low,
            _ => Group::High,
        }
    }

    /// Kind of every coefficient of a light on a sheet, and its share of the kind's variance: the lower the degree, the larger.
    pub(super) fn shares(&self) -> Vec<(Group, f64)> {
        let shares = degrees(0, self.degree).map(|(a, b)| {
            (Self::group_of(a + b), f64::from(u32::try_from((a + b).max(1)).unwrap_or(1)).powi(-2))
        });
        normalised_shares(&shares.collect::<Vec<_>>())
    }

    /// The same for those that all sheets share.
    pub(super) fn fixed_shares(&self) -> Vec<(Group, f64)> {
        let shares = degrees(1, self.fixed_degree)
            .map(|(a, b)| (Group::Fixed, f64::from(u32::try_from(a + b).unwrap_or(1)).powi(-2)));
        normalised_shares(&shares.collect::<Vec<_>>())
    }

    fn variance(&self, (group, share): (Group, f64)) -> f64 {
        self.rms[group as usize].powi(2) * share
    }

    /// 1 / variance of every coefficient of a light on a sheet before the pictures.
    pub(super) fn precision(&self) -> Vec<f64> {
        self.shares().into_iter().map(|share| self.variance(share).recip()).collect()
    }

    /// The same for those that all sheets share.
    pub(super) fn fixed_precision(&self) -> Vec<f64> {
        self.fixed_shares().into_iter().map(|share| self.variance(share).recip()).collect()
    }

    /// Adds a coefficient's posterior mean and variance to what is known of its kind.
    pub(super) fn learn(
        &self,
        evidence: &mut [Evidence; 4],
        (group, share): (Group, f64),
        mean: f64,
        variance: f64,
    ) {
        let of = &mut evidence[group as usize];
        of.square += mean * mean / share;
        of.determined += (1.0 - variance / self.variance((group, share))).clamp(0.0, 1.0);
    }

    /// Takes the sizes that the pictures make most probable. What is not seen of low degrees is thought as large as what is
    /// seen of the higher ones says.
    pub(super) fn adopt(&mut self, evidence: &[Evidence; 4]) {
        let size = |group: Group, usual: f64| {
            let Evidence { square, determined } = evidence[group as usize];
            let weight = group.usual().1;
            let variance = (square + weight * usual * usual) / (determined + weight);
            variance.sqrt().clamp(POSSIBLE.0, POSSIBLE.1)
        };
        let high = size(Group::High, Group::High.usual().0);
        let low = size(Group::Low, Group::Low.usual().0.max(1.6 * high));
        let drift = size(Group::Drift, Group::Drift.usual().0);
        let fixed = size(Group::Fixed, Group::Fixed.usual().0);
        self.rms = [drift, low, high, fixed];
    }
}

/// Shares of a kind sum to 1.
fn normalised_shares(shares: &[(Group, f64)]) -> Vec<(Group, f64)> {
    let total = |group: Group| {
        shares.iter().filter(|(other, _)| *other == group).map(|(_, share)| share).sum::<f64>()
    };
    shares.iter().map(|(group, share)| (*group, share / total(*group))).collect()
}
