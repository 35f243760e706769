//! What a block's solve found, and how it is written to the row.

use super::block::{Block, LANES, Lanes, Sample, ZERO};
use super::light_set::LightSet;
use super::reference::MOST_ERROR_DEG;
use super::row::{Outcome, RowOutput, Support};

/// Albedo times normal of a block, with what is known about it. Light vectors are in units of `Pieces::unit`.
pub(crate) struct Surface {
    pub(crate) g: [Lanes; 3],
    /// Trace of the covariance of g across the normal.
    pub(crate) tangent_variance: Lanes,
    /// Sum of squared residuals over the lights used, and how many these are.
    pub(crate) squares: Lanes,
    pub(crate) count: Lanes,
    /// `false` where a photosite needs another path: samples missing, lights too badly conditioned for float32.
    pub(crate) carried: [bool; LANES],
    /// What the subset test says of a solved photosite.
    pub(crate) outcome: [Outcome; LANES],
    /// Samples that it dropped.
    pub(crate) dropped: [LightSet; LANES],
    /// See [`MOST_LENGTHENING`](super::method::MOST_LENGTHENING); 0 leaves the albedo as it is.
    pub(crate) most_lengthening: f32,
    /// Albedo of the lights clear of the horizon over that of all; see [`CLEAR_DEVIATIONS`](super::method::CLEAR_DEVIATIONS).
    pub(crate) albedo_share: Lanes,
}

/// |g|^2 outside this range may have lost bits to underflow or overflow: float64 takes over.
const COMFORTABLE: std::ops::Range<f32> = 1e-24..1e24;

impl Default for Surface {
    fn default() -> Self {
        Self::new([ZERO; 3], 0.0)
    }
}

impl Surface {
    /// A solution of which nothing is known yet.
    #[inline(always)]
    pub(crate) fn new(g: [Lanes; 3], most_lengthening: f64) -> Self {
        let carried = [true; LANES];
        let most_lengthening = most_lengthening as f32;
        let outcome = [Outcome::Fitted; LANES];
        Self {
            g,
            tangent_variance: ZERO,
            squares: ZERO,
            count: ZERO,
            carried,
            outcome,
            dropped: [LightSet::NONE; LANES],
            most_lengthening,
            albedo_share: [1.0; LANES],
        }
    }

    /// The signal that lane `k`'s solution predicts.
    pub(crate) fn predicted(&self, sample: &Sample, k: usize) -> f32 {
        let [lx, ly, lz] = &sample.light;
        lx[k] * self.g[0][k] + ly[k] * self.g[1][k] + lz[k] * self.g[2][k]
    }

    /// Unit normal (0 where there is none), length of g in the block's units.
    #[inline(always)]
    pub(crate) fn normal_and_length(&self) -> ([Lanes; 3], Lanes) {
        let [x, y, z] = &self.g;
        let (mut normal, mut lengths) = ([ZERO; 3], ZERO);
        for k in 0..LANES {
            let square = x[k] * x[k] + y[k] * y[k] + z[k] * z[k];
            let length = square.sqrt();
            lengths[k] = length;
            let scale = if COMFORTABLE.contains(&square) { 1.0 / length } else { 0.0 };
            normal[0][k] = x[k] * scale;
            normal[1][k] = y[k] * scale;
            normal[2][k] = z[k] * scale;
        }
        (normal, lengths)
    }

    /// Standard deviation across the normal (both axes together) over the length of g, and that length without what noise adds
    /// to it.
    #[inline(always)]
    pub(crate) fn deviation_and_true_length(&self, length: &Lanes) -> (Lanes, Lanes) {
        let (mut deviation, mut true_length) = (ZERO, ZERO);
        for k in 0..LANES {
            let relative = self.tangent_variance[k].max(0.0).sqrt() / length[k];
            let lengthening = (0.5 * relative * relative).min(self.most_lengthening);
            deviation[k] = relative;
            true_length[k] = length[k] * (1.0 - lengthening);
        }
        (deviation, true_length)
    }

    /// Writes the block's photosites and hands the lanes that float32 cannot carry to `refused`.
    #[inline(always)]
    pub(crate) fn write(
        &self,
        block: &Block,
        unit: f64,
        output: &mut RowOutput,
        mut refused: impl FnMut(usize, &mut RowOutput),
    ) {
        let (normal, length) = self.normal_and_length();
        let (mut albedo, mut error_deg, mut residual) = (ZERO, ZERO, ZERO);
        let per_unit = (1.0 / unit) as f32;
        let (relative, true_length) = self.deviation_and_true_length(&length);
        for k in 0..LANES {
            albedo[k] = true_length[k] * per_unit * self.albedo_share[k];
            error_deg[k] =
                (relative[k] * (180.0 / std::f32::consts::PI)).min(MOST_ERROR_DEG as f32);
            residual[k] = (self.squares[k].max(0.0) / self.count[k].max(1.0)).sqrt();
        }
        let mut good = [true; LANES];
        for k in 0..LANES {
            let square = length[k] * length[k];
            good[k] = self.carried[k]
                & COMFORTABLE.contains(&square)
                & (albedo[k] >= f32::MIN_POSITIVE)
                & (albedo[k] < f32::MAX)
                & (residual[k] < f32::MAX);
        }
        let solved = Solved { normal, albedo, error_deg, residual };
        let mut plain = block.is_run() & output.support.is_none();
        for k in 0..LANES {
            plain &= good[k] & (solved.normal[2][k] > 0.0);
        }
        if plain {
            return self.write_run(block.column[0], &solved, output);
        }
        for k in 0..block.len {
            if !good[k] {
                refused(k, output);
            } else if solved.normal[2][k] > 0.0 {
                self.write_lane(block, k, &solved, output);
            } else {
                output.clear(block.column[k], Outcome::NoSurface);
            }
        }
    }

    /// Writes a whole block of neighbours that are all solved.
    #[inline(always)]
    fn write_run(&self, start: usize, solved: &Solved, output: &mut RowOutput) {
        let columns = start..start + LANES;
        let [x, y, z] = &solved.normal;
        for (k, normal) in output.normal[columns.clone()].iter_mut().enumerate() {
            *normal = [x[k], y[k], z[k]];
        }
        output.albedo[columns.clone()].copy_from_slice(&solved.albedo);
        output.expected_error_deg[columns.clone()].copy_from_slice(&solved.error_deg);
        output.residual[columns.clone()].copy_from_slice(&solved.residual);
        output.outcome[columns].copy_from_slice(&self.outcome);
    }

    fn write_lane(&self, block: &Block, k: usize, solved: &Solved, output: &mut RowOutput) {
        let column = block.column[k];
        let [x, y, z] = &solved.normal;
        output.normal[column] = [x[k], y[k], z[k]];
        output.albedo[column] = solved.albedo[k];
        output.expected_error_deg[column] = solved.error_deg[k];
        output.residual[column] = solved.residual[k];
        output.outcome[column] = self.outcome[k];
        if output.support.is_some() {
            output.note(column, Support { kept: block.kept(k), dropped: self.dropped[k] });
        }
    }
}

/// What a block is written from.
struct Solved {
    normal: [Lanes; 3],
    albedo: Lanes,
    error_deg: Lanes,
    residual: Lanes,
}
