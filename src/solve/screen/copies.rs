//! One picture under several names. No two exposures share their noise, so frames with the same samples, up to the scale of
//! another container, are copies of one exposure; which light was on while it was taken, nothing in them tells.

use crate::linear::{Exposure, PhotographedLight};
use crate::raw::{Frame, Layout, Samples};
use crate::solve::error::SolveError;
use crate::solve::scene::Scene;
use crate::solve::words::few;
use weavelight_calibration::description::Light;

/// The fewest lights that can be solved.
const LEAST_LIGHTS: usize = 3;
/// Samples by which two frames are compared before all are.
const COMPARED: usize = 4096;
/// Fewer samples may agree by chance.
const LEAST_SAMPLES: usize = 16;
/// Fewer pairs of samples always lie on some line.
const LEAST_PAIRS: usize = 256;
/// A picture must change from photosite to photosite by this many times what rounding explains, or a line through the
/// samples of two pictures proves nothing.
const CLEAR_OF_ROUNDING: f64 = 4.0;
/// Scales of containers are whole powers of two, or the ratio of two largest numbers.
const SAME_SCALE: f64 = 2e-3;

/// Leaves out copies and tells which. Of one light's frames at one exposure the first stays, as it makes no difference which;
/// where copies bear different lights, or exposures, none can be trusted.
///
/// # Errors
/// Where fewer than three lights have a picture of their own.
pub(crate) fn leave_out_copies(scene: &mut Scene) -> Result<Vec<String>, SolveError> {
    let verdicts: Vec<Verdict> = groups(scene).iter().map(|group| verdict(group)).collect();
    let idle: Vec<Place> = verdicts.iter().flat_map(|of| of.left_out.iter().copied()).collect();
    let warnings: Vec<String> = verdicts.into_iter().flat_map(|of| of.sentences).collect();
    for (position, light) in scene.lights.iter_mut().enumerate() {
        retain(&mut light.exposures, &idle, Some(position));
    }
    retain(&mut scene.ambient, &idle, None);
    scene.lights.retain(|light| !light.exposures.is_empty());
    match warnings.iter().max_by_key(|sentence| sentence.len()) {
        Some(what) if scene.lights.len() < LEAST_LIGHTS => Err(SolveError::Copies {
            session: scene.origin.session.clone(),
            what: what.clone(),
            left: scene.lights.len(),
        }),
        _ => Ok(warnings),
    }
}

/// The position of a frame's light, `None` for ambient light, and the frame's place among the exposures.
type Place = (Option<usize>, usize);

/// What is said of a group of copies, and what is left out.
struct Verdict {
    sentences: Vec<String>,
    left_out: Vec<Place>,
}

fn retain(exposures: &mut Vec<Exposure>, idle: &[Place], of: Option<usize>) {
    let mut at = 0;
    exposures.retain(|_| {
        at += 1;
        !idle.contains(&(of, at - 1))
    });
}

/// A frame of the scene.
#[derive(Clone, Copy)]
struct Shot<'s> {
    light: Option<&'s PhotographedLight>,
    at: Place,
    exposure: &'s Exposure,
}

fn shots(scene: &Scene) -> Vec<Shot<'_>> {
    let of_lights = scene.lights.iter().enumerate().flat_map(|(position, light)| {
        light.exposures.iter().enumerate().map(move |(k, exposure)| Shot {
            light: Some(light),
            at: (Some(position), k),
            exposure,
        })
    });
    let ambient = scene.ambient.iter().enumerate();
    of_lights
        .chain(ambient.map(|(k, exposure)| Shot { light: None, at: (None, k), exposure }))
        .collect()
}

/// Frames that show one picture, two at least in each group; in the order of the lights.
fn groups(scene: &Scene) -> Vec<Vec<Shot<'_>>> {
    let shots = shots(scene);
    let looks: Vec<Look> = shots.iter().map(|shot| Look::new(&shot.exposure.frame)).collect();
    let mut group: Vec<usize> = (0..shots.len()).collect();
    for b in 0..shots.len() {
        if let Some(a) = (0..b).find(|&a| is_copy(&shots[a], &looks[a], &shots[b], &looks[b])) {
            group[b] = group[a];
        }
    }
    let members = |first: usize| -> Vec<Shot> {
        (first..shots.len()).filter(|&k| group[k] == first).map(|k| shots[k]).collect()
    };
    (0..shots.len()).map(members).filter(|members| members.len() > 1).collect()
}

