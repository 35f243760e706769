//! What the lights say of each other: with more than three, every light's signal is predicted by the rest. Finds lights
//! that stayed dark, that are far brighter than calibrated, and pairs that were swapped.

use super::check::in_words;
use super::field::LightField;
use super::scene::Scene;
use super::signal::{Normalizer, SignalRows};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Photosites asked: rows and columns of a coarse lattice over the frame.
const ROWS: usize = 24;
const COLUMNS: usize = 64;
/// Fewer than this and nothing is said.
const LEAST_PHOTOSITES: usize = 30;
/// A light below this share of its prediction adds nothing and is left out.
const DARK_SHARE: f64 = 0.05;
/// A light below this share (or above its inverse) is worth a warning.
const ODD_SHARE: f64 = 0.5;
/// Predictions below this share of the photosite's brightest sample are not compared: shadows look like dark lights.
const CLEARLY_LIT: f64 = 0.3;
/// Swapping two lights must bring the residual below this share of what it is ...
const SWAP_GAIN: f64 = 0.6;
/// ... and be worth mentioning at all: relative residual of a good fit.
const GOOD_RESIDUAL: f64 = 0.02;

/// What one photosite shows of every light.
struct Witness {
    vectors: Vec<Vector3<f64>>,
    y: Vec<f64>,
}

/// The verdict over all photosites asked.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Verdict {
    /// Positions in `scene.lights` of lights that add nothing.
    pub(crate) dark: Vec<usize>,
    /// In words.
    pub(crate) warnings: Vec<String>,
}

/// Asks a lattice of photosites.
pub(crate) fn question(scene: &Scene, field: &LightField) -> Verdict {
    let count = scene.lights.len();
    if count < 4 {
        let sentence =
            "With three lights nothing can tell whether one of them failed or two were swapped.";
        return Verdict { dark: vec![], warnings: vec![sentence.to_owned()] };
    }
    let mut witnesses = witnesses(scene, field);
    let mut verdict = Verdict::default();
    // Swapped lights also look too dark and too bright: looked for first, and put right before going on.
    if let Some(swap) = swapped(&witnesses, count) {
        verdict.warnings.push(swap.in_words(scene));
        witnesses.iter_mut().for_each(|witness| witness.y.swap(swap.a, swap.b));
    }
    let mut trusted: Vec<usize> = (0..count).collect();
    while trusted.len() > 3 {
        let Some((light, share)) = oddest(&witnesses, &trusted) else { break };
        let index = scene.lights[trusted[light]].index;
        let percent = 100.0 * share;
        let dark = share < DARK_SHARE && count - verdict.dark.len() > 3;
        if dark {
            verdict.dark.push(trusted[light]);
            verdict.warnings.push(format!(
                "Light {index} gives {percent:.1} % of what the others predict and was left out; is its LED on, is its frame black?"
            ));
        } else {
            verdict.warnings.push(format!(
                "Light {index} gives {percent:.0} % of what the others predict; check its exposure, its LED and lights.toml."
            ));
        }
        trusted.remove(light);
    }
    verdict.dark.sort_unstable();
    verdict
}

/// Photosites of the lattice at which every light has a usable sample.
fn witnesses(scene: &Scene, field: &LightField) -> Vec<Witness> {
    let equal: Vec<Vec<f64>> =
        scene.lights.iter().map(|light| vec![1.0; light.exposures.len()]).collect();
    let normalizer = Normalizer::new(scene, &equal);
    let mut rows = SignalRows::default();
    let mut found = vec![];
    for y in lattice(scene.height, ROWS) {
        normalizer.row(y, 0..scene.width, &mut rows);
        for x in lattice(scene.width, COLUMNS) {
            if scene.mask.as_ref().is_some_and(|mask| !mask.at(x, y)) {
                continue;
            }
            let y_of_lights: Vec<f64> =
                rows.signals().iter().map(|row| f64::from(row[x])).collect();
            let usable =
                y_of_lights.iter().all(|y| y.is_finite()) && y_of_lights.iter().any(|&y| y > 0.0);
            if let (true, Some(vectors)) = (usable, field.exact([x as f64, y as f64])) {
                found.push(Witness { vectors, y: y_of_lights });
            }
        }
    }
    found
}

fn lattice(length: usize, count: usize) -> impl Iterator<Item = usize> {
    let count = count.min(length);
    (0..count).map(move |k| (2 * k + 1) * length / (2 * count))
}

