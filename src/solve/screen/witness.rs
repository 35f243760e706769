//! What the lights say of each other: with more than three, every light's signal is predicted by the rest. Finds lights
//! that stayed dark, that are far brighter than calibrated, and pairs that were swapped.

use crate::linear::{GREY, Normalizer, PhotographedLight, SignalRows, intensity_of_places};
use crate::raw::Layout;
use crate::solve::light_field::LightField;
use crate::solve::scene::Scene;
use crate::solve::words::in_words;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use weavelight_calibration::gain::gain_at;

/// Photosites asked: as many rows and columns of a coarse lattice over the frame.
const LATTICE: usize = 40;
/// Fewer than this and nothing is said.
const LEAST_PHOTOSITES: usize = 30;
/// A light below this share of its prediction adds nothing and is left out.
const DARK_SHARE: f64 = 0.05;
/// A light below this share (or above its inverse) is worth a warning: one whose exposure is off by a factor of two is.
const ODD_SHARE: f64 = 0.6;
/// Predictions below this share of the photosite's brightest sample are not compared: shadows look like dark lights.
const CLEARLY_LIT: f64 = 0.3;
/// Exchanging two lights must bring the mean residual below this share of what it is ...
const SWAP_GAIN: f64 = 0.9;
/// ... and gain this much at the average photosite (see [`Fit::gain_if_swapped`]). Over all pairs, on six simulated cloths,
/// lights that were swapped gain 0.17 or more and lights that were not lose as much ...
const LEAST_GAIN: f64 = 0.08;
/// ... beyond this many standard errors of that average, as few photosites gain by chance.
const STANDARD_ERRORS: f64 = 5.0;

/// What one photosite shows of every light.
struct Witness {
    vectors: Vec<Vector3<f64>>,
    y: Vec<f64>,
    /// What each light's signal was divided by: its intensity and gain.
    strength: Vec<f64>,
}

impl Witness {
    /// The signals of two lights if each has the other's frame.
    fn exchanged(&self, a: usize, b: usize) -> [f64; 2] {
        let ratio = self.strength[a] / self.strength[b];
        [self.y[b] / ratio, self.y[a] * ratio]
    }

    fn exchange(&mut self, a: usize, b: usize) {
        [self.y[a], self.y[b]] = self.exchanged(a, b);
    }
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
    let mut trusted: Vec<usize> = (0..count).collect();
    if let Some(swap) = swapped(&witnesses, count) {
        let exchange = |witness: &mut Witness| witness.exchange(swap.a, swap.b);
        witnesses.iter_mut().for_each(exchange);
        // A light that is dark or dim fits a little better wherever less is expected of it, but not well.
        let still_odd = oddest(&witnesses, &trusted)
            .is_some_and(|(light, _)| [swap.a, swap.b].contains(&light));
        if still_odd {
            witnesses.iter_mut().for_each(exchange);
        } else {
            verdict.warnings.push(swap.in_words(scene));
        }
    }
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
    let normalizer = Normalizer::new(&scene.photographs(), &equal);
    let mut rows = SignalRows::default();
    let mut found = vec![];
    for y in lattice(scene.height) {
        normalizer.row(y, 0..scene.width, &mut rows);
        for x in lattice(scene.width) {
            if scene.mask.as_ref().is_some_and(|mask| !mask.at(x, y)) {
                continue;
            }
            let y_of_lights: Vec<f64> =
                rows.signals().iter().map(|row| f64::from(row[x])).collect();
            let usable =
                y_of_lights.iter().all(|y| y.is_finite()) && y_of_lights.iter().any(|&y| y > 0.0);
            if let (true, Some(vectors)) = (usable, field.exact([x as f64, y as f64])) {
                let strength =
                    scene.lights.iter().map(|light| strength(scene, light, [x, y])).collect();
                found.push(Witness { vectors, y: y_of_lights, strength });
            }
        }
    }
    found
}

/// Intensity times gain of a light at a photosite, in its channel; of all channels together where it has several.
fn strength(scene: &Scene, light: &PhotographedLight, [x, y]: [usize; 2]) -> f64 {
    let (intensity, place) = (light.calibrated.light.intensity(), (y & 1) * 2 + (x & 1));
    let gain =
        light.calibrated.gain_map.as_ref().map_or([1.0; 3], |map| {
            gain_at(map, (scene.width, scene.height), [x as f64, y as f64])
        });
    let of_channels = [0, 1, 2].map(|channel| intensity[channel] * gain[channel]);
    match scene.layout {
        Layout::Rgb => of_channels.iter().zip(GREY).map(|(i, weight)| i * f64::from(weight)).sum(),
        layout => intensity_of_places(layout, 0, of_channels)[place],
    }
}

