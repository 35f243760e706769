//! The normal equations of one sheet, and the elimination of what only it knows.

use super::emission::{LogIrradiance, PER_LIGHT};
use super::joint::{Linearised, PER_SHEET, Placed, Reading, weighted_mean};
use super::slow::{Evidence, SlowErrors};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// J'WJ and J'Wr of one sheet over (lights, its pose, slow errors light by light), each cell's gain eliminated. Lower
/// triangle valid.
pub(super) struct SheetSystem {
    hessian: DMatrix<f64>,
    descent: DVector<f64>,
    /// Half the weighted square sum.
    cost: f64,
    mean: DVector<f64>,
    /// Weighted sums of J's rows in each cell over the root of its weight, column by column: what the free gains take.
    gains: Vec<f64>,
    /// Lights and pose: the parameters that stay.
    kept: usize,
    ripples_per_light: usize,
}

/// What is left of a sheet once its slow errors are eliminated: over lights, its pose, and the slow errors that all sheets
/// share.
pub(super) struct Reduced {
    hessian: DMatrix<f64>,
    descent: DVector<f64>,
    cost: f64,
}

/// Cells whose gains are taken out together.
const GAINS_AT_ONCE: usize = 256;

/// One row of J: a light in a cell.
struct Row<'a> {
    by_light: &'a [f64; PER_LIGHT],
    by_pose: [f64; PER_SHEET],
    ripples: &'a [f64],
    /// Where the parameters of this row start: the light's, the pose's, the slow errors'.
    at: [usize; 3],
}

impl SheetSystem {
    pub(super) fn new(lights: usize, ripples_per_light: usize) -> Self {
        let kept = lights * PER_LIGHT + PER_SHEET;
        let n = kept + lights * ripples_per_light;
        let zeros = DVector::zeros(n);
        Self {
            hessian: DMatrix::zeros(n, n),
            descent: zeros.clone(),
            cost: 0.0,
            mean: zeros,
            gains: Vec::new(),
            kept,
            ripples_per_light,
        }
    }

    /// J' W (I - 1 w' / sum w) J of one cell: its own gain eliminated (variable projection of a linear parameter).
    pub(super) fn add_cell(
        &mut self,
        at: &[Option<LogIrradiance>],
        readings: &[Reading],
        weights: &[f64],
        placed: &Placed,
        ripples: &[f64],
    ) {
        let residuals: Vec<f64> = at
            .iter()
            .zip(readings)
            .map(|(at, reading)| at.map_or(f64::NAN, |at| reading.log - at.value))
            .collect();
        let total: f64 =
            weights.iter().zip(at).map(|(w, at)| if at.is_some() { *w } else { 0.0 }).sum();
        if total <= 0.0 {
            return;
        }
        let gain = weighted_mean(&residuals, weights);
        self.mean.fill(0.0);
        for (i, at) in at.iter().enumerate() {
            let Some(at) = at.as_ref().filter(|_| weights[i] > 0.0) else { continue };
            let by_pose = std::array::from_fn(|k| {
                at.by_point.dot(&placed.point_by_pose[k])
                    + at.by_normal.dot(&placed.normal_by_pose[k])
            });
            let starts =
                [i * PER_LIGHT, self.kept - PER_SHEET, self.kept + i * self.ripples_per_light];
            let row = Row { by_light: &at.by_light, by_pose, ripples, at: starts };
            self.add_row(&row, weights[i], residuals[i] - gain);
        }
        let share = total.sqrt().recip();
        self.gains.extend(self.mean.iter().map(|value| share * value));
        if self.gains.len() >= GAINS_AT_ONCE * self.mean.len() {
            self.take_gains();
        }
    }

    /// Takes the free gains of many cells out at once: one product of matrices is several times as fast as one update a cell.
    fn take_gains(&mut self) {
        let n = self.mean.len();
        let gains = DMatrix::from_vec(n, self.gains.len() / n, std::mem::take(&mut self.gains));
        self.hessian.gemm(-1.0, &gains, &gains.transpose(), 1.0);
    }

