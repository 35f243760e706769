//! The ratio-mode least-squares problem: one free gain per cell, shared by all lights, eliminated exactly.

use super::emission::{Emitter, LogIrradiance, PER_LIGHT, Place, tangents};
use super::observation::{Cell, Sample, Sheet};
use super::slow::SlowErrors;
use super::system::SheetSystem;
use nalgebra::{Cholesky, DMatrix, DVector, Point3, UnitVector3, Vector3};

/// Parameters of a sheet's pose: two tilts and the offset along the normal.
pub(super) const PER_SHEET: usize = 3;
/// Systematic part of a cell's relative error below which weighting by photon noise makes no sense.
const SIGMA_FLOOR: f64 = 3e-4;
/// Residuals beyond this many scales do not count (Tukey's biweight; 98 % efficient for Gaussian noise).
const ROBUST_SCALES: f64 = 6.0;
/// The overall intensity is free in ratio mode; its mean is held with this weight.
const GAUGE_WEIGHT: f64 = 1e6;
/// Weight of a light's log intensity before the pictures: it may be anything, but a light that no sample is left of must not
/// leave the equations without a solution.
const INTENSITY_WEIGHT: f64 = 1e-2;

/// What is believed of a light before any picture.
#[derive(Clone, Debug)]
pub struct Prior {
    /// The best guess.
    pub emitter: Emitter,
    /// Position, millimetres, each axis.
    pub position_sigma_mm: f64,
    /// Axis or far direction, radians, each of two.
    pub angle_sigma_rad: f64,
    /// Exponent.
    pub exponent_sigma: f64,
}

/// Everything the fit moves.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) emitters: Vec<Emitter>,
    /// Per sheet: tilt about its two tangents (radians) and offset (mm) from the stated pose.
    pub(super) poses: Vec<[f64; PER_SHEET]>,
}

/// A quadratic model of the cost about a state.
pub(super) struct Linearised {
    /// Data and prior, lower triangle valid.
    pub(super) hessian: DMatrix<f64>,
    /// Right side: minus the cost's gradient.
    pub(super) descent: DVector<f64>,
    /// The cost: half the weighted square sum about each cell's own gain and the slow errors, plus the priors.
    pub(super) cost: f64,
}

/// One light's log signal in one cell, channels combined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub(super) log: f64,
    sigma: f64,
}

pub(super) struct Problem<'a> {
    pub(super) sheets: &'a [Sheet],
    pub(super) lights: usize,
    readings: Vec<Vec<Reading>>,
    pub(super) priors: Vec<Prior>,
    /// Multiplies every prior's position sigma.
    pub(super) ruler_scale: f64,
    /// Variance of the data in units of the readings' own.
    pub(super) data_scale: f64,
    /// The prior of the slow, light-dependent errors.
    pub(super) slow: SlowErrors,
}

impl State {
    pub(super) fn start(priors: &[Prior], sheets: usize) -> Self {
        let emitters = priors.iter().map(|prior| prior.emitter.clone()).collect();
        Self { emitters, poses: vec![[0.0; PER_SHEET]; sheets] }
    }

    pub(super) fn moved(&self, step: &DVector<f64>) -> Self {
        let lights = self.emitters.len();
        let step = step.as_slice();
        let emitters = self
            .emitters
            .iter()
            .enumerate()
            .map(|(i, e)| e.moved(&step[i * PER_LIGHT..(i + 1) * PER_LIGHT]));
        let pose = |(s, pose): (usize, &[f64; PER_SHEET])| {
            let at = lights * PER_LIGHT + s * PER_SHEET;
            std::array::from_fn(|k| pose[k] + step[at + k])
        };
        Self {
            emitters: emitters.collect(),
            poses: self.poses.iter().enumerate().map(pose).collect(),
        }
    }
}

/// Where a cell's centre and the sheet's normal are once the sheet's pose has moved.
pub(super) struct Placed {
    pub(super) point: Point3<f64>,
    pub(super) normal: UnitVector3<f64>,
    /// By the two tilts and the offset.
    pub(super) point_by_pose: [Vector3<f64>; PER_SHEET],
    pub(super) normal_by_pose: [Vector3<f64>; PER_SHEET],
}

