//! The normal equations of one sheet, and the elimination of what only it knows.

use super::emission::{LogIrradiance, PER_LIGHT};
use super::joint::{Linearised, PER_SHEET, Placed, Reading, weighted_mean};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// J'WJ and J'Wr of one sheet over (lights, its pose, slow errors light by light), each cell's gain eliminated. Lower
/// triangle valid.
pub(super) struct SheetSystem {
    hessian: DMatrix<f64>,
    descent: DVector<f64>,
    /// Half the weighted square sum.
    cost: f64,
    mean: DVector<f64>,
    /// Lights and pose: the parameters that stay.
    kept: usize,
    ripples_per_light: usize,
}

/// What is left of a sheet once its slow errors are eliminated.
pub(super) struct Reduced {
    hessian: DMatrix<f64>,
    descent: DVector<f64>,
    cost: f64,
    log_volume: f64,
}

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
        self.hessian.syger(-1.0 / total, &self.mean, &self.mean, 1.0);
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

    pub(super) fn scale(&mut self, factor: f64) {
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

    /// The most probable slow errors at the state of the system, light by light.
    pub(super) fn ripples(&self, precision: &[f64]) -> Option<DVector<f64>> {
        let descent = self.descent.rows(self.kept, self.ripple_count()).into_owned();
        Some(self.ripple_factor(precision)?.solve(&descent))
    }

    /// Schur complement over the slow errors, whose prior has 1 / variance `precision` (one light's).
    pub(super) fn eliminate(&self, precision: &[f64]) -> Option<Reduced> {
        let kept = self.kept;
        let mut hessian = self.hessian.view((0, 0), (kept, kept)).into_owned();
        let mut descent = self.descent.rows(0, kept).into_owned();
        let n = self.ripple_count();
        let factor = self.ripple_factor(precision)?;
        let mut cross = self.hessian.view((kept, 0), (n, kept)).into_owned();
        let mut right = self.descent.rows(kept, n).into_owned();
        let l = factor.l_dirty();
        (l.solve_lower_triangular_mut(&mut cross) && l.solve_lower_triangular_mut(&mut right))
            .then_some(())?;
        hessian.gemm_tr(-1.0, &cross, &cross, 1.0);
        descent.gemv_tr(-1.0, &cross, &right, 1.0);
        let prior: f64 =
            precision.iter().map(|p| p.ln()).sum::<f64>() * (n / self.ripples_per_light) as f64;
        let log_volume = l.diagonal().iter().map(|d| d.ln()).sum::<f64>() - 0.5 * prior;
        Some(Reduced { hessian, descent, cost: self.cost - 0.5 * right.norm_squared(), log_volume })
    }
}

impl Reduced {
    /// Adds into the system of all sheets, whose parameters from `pose_at` on are poses, this sheet's at `pose_to`.
    pub(super) fn scatter(&self, pose_to: usize, pose_at: usize, out: &mut Linearised) {
        let to = |k: usize| if k < pose_at { k } else { pose_to + k - pose_at };
        for column in 0..self.hessian.ncols() {
            out.descent[to(column)] += self.descent[column];
            for row in column..self.hessian.nrows() {
                out.hessian[(to(row), to(column))] += self.hessian[(row, column)];
            }
        }
        out.cost += self.cost;
        out.log_volume += self.log_volume;
    }
}
