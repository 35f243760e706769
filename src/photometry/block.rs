//! Photosites side by side: a block holds 32 of them, every quantity an array over its lanes, so that each loop over
//! lanes becomes vector instructions of whatever width the processor has.
//!
//! Where a product is added to something, that is a fused `mul_add`, never left to the compiler: the same operations in the
//! same order on every lane, hence the same bits on every processor. (One without the instruction computes it in software:
//! slow, but x86 has had it since 2013 and ARM since its 64 bits.)

use std::ops::Range;

use super::light_set::LightSet;
use super::method::{RELATIVE_FLOOR, START_LEVEL};
use super::pieces::Pieces;
use super::row::{RowInput, VarianceModel};

/// Photosites of a block.
pub(crate) const LANES: usize = 16;

/// One number a photosite.
pub(crate) type Lanes = [f32; LANES];

/// Zero in every lane.
pub(crate) const ZERO: Lanes = [0.0; LANES];

/// Up to 32 photosites of one row, which need not be neighbours.
#[derive(Default)]
pub(crate) struct Block {
    /// Photosites held; the lanes beyond are padding without a usable sample.
    pub(crate) len: usize,
    /// Whether the lanes hold neighbours.
    neighbours: bool,
    /// Where they stand in the row.
    pub(crate) column: [usize; LANES],
    /// The brightest usable sample.
    pub(crate) level: Lanes,
    /// Samples above [`START_LEVEL`] of it.
    pub(crate) bright: Lanes,
    pub(crate) sample: Vec<Sample>,
    /// Samples of neighbours that are fewer than the lanes.
    pub(crate) padded: Vec<Lanes>,
    /// Columns of neighbours that have not been solved.
    pub(crate) refused: Vec<usize>,
    /// Parity of the first column for which the noise models stand, where these are not scaled.
    noise_of: Option<usize>,
}

/// What a block knows of one light. Aligned, or every vector would straddle two cache lines.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Sample {
    /// y, zero where unusable.
    pub(crate) y: Lanes,
    /// 1 where y is finite, else 0.
    pub(crate) finite: Lanes,
    /// 1 where y takes part, else 0: finite and not withdrawn by the subset test.
    pub(crate) usable: Lanes,
    /// Light vector in units of [`Pieces::unit`].
    pub(crate) light: [Lanes; 3],
    /// Weight of the latest solve.
    pub(crate) weight: Lanes,
    /// The noise model of each photosite, scaled as its gain maps ask.
    pub(crate) shot: Lanes,
    pub(crate) floor: Lanes,
    pub(crate) kappa: Lanes,
    /// Of even and odd columns.
    variance: [VarianceModel; 2],
}

impl Block {
    /// Makes room for the lights of `input`.
    pub(crate) fn reset(&mut self, input: &RowInput) {
        let blank = Sample {
            y: ZERO,
            finite: ZERO,
            usable: ZERO,
            light: [ZERO; 3],
            weight: ZERO,
            shot: ZERO,
            floor: ZERO,
            kappa: ZERO,
            variance: [VarianceModel::default(); 2],
        };
        self.sample.resize(input.field.lights, blank);
        for (sample, variance) in self.sample.iter_mut().zip(input.variance) {
            sample.variance = variance.map(|model| model.clean());
        }
        self.noise_of = None;
    }

    /// Takes the place of neighbours.
    #[inline(always)]
    pub(crate) fn place(&mut self, columns: &Range<usize>) {
        self.len = columns.len();
        self.neighbours = true;
        for k in 0..LANES {
            self.column[k] = columns.start + k;
        }
    }

    /// Loads what the neighbours' way does not take from the row itself.
    #[inline(always)]
    pub(crate) fn load(&mut self, input: &RowInput, columns: &Range<usize>) {
        if columns.len() < LANES {
            self.pad(input, columns);
        }
        match input.noise_scale {
            Some(scale) => self.set_noise(columns.start, &scale[columns.clone()]),
            None if self.noise_of == Some(columns.start & 1) => {}
            None => self.set_noise(columns.start, &[]),
        }
        self.noise_of = input.noise_scale.is_none().then_some(columns.start & 1);
    }

    /// Noise models of neighbours, whose scale is 1 where it is not given.
    #[inline(never)]
    fn set_noise(&mut self, start: usize, scale: &[f32]) {
        for sample in &mut self.sample {
            for k in 0..LANES {
                sample.set_noise(k, start + k, scale.get(k).copied().unwrap_or(1.0));
            }
        }
    }

    /// Samples of neighbours that do not fill the lanes.
    #[inline(never)]
    fn pad(&mut self, input: &RowInput, columns: &Range<usize>) {
        self.padded.resize(input.signal.len(), ZERO);
        for (padded, signal) in self.padded.iter_mut().zip(input.signal) {
            *padded = [f32::NAN; LANES];
            padded[..columns.len()].copy_from_slice(&signal[columns.clone()]);
        }
    }