/// Places along one side, the same from either end: turned pictures are asked at the same photosites.
fn lattice(length: usize) -> impl Iterator<Item = usize> {
    let count = LATTICE.min(length);
    let place = move |k: usize| (2 * k + 1) * length / (2 * count);
    (0..count).map(move |k| match 2 * k < count {
        true => place(k),
        false => length - 1 - place(count - 1 - k),
    })
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
struct Fit<'w> {
    witness: &'w Witness,
    y: DVector<f64>,
    residual: DVector<f64>,
    annihilator: DMatrix<f64>,
}

impl<'w> Fit<'w> {
    fn new(witness: &'w Witness, lights: &[usize]) -> Option<Self> {
        let count = lights.len();
        let l = DMatrix::from_fn(count, 3, |row, axis| witness.vectors[lights[row]][axis]);
        let normal_matrix = Matrix3::from_fn(|i, j| l.column(i).dot(&l.column(j)));
        let inverse = normal_matrix.try_inverse()?;
        let annihilator = DMatrix::identity(count, count) - &l * inverse * l.transpose();
        let y = DVector::from_fn(count, |k, _| witness.y[lights[k]]);
        Some(Self { witness, residual: &annihilator * &y, annihilator, y })
    }

    /// Residual relative to the signal.
    fn relative(&self) -> f64 {
        self.residual.norm() / self.y.norm()
    }

    /// The same with the frames of two lights exchanged, where the fit is of all lights: with what each changes by,
    /// |M (y + d_a e_a + d_b e_b)|^2.
    fn relative_if_swapped(&self, a: usize, b: usize) -> f64 {
        let (m, y) = (&self.annihilator, self.witness.exchanged(a, b));
        let (da, db) = (y[0] - self.y[a], y[1] - self.y[b]);
        let grown = 2.0 * (da * self.residual[a] + db * self.residual[b])
            + da * da * m[(a, a)]
            + db * db * m[(b, b)]
            + 2.0 * da * db * m[(a, b)];
        let level = self.y.norm_squared() + da * (y[0] + self.y[a]) + db * (y[1] + self.y[b]);
        ((self.residual.norm_squared() + grown).max(0.0) / level).sqrt()
    }

    /// From -1, where exchanging the two spoils a perfect fit, to 1, where it makes one: (r^2 - s^2) / (r^2 + s^2) of the
    /// residuals as they are and exchanged.
    fn gain_if_swapped(&self, a: usize, b: usize) -> f64 {
        let (now, then) = (self.relative().powi(2), self.relative_if_swapped(a, b).powi(2));
        (now - then) / (now + then).max(f64::MIN_POSITIVE)
    }
}

/// Two lights, by position, and what exchanging their frames does.
struct Swap {
    a: usize,
    b: usize,
    /// Mean relative residual as it is and with the two exchanged.
    now: f64,
    then: f64,
    /// Mean gain, and the standard error of that mean.
    gain: f64,
    uncertainty: f64,
}

impl Swap {
    fn new(fits: &[Fit], a: usize, b: usize) -> Self {
        let count = fits.len() as f64;
        let mean = |of: &dyn Fn(&Fit) -> f64| fits.iter().map(of).sum::<f64>() / count;
        let gain = mean(&|fit| fit.gain_if_swapped(a, b));
        let variance = mean(&|fit| (fit.gain_if_swapped(a, b) - gain).powi(2));
        Self {
            a,
            b,
            now: mean(&|fit| fit.relative()),
            then: mean(&|fit| fit.relative_if_swapped(a, b)),
            gain,
            uncertainty: (variance / count).sqrt(),
        }
    }

    /// Whether the pictures are explained far better when the two are exchanged: not by a few photosites whose highlights or
    /// shadows happen to fit, but nearly everywhere.
    fn is_clear(&self) -> bool {
        self.then < SWAP_GAIN * self.now
            && self.gain > LEAST_GAIN + STANDARD_ERRORS * self.uncertainty
    }

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
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    let clear = pairs.map(|(a, b)| Swap::new(&fits, a, b)).filter(Swap::is_clear);
    clear.min_by(|one, other| one.then.total_cmp(&other.then))
}