fn is_copy(a: &Shot, look_a: &Look, b: &Shot, look_b: &Look) -> bool {
    if is_same(look_a, look_b) {
        return true;
    }
    let Some(scale) = scale_between(look_a, look_b) else { return false };
    // Frames of one light at two exposures are in proportion where a renderer made them without noise, and so may be those
    // of two far lights over a flat surface; those of two near lights never are.
    let far = |shot: &Shot| {
        shot.light.is_some_and(|light| matches!(light.calibrated.light, Light::Directional(_)))
    };
    let containers = look_a.floating != look_b.floating || is_of_containers(scale);
    a.at.0 != b.at.0 && (containers || !(far(a) || far(b)))
}

/// Whether two frames are one exposure: the same samples in whatever container.
pub(crate) fn is_same_picture(a: &Frame, b: &Frame) -> bool {
    let (a, b) = (Look::new(a), Look::new(b));
    is_same(&a, &b) || scale_between(&a, &b).is_some_and(is_of_containers)
}

/// A frame with some of its samples.
struct Look<'f> {
    frame: &'f Frame,
    samples: Vec<f64>,
    /// Each one's neighbour of the same colour; for the change from photosite to photosite.
    neighbours: Vec<f64>,
    floating: bool,
}

impl<'f> Look<'f> {
    fn new(frame: &'f Frame) -> Self {
        let length = frame.width * frame.height * frame.layout.channels();
        // An odd step visits every colour.
        let step = (length / COMPARED).max(1) | 1;
        let places = (0..length).step_by(step);
        let beside = 2 * frame.layout.channels();
        let (samples, neighbours) = places
            .map(|at| {
                let neighbour = if at + beside < length { at + beside } else { at };
                (value(&frame.samples, at), value(&frame.samples, neighbour))
            })
            .unzip();
        let floating = matches!(frame.samples, Samples::F32(_));
        Self { frame, samples, neighbours, floating }
    }

    fn shape(&self) -> (usize, usize, Layout) {
        (self.frame.width, self.frame.height, self.frame.layout)
    }