/// The centre of `cell` slides along its line of sight when the sheet tilts or lifts: n . (p + t v - q) = 0.
pub(super) fn place(sheet: &Sheet, cell: &Cell, pose: &[f64; PER_SHEET]) -> Placed {
    let plane = &sheet.plane;
    let [first, second] = tangents(&plane.normal);
    let normal =
        UnitVector3::new_normalize(plane.normal.into_inner() + first * pose[0] + second * pose[1]);
    let from_pivot = cell.point_mm - plane.point_mm;
    let view = cell.view.into_inner();
    let across = normal.dot(&view);
    let slide = (pose[2] - normal.dot(&from_pivot)) / across;
    let moved = from_pivot + view * slide;
    let tilt = |t: &Vector3<f64>| view * (-t.dot(&moved) / across);
    Placed {
        point: plane.point_mm + moved,
        normal,
        point_by_pose: [tilt(&first), tilt(&second), view / across],
        normal_by_pose: [first, second, Vector3::zeros()],
    }
}

impl<'a> Problem<'a> {
    pub(super) fn new(sheets: &'a [Sheet], priors: Vec<Prior>) -> Self {
        let weights = channel_weights(sheets);
        let read =
            |sheet: &Sheet| sheet.samples.iter().map(|sample| combine(sample, &weights)).collect();
        let readings = sheets.iter().map(read).collect();
        let (ruler_scale, data_scale, lights) = (1.0, 1.0, priors.len());
        let slow = SlowErrors::for_lights(lights);
        Self { sheets, lights, readings, priors, ruler_scale, data_scale, slow }
    }

    pub(super) fn parameters(&self) -> usize {
        self.lights * PER_LIGHT + self.sheets.len() * PER_SHEET
    }

    pub(super) fn parameters_with_slow_errors(&self) -> usize {
        self.parameters() + self.sheets.len() * self.lights * self.slow.per_light()
    }

    /// Residuals (log signal less model) of every cell and light, sheet by sheet; NaN where there is none.
    pub(super) fn residuals(&self, state: &State) -> Vec<Vec<f64>> {
        let of_sheet = |(s, sheet): (usize, &Sheet)| {
            let mut residuals = Vec::with_capacity(sheet.samples.len());
            for (c, cell) in sheet.cells.iter().enumerate() {
                let placed = place(sheet, cell, &state.poses[s]);
                for (i, emitter) in state.emitters.iter().enumerate() {
                    let model = emitter.log_irradiance(&placed.point, &placed.normal);
                    let log = self.readings[s][c * self.lights + i].log;
                    residuals.push(model.map_or(f64::NAN, |model| log - model));
                }
            }
            residuals
        };
        self.sheets.iter().enumerate().map(of_sheet).collect()
    }

    /// Relative sigma of a reading as stated (photon noise and a floor).
    pub(super) fn sigma(&self, sheet: usize, sample: usize) -> f64 {
        self.readings[sheet][sample].sigma
    }

    /// Robust weights in units of 1 / variance of the reading (not yet divided by `data_scale`).
    pub(super) fn weights(&self, residuals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let standard: Vec<Vec<f64>> = residuals
            .iter()
            .enumerate()
            .map(|(s, of_sheet)| self.standardised(s, of_sheet))
            .collect();
        let scale_of = |values: &mut dyn Iterator<Item = &f64>| {
            let mut sizes: Vec<f64> = values.filter(|u| u.is_finite()).map(|u| u.abs()).collect();
            // The median takes one light of each cell as the centre: with few lights many residuals are zero by construction.
            let freedom = self.lights as f64 / (self.lights as f64 - 1.0).max(1.0);
            (1.4826 * freedom * median(&mut sizes)).max(1e-3)
        };
        let scale = scale_of(&mut standard.iter().flatten());
        // A light that is far from the model as a whole (its beam is not yet known) is no outlier: parts of it are.
        let scales: Vec<f64> = (0..self.lights)
            .map(|i| {
                let own = standard.iter().flat_map(|u| u.iter().skip(i).step_by(self.lights));
                scale_of(&mut own.into_iter()).max(scale)
            })
            .collect();
        let weigh = |(s, of_sheet): (usize, &Vec<f64>)| {
            let weight = |(k, u): (usize, &f64)| {
                let reach = ROBUST_SCALES * scales[k % self.lights];
                let robust = (1.0 - (u / reach).powi(2)).max(0.0).powi(2);
                if u.is_finite() { robust / self.sigma(s, k).powi(2) } else { 0.0 }
            };
            of_sheet.iter().enumerate().map(weight).collect()
        };
        standard.iter().enumerate().map(weigh).collect()
    }

