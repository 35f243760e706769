//! Photosites side by side: a block holds 32 of them, every quantity an array over its lanes, so that each loop over
//! lanes becomes vector instructions of whatever width the processor has.
//!
//! Multiplications and additions are written out, never fused: the same operations in the same order on every lane, hence
//! the same bits on every processor.

use std::ops::Range;

use super::method::{RELATIVE_FLOOR, START_LEVEL};
use super::pieces::{Piece, Pieces};
use super::row::{RowInput, VarianceModel};

/// Photosites of a block.
pub(crate) const LANES: usize = 32;

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
    /// Whether at an odd column (the row's second colour filter).
    pub(crate) odd: [u32; LANES],
    pub(crate) noise_scale: Lanes,
    /// The brightest usable sample.
    pub(crate) level: Lanes,
    /// Samples above [`START_LEVEL`] of it.
    pub(crate) bright: Lanes,
    pub(crate) sample: Vec<Sample>,
}

/// What a block knows of one light.
#[derive(Clone)]
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
    pub(crate) variance: [VarianceModel; 2],
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
            variance: [VarianceModel::default(); 2],
        };
        self.sample.resize(input.field.lights, blank);
        for (sample, variance) in self.sample.iter_mut().zip(input.variance) {
            sample.variance = variance.map(|model| model.clean());
        }
    }

    /// Loads neighbours: columns `start..start + len` of a piece.
    #[inline(always)]
    pub(crate) fn load(
        &mut self,
        input: &RowInput,
        pieces: &Pieces,
        piece: &Piece,
        columns: Range<usize>,
    ) {
        let start = columns.start;
        self.len = columns.len();
        self.neighbours = true;
        for k in 0..LANES {
            self.column[k] = start + k;
            self.odd[k] = ((start + k) & 1) as u32;
        }
        self.noise_scale = [1.0; LANES];
        if let Some(scale) = input.noise_scale {
            copy_lanes(&mut self.noise_scale, &scale[columns.clone()]);
        }
        clean_scale(&mut self.noise_scale);
        let offset = self.offset(piece);
        for (i, sample) in self.sample.iter_mut().enumerate() {
            match <&Lanes>::try_from(&input.signal[i][columns.clone()]) {
                Ok(y) => sample.set(y),
                Err(_) => sample.set_padded(&input.signal[i][columns.clone()]),
            }
            let linear = &pieces.light[piece.first + i];
            for (axis, light) in sample.light.iter_mut().enumerate() {
                let (a, b) = (linear.at_start[axis], linear.per_column[axis]);
                for k in 0..LANES {
                    light[k] = a + b * offset[k];
                }
            }
        }
        self.find_level();
    }

    /// Loads photosites from anywhere in the row.
    pub(crate) fn gather(&mut self, input: &RowInput, pieces: &Pieces, places: &[Place]) {
        self.len = places.len();
        self.neighbours = false;
        for (k, place) in places.iter().enumerate() {
            self.column[k] = place.column;
            self.odd[k] = (place.column & 1) as u32;
            self.noise_scale[k] = input.noise_scale.map_or(1.0, |scale| scale[place.column]);
        }
        clean_scale(&mut self.noise_scale);
        for (i, sample) in self.sample.iter_mut().enumerate() {
            let mut y = [f32::NAN; LANES];
            for (k, place) in places.iter().enumerate() {
                y[k] = input.signal[i][place.column];
                let piece = &pieces.list[place.piece];
                let linear = &pieces.light[piece.first + i];
                let offset = (place.column - piece.start) as f32;
                for axis in 0..3 {
                    sample.light[axis][k] =
                        linear.at_start[axis] + linear.per_column[axis] * offset;
                }
            }
            sample.set(&y);
        }
        self.find_level();
    }

    /// Columns from the piece's start, for a block of neighbours.
    #[inline(always)]
    pub(crate) fn offset(&self, piece: &Piece) -> Lanes {
        let first = (self.column[0] - piece.start) as f32;
        let mut offset = ZERO;
        for k in 0..LANES {
            offset[k] = first + k as f32;
        }
        offset
    }

    /// Leaves only samples that had a weight and are not in these sets (bit i for light i), for this solve and those to come.
    pub(crate) fn keep_others(&mut self, dropped: &[u64; LANES]) {
        for (i, sample) in self.sample.iter_mut().enumerate() {
            for k in 0..LANES {
                if dropped[k] >> i & 1 == 1 {
                    sample.weight[k] = 0.0;
                }
                sample.usable[k] = if sample.weight[k] > 0.0 { 1.0 } else { 0.0 };
            }
        }
    }

    /// Gives every usable sample the weight 1.
    pub(crate) fn weigh_equally(&mut self) {
        for sample in &mut self.sample {
            sample.weight = sample.usable;
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

    /// Bit i is set if light i had a weight in the latest solve of lane `k`.
    pub(crate) fn kept(&self, k: usize) -> u64 {
        let lights = self.sample.iter().enumerate();
        lights.filter(|(_, sample)| sample.weight[k] > 0.0).fold(0, |kept, (i, _)| kept | 1 << i)
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
                self.level[k] = self.level[k].max(sample.y[k].abs());
            }
        }
        self.bright = ZERO;
        for sample in &self.sample {
            for k in 0..LANES {
                self.bright[k] +=
                    if sample.y[k] > START_LEVEL as f32 * self.level[k] { 1.0 } else { 0.0 };
            }
        }
    }

    /// Least variance that counts, per lane.
    #[inline(always)]
    pub(crate) fn least_variance(&self) -> Lanes {
        let mut least = ZERO;
        for k in 0..LANES {
            let sigma = RELATIVE_FLOOR as f32 * self.level[k];
            least[k] = (sigma * sigma).max(f32::MIN_POSITIVE);
        }
        least
    }
}

/// A photosite of a row and the piece that it lies on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) column: usize,
    pub(crate) piece: usize,
}

impl Sample {
    /// A block's end that the row does not fill. Kept apart, or every block would be copied once more.
    #[inline(never)]
    fn set_padded(&mut self, values: &[f32]) {
        let mut lanes = [f32::NAN; LANES];
        lanes[..values.len()].copy_from_slice(values);
        self.set(&lanes);
    }

    #[inline(always)]
    fn set(&mut self, y: &Lanes) {
        for k in 0..LANES {
            let usable = y[k].abs() < f32::INFINITY;
            self.y[k] = if usable { y[k] } else { 0.0 };
            self.finite[k] = if usable { 1.0 } else { 0.0 };
        }
        self.usable = self.finite;
    }
}

impl VarianceModel {
    /// Terms that are not finite or negative count as zero.
    pub(crate) fn clean(self) -> Self {
        let term = |t: f32| if t.is_finite() { t.max(0.0) } else { 0.0 };
        Self { shot: term(self.shot), floor: term(self.floor), kappa: term(self.kappa) }
    }
}

#[inline(always)]
fn copy_lanes(lanes: &mut Lanes, values: &[f32]) {
    match <&Lanes>::try_from(values) {
        Ok(whole) => *lanes = *whole,
        Err(_) => lanes[..values.len()].copy_from_slice(values),
    }
}

#[inline(always)]
fn clean_scale(scale: &mut Lanes) {
    for s in scale {
        *s = if *s > 0.0 && *s < f32::INFINITY { *s } else { 1.0 };
    }
}