    fn add_row(&mut self, row: &Row, weight: f64, residual: f64) {
        self.cost += 0.5 * weight * residual * residual;
        let parts: [(usize, &[f64]); 3] =
            [(row.at[0], row.by_light), (row.at[1], &row.by_pose), (row.at[2], row.ripples)];
        for (p, (column_at, columns)) in parts.iter().enumerate() {
            for (b, y) in columns.iter().enumerate() {
                let (column, weighted) = (column_at + b, weight * y);
                self.mean[column] += weighted;
                self.descent[column] += weighted * residual;
                for (row_at, rows) in &parts[p..] {
                    for (a, x) in rows.iter().enumerate().filter(|(a, _)| row_at + a >= column) {
                        self.hessian[(row_at + a, column)] += weighted * x;
                    }
                }
            }
        }
    }

    /// To be called once, after the last cell.
    pub(super) fn finish(&mut self, factor: f64) {
        self.take_gains();
        self.hessian *= factor;
        self.descent *= factor;
        self.cost *= factor;
    }

    fn ripple_count(&self) -> usize {
        self.descent.len() - self.kept
    }

    fn ripple_factor(&self, precision: &[f64]) -> Option<Cholesky<f64, Dyn>> {
        let (kept, n) = (self.kept, self.ripple_count());
        let mut block = self.hessian.view((kept, kept), (n, n)).into_owned();
        for k in 0..n {
            block[(k, k)] += precision[k % self.ripples_per_light];
        }
        Cholesky::new(block)
    }

    /// Numbers, among this sheet's slow errors, of those that all sheets share, light by light.
    fn shared(&self, slow: &SlowErrors) -> Vec<usize> {
        let lights = self.ripple_count() / self.ripples_per_light;
        (0..lights)
            .flat_map(|i| slow.fixed().map(move |k| i * self.ripples_per_light + k))
            .collect()
    }

    /// The most probable slow errors at the state of the system, light by light, with `fixed` those that all sheets share: a
    /// sheet's own scatter about them.
    pub(super) fn ripples(&self, slow: &SlowErrors, fixed: &DVector<f64>) -> Option<DVector<f64>> {
        let precision = slow.precision();
        let mut right = self.descent.rows(self.kept, self.ripple_count()).into_owned();
        for (value, k) in fixed.iter().zip(self.shared(slow)) {
            right[k] += precision[k % self.ripples_per_light] * value;
        }
        Some(self.ripple_factor(&precision)?.solve(&right))
    }

    /// Schur complement over the slow errors u, whose prior is N(q, 1 / precision) with q those that all sheets share. With
    /// B = [H_uk, -P E], E putting q among u: the quadratic form loses B' (H_uu + P)^-1 B.
    pub(super) fn eliminate(&self, slow: &SlowErrors) -> Option<Reduced> {
        let (kept, n) = (self.kept, self.ripple_count());
        let precision = slow.precision();
        let shared = self.shared(slow);
        let all = kept + shared.len();
        let factor = self.ripple_factor(&precision)?;
        let mut cross = DMatrix::zeros(n, all);
        cross.columns_mut(0, kept).copy_from(&self.hessian.view((kept, 0), (n, kept)));
        let mut hessian = DMatrix::zeros(all, all);
        hessian.view_mut((0, 0), (kept, kept)).copy_from(&self.hessian.view((0, 0), (kept, kept)));
        for (column, k) in shared.iter().enumerate() {
            let weight = precision[k % self.ripples_per_light];
            cross[(*k, kept + column)] = -weight;
            hessian[(kept + column, kept + column)] = weight;
        }
        let mut descent = DVector::zeros(all);
        descent.rows_mut(0, kept).copy_from(&self.descent.rows(0, kept));
        let mut right = self.descent.rows(kept, n).into_owned();
        let l = factor.l_dirty();
        (l.solve_lower_triangular_mut(&mut cross) && l.solve_lower_triangular_mut(&mut right))
            .then_some(())?;
        // Not `gemm_tr`, which takes column by column.
        hessian.gemm(-1.0, &cross.transpose(), &cross, 1.0);
        descent.gemv_tr(-1.0, &cross, &right, 1.0);
        Some(Reduced { hessian, descent, cost: self.cost - 0.5 * right.norm_squared() })
    }