    /// Residuals about the cell's median, over sigma: a shadow on one light leaves the others where they are.
    fn standardised(&self, sheet: usize, residuals: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(residuals.len());
        for (c, cell) in residuals.chunks(self.lights).enumerate() {
            let mut usable: Vec<f64> = cell.iter().copied().filter(|r| r.is_finite()).collect();
            let centre = median(&mut usable);
            let over_sigma =
                |(i, r): (usize, &f64)| (r - centre) / self.sigma(sheet, c * self.lights + i);
            out.extend(cell.iter().enumerate().map(over_sigma));
        }
        out
    }

    /// Sets every light's strength to what its pictures say at the first glance (medians over cells, in turns with medians over
    /// lights): a weak light must not pass for an outlier.
    pub(super) fn level(&self, state: &mut State) {
        for _ in 0..3 {
            let residuals = self.residuals(state);
            let mut offs: Vec<Vec<f64>> = vec![Vec::new(); self.lights];
            for cell in residuals.iter().flat_map(|sheet| sheet.chunks(self.lights)) {
                let mut usable: Vec<f64> = cell.iter().copied().filter(|r| r.is_finite()).collect();
                let centre = median(&mut usable);
                for (off, r) in offs.iter_mut().zip(cell).filter(|(_, r)| r.is_finite()) {
                    off.push(r - centre);
                }
            }
            for (emitter, off) in state.emitters.iter_mut().zip(&mut offs) {
                let off = median(off);
                emitter.log_intensity += if off.is_finite() { off } else { 0.0 };
            }
            // Only ratios count: the mean stays where the priors have it.
            let gauge = self.gauge(state) / self.lights as f64;
            state.emitters.iter_mut().for_each(|emitter| emitter.log_intensity -= gauge);
        }
    }

    fn prior_cost(&self, state: &State) -> f64 {
        let mut cost = 0.0;
        for (emitter, prior) in state.emitters.iter().zip(&self.priors) {
            cost += self
                .prior_terms(emitter, prior)
                .iter()
                .map(|(r, weight)| weight * r * r)
                .sum::<f64>();
        }
        for (pose, sheet) in state.poses.iter().zip(self.sheets) {
            let terms = pose.iter().zip(pose_weights(sheet)).map(|(x, weight)| weight * x * x);
            cost += terms.filter(|t| t.is_finite()).sum::<f64>();
        }
        let gauge: f64 = self.gauge(state);
        cost + GAUGE_WEIGHT * gauge * gauge
    }

    fn gauge(&self, state: &State) -> f64 {
        state
            .emitters
            .iter()
            .zip(&self.priors)
            .map(|(e, p)| e.log_intensity - p.emitter.log_intensity)
            .sum()
    }

    /// Per parameter of a light: how far it is from the prior, and the prior's weight.
    fn prior_terms(&self, emitter: &Emitter, prior: &Prior) -> [(f64, f64); PER_LIGHT] {
        let angle = prior.angle_sigma_rad.powi(-2);
        let intensity = (emitter.log_intensity - prior.emitter.log_intensity, INTENSITY_WEIGHT);
        let turn = |from: &UnitVector3<f64>, to: &UnitVector3<f64>| {
            tangents(to).map(|t| (-t.dot(from), angle))
        };
        match (&emitter.place, &prior.emitter.place) {
            (
                Place::Near { position_mm, axis, exponent },
                Place::Near { position_mm: position0, axis: axis0, exponent: exponent0 },
            ) => {
                let off = position_mm - position0;
                let weight = (prior.position_sigma_mm * self.ruler_scale).powi(-2);
                let [first, second] = turn(axis0, axis);
                let exponent = (exponent - exponent0, prior.exponent_sigma.powi(-2));
                [
                    (off.x, weight),
                    (off.y, weight),
                    (off.z, weight),
                    first,
                    second,
                    exponent,
                    intensity,
                ]
            }
            (Place::Far { direction }, Place::Far { direction: direction0 }) => {
                let [first, second] = turn(direction0, direction);
                let unused = (0.0, 1.0);
                [unused, unused, unused, first, second, unused, intensity]
            }
            _ => [(0.0, 1.0); PER_LIGHT],
        }
    }