    /// Loads photosites from anywhere in the row.
    #[inline(always)]
    pub(crate) fn gather(&mut self, input: &RowInput, pieces: &Pieces, places: &[Place]) {
        self.len = places.len();
        self.neighbours = false;
        self.noise_of = None;
        for (k, place) in places.iter().enumerate() {
            self.column[k] = place.column;
        }
        for (i, sample) in self.sample.iter_mut().enumerate() {
            let mut y = [f32::NAN; LANES];
            for (k, place) in places.iter().enumerate() {
                y[k] = input.signal[i][place.column];
                let scale = input.noise_scale.map_or(1.0, |scale| scale[place.column]);
                sample.set_noise(k, place.column, scale);
                let piece = &pieces.list[place.piece];
                let linear = &pieces.light[piece.first + i];
                let offset = (place.column - piece.start) as f32;
                for axis in 0..3 {
                    let (a, b) = (linear.at_start[axis], linear.per_column[axis]);
                    sample.light[axis][k] = b.mul_add(offset, a);
                }
            }
            sample.set(&y);
        }
        self.find_level();
    }

    /// Leaves only samples that had a weight and are not in these sets, for this solve and those to come.
    pub(crate) fn keep_others(&mut self, dropped: &[LightSet; LANES]) {
        for (i, sample) in self.sample.iter_mut().enumerate() {
            for k in 0..LANES {
                if dropped[k].contains(i) {
                    sample.weight[k] = 0.0;
                }
                sample.usable[k] = if sample.weight[k] > 0.0 { 1.0 } else { 0.0 };
            }
        }
    }

    /// Lets every finite sample take part again.
    pub(crate) fn readmit(&mut self) {
        for sample in &mut self.sample {
            sample.usable = sample.finite;
        }
    }

    /// Whether all lanes hold neighbours in a row.
    #[inline(always)]
    pub(crate) fn is_run(&self) -> bool {
        self.len == LANES && self.neighbours
    }

    /// Samples that lane `k` can use.
    pub(crate) fn usable_samples(&self, k: usize) -> usize {
        self.sample.iter().filter(|sample| sample.finite[k] > 0.0).count()
    }

    /// Lights that had a weight in the latest solve of lane `k`; neighbours keep every light.
    pub(crate) fn kept(&self, k: usize) -> LightSet {
        if self.neighbours {
            return LightSet::first(self.sample.len());
        }
        let lights = self.sample.iter().enumerate();
        lights.filter(|(_, sample)| sample.weight[k] > 0.0).map(|(i, _)| i).collect()
    }

    /// Whether no photosite has any signal.
    pub(crate) fn is_dark(&self) -> bool {
        self.level.iter().all(|&level| level == 0.0)
    }

    #[inline(always)]
    fn find_level(&mut self) {
        self.level = ZERO;
        for sample in &self.sample {
            for k in 0..LANES {
                self.level[k] = larger(self.level[k], sample.y[k].abs());
            }
        }
        self.bright = ZERO;
        for sample in &self.sample {
            for k in 0..LANES {
                let bright = sample.y[k] > START_LEVEL as f32 * self.level[k];
                self.bright[k] += if bright { 1.0 } else { 0.0 };
            }
        }
    }

    /// Least variance that counts, per lane.
    #[inline(always)]
    pub(crate) fn least_variance(&self) -> Lanes {
        least_variance(&self.level)
    }
}

/// Least variance that counts beside samples up to this level.
#[inline(always)]
pub(crate) fn least_variance(level: &Lanes) -> Lanes {
    let mut least = ZERO;
    for k in 0..LANES {
        let sigma = RELATIVE_FLOOR as f32 * level[k];
        least[k] = larger(sigma * sigma, f32::MIN_POSITIVE);
    }
    least
}

/// A photosite of a row and the piece that it lies on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) column: usize,
    pub(crate) piece: usize,
}

impl Sample {
    /// Gives lane `k` the noise model of its column; a scale that is not positive and finite counts as 1.
    #[inline(always)]
    fn set_noise(&mut self, k: usize, column: usize, scale: f32) {
        let scale = if scale > 0.0 && scale < f32::INFINITY { scale } else { 1.0 };
        let model = &self.variance[column & 1];
        self.shot[k] = model.shot * scale;
        self.floor[k] = model.floor * scale * scale;
        self.kappa[k] = model.kappa;
    }

    /// var(y) of lane `k` at a predicted value.
    #[inline(always)]
    pub(crate) fn variance(&self, k: usize, predicted: f32) -> f32 {
        let predicted = larger(predicted, 0.0);
        let model_error = self.kappa[k] * predicted;
        model_error.mul_add(model_error, self.shot[k].mul_add(predicted, self.floor[k]))
    }

    #[inline(always)]
    fn set(&mut self, y: &Lanes) {
        for k in 0..LANES {
            let usable = y[k].abs() < f32::INFINITY;
            self.y[k] = if usable { y[k] } else { 0.0 };
            let usable = if usable { 1.0 } else { 0.0 };
            self.finite[k] = usable;
            self.usable[k] = usable;
        }
    }
}

impl VarianceModel {
    /// Terms that are not finite or negative count as zero.
    pub(crate) fn clean(self) -> Self {
        let term = |t: f32| if t.is_finite() { t.max(0.0) } else { 0.0 };
        Self { shot: term(self.shot), floor: term(self.floor), kappa: term(self.kappa) }
    }
}

/// The larger of two numbers, the second where either is not one: a single instruction, other than `f32::max`.
#[inline(always)]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