    /// Adds what this sheet says of the sizes of its own slow errors (less the shared ones): `step` and `covariance` are those of
    /// (lights, this pose, shared ones).
    pub(super) fn learn(
        &self,
        slow: &SlowErrors,
        step: &DVector<f64>,
        covariance: &DMatrix<f64>,
        evidence: &mut [Evidence; 4],
    ) -> Option<()> {
        let (kept, n) = (self.kept, self.ripple_count());
        let (precision, shares, shared) = (slow.precision(), slow.shares(), self.shared(slow));
        let factor = self.ripple_factor(&precision)?;
        // How (H_uu + P) times u - E q answers to lights, pose and q.
        let mut answer = DMatrix::zeros(n, kept + shared.len());
        answer.columns_mut(0, kept).copy_from(&self.hessian.view((kept, 0), (n, kept)));
        for (column, k) in shared.iter().enumerate() {
            for row in 0..n {
                let (a, b) = (row.max(*k), row.min(*k));
                answer[(row, kept + column)] = self.hessian[(kept + a, kept + b)];
            }
        }
        let mean = factor.solve(&(self.descent.rows(kept, n) - &answer * step));
        factor.solve_mut(&mut answer);
        let spread = &answer * covariance;
        let own = factor.inverse();
        for k in 0..n {
            let variance = own[(k, k)] + spread.row(k).dot(&answer.row(k));
            slow.learn(evidence, shares[k % self.ripples_per_light], mean[k], variance);
        }
        Some(())
    }
}

impl Reduced {
    /// Adds into the system of all sheets, this one's parameters at `places`.
    pub(super) fn scatter(&self, places: &[usize], out: &mut Linearised) {
        for (column, to) in places.iter().enumerate() {
            out.descent[*to] += self.descent[column];
            for (row, to_row) in places.iter().enumerate().skip(column) {
                out.hessian[(*to_row, *to)] += self.hessian[(row, column)];
            }
        }
        out.cost += self.cost;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::bench_scene::{Bench, poses};
    use crate::lights::joint::{Problem, State, place};

    /// J'W (I - 1 w' / sum w) J and its right side, written out with dense matrices.
    fn plain(problem: &Problem, state: &State, weights: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let (lights, sheet, per_light) =
            (problem.lights, &problem.sheets[0], problem.slow.per_light());
        let kept = lights * PER_LIGHT + PER_SHEET;
        let n = kept + lights * per_light;
        let (mut hessian, mut descent) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let residuals = problem.residuals(state);
        for (c, cell) in sheet.cells.iter().enumerate() {
            let placed = place(sheet, cell, &state.poses[0]);
            let ripples = problem.slow.at(sheet, cell);
            let mut rows = DMatrix::zeros(lights, n);
            for (i, emitter) in state.emitters.iter().enumerate() {
                let at = emitter.linearise(&placed.point, &placed.normal).unwrap();
                (0..PER_LIGHT).for_each(|k| rows[(i, i * PER_LIGHT + k)] = at.by_light[k]);
                for k in 0..PER_SHEET {
                    rows[(i, kept - PER_SHEET + k)] = at.by_point.dot(&placed.point_by_pose[k])
                        + at.by_normal.dot(&placed.normal_by_pose[k]);
                }
                (0..per_light).for_each(|k| rows[(i, kept + i * per_light + k)] = ripples[k]);
            }
            let range = c * lights..(c + 1) * lights;
            let w = DVector::from_column_slice(&weights[range.clone()]);
            let r = DVector::from_column_slice(&residuals[0][range]);
            let weight = DMatrix::from_diagonal(&w) - &w * w.transpose() / w.sum();
            hessian += rows.transpose() * &weight * &rows;
            descent += rows.transpose() * weight * r;
        }
        (hessian, descent)
    }

    /// More cells than are taken out at once, and a number that is no multiple of it.
    #[test]
    fn the_equations_are_those_of_a_plain_reference() {
        let bench = Bench { grid: [24, 16], ..Bench::default() };
        let leds = bench.leds();
        let sheets = bench.sheets(&leds, &poses()[..1]);
        let problem = Problem::new(&sheets, bench.priors(&leds));
        let mut state = State::start(&bench.priors(&leds), 1);
        problem.level(&mut state);
        let weights = problem.weights(&problem.residuals(&state));
        let system = &problem.systems(&state, &weights)[0];
        let (hessian, descent) = plain(&problem, &state, &weights[0]);
        let size = hessian.diagonal().map(f64::sqrt);
        for column in 0..hessian.ncols() {
            for row in column..hessian.nrows() {
                let off = system.hessian[(row, column)] - hessian[(row, column)];
                assert!(off.abs() <= 1e-11 * size[row] * size[column], "{row}, {column}: {off}");
            }
        }
        let reach = (2.0 * system.cost).sqrt();
        let off = (&system.descent - descent).component_div(&(size * reach)).amax();
        assert!(off < 1e-11, "{off}");
    }
}