    /// The normal equations of every sheet at `state`.
    pub(super) fn systems(&self, state: &State, weights: &[Vec<f64>]) -> Vec<SheetSystem> {
        (0..self.sheets.len()).map(|s| self.sheet_system(s, state, &weights[s])).collect()
    }

    fn sheet_system(&self, s: usize, state: &State, weights: &[f64]) -> SheetSystem {
        let (lights, sheet) = (self.lights, &self.sheets[s]);
        let mut system = SheetSystem::new(lights, self.slow.per_light());
        for (c, cell) in sheet.cells.iter().enumerate() {
            let placed = place(sheet, cell, &state.poses[s]);
            let range = c * lights..(c + 1) * lights;
            let at: Vec<Option<LogIrradiance>> =
                state.emitters.iter().map(|e| e.linearise(&placed.point, &placed.normal)).collect();
            let ripples = self.slow.at(sheet, cell);
            let readings = &self.readings[s][range.clone()];
            system.add_cell(&at, readings, &weights[range], &placed, &ripples);
        }
        system.finish(self.data_scale.recip());
        system
    }

    /// All sheets and priors together over (lights, poses, then the slow errors that sheets share, light by light); those of
    /// single sheets eliminated.
    pub(super) fn joint(&self, systems: &[SheetSystem], state: &State) -> Option<Linearised> {
        let n = self.parameters();
        let fixed = self.slow.fixed_precision();
        let all = n + self.lights * fixed.len();
        let mut out = Linearised {
            hessian: DMatrix::zeros(all, all),
            descent: DVector::zeros(all),
            cost: 0.0,
        };
        for (s, system) in systems.iter().enumerate() {
            let places = self.places(s);
            system.eliminate(&self.slow)?.scatter(&places, &mut out);
        }
        for k in n..all {
            out.hessian[(k, k)] += fixed[(k - n) % fixed.len()];
        }
        self.add_priors(state, &mut out);
        out.cost += 0.5 * self.prior_cost(state);
        Some(out)
    }

    /// Where the parameters of sheet `s` (lights, its pose, shared slow errors) are among those of all.
    pub(super) fn places(&self, s: usize) -> Vec<usize> {
        let pose_at = self.lights * PER_LIGHT;
        let pose = pose_at + s * PER_SHEET;
        let n = self.parameters();
        let shared = self.lights * self.slow.fixed().len();
        (0..pose_at).chain(pose..pose + PER_SHEET).chain(n..n + shared).collect()
    }

    /// All sheets and priors together, all slow errors eliminated.
    pub(super) fn assemble(&self, systems: &[SheetSystem], state: &State) -> Option<Linearised> {
        self.marginal(&self.joint(systems, state)?)
    }

    /// Without the slow errors that sheets share.
    pub(super) fn marginal(&self, joint: &Linearised) -> Option<Linearised> {
        let n = self.parameters();
        let shared = joint.hessian.nrows() - n;
        let factor = Cholesky::new(joint.hessian.view((n, n), (shared, shared)).into_owned())?;
        let mut cross = joint.hessian.view((n, 0), (shared, n)).into_owned();
        let mut right = joint.descent.rows(n, shared).into_owned();
        let l = factor.l_dirty();
        (l.solve_lower_triangular_mut(&mut cross) && l.solve_lower_triangular_mut(&mut right))
            .then_some(())?;
        let mut hessian = joint.hessian.view((0, 0), (n, n)).into_owned();
        let mut descent = joint.descent.rows(0, n).into_owned();
        hessian.gemm(-1.0, &cross.transpose(), &cross, 1.0);
        descent.gemv_tr(-1.0, &cross, &right, 1.0);
        Some(Linearised { hessian, descent, cost: joint.cost - 0.5 * right.norm_squared() })
    }

    /// The most probable slow errors of every sheet at the state of `systems` and their `joint`, light by light.
    pub(super) fn ripples_from(
        &self,
        systems: &[SheetSystem],
        joint: &Linearised,
    ) -> Option<Vec<DVector<f64>>> {
        let n = self.parameters();
        let shared = joint.hessian.nrows() - n;
        let factor = Cholesky::new(joint.hessian.view((n, n), (shared, shared)).into_owned())?;
        let shared = factor.solve(&joint.descent.rows(n, shared).into_owned());
        systems.iter().map(|system| system.ripples(&self.slow, &shared)).collect()
    }