/// The light whose share of its prediction by the others is the farthest from one, if it is odd: its position in `lights`
/// and the median share.
fn oddest(witnesses: &[Witness], lights: &[usize]) -> Option<(usize, f64)> {
    let mut shares: Vec<Vec<f64>> = lights.iter().map(|_| vec![]).collect();
    for witness in witnesses {
        let Some(fit) = Fit::new(witness, lights) else { continue };
        let predicted: Vec<f64> = (0..lights.len())
            .map(|k| fit.y[k] - fit.residual[k] / fit.annihilator[(k, k)])
            .collect();
        let brightest = fit.y.max();
        for (k, shares) in shares.iter_mut().enumerate() {
            // A light that the fit cannot do without has no prediction.
            if fit.annihilator[(k, k)] > 0.05 && predicted[k] > CLEARLY_LIT * brightest {
                shares.push(fit.y[k] / predicted[k]);
            }
        }
    }
    let medians = shares.into_iter().map(|shares| median(shares).unwrap_or(1.0));
    let odd =
        medians.enumerate().filter(|(_, share)| !(ODD_SHARE..=1.0 / ODD_SHARE).contains(share));
    let distance = |share: f64| share.max(1e-9).ln().abs();
    odd.max_by(|(_, a), (_, b)| distance(*a).total_cmp(&distance(*b)))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    if values.len() < LEAST_PHOTOSITES {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Plain least squares at one photosite, with the matrix that takes signals to residuals: M = I - L (L^T L)^-1 L^T.
struct Fit {
    y: DVector<f64>,
    residual: DVector<f64>,
    annihilator: DMatrix<f64>,
}

impl Fit {
    fn new(witness: &Witness, lights: &[usize]) -> Option<Self> {
        let count = lights.len();
        let l = DMatrix::from_fn(count, 3, |row, axis| witness.vectors[lights[row]][axis]);
        let normal_matrix = Matrix3::from_fn(|i, j| l.column(i).dot(&l.column(j)));
        let inverse = normal_matrix.try_inverse()?;
        let annihilator = DMatrix::identity(count, count) - &l * inverse * l.transpose();
        let y = DVector::from_fn(count, |k, _| witness.y[lights[k]]);
        Some(Self { residual: &annihilator * &y, annihilator, y })
    }

    /// Residual relative to the signal.
    fn relative(&self) -> f64 {
        self.residual.norm() / self.y.norm()
    }

    /// The same with the signals of two lights exchanged: with d = y_b - y_a, |M (y + d (e_a - e_b))|^2.
    fn relative_if_swapped(&self, a: usize, b: usize) -> f64 {
        let (d, m) = (self.y[b] - self.y[a], &self.annihilator);
        let grown = 2.0 * d * (self.residual[a] - self.residual[b])
            + d * d * (m[(a, a)] + m[(b, b)] - 2.0 * m[(a, b)]);
        (self.residual.norm_squared() + grown).max(0.0).sqrt() / self.y.norm()
    }
}

/// Two lights, by position, whose frames explain the pictures far better when exchanged.
struct Swap {
    a: usize,
    b: usize,
    /// Mean relative residual as it is and with the two exchanged.
    now: f64,
    then: f64,
}

impl Swap {
    fn in_words(&self, scene: &Scene) -> String {
        let names = in_words(&[self.a, self.b].map(|k| scene.lights[k].index.to_string()));
        format!(
            "Lights {names} seem to be swapped: exchanging their frames would bring the residual from {:.1} % down to {:.1} %; \
             check their cables, or the order in lights.toml.",
            100.0 * self.now,
            100.0 * self.then
        )
    }
}

fn swapped(witnesses: &[Witness], count: usize) -> Option<Swap> {
    let all: Vec<usize> = (0..count).collect();
    let fits: Vec<Fit> = witnesses.iter().filter_map(|witness| Fit::new(witness, &all)).collect();
    if fits.len() < LEAST_PHOTOSITES {
        return None;
    }
    let mean = |of: &dyn Fn(&Fit) -> f64| fits.iter().map(of).sum::<f64>() / fits.len() as f64;
    let now = mean(&Fit::relative);
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    let swaps =
        pairs.map(|(a, b)| Swap { a, b, now, then: mean(&|fit| fit.relative_if_swapped(a, b)) });
    let best = swaps.min_by(|one, other| one.then.total_cmp(&other.then))?;
    (now > GOOD_RESIDUAL && best.then < SWAP_GAIN * now).then_some(best)
}
