//! The subset test of a block: two searches, the first with weights that no fit has spoilt, the second with those of the
//! survivors' fit; then the weighted solution of what is left. The reference says the same in
//! `reference_robust`.

use multiversion::multiversion;

use super::block::{Block, LANES, Lanes, ZERO, larger};
use super::light_set::LightSet;
use super::method::{DARK_SHARE, MAX_LIGHTS, MOST_LIGHTS_EXACT, SEARCH_SAMPLES};
use super::normal_equations::{Weighting, accumulate, improve};
use super::row::Outcome;
use super::subset::{SubsetSearch, WIDE, Whitened, best_subset};
use super::tighten::tighten;
use super::weighted::{Weighted, finish};

/// Buffers of the subset test.
#[derive(Default)]
pub(crate) struct RobustSolver {
    samples: Whitened,
    search: SubsetSearch,
}

impl RobustSolver {
    /// Solves every photosite of a block by the subset test; writes the outcomes into the surface.
    pub(crate) fn solve(&mut self, block: &mut Block) -> Weighted {
        first_weights(block, &medians(block));
        let dropped = self.search(block);
        block.keep_others(&dropped);
        let mut g = [ZERO; 3];
        for weighting in [Weighting::Kept, Weighting::Noise] {
            let sums = accumulate(block, &g, weighting);
            improve(&mut g, &sums);
        }
        block.readmit();
        accumulate(block, &g, Weighting::Noise);
        let dropped = self.search(block);
        block.keep_others(&dropped);
        let sums = accumulate(block, &g, Weighting::Kept);
        improve(&mut g, &sums);
        let sums = accumulate(block, &g, Weighting::Noise);
        let (inverse, condition_squared) = improve(&mut g, &sums);
        let mut solved = finish(block, &g, &inverse, &condition_squared);
        judge(block, &dropped, &mut solved);
        solved
    }

    fn search(&mut self, block: &Block) -> [LightSet; LANES] {
        let mut dropped = [LightSet::NONE; LANES];
        for first in (0..block.len).step_by(WIDE) {
            self.samples.take(block, first);
            let found = if block.sample.len() <= MOST_LIGHTS_EXACT {
                best_subset(&mut self.search, &self.samples).map(LightSet::from)
            } else {
                tighten(&self.samples)
            };
            dropped[first..first + WIDE].copy_from_slice(&found);
        }
        dropped
    }
}

/// 1 / var at the median sample; samples in shadow are set aside.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn first_weights(block: &mut Block, median: &Lanes) {
    let least = block.least_variance();
    let mut bright = ZERO;
    for sample in &block.sample {
        for k in 0..LANES {
            let counts = sample.y[k] > DARK_SHARE as f32 * median[k];
            bright[k] += if counts { sample.usable[k] } else { 0.0 };
        }
    }
    for sample in &mut block.sample {
        for k in 0..LANES {
            let variance = larger(sample.variance(k, median[k]), least[k]);
            let few = bright[k] < SEARCH_SAMPLES as f32;
            let counts = few | (sample.y[k] > DARK_SHARE as f32 * median[k]);
            sample.weight[k] = if counts { sample.usable[k] / variance } else { 0.0 };
        }
    }
}

/// The middle usable sample, the upper one of two.
fn medians(block: &Block) -> Lanes {
    let mut median = ZERO;
    let mut values = [0.0_f32; MAX_LIGHTS];
    for k in 0..block.len {
        let mut count = 0;
        for sample in block.sample.iter().filter(|sample| sample.usable[k] > 0.0) {
            values[count] = sample.y[k];
            count += 1;
        }
        if count > 0 {
            median[k] = *values[..count].select_nth_unstable_by(count / 2, f32::total_cmp).1;
        }
    }
    median
}

/// Which samples of each photosite were dropped, and what they have in common.
fn judge(block: &Block, dropped: &[LightSet; LANES], solved: &mut Weighted) {
    for k in 0..block.len {
        solved.surface.dropped[k] = dropped[k];
        let (mut dark, mut bright) = (false, false);
        for (_, sample) in block.sample.iter().enumerate().filter(|&(i, _)| dropped[k].contains(i))
        {
            let above = sample.y[k] > solved.surface.predicted(sample, k);
            bright |= above;
            dark |= !above;
        }
        solved.surface.outcome[k] = match (dark, bright) {
            (true, false) => Outcome::Shadow,
            (false, true) => Outcome::Highlight,
            (true, true) => Outcome::Other,
            (false, false) if solved.fits(k) => Outcome::Fitted,
            (false, false) => Outcome::Other,
        };
    }
}