    /// Residuals less slow errors: what is left is noise and outliers. Empty `ripples`: none.
    pub(super) fn without_ripples(
        &self,
        residuals: &[Vec<f64>],
        ripples: &[DVector<f64>],
    ) -> Vec<Vec<f64>> {
        let mut out = residuals.to_vec();
        for ((sheet, out), ripples) in self.sheets.iter().zip(&mut out).zip(ripples) {
            let per_light = ripples.len() / self.lights;
            for (cell, out) in sheet.cells.iter().zip(out.chunks_mut(self.lights)) {
                let basis = self.slow.at(sheet, cell);
                for (value, mine) in out.iter_mut().zip(ripples.as_slice().chunks(per_light)) {
                    *value -= basis.iter().zip(mine).map(|(b, x)| b * x).sum::<f64>();
                }
            }
        }
        out
    }

    /// 1 / variance of every light's parameters before any picture (poses are not counted).
    pub(super) fn prior_weights(&self) -> Vec<f64> {
        let terms =
            |prior: &Prior| self.prior_terms(&prior.emitter, prior).map(|(_, weight)| weight);
        self.priors.iter().flat_map(terms).collect()
    }

    fn add_priors(&self, state: &State, out: &mut Linearised) {
        for (i, (emitter, prior)) in state.emitters.iter().zip(&self.priors).enumerate() {
            for (k, (off, weight)) in self.prior_terms(emitter, prior).into_iter().enumerate() {
                out.hessian[(i * PER_LIGHT + k, i * PER_LIGHT + k)] += weight;
                out.descent[i * PER_LIGHT + k] -= weight * off;
            }
        }
        let pose_at = self.lights * PER_LIGHT;
        for (s, sheet) in self.sheets.iter().enumerate() {
            for (k, weight) in pose_weights(sheet).into_iter().enumerate() {
                let at = pose_at + s * PER_SHEET + k;
                // A pose that is known exactly does not move: the weight swamps whatever the data say.
                let weight = if weight.is_finite() { weight } else { 1e18 };
                out.hessian[(at, at)] += weight;
                out.descent[at] -= weight * state.poses[s][k];
            }
        }
        let gauge = self.gauge(state);
        for i in 0..self.lights {
            out.descent[i * PER_LIGHT + 6] -= GAUGE_WEIGHT * gauge;
            for j in 0..self.lights {
                out.hessian[(i * PER_LIGHT + 6, j * PER_LIGHT + 6)] += GAUGE_WEIGHT;
            }
        }
    }
}

fn pose_weights(sheet: &Sheet) -> [f64; PER_SHEET] {
    let tilt = sheet.pose_sigma.tilt_rad.powi(-2);
    [tilt, tilt, sheet.pose_sigma.offset_mm.powi(-2)]
}

/// How much each channel counts: inverse of its typical variance, sum 1.
fn channel_weights(sheets: &[Sheet]) -> [f64; 3] {
    let usable =
        || sheets.iter().flat_map(|sheet| &sheet.samples).filter(|sample| sample.is_usable());
    let weights: [f64; 3] = std::array::from_fn(|k| {
        let mut sigmas: Vec<f64> = usable().map(|sample| sample.relative_sigma[k]).collect();
        (median(&mut sigmas).powi(2) + SIGMA_FLOOR.powi(2)).recip()
    });
    let total: f64 = weights.iter().sum();
    if total.is_finite() && total > 0.0 { weights.map(|w| w / total) } else { [1.0 / 3.0; 3] }
}

fn combine(sample: &Sample, weights: &[f64; 3]) -> Reading {
    if !sample.is_usable() {
        return Reading { log: f64::NAN, sigma: f64::NAN };
    }
    let log = (0..3).map(|k| weights[k] * sample.signal[k].ln()).sum();
    let variance: f64 = (0..3).map(|k| (weights[k] * sample.relative_sigma[k]).powi(2)).sum();
    Reading { log, sigma: (variance + SIGMA_FLOOR.powi(2)).sqrt() }
}

pub(super) fn weighted_mean(values: &[f64], weights: &[f64]) -> f64 {
    let used =
        || values.iter().zip(weights).filter(|(value, weight)| **weight > 0.0 && value.is_finite());
    let total: f64 = used().map(|(_, weight)| weight).sum();
    used().map(|(value, weight)| value * weight).sum::<f64>() / total
}

/// The middle value; NaN of nothing. Reorders its input.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