    /// Lowest and highest of the samples: beyond them a copy may have been cut off.
    fn extremes(&self) -> [f64; 2] {
        let finite = || self.samples.iter().copied().filter(|value| value.is_finite());
        [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Root mean square of the change from a photosite to the next of its colour, over the square root of two.
    fn change(&self) -> f64 {
        let squares = self.samples.iter().zip(&self.neighbours).map(|(a, b)| (a - b).powi(2));
        let (sum, count) = squares
            .filter(|square| square.is_finite())
            .fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
        (sum / f64::max(2.0 * count, 1.0)).sqrt()
    }
}

fn value(samples: &Samples, at: usize) -> f64 {
    match samples {
        Samples::U16(samples) => f64::from(samples[at]),
        Samples::F32(samples) => f64::from(samples[at]),
    }
}

/// The same numbers at every photosite, and not all alike: a black or white picture says nothing.
fn is_same(a: &Look, b: &Look) -> bool {
    let [low, high] = a.extremes();
    let alike = a.shape() == b.shape() && a.samples == b.samples;
    if !alike || a.frame.width * a.frame.height < LEAST_SAMPLES {
        return false;
    }
    let all = 0..a.frame.width * a.frame.height * a.frame.layout.channels();
    let equal = match (&a.frame.samples, &b.frame.samples) {
        (Samples::U16(a), Samples::U16(b)) => a == b,
        (Samples::F32(a), Samples::F32(b)) => a == b,
        (a, b) => all.clone().all(|at| value(a, at) == value(b, at)),
    };
    // Of a picture that is nearly all of one number, the few others may not be among the samples.
    let first = value(&a.frame.samples, 0);
    equal && (low < high || all.into_iter().any(|at| value(&a.frame.samples, at) != first))
}

/// The scale that turns the samples of one frame into those of the other, offset and rounding aside; `None` where none does.
fn scale_between(a: &Look, b: &Look) -> Option<f64> {
    if a.shape() != b.shape() {
        return None;
    }
    let ([a_low, a_high], [b_low, b_high]) = (a.extremes(), b.extremes());
    let inside = |a: f64, b: f64| a_low < a && a < a_high && b_low < b && b < b_high;
    let pairs = || a.samples.iter().zip(&b.samples).filter(|(a, b)| inside(**a, **b));
    let count = pairs().count();
    if count < LEAST_PAIRS.min(a.samples.len() / 2).max(LEAST_SAMPLES) {
        return None;
    }
    let mean =
        |of: &dyn Fn(f64, f64) -> f64| pairs().map(|(a, b)| of(*a, *b)).sum::<f64>() / count as f64;
    let (mean_a, mean_b) = (mean(&|a, _| a), mean(&|_, b| b));
    let scale = mean(&|a, b| (a - mean_a) * (b - mean_b)) / mean(&|a, _| (a - mean_a).powi(2));
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let rounding = rounding(a, b, scale);
    let on_line = pairs().all(|(a, b)| (b - mean_b - scale * (a - mean_a)).abs() <= rounding);
    (on_line && scale * a.change() > CLEAR_OF_ROUNDING * rounding).then_some(scale)
}

/// How far a sample of `b` may be off: it was rounded, or the one of `a` was. Half a number, and a little for the fit.
fn rounding(a: &Look, b: &Look, scale: f64) -> f64 {
    let of = |look: &Look, scale: f64| {
        let [low, high] = look.extremes();
        // float16 keeps eleven binary digits.
        scale * if look.floating { 5e-4 * low.abs().max(high.abs()) } else { 0.55 }
    };
    f64::max(of(a, scale), of(b, 1.0))
}

/// Whether a container explains the scale: 14 bits moved up by two, 8 bits spread over 16.
fn is_of_containers(scale: f64) -> bool {
    let larger = scale.max(1.0 / scale);
    let near = |expected: f64| (larger / expected - 1.0).abs() < SAME_SCALE;
    let powers = (0..=8).map(|bits| f64::from(1 << bits));
    let spread = (8..=14).map(|bits| 65_535.0 / f64::from((1 << bits) - 1));
    powers.chain(spread).any(near)
}

fn verdict(group: &[Shot]) -> Verdict {
    let first = group[0];
    let seconds = |shot: &Shot| shot.exposure.seconds_at_iso_100();
    let of_one = group.iter().all(|shot| shot.at.0 == first.at.0);
    if of_one && group.iter().all(|shot| seconds(shot) == seconds(&first)) {
        let who = match first.light {
            Some(light) => format!("Light {}", light.index),
            None => "Ambient light".to_owned(),
        };
        let sentence = |shot: &Shot| {
            let (copy, original) = (name(shot.exposure), name(first.exposure));
            format!("{who}: {copy} is a copy of {original} and was left out.")
        };
        let others = &group[1..];
        return Verdict {
            sentences: others.iter().map(sentence).collect(),
            left_out: others.iter().map(|shot| shot.at).collect(),
        };
    }
    let names = few(group.iter().map(|shot| name(shot.exposure)).collect());
    if of_one {
        let who = match first.light {
            Some(light) => format!("light {}", light.index),
            None => "the ambient light".to_owned(),
        };
        let sentence = format!(
            "{names} of {who} are copies of one picture at different exposures and were left out; correct exposure_s and iso, or take them again."
        );
        let left_out = group.iter().map(|shot| shot.at).collect();
        return Verdict { sentences: vec![sentence], left_out };
    }
    // The ambient frame stays: whether it is too bright to be one is seen beside the frames that remain.
    let lit = group.iter().map(|shot| shot.at).filter(|at| at.0.is_some());
    Verdict { left_out: lit.collect(), sentences: vec![sentence_of_lights(group, &names)] }
}

fn sentence_of_lights(group: &[Shot], names: &str) -> String {
    let mut lights: Vec<usize> =
        group.iter().filter_map(|shot| shot.light.map(|light| light.index)).collect();
    lights.sort_unstable();
    lights.dedup();
    let lights: Vec<String> = lights.iter().map(ToString::to_string).collect();
    let s = if lights.len() == 1 { "" } else { "s" };
    let ambient =
        if group.iter().any(|shot| shot.light.is_none()) { " and ambient light" } else { "" };
    format!(
        "Light{s} {}{ambient} have the same picture ({names} are copies of one frame), and which of them it shows cannot be told: \
         light{s} {} left out; photograph {} again.",
        few(lights.clone()),
        if lights.len() == 1 { "was" } else { "were" },
        if lights.len() == 1 { "it" } else { "them" },
    )
}

pub(crate) fn name(exposure: &Exposure) -> String {
    exposure.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
